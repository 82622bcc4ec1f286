/// \file The places of the particles of a simulation with one material, and how far they have moved.
#pragma once

#include <firn/simulation.hpp>

#include <algorithm>
#include <vector>

namespace verification {

/// Returns the positions of all particles [m], by id.
template <class Simulation>
auto places_of(const Simulation& simulation) {
    const auto& particles = simulation.particles();
    std::vector<firn::Vec<double, Simulation::dimension>> all(particles.next_id());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) all[particles.id(slot)] = particles.exact_position(slot);
    return all;
}
/// Returns the largest distance by which particles have moved [m].
/// \param counts  counts(x) tells whether the particle that was at x counts
template <int D, class Counts>
double largest_motion(const std::vector<firn::Vec<double, D>>& from, const std::vector<firn::Vec<double, D>>& to,
                      const Counts& counts) {
    double most = 0;
    for (std::size_t i = 0; i < from.size(); ++i)
        if (counts(from[i])) most = std::max(most, norm(to[i] - from[i]));
    return most;
}
template <int D>
double largest_motion(const std::vector<firn::Vec<double, D>>& from, const std::vector<firn::Vec<double, D>>& to) {
    return largest_motion(from, to, [](const auto&) { return true; });
}

}  // namespace verification
