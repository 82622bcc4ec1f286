/// \file Soil and soft rock: Mohr–Coulomb plasticity with a tension cut-off and softening.
#pragma once

#include <firn/core/repeat.hpp>
#include <firn/material/friction_angle.hpp>
#include <firn/material/hencky.hpp>
#include <firn/math/trigonometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace firn::inline FIRN_BUILD {

/// Measurable properties of soil. MohrCoulomb::from_properties() makes the material from these properties. The defaults
/// are those of a stiff clay without softening.
struct MohrCoulombProperties {
    double young = 1e7;                  ///< Young's modulus [Pa]
    double poisson = 0.3;                ///< Poisson's ratio [1]
    double cohesion = 1e4;               ///< cohesion c before any plastic flow [Pa]
    Angle friction_angle = degrees(25);  ///< friction angle φ before any plastic flow
    Angle dilatancy_angle = degrees(0);  ///< dilatancy angle ψ before any plastic flow
    /// largest tensile principal stress [Pa]; infinity: none but that of cohesion and friction, c cot φ
    double tension = std::numeric_limits<double>::infinity();
    double residual_cohesion = 0;                 ///< cohesion c once softened [Pa]
    Angle residual_friction_angle = degrees(0);   ///< friction angle φ once softened
    Angle residual_dilatancy_angle = degrees(0);  ///< dilatancy angle ψ once softened
    double softening_strain = 0;  ///< plastic shear strain over which c, φ and ψ fall [1]; 0: they do not fall
};

/// Soil, soft rock, concrete: a solid with cohesion and friction, that dilates as it shears, and tears under tension.
///
/// The elasticity is that of Hencky. With the principal Kirchhoff stresses τ₁ ≥ τ₂ ≥ τ₃, which are positive under
/// tension, there is plastic flow where
///
///     τ₁ − τ₃ + (τ₁ + τ₃) sin φ > 2 c cos φ      the shear strength
///     τ₁ > t                                     the tension cut-off
///
/// c is the `cohesion`, φ the `friction_angle` and t the `tension`; the cut-off acts where t is below c cot φ, the
/// tension at the apex of the first surface. Plastic flow on the first surface has the principal strains
/// (1 + sin ψ, 0, −1 + sin ψ) times its size, so it gains volume if the dilatancy angle ψ is positive. ψ = φ is
/// associated flow, φ = 0 is the criterion of Tresca. On the cut-off flow is along τ₁. At edges and corners the flows
/// add up. Matter past the apex goes there, also if ψ = 0, for which no sum of these flows leads there.
///
/// In 2D there are the two principal stresses of the plane, as if the third were always the middle one, and no plastic
/// flow out of the plane. This agrees with plane strain as long as the third is the middle one.
///
/// The plastic shear strain γ of a particle is the sum, over the steps in which it flowed, of the largest minus the
/// smallest principal strain that the step turned from elastic to plastic. Torn matter gains γ, too. The strength
/// falls linearly with γ: c, φ and ψ go from their first values to the `residual` ones while γ goes from 0 to the
/// `softening_strain`. t stays, but is at most c cot φ. If the softening strain is 0, the plasticity is perfect.
///
/// Softening makes flow gather in bands, about a cell wide, so the work of a band, per area, shrinks with the cells.
/// SofteningBand scales the softening strain by the cell size to keep that work.
///
/// Use MohrCoulomb for soil and rock whose strength was measured as c and φ: slopes, excavations, footings, retaining
/// walls. For dry grains that fly apart and come together again, use Sand: MohrCoulomb bears pressure as soon as torn
/// matter is compressed, even if the gap is still open. For undrained clay, VonMises costs less; for matter that
/// hardens under pressure, use Nacc.
///
/// With FBar, soil whose dilatancy angle is not zero locks: give PlasticVolume<MohrCoulomb<S>>.
///
/// The return is exact for perfect plasticity: Clausen, Damkilde and Andersen 2006, "Efficient return algorithms for
/// associated plasticity with multiple yield planes", and 2007, "An efficient return algorithm for non-associated
/// plasticity with linear yield criteria in principal stress space"; de Souza Neto, Perić and Owen 2008,
/// "Computational Methods for Plasticity", §8.2.
template <scalar S = float>
struct MohrCoulomb {
    S mu = S(1e7 / 2.6);                           ///< shear modulus [Pa]
    S lambda = S(3e6 / (1.3 * 0.4));               ///< first Lamé parameter [Pa]
    S cohesion = S(1e4);                           ///< cohesion c before any plastic flow [Pa]
    S friction_angle = S(0.43633231299858239423);  ///< friction angle φ before any plastic flow [rad]
    S dilatancy_angle = S(0);                      ///< dilatancy angle ψ before any plastic flow [rad]
    S tension = S(no_cut_off);                     ///< t: largest tensile principal stress [Pa]
    S residual_cohesion = S(0);                    ///< cohesion c once softened [Pa]
    S residual_friction_angle = S(0);              ///< friction angle φ once softened [rad]
    S residual_dilatancy_angle = S(0);             ///< dilatancy angle ψ once softened [rad]
    S softening_strain = S(0);  ///< plastic shear strain γ over which c, φ and ψ fall [1]; 0: they do not fall

