/// \file Ground at rest under its own weight, as a start of a simulation.
#pragma once

#include <firn/core/angle.hpp>
#include <firn/material/friction_angle.hpp>
#include <firn/simulation.hpp>
#include <firn/simulation/elastic_state.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Returns K₀ [1], the ratio of horizontal to vertical effective stress of ground that was never strained sideways:
/// (1 − sin φ) OCR^{sin φ} (Jaky 1944; Mayne and Kulhawy 1982, "K0–OCR relationships in soil").
/// \param friction_angle  φ of the effective stress
/// \param over_consolidation  OCR [1]: the largest vertical effective stress ever, over the present one
/// \throws parameter_error  unless 0° ≤ φ < 90° and OCR ≥ 1
inline double earth_pressure_at_rest(Angle friction_angle, double over_consolidation = 1) {
    const double sine = std::sin(check_friction_angle(friction_angle).in_radians());
    if (!(over_consolidation >= 1) || !std::isfinite(over_consolidation))
        throw parameter_error(
            sentence("The over-consolidation ratio is ", over_consolidation, "; it must be at least 1 and finite."));
    return (1 - sine) * std::pow(over_consolidation, sine);
}

/// Ground at rest. The y axis points up. Above the surface there is no stress.
///
/// The vertical stress is that of the weight above, with the density of the particle itself: ρ g times the depth below
/// the surface, plus the surcharge. The effective stress is less by the pore pressure, which grows below the water
/// table; the horizontal effective stresses are K₀ times the vertical one.
template <int D>
struct GroundAtRest {
    /// Height of the surface [m] above a place.
    std::function<double(const Vec<double, D>& x)> surface;
    /// The vertical stress at a place [Pa], positive in compression, in place of ρ g × depth: for ground in layers.
    std::function<double(const Vec<double, D>& x)> vertical_stress{};
    double gravity = 9.81;                                          ///< g [m/s²], downwards
    double surcharge = 0;                                           ///< pressure on the surface [Pa]
    double earth_pressure = 0.5;                                    ///< K₀ [1]. \see earth_pressure_at_rest
    double water_table = -std::numeric_limits<double>::infinity();  ///< height of the water table [m]
    double water_density = 1000;                                    ///< density of the water [kg/m³]
};

namespace detail {
/// \throws parameter_error  if a number is out of range
template <int D>
void check_ground(const GroundAtRest<D>& ground) {
    const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
    if (!ground.surface) throw parameter_error("Ground at rest needs a surface: a function of the place.");
    if (!positive(ground.gravity) || !positive(ground.earth_pressure) || !positive(ground.water_density) ||
        !(ground.surcharge >= 0) || !std::isfinite(ground.surcharge) || std::isnan(ground.water_table))
        throw parameter_error(sentence("Ground at rest has gravity ", ground.gravity, " m/s², earth pressure ",
                                       ground.earth_pressure, ", water of ", ground.water_density,
                                       " kg/m³, a water table at ", ground.water_table, " m and a surcharge of ",
                                       ground.surcharge,
                                       " Pa; the first three must be positive and finite, the surcharge not negative, "
                                       "and the water table a number."));
}
}  // namespace detail

/// Lets the particles of a body begin in ground at rest: each gets the elastic state in which its material bears the
/// stress that GroundAtRest says, and the initial volume that makes its present volume the one that it was added with.
/// So density and volume are those of the loaded ground. Velocities and plastic variables are not changed.
///
///     const Body soil = simulation.add(samples, 1900);
///     set_at_rest(simulation.set(), soil, {.surface = [](auto) { return 10.0; }, .earth_pressure = 0.6});
///
/// Below the water table the material must have a pore pressure. \see Undrained, elastic_state
/// \throws parameter_error  if a number of `ground` is out of range, if a material cannot bear the stress without
///                          yielding, if it has no pore pressure and lies below the water table, or if `body` is not
///                          one of the bodies of this particle set; nothing is changed in these cases.
///                          On several ranks all throw, if one of them finds such a particle
template <class Simulation, std::size_t I>
void set_at_rest(SetHandle<Simulation, I> set, const Body& body, const GroundAtRest<Simulation::dimension>& ground) {
    constexpr int D = Simulation::dimension;
    using S = typename Simulation::scalar_type;
    detail::check_ground(ground);
    set.simulation().sets()[I].check_body(body);
    const auto material = lift<double>(set.material());
    const double time = set.simulation().time();
    using State = std::remove_cvref_t<decltype(set.particles().state(0))>;
    using OfDoubles = material_state_t<std::remove_cvref_t<decltype(material)>, D>;
    struct Found {
        std::size_t slot;
        State state;
        S volume;
    };
    std::vector<Found> all;
    const auto& particles = set.particles();
    const auto find = [&] {
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || !body.holds(particles.id(slot))) continue;
            const Vec<double, D> x = particles.exact_position(slot);
            const double volume = double(particles.volume(slot)), density = double(particles.mass(slot)) / volume;
            const double below = ground.surface(x) - x[1];
            double vertical = ground.surcharge + density * ground.gravity * (below < 0 ? 0 : below);
            if (ground.vertical_stress) vertical = ground.vertical_stress(x);
            const double water = std::max(0.0, (ground.water_table - x[1]) * ground.water_density * ground.gravity);
            if (!std::isfinite(vertical) || !std::isfinite(water))
                throw parameter_error(sentence("At ", detail::point_text(x.v, D),
                                               " m the vertical stress of ground at rest is ", vertical,
                                               " Pa and its pore pressure ", water, " Pa; give finite ones."));
            const double effective = vertical - water, across = ground.earth_pressure * effective;
            auto start = detail::converted_state<OfDoubles>(particles.state(slot));
            constexpr bool has_water = requires { start.pore_pressure; };
            if constexpr (has_water) start.pore_pressure = 0;
            if (!has_water && water > 0)
                throw parameter_error(sentence(
                    "At ", detail::point_text(x.v, D), " m the ground lies below the water table, but the material ",
                    name_of<std::remove_cvref_t<decltype(material)>>(),
                    " has no pore pressure: use Undrained<…>, or leave the water table out and "
                    "give the density under buoyancy."));
            const auto here = [&] { return detail::surroundings_of_particle<double>(particles, slot, time); };
            auto found = elastic_state<D>(placed<D>(material, here), {-across, -effective, -across}, start);
            const double J = 1 + volume_change(found);
            if constexpr (has_water) found.pore_pressure = water * J;
            all.push_back({slot, detail::converted_state<State>(found), S(volume / J)});
        }
    };
    std::string refused;
    try {
        find();
    } catch (const parameter_error& wrong) {
        refused = wrong.what();
    }
    refused = detail::all_ranks<S, D>(set.simulation().execution).text_of_first(refused);
    if (!refused.empty()) throw parameter_error(refused);
    auto& changed = set.edit_particles();
    for (const Found& one : all) {
        changed.set_state(one.slot, one.state);
        changed.set_volume(one.slot, one.volume);
    }
}

}  // namespace firn::inline FIRN_BUILD
