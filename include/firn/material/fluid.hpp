/// \file A weakly compressible fluid with viscosity: water, honey, spray.
#pragma once

#include <firn/core/error.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/pow.hpp>

namespace firn::inline FIRN_BUILD {

/// Measurable properties of a fluid. Fluid::from_properties() makes the material from these properties.
///
/// The time step is proportional to 1/√K, where K is the bulk modulus, so a K far below that of real water (2.2e9 Pa)
/// is usual: K ≥ 100 ρ v² keeps the change of the density ρ below one per cent at speeds up to v.
struct FluidProperties {
    double bulk = 1e5;     ///< bulk modulus K at the rest density [Pa]
    double gamma = 7;      ///< exponent γ of the equation of state [1]
    double viscosity = 0;  ///< dynamic viscosity μ [Pa s]; water has 0.001
    double tension = 0;    ///< largest tension that the fluid can bear [Pa]
};

/// A weakly compressible fluid with viscosity: water, honey, spray.
///
///     σ = −p I + μ (∇v + ∇vᵀ − ⅔ div v I)           Cauchy stress [Pa]
///     p = K/γ (J^−γ − 1), but at least −tension      pressure [Pa]
///
/// v is the velocity; K, γ and μ are the parameters `bulk`, `gamma` and `viscosity`. A particle's only state is J, the
/// ratio of its volume to its volume at rest; J is clamped to [1/8, 8]. In 2D the fluid flows in a plane, and the
/// factor before div v is ⅔, as in 3D.
///
/// With tension = 0 the particles of a spray do not attract each other: the pressure is zero for J > 1. J is still
/// updated, so the pressure is positive again as soon as J < 1.
///
/// Use Fluid for every liquid. The bulk modulus K sets the time step; FluidProperties says how low K may be.
///
/// The equation for the pressure is Tait's, in the form of Murnaghan: Murnaghan 1944, "The compressibility of media
/// under extreme pressures"; Monaghan 1994, "Simulating free surface flows with SPH".
template <scalar S = float>
struct Fluid {
    S bulk = S(1e5);     ///< bulk modulus K at the rest density, J = 1 [Pa]
    S gamma = S(7);      ///< exponent γ of the equation of state [1]
    S viscosity = S(0);  ///< dynamic viscosity μ [Pa s]
    S tension = S(0);    ///< largest tension that the fluid can bear [Pa]

    static constexpr const char* name = "fluid";
    static constexpr auto parameters() {
        return std::tuple{parameter{"bulk", "Pa", &Fluid::bulk}, parameter{"gamma", "1", &Fluid::gamma},
                          parameter{"viscosity", "Pa s", &Fluid::viscosity},
                          parameter{"tension", "Pa", &Fluid::tension}};
    }
    static constexpr double smallest_J = 0.125,  ///< lower bound of J [1]; a smaller J is set to this bound
        largest_J = 8;                           ///< upper bound of J [1]; a larger J is set to this bound

    /// The state of a particle: its volume ratio.
    template <int D>
    struct state {
        VolumeRatio<S> J;  ///< ratio of the volume to the volume at rest [1]

        static constexpr auto fields() { return std::tuple{parameter{"volume_ratio", "1", &state::J}}; }
    };

    /// Makes the material from measurable properties.
    /// \throws parameter_error unless bulk > 0, 1 ≤ gamma ≤ 15, viscosity ≥ 0, tension ≥ 0, and all four are finite
    static Fluid from_properties(const FluidProperties& fluid) {
        if (!(fluid.bulk > 0) || !std::isfinite(double(value_type_t<S>(fluid.bulk))))
            throw parameter_error(
                sentence("The bulk modulus of a fluid is ", fluid.bulk, " Pa; it must be positive and finite."));
        if (!(fluid.gamma >= 1 && fluid.gamma <= 15))
            throw parameter_error(
                sentence("The exponent γ of a fluid is ", fluid.gamma, "; it must lie between 1 and 15. Water has 7."));
        if (!(fluid.viscosity >= 0) || !std::isfinite(fluid.viscosity))
            throw parameter_error(sentence("The viscosity of a fluid is ", fluid.viscosity,
                                           " Pa s; it must be finite and not negative. Water has 0.001."));
        if (!(fluid.tension >= 0) || !std::isfinite(fluid.tension))
            throw parameter_error(sentence("The tension of a fluid is ", fluid.tension,
                                           " Pa; it must be finite and not negative. With 0, drops part freely."));
        return {S(fluid.bulk), S(fluid.gamma), S(fluid.viscosity), S(fluid.tension)};
    }

