/// \file The loads of a simulation as forces on nodes, and what else an implicit step takes from particles as they are.
#pragma once

#include <firn/force/none.hpp>
#include <firn/implicit/node_vectors.hpp>
#include <firn/loops/p2g.hpp>
#include <firn/simulation/set_of.hpp>
#include <firn/transfer/pic.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Calls a function at the end of a scope, whether or not an exception leaves it.
template <class F>
struct ScopeEnd {
    F act;
    ~ScopeEnd() { act(); }
};
template <class F>
ScopeEnd(F) -> ScopeEnd<F>;

/// Returns the largest speed of the particles in a store [m/s]. \param slots  number of slots of the store
template <std::floating_point S, int D>
double largest_speed_of(ParticleStore<S, D>& store) {
    double squared = 0;
    for (std::size_t slot = 0; slot < store.slots(); ++slot) {
        if (!store.is_particle(slot)) continue;
        const Vec<double, D> v = cast<double>(store.velocity(slot));
        squared = std::max(squared, dot(v, v));
    }
    return std::sqrt(squared);
}
/// Sets the velocities of all particles in a store to zero.
template <std::floating_point S, int D>
void stop(ParticleStore<S, D>& store) {
    std::fill_n(store.motion().velocity.data, store.slots() * std::size_t(D), S(0));
}

/// Sets a layer of the grid to the forces of loads on nodes [N]: Σ N f over the particles. Velocities of particles are
/// as before.
/// \param dt    time of the step [s]
/// \param push  push() lets loads push the particles for that time
/// \throws usage_error  if there are forces between particles
template <class Kernel, std::floating_point S, int D, class Push>
void loads_of_nodes(SparseGrid<S, D>& grid, int threads, std::size_t layer, SetList<S, D>& sets, double dt,
                    const Push& push) {
    const NodeVectors<S, D> vectors(grid, threads);
    vectors.make(layer);
    bool has_loads = false;
    for (SetOf<S, D>& set : sets) {
        if (set.forces)
            throw usage_error(
                "Implicit and quasi-static steps know no forces between particles (add_force(), nets). Take Explicit.");
        has_loads = has_loads || set.loads;
    }
    if (!has_loads) return push();  // sinks take note of where particles are
    std::vector<aligned_vector<S>> kept;
    for (SetOf<S, D>& set : sets) {
        ParticleStore<S, D>& store = set.store();
        const S* const velocities = store.motion().velocity.data;
        kept.emplace_back(velocities, velocities + store.slots() * std::size_t(D));
        stop(store);
    }
    const ScopeEnd put_back{[&] {
        for (std::size_t k = 0; k < sets.size(); ++k)
            std::copy(kept[k].begin(), kept[k].end(), sets[k].store().motion().velocity.data);
    }};
    push();
    using View = MotionView<S, D, BlockedSpan<S>>;
    std::vector<ParticleSet<View>> views;
    for (SetOf<S, D>& set : sets) views.push_back({set.store().motion(), set.partition});
    p2g<Kernel, Pic, NoForceNoField>(Coloured{threads}, grid, 0, ParticleSets<View>(views));
    vectors.add_vectors(layer, 1 / dt, 0);
}

}  // namespace firn::inline FIRN_BUILD::detail