    /// The `tension` of matter without a tension cut-off [Pa]: above every stress.
    static constexpr double no_cut_off = 1e20;

    static constexpr const char* name = "mohr_coulomb";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &MohrCoulomb::mu},
                          parameter{"lambda", "Pa", &MohrCoulomb::lambda},
                          parameter{"cohesion", "Pa", &MohrCoulomb::cohesion},
                          parameter{"friction_angle", "rad", &MohrCoulomb::friction_angle},
                          parameter{"dilatancy_angle", "rad", &MohrCoulomb::dilatancy_angle},
                          parameter{"tension", "Pa", &MohrCoulomb::tension},
                          parameter{"residual_cohesion", "Pa", &MohrCoulomb::residual_cohesion},
                          parameter{"residual_friction_angle", "rad", &MohrCoulomb::residual_friction_angle},
                          parameter{"residual_dilatancy_angle", "rad", &MohrCoulomb::residual_dilatancy_angle},
                          parameter{"softening_strain", "1", &MohrCoulomb::softening_strain}};
    }

    /// The state of a particle.
    template <int D>
    struct state {
        DeformationGradient<S, D> F;  ///< elastic deformation gradient [1]
        S plastic_strain = S(0);      ///< plastic shear strain γ [1]

        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F},
                              parameter{"plastic_strain", "1", &state::plastic_strain}};
        }
    };

    /// Makes the material from measurable properties.
    /// \throws parameter_error unless young > 0, −1 < poisson < ½, cohesion ≥ 0, tension ≥ 0, 0° ≤ ψ ≤ φ < 90° for the
    /// dilatancy angle ψ and the friction angle φ, and softening_strain ≥ 0; with softening, unless the residual values
    /// are as these and not larger
    static MohrCoulomb from_properties(const MohrCoulombProperties& soil) {
        const Hencky<S> elastic = Hencky<S>::from_young_poisson(soil.young, soil.poisson);
        MohrCoulomb model;
        model.mu = elastic.mu;
        model.lambda = elastic.lambda;
        model.cohesion = S(soil.cohesion);
        model.friction_angle = S(soil.friction_angle.in_radians());
        model.dilatancy_angle = S(soil.dilatancy_angle.in_radians());
        model.tension = S(soil.tension > no_cut_off ? no_cut_off : soil.tension);
        model.residual_cohesion = S(soil.residual_cohesion);
        model.residual_friction_angle = S(soil.residual_friction_angle.in_radians());
        model.residual_dilatancy_angle = S(soil.residual_dilatancy_angle.in_radians());
        model.softening_strain = S(soil.softening_strain);
        check_strength({soil.cohesion, soil.friction_angle.in_radians(), soil.dilatancy_angle.in_radians()},
                       {soil.residual_cohesion, soil.residual_friction_angle.in_radians(),
                        soil.residual_dilatancy_angle.in_radians()},
                       soil.tension > no_cut_off ? no_cut_off : soil.tension, soil.softening_strain);
        return model;
    }
    /// Checks the parameters.
    /// \throws parameter_error unless μ > 0, λ + 2 μ/3 > 0, cohesion ≥ 0, tension ≥ 0, 0 ≤ ψ ≤ φ < π/2 for the
    /// dilatancy angle ψ and the friction angle φ, and softening_strain ≥ 0, and all are finite; with softening, unless
    /// the residual values are as these and not larger
    void check() const
        requires std::floating_point<S>
    {
        check_lame_of_plastic(double(mu), double(lambda));
        check_strength({double(cohesion), double(friction_angle), double(dilatancy_angle)},
                       {double(residual_cohesion), double(residual_friction_angle), double(residual_dilatancy_angle)},
                       double(tension), double(softening_strain));
    }

    /// Takes strength from this soil: divides c and tan φ by a factor, and lets ψ be at most φ. The tension cut-off
    /// stays. \see factor_of_safety
    /// \throws parameter_error  unless the factor is positive and finite
    void weaken(double factor)
        requires std::floating_point<S>
    {
        if (!(factor > 0) || !std::isfinite(factor))
            throw parameter_error(sentence("Strength is divided by ", factor, "; give a positive, finite factor."));
        const auto reduce = [&](S& c, S& friction, S& dilatancy) {
            c = S(double(c) / factor);
            friction = S(std::atan(std::tan(double(friction)) / factor));
            dilatancy = std::min(dilatancy, friction);
        };
        reduce(cohesion, friction_angle, dilatancy_angle);
        reduce(residual_cohesion, residual_friction_angle, residual_dilatancy_angle);
    }

    /// Whether plastic flow changes the volume: ψ > 0. \see PlasticVolume
    bool dilates() const
        requires std::floating_point<S>
    {
        return dilatancy_angle > S(0);
    }
    /// The elastic solid with the moduli of this soil.
    FIRN_INLINE Hencky<S> elastic() const { return {mu, lambda}; }

    /// Kirchhoff stress τ [Pa], computed as in Hencky from the elastic F.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& soil) const {
        return elastic().kirchhoff_stress(soil.F);
    }
    /// Elastic energy ψ [J/m³ of undeformed volume], computed as in Hencky from the elastic F.
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& soil) const {
        return elastic().energy_density(soil.F);
    }
    /// Upper bound of the wave speed [m/s], computed as in Hencky from the elastic F. `density` is the density of the
    /// undeformed material [kg/m³].
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& soil) const {
        return elastic().wave_speed(density, soil.F);
    }

    /// Returns the state after the plastic return mapping, and the Kirchhoff stress [Pa] in this state. The logarithmic
    /// strain keeps its directions. Its principal values become those of the one point on the two yield surfaces that
    /// non-negative flow reaches: on a face, an edge or a corner of the surfaces, or at the apex. A state that does not
    /// yield beyond rounding is kept bit for bit.
    ///
    /// With softening, the strength is that of γ after the step, which the secant method or false position finds, in as
    /// many passes as each particle needs, up to a limit. Where γ reaches the softening strain within the step, it is
    /// exact. Else, where the softening strain is at least ten times the elastic strain at yield, the error of γ is at
    /// most 1e-9 of what a step adds to it, in float 1e-3 (measured over steps of 4 %: 4e-10 and 3e-4). Where it is no
    /// larger than twice that strain, one such step in a hundred has an error above 1e-3.
    ///
    /// An inverted F (det F < 0) has the strain that logarithmic_strain() gives it, and becomes upright where it
    /// yields.
    ///
    /// With dual numbers the derivative of γ where two principal strains are equal is that of one side: the largest of
    /// two numbers has none there. The stress has one.
    template <int D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const Mat<S, D> strain = logarithmic_strain(trial.F);
        const Strength first = strength(softened_part(trial.plastic_strain));
        // What rounding may add to the two yield functions [Pa].
        const S rounding = S(detail::strain_rounding<S>), G = mu + mu, bulk = abs(lambda) * S(D);
        const S of_shear = (G + first.sine * bulk) * (rounding + rounding), of_tension = (G + bulk) * rounding;

        const auto near = may_yield(strain, first, of_shear, of_tension);
        StateAndStress<state<D>, S, D> after{trial, strain};
        if (any(near)) {
            const PrincipalForm<S, D> principal(strain);
            const Vec<S, D>& e = principal.values;
            const S volumetric = sum(e);
            const auto sheared = of_shear < shear_excess(e, volumetric, first);
            const auto torn = first.cuts & (of_tension < G * e.v[0] + lambda * volumetric - first.tension);
            const auto yields = near & (sheared | torn);
            const auto softens = yields & (S(0) < softening_strain);
            Strength last = first;
            if (any(softens)) last = strength(select(softens, softened(e, trial.plastic_strain, first, softens), S(0)));
            const OnSurface<D> on = to_surface(e, last);
            Vec<S, D> flow;
            unroll<D>([&](auto i) FIRN_LAMBDA { flow.v[i] = select(yields, on.strain.v[i] - e.v[i], S(0)); });
            const Mat<S, D> change =
                principal.changes(flow, [&](int i, int j) FIRN_LAMBDA { return yields & on.joined(i, j); });
            if (any(yields)) after.state.F = select(yields, strained_by(trial.F, change), trial.F);
            after.state.plastic_strain = trial.plastic_strain + (flow.v[D - 1] - flow.v[0]);
            after.stress = strain + change;
        }
        after.stress = elastic().stress_of_strain(after.stress);
        return after;
    }
    /// The state after the plastic return mapping.
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return returned_with_stress(trial).state;
    }