    /// Checks the parameters.
    /// \throws parameter_error unless bulk > 0, 1 ≤ gamma ≤ 15, viscosity ≥ 0, tension ≥ 0, and all four are finite
    void check() const
        requires std::floating_point<S>
    {
        static_cast<void>(from_properties({double(bulk), double(gamma), double(viscosity), double(tension)}));
    }

    /// The pressure p = max(K/γ (J^−γ − 1), −tension) [Pa] at the volume ratio J; K and γ are `bulk` and `gamma`.
    FIRN_INLINE S pressure(const VolumeRatio<S>& J) const {
        return named("pressure", max(bulk / gamma * pow_less_one(J.excess, -gamma), -tension));
    }

    /// The state after a time step dt [s] with velocity gradient ∇v [1/s]: the new J is J (1 + dt div v), clamped to
    /// [1/8, 8].
    template <int D>
    FIRN_INLINE state<D> updated(const state<D>& fluid, const Mat<S, D>& velocity_gradient, const S& dt) const {
        const S excess = fluid.J.excess + S(fluid.J) * (trace(velocity_gradient) * dt);
        return {VolumeRatio<S>::from_excess(max(min(excess, S(largest_J - 1)), S(smallest_J - 1)))};
    }

    /// Kirchhoff stress τ = −p J I [Pa] of the fluid without flow (∇v = 0); p is the pressure.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& fluid) const {
        return Mat<S, D>::diagonal(-(pressure(fluid.J) * S(fluid.J)));
    }
    /// Kirchhoff stress τ = J σ [Pa] at the velocity gradient ∇v [1/s]. The Cauchy stress σ contains pressure and
    /// viscous stress.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& fluid, const Mat<S, D>& velocity_gradient) const {
        const S expansion = S(2. / 3) * trace(velocity_gradient);
        const Mat<S, D> rate = velocity_gradient + transpose(velocity_gradient) - Mat<S, D>::diagonal(expansion);
        return rate * (viscosity * S(fluid.J)) + kirchhoff_stress(fluid);
    }

    /// Elastic energy ψ [J/m³ of undeformed volume], from the pressure p = −dψ/dJ:
    ///
    ///     ψ = K/γ ((J^{1−γ} − 1)/(γ − 1) + J − 1);       for γ = 1 the fraction is −ln J
    ///
    /// K and γ are `bulk` and `gamma`. Where p = −tension, ψ grows linearly with J, with the slope dψ/dJ = tension.
    /// With tension = 0, ψ is 0 for all J ≥ 1.
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& fluid) const {
        // The value of J at which p = −tension; largest_J if p > −tension for every J.
        const S remaining = S(1) - tension * gamma / bulk;
        const S parting =
            select(S(0) < remaining, pow(max(remaining, S(detail::least_square)), S(-1) / gamma), S(largest_J));
        const S excess = min(fluid.J.excess, max(S(1), parting) - S(1));
        const auto logarithmic = gamma == S(1);
        const S power = pow_less_one(excess, S(1) - gamma) / select(logarithmic, S(1), gamma - S(1));
        const S fraction = select(logarithmic, -log(S(1) + excess, excess), power);
        return bulk / gamma * (fraction + excess) + tension * (fluid.J.excess - excess);
    }

    /// The speed of sound c [m/s], with ρ0 c² = K J^{1−γ} from c² = dp/dρ. ρ0 is the rest density [kg/m³], K and γ are
    /// `bulk` and `gamma`. Where J > 1, the value at J = 1 is used.
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& fluid) const {
        return sqrt(bulk * pow(min(S(fluid.J), S(1)), S(1) - gamma) / density);
    }
    /// Diffusivity of momentum by viscosity, 4/3 μ J / ρ0 [m²/s]; μ is the viscosity, ρ0 the rest density [kg/m³]. This
    /// value holds for a velocity that varies along its own direction. For a velocity that varies across its direction,
    /// as in shear flow, the diffusivity is smaller.
    template <int D>
    FIRN_INLINE S diffusivity(const S& density, const state<D>& fluid) const {
        return S(4. / 3) * viscosity * S(fluid.J) / density;
    }
};

}  // namespace firn::inline FIRN_BUILD
