/// \file What the tests of contact's determinism share: spray, and runs whose particles lie elsewhere in memory.
#pragma once

#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/firn.hpp>

namespace scenes {

/// Single particles, strewn over the lower 0.4 m of each axis from `lower` on.
template <int D>
firn::Samples<D> spray(double lower) {
    firn::Samples<D> samples;
    for (std::uint64_t i = 0; i < 40; ++i) {
        samples.positions.emplace_back();
        for (int a = 0; a < D; ++a)
            samples.positions.back()[a] = lower + 0.4 * noise(std::uint64_t(D) * i + std::uint64_t(a));
    }
    samples.volume = std::pow(1.0 / 64, D);
    return samples;
}

/// Runs a simulation twice, once with its particles elsewhere in memory, at the start and on the way. Checks that both
/// have the same bits.
/// \param made  a simulation without particles;  \param add  add(simulation) adds them
template <class Simulation, class Add>
void check_any_order(const Simulation& made, const Add& add) {
    Simulation one = made, other = made;
    for (Simulation* simulation : {&one, &other}) add(*simulation);
    for (const std::uint64_t seed : {1, 2}) {
        one.edit_particles();
        shuffle(other.edit_particles(), seed);
        for (int step = 0; step < 40; ++step) {
            one.step();
            other.step();
        }
        CHECK(hash(one.particles()) == hash(other.particles()));
    }
}

/// Adds the impulses between contact groups, of the last step, to a hash.
/// \return whether one of them is not zero
template <class Simulation>
bool add_impulses(Hash& hash, const Simulation& simulation) {
    bool any = false;
    for (const auto& [groups, impulse] : simulation.contact_impulses->on_first)
        for (int a = 0; a < Simulation::dimension; ++a) {
            hash.add(&impulse[a], 1);
            any = any || impulse[a] != 0;
        }
    return any;
}

/// Runs two sets of bodies, of two materials, with 1, 3 and 7 threads. Checks that all runs have the same bits.
/// \param add       add(simulation) adds the bodies
/// \param policies  policies of the simulation: a boundary, a contact law, or both
template <class Add, class... Policies>
void check_two_materials(const Add& add, const Policies&... policies) {
    using namespace firn;
    const auto run = [&](int threads) {
        const Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32};
        Simulation simulation(domain,
                              Materials{FixedCorotated<float>::from_young_poisson(1e5, 0.3),
                                        NeoHookean<float>::from_young_poisson(1e4, 0.3)},
                              Coloured{threads}, policies...);
        add(simulation);
        for (int step = 0; step < 60; ++step) simulation.step();
        return std::pair(hash(simulation.template set<0>().particles()),
                         hash(simulation.template set<1>().particles()));
    };
    const auto one = run(1);
    CHECK(run(3) == one);
    CHECK(run(7) == one);
}

}  // namespace scenes
