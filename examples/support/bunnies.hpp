/// \file Two bunnies, read from a mesh and filled with particles: one above the other, which falls on it.
#pragma once

#include "support/rotation.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/sampling.hpp>
#include <firn/io/obj.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/simulation.hpp>

#include <cmath>
#include <cstdint>
#include <string>

namespace example {

inline constexpr double bunny_size = 0.32;  ///< [m]

/// The particles of both bunnies before they move.
struct Bunnies {
    double spacing = 0;
    firn::Samples<3> below, above;
};

/// Fills a mesh, so that there are about so many particles in all.
inline Bunnies bunnies_from_mesh(const std::string& file, std::int64_t particles) {
    const firn::TriangleMesh mesh = firn::read_obj(file);
    const firn::InsideTest closed(mesh);  // throws for a mesh that cannot be filled
    const firn::TriangleMesh below = firn::fitted(mesh, {0.47, 0.5 * bunny_size, 0.5}, bunny_size);
    const firn::TriangleMesh turned =
        firn::rotated(firn::fitted(mesh, {0.0, 0.0, 0.0}, bunny_size), firn::rotation({0.0, 1.0, 0.0}, 2.2));
    const firn::TriangleMesh above = firn::translated(turned, {0.56, 0.62, 0.53});
    const double volume = std::abs(firn::signed_volume(below));
    const double spacing = std::cbrt(2 * volume / double(particles));
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered, .jitter = 0.1};
    return {spacing, firn::sample_mesh(below, filling), firn::sample_mesh(above, filling)};
}

/// Returns the simulation of two bunnies in a box, with steps of half their bound.
/// \tparam Policies  those that are not the default
template <class... Policies>
auto bunnies_in_a_box(const Bunnies& bunnies, const firn::FixedCorotated<float>& material, int threads) {
    firn::SimulationWith<3, firn::FixedCorotated<float>, Policies...> simulation(
        {.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1 / std::round(0.5 / bunnies.spacing)}, material,
        {threads});
    simulation.boundary = firn::Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {firn::Contact::separate, 0.3});
    simulation.add(bunnies.below, 1.0);
    simulation.add(bunnies.above, 1.0, {0.0, -2.0, 0.0});
    simulation.fixed_time_step = 0.5 * simulation.stable_time_step();
    return simulation;
}

}  // namespace example
