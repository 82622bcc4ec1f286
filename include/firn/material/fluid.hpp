/// \file A weakly compressible fluid with viscosity. The pressure by Tait's equation in Murnaghan's form: Murnaghan
/// 1944, "The compressibility of media under extreme pressures"; Monaghan 1994, "Simulating free surface flows with
/// SPH".
#pragma once

#include <firn/core/error.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/pow.hpp>

namespace firn {

/// A fluid in terms that can be measured. A bulk modulus far below that of real water (2.2e9 Pa) is usual, as the time
/// step goes with 1/√K: K ≥ 100 ρ v² keeps the change of density below one per cent at speeds up to v.
struct FluidProperties {
    double bulk = 1e5;     ///< bulk modulus at rest, K [Pa]
    double gamma = 7;      ///< exponent γ of the equation of state [1]
    double viscosity = 0;  ///< μ [Pa s]
    double tension = 0;    ///< what the fluid bears before it parts [Pa]
};

/// σ = −p I + μ (∇v + ∇vᵀ − ⅔ div v I), p = K/γ (J^−γ − 1) ≥ −tension; J, the volume over that at rest, is the whole
/// state. In 2D that of a flow in a plane, with the same ⅔.
///
/// Without tension the particles of a spray do not pull at each other. J goes on to measure the volume then, and there
/// is no pressure until it is back at 1. J is kept in [1/8, 8].
template <scalar S = float>
struct Fluid {
    S bulk = S(1e5);     ///< K [Pa]
    S gamma = S(7);      ///< γ [1]
    S viscosity = S(0);  ///< μ [Pa s]
    S tension = S(0);    ///< [Pa]

    static constexpr const char* name = "fluid";
    static constexpr auto parameters() {
        return std::tuple{parameter{"bulk", "Pa", &Fluid::bulk}, parameter{"gamma", "1", &Fluid::gamma},
                          parameter{"viscosity", "Pa s", &Fluid::viscosity},
                          parameter{"tension", "Pa", &Fluid::tension}};
    }
    static constexpr double smallest_J = 0.125, largest_J = 8;

    template <int D>
    struct state {
        S J = S(1);  ///< volume over that at rest [1]

        static constexpr auto fields() { return std::tuple{parameter{"volume_ratio", "1", &state::J}}; }
    };

    /// \throws parameter_error unless K > 0, 1 ≤ γ ≤ 15, μ ≥ 0 and the tension is not negative
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
            throw parameter_error(sentence("A fluid bears a tension of ", fluid.tension,
                                           " Pa; it must be finite and not negative. 0: it parts."));
        return {S(fluid.bulk), S(fluid.gamma), S(fluid.viscosity), S(fluid.tension)};
    }

    /// \throws parameter_error, as from_properties()
    void check() const
        requires std::floating_point<S>
    {
        static_cast<void>(from_properties({double(bulk), double(gamma), double(viscosity), double(tension)}));
    }

    /// p [Pa]
    FIRN_INLINE S pressure(const S& J) const {
        return named("pressure", max(bulk / gamma * (pow(J, -gamma) - S(1)), -tension));
    }

    /// J ← J (1 + dt div v)
    template <int D>
    FIRN_INLINE state<D> updated(const state<D>& fluid, const Mat<S, D>& velocity_gradient, const S& dt) const {
        const S J = fluid.J + fluid.J * (trace(velocity_gradient) * dt);
        return {max(min(J, S(largest_J)), S(smallest_J))};
    }

    /// τ at rest = −p J I [Pa]
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& fluid) const {
        return Mat<S, D>::diagonal(-(pressure(fluid.J) * fluid.J));
    }
    /// τ = J σ [Pa]
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& fluid, const Mat<S, D>& velocity_gradient) const {
        const S expansion = S(2. / 3) * trace(velocity_gradient);
        const Mat<S, D> rate = velocity_gradient + transpose(velocity_gradient) - Mat<S, D>::diagonal(expansion);
        return rate * (viscosity * fluid.J) + kirchhoff_stress(fluid);
    }

    /// ψ = K/γ ((J^{1−γ} − 1)/(γ − 1) + J − 1) [J/m³ of undeformed volume], dψ/dJ = −p; 0 where nothing bears tension.
    /// −ln J in the place of the fraction for γ = 1. In between, tension bears a part: ψ is then that of the stretch
    /// at which it is reached, and grows with the tension.
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& fluid) const {
        // p = −tension at this J, or nowhere
        const S remaining = S(1) - tension * gamma / bulk;
        const S parting = select(S(0) < remaining, pow(max(remaining, S(1e-30)), S(-1) / gamma), S(largest_J));
        const S J = min(fluid.J, max(S(1), parting));
        const auto logarithmic = gamma == S(1);
        const S power = (S(1) - pow(J, S(1) - gamma)) / select(logarithmic, S(1), S(1) - gamma);
        const S fraction = select(logarithmic, -log(J), power);
        return bulk / gamma * (fraction + J - S(1)) + tension * (fluid.J - J);
    }

    /// ρ0 c² = K J^{1−γ}: c² = dp/dρ. Of what has parted, that of the fluid at rest.  [m/s]
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& fluid) const {
        return sqrt(bulk * pow(min(fluid.J, S(1)), S(1) - gamma) / density);
    }
    /// 4/3 μ J / ρ0, along a velocity that points where it varies. [m²/s]
    template <int D>
    FIRN_INLINE S diffusivity(const S& density, const state<D>& fluid) const {
        return S(4. / 3) * viscosity * fluid.J / density;
    }
};

}  // namespace firn