private:
    /// The two yield surfaces.
    struct Strength {
        S sine;            ///< sin φ [1]
        S flow_sine;       ///< sin ψ [1]
        S cohesive;        ///< 2 c cos φ [Pa]
        S tension;         ///< t [Pa]
        mask_t<S> cuts;    ///< whether t lies below the apex
        mask_t<S> tipped;  ///< whether φ > 0, so there is an apex
    };
    /// A point on the yield surfaces.
    template <int D>
    struct OnSurface {
        Vec<S, D> strain;      ///< principal strains, in descending order [1]
        mask_t<S> first_join;  ///< whether the first two are equal, for all trial strains nearby
        mask_t<S> last_join;   ///< whether the last two are, likewise

        /// Returns the mask of where strains i < j are equal, for all trial strains nearby.
        FIRN_INLINE mask_t<S> joined(int i, int j) const {
            return j == 1 ? first_join : i == 1 ? last_join : first_join & last_join;
        }
    };

    template <int D>
    FIRN_INLINE static S sum(const Vec<S, D>& e) {
        S total = e.v[0];
        unroll<D - 1>([&](auto i) FIRN_LAMBDA { total = total + e.v[i + 1]; });
        return total;
    }

    /// Returns how much of the softening a plastic shear strain γ makes: 0 to 1.
    FIRN_INLINE S softened_part(const S& gamma) const {
        const auto softens = S(0) < softening_strain;
        return select(softens, min(gamma / select(softens, softening_strain, S(1)), S(1)), S(0));
    }
    /// Returns the strength after a part of the softening, 0 to 1.
    FIRN_INLINE Strength strength(const S& part) const {
        const auto between = [&](const S& peak, const S& residual)
                                 FIRN_LAMBDA { return peak + (residual - peak) * part; };
        Strength k;
        k.sine = named("sine", detail::sine_up_to_quarter_turn(between(friction_angle, residual_friction_angle)));
        k.flow_sine =
            named("flow_sine", detail::sine_up_to_quarter_turn(between(dilatancy_angle, residual_dilatancy_angle)));
        const S cosine = sqrt((S(1) - k.sine) * (S(1) + k.sine));
        k.cohesive = named("cohesive", S(2) * between(cohesion, residual_cohesion) * cosine);
        k.tension = tension;
        k.tipped = S(0) < k.sine;
        k.cuts = (k.tension * (k.sine + k.sine) < k.cohesive) | !k.tipped;
        return k;
    }
    /// Returns the yield function of the shear strength [Pa] at principal strains e.
    template <int D>
    FIRN_INLINE S shear_excess(const Vec<S, D>& e, const S& volumetric, const Strength& k) const {
        const S difference = (S(1) + k.sine) * e.v[0] - (S(1) - k.sine) * e.v[D - 1];
        return (mu + mu) * difference + (k.sine + k.sine) * lambda * volumetric - k.cohesive;
    }
    /// Returns the mask of the strains that may lie beyond a yield surface. The deviator of a given size d has
    /// principal values at most √(1 − 1/D) d, and its yield function of shear is at most √(2 + 2/3 sin² φ) d, in 2D √2
    /// d.
    template <int D>
    FIRN_INLINE mask_t<S> may_yield(const Mat<S, D>& strain, const Strength& k, const S& of_shear,
                                    const S& of_tension) const {
        const S G = mu + mu;
        const S volumetric = trace(strain);
        const S size = G * sqrt(squared_norm(strain - Mat<S, D>::diagonal(volumetric * S(1. / D))));
        const S mean = (G * S(1. / D) + lambda) * volumetric;
        const S steepest = S(std::numbers::sqrt2) * (D == 2 ? S(1) : S(1) + S(1. / 6) * k.sine * k.sine);
        const S slack = S(1e-3) * size;  // covers the rounding of this estimate
        const auto sheared = of_shear < steepest * size + slack + (k.sine + k.sine) * mean - k.cohesive;
        const auto torn = k.cuts & (of_tension < mean + size + slack - k.tension);
        return sheared | torn;
    }

    /// Returns the part of the softening after a step, in lanes that soften. Their strains yield with the strength
    /// `first`, which γ = `before` leaves.
    ///
    /// The step adds Δ(γ) with the strength of γ, so γ is the root of before + Δ(γ) − γ, which is positive at γ =
    /// `before`. But Δ is at most the largest minus the smallest strain. Where even that leaves γ below the softening
    /// strain, the slope of Δ is below 1, and the secant method finds the root from `before` and before + Δ(before).
    /// Elsewhere the second point is the softening strain. If the function is not negative there, γ lies beyond, and
    /// the strength is the residual one, else false position finds the root between the two (Anderson and Björck 1973,
    /// "A new high order method of the regula falsi type"). Both are exact at once where Δ is linear.
    template <int D>
    FIRN_INLINE S softened(const Vec<S, D>& e, const S& before, const Strength& first, const mask_t<S>& softens) const {
        constexpr bool is_float = sizeof(value_type_t<S>) == 4;
        const auto added_with = [&](const Strength& k) FIRN_LAMBDA {
            const OnSurface<D> on = to_surface(e, k);
            return (e.v[0] - on.strain.v[0]) - (e.v[D - 1] - on.strain.v[D - 1]);
        };
        const auto function = [&](const S& x)
                                  FIRN_LAMBDA { return added_with(strength(softened_part(before + x))) - x; };
        // Points that agree to half of their digits have no slope beyond rounding; x + y is nearer the root than x.
        constexpr double close = is_float ? 3e-4 : 1e-8;
        using Points = std::array<Vec<S, 3>, 2>;  // γ − before, the function there, and in the first: what is missing
        const auto root = [](const Points& b) FIRN_LAMBDA {
            const S step = b[1].v[0] - b[0].v[0], span = b[0].v[1] - b[1].v[1];
            const mask_t<S> far = S(close) * abs(b[0].v[0]) < abs(step), level = span == S(0), apart = far & !level;
            return select(apart, b[0].v[0] + step * (b[0].v[1] / select(apart, span, S(1))), b[1].v[0] + b[1].v[1]);
        };
        // The next root is nearer than the size of the function at the last one by the loss of strength over the step.
        constexpr double enough = is_float ? 3e-3 : 1e-9;
        const auto too_large = [](const S& y, const S& x) FIRN_LAMBDA { return abs(y) - S(enough) * x; };

        const S room = softening_strain - before, least = added_with(first);
        const auto stays_below = e.v[0] - e.v[D - 1] < room;
        const S x1 = select(stays_below, least, room), y1 = function(x1);
        const mask_t<S> reaches = S(0) <= y1, beyond = reaches & !stays_below;
        const S missing = select(softens & !beyond, too_large(y1, x1), S(-1));
        Points points{Vec<S, 3>{S(0), least, missing}, Vec<S, 3>{x1, y1, S(0)}};
        if (any(S(0) < missing))
            points = repeat_while<is_float ? 4 : 8>(points, [&](Points& b) FIRN_LAMBDA {
                const auto active = S(0) < b[0].v[2];
                const S x = root(b), y = function(x);
                const auto below = S(0) < y;
                // The end that false position keeps counts less.
                const S replaced = select(below, b[0].v[1], b[1].v[1]);
                const S left = S(1) - y / select(replaced == S(0), S(1), replaced);
                const auto secant = active & stays_below, false_position = active & !stays_below;
                const S weight = select(false_position, select(S(0) < left, left, S(0.5)), S(1));
                const auto lower = false_position & below, upper = active & !lower;
                const S more = select(active, too_large(y, x), b[0].v[2]);
                b[0] = {select(secant, b[1].v[0], select(lower, x, b[0].v[0])),
                        select(secant, b[1].v[1], select(lower, y, b[0].v[1] * weight)), more};
                b[1] = {select(upper, x, b[1].v[0]), select(upper, y, b[1].v[1] * weight), S(0)};
                return S(0) < more;
            });
        return select(beyond, S(1), softened_part(before + root(points)));
    }

    /// Returns the point on the yield surfaces that strains beyond them go to. Strains inside stay, up to rounding.
    ///
    /// Flow along r strains elastically by −r, so it changes the stresses by −2μ r − λ tr r. On a face of the shear
    /// strength it goes along r = (1 + sin ψ, 0, −1 + sin ψ), the flow of the plane τ₁₃. If that breaks the order of
    /// the principal values, the next plane acts, too: τ₂₃ at the edge τ₁ = τ₂, τ₁₂ at the edge τ₂ = τ₃; and if the
    /// order is still broken, or both of its inequalities were, the state is past the apex.
    template <int D>
    FIRN_INLINE OnSurface<D> to_surface(const Vec<S, D>& e, const Strength& k) const {
        constexpr int last = D - 1;
        const S G = mu + mu, a = S(1) + k.sine, b = S(1) - k.sine, up = S(1) + k.flow_sine, down = S(1) - k.flow_sine;
        const S volumetric = sum(e);
        const S excess = shear_excess(e, volumetric, k);
        const S dilation = S(4) * lambda * k.sine * k.flow_sine;
        const S stiffness = G * (a * up + b * down) + dilation;
        const S slip = max(excess, S(0)) / stiffness;

        OnSurface<D> on;
        on.strain = e;
        on.strain.v[0] = e.v[0] - up * slip;
        on.strain.v[last] = e.v[last] + down * slip;
        mask_t<S> past_apex = on.strain.v[0] < on.strain.v[last];
        if constexpr (D == 3) {
            on.first_join = on.strain.v[0] < e.v[1];
            on.last_join = e.v[1] < on.strain.v[2];
            const auto both = on.first_join & on.last_join, at_edge = on.first_join | on.last_join;
            // The yield functions of the two planes, and their flows, add up.
            const Vec<S, 3> other{select(on.first_join, e.v[1], e.v[0]), e.v[1], select(on.first_join, e.v[2], e.v[1])};
            const S coupled = stiffness + G * select(on.first_join, b * down, a * up) + dilation;
            const S slips = (excess + shear_excess(other, volumetric, k)) / coupled;
            const S first = select(on.first_join, S(0.5) * ((e.v[0] + e.v[1]) - up * slips), e.v[0] - up * slips);
            const S third = select(on.first_join, e.v[2] + down * slips, S(0.5) * ((e.v[1] + e.v[2]) + down * slips));
            on.strain = select(at_edge, Vec<S, 3>{first, select(on.first_join, first, third), third}, on.strain);
            past_apex = both | (at_edge & (first < third));
        } else {
            on.first_join = past_apex;
            on.last_join = past_apex;
        }
        past_apex = past_apex & k.tipped;
        on.first_join = on.first_join | past_apex;
        on.last_join = on.last_join | past_apex;
        const S apex = k.cohesive / (select(k.tipped, k.sine + k.sine, S(1)) * (G + S(D) * lambda));
        on.strain = select(past_apex, Vec<S, D>::filled(apex), on.strain);

        const auto torn = k.cuts & (k.tension < G * on.strain.v[0] + lambda * sum(on.strain));
        if (any(torn)) {
            const OnSurface<D> cut = to_cut_off(e, k);
            on.strain = select(torn, cut.strain, on.strain);
            on.first_join = (torn & cut.first_join) | (on.first_join & !torn);
            on.last_join = (torn & cut.last_join) | (on.last_join & !torn);
        }
        return on;
    }
    /// Returns the point on the tension cut-off that strains go to which the flow of shear alone leaves beyond it.
    ///
    /// Where the flow of tension alone leads to enough shear strength, that is it: τ₁ = t on the face, also τ₂ = t at
    /// the edge, and τ₃ = t at the corner. Else both surfaces are reached, τ₁ = t and τ₃ = q = ((1 + sin φ) t −
    /// 2 c cos φ)/(1 − sin φ), and τ₂ is what it was without flow along it, but between t and q.
    template <int D>
    FIRN_INLINE OnSurface<D> to_cut_off(const Vec<S, D>& e, const Strength& k) const {
        constexpr int last = D - 1;
        const S G = mu + mu, t = k.tension;
        const S volumetric = sum(e);
        // Reciprocals, so that the passes of softened() divide once.
        const S per_one = S(1) / (G + lambda), per_bulk = S(1) / (G + S(D) * lambda), per_G = S(1) / G;

        [[maybe_unused]] const S per_two = S(1) / (G + lambda + lambda);
        OnSurface<D> on;
        on.strain = e;
        const S one = (t - lambda * (volumetric - e.v[0])) * per_one;
        on.strain.v[0] = one;
        on.first_join = one < e.v[1];
        on.last_join = on.first_join;
        if constexpr (D == 3) {
            const S two = (t - lambda * e.v[2]) * per_two;
            on.last_join = on.first_join & (two < e.v[2]);
            on.strain = select(on.first_join, Vec<S, 3>{two, two, e.v[2]}, on.strain);
        }
        on.strain = select(on.last_join, Vec<S, D>::filled(t * per_bulk), on.strain);

        const auto shears = S(0) < shear_excess(on.strain, sum(on.strain), k);
        const S q = ((S(1) + k.sine) * t - k.cohesive) / (S(1) - k.sine);
        S trace = (t + q) * per_bulk;
        Vec<S, D> edge;
        if constexpr (D == 3) {
            const S mean = S(0.5) * (t + q - (lambda + lambda) * e.v[1]) * per_two;
            const S half = S(0.5) * (t - q) * per_G;
            const auto to_first = mean + half < e.v[1], to_last = e.v[1] < mean - half;
            trace = select(to_first | to_last, (t + q + select(to_first, t, q)) * per_bulk, mean + mean + e.v[1]);
            edge.v[1] =
                select(to_first, (t - lambda * trace) * per_G, select(to_last, (q - lambda * trace) * per_G, e.v[1]));
            on.first_join = (shears & to_first) | (on.first_join & !shears);
            on.last_join = (shears & to_last) | (on.last_join & !shears);
        } else {
            on.first_join = on.first_join & !shears;
            on.last_join = on.first_join;
        }
        edge.v[0] = (t - lambda * trace) * per_G;
        edge.v[last] = (q - lambda * trace) * per_G;
        on.strain = select(shears, edge, on.strain);
        return on;
    }

    /// Cohesion [Pa], friction angle [rad] and dilatancy angle [rad].
    struct Values {
        double cohesion, friction, dilatancy;
    };
    static void check_values(const Values& of, const char* which) {
        if (!(of.cohesion >= 0) || !std::isfinite(of.cohesion))
            throw parameter_error(
                sentence("The ", which, "cohesion is ", of.cohesion, " Pa; it must be finite and not negative."));
        check_friction_angle(radians(of.friction));
        if (!(of.dilatancy >= 0 && of.dilatancy <= of.friction))
            throw parameter_error(
                sentence("The ", which, "dilatancy angle is ", radians(of.dilatancy).in_degrees(), " degrees and the ",
                         which, "friction angle ", radians(of.friction).in_degrees(),
                         " degrees; the dilatancy angle must be at least 0 and at most the friction angle, or "
                         "plastic flow would give energy."));
    }
    static void check_strength(const Values& peak, const Values& residual, double t, double strain) {
        check_values(peak, "");
        check_values(residual, "residual ");
        if (!(t >= 0) || !std::isfinite(t))
            throw parameter_error(sentence("The tension cut-off is ", t,
                                           " Pa; it must be finite and not negative. For none, take "
                                           "MohrCoulomb::no_cut_off."));
        if (!(strain >= 0) || !std::isfinite(strain))
            throw parameter_error(sentence("The softening strain is ", strain,
                                           "; it must be finite and not negative. With 0, nothing softens."));
        if (strain > 0 && (residual.cohesion > peak.cohesion || residual.friction > peak.friction ||
                           residual.dilatancy > peak.dilatancy))
            throw parameter_error(
                sentence("The soil softens from a cohesion of ", peak.cohesion, " Pa, a friction angle of ",
                         radians(peak.friction).in_degrees(), " degrees and a dilatancy angle of ",
                         radians(peak.dilatancy).in_degrees(), " degrees to ", residual.cohesion, " Pa, ",
                         radians(residual.friction).in_degrees(), " and ", radians(residual.dilatancy).in_degrees(),
                         " degrees; no residual value may be larger than the first one."));
    }
};

}  // namespace firn::inline FIRN_BUILD
