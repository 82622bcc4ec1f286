/// \file Contact between groups: the same bits for any number of threads and for any order of the particles in memory,
/// in every execution, with transfers of several passes, several materials, and across the ends of a periodic axis.
/// Without `--full`, gap_contact.cpp holds most of these with boundaries that act by the gap as well, so that each pair
/// of choices is in one of the two files.
#include "support/contact_bodies.hpp"
#include "support/effort.hpp"
#include <firn/contact/coulomb.hpp>

namespace contact_determinism {

using namespace firn;

namespace {

/// Adds three bodies and spray, each in a group of its own, that fly into each other at a corner of the domain (along
/// axis 0 across the ends, if it is periodic).
template <std::size_t I = 0, class Simulation>
void add_bodies(Simulation& simulation, int first_group = 0) {
    constexpr int D = Simulation::dimension;
    using V = Vec<double, D>;
    simulation.warn = {};
    simulation.most_steps_between_sorts = 7;
    auto set = simulation.template set<I>();
    const SamplingOptions filling{.spacing = 1.0 / 64, .pattern = Pattern::jittered, .jitter = 0.2};
    const double side = D == 2 ? 0.25 : 0.14, gap = 0.02;
    for (int k = 0; k < 3; ++k) {
        V lower = V::filled(0.05);
        if (k > 0) lower[k - 1] += side + gap;
        V velocity = V::zero();
        if (k > 0) velocity[k - 1] = -3;
        if (D == 3) velocity[2] = 0.3 * (k - 1);
        const Body body = set.add(sample_box<D>(lower, lower + V::filled(side), filling), 1000, velocity);
        set.set_contact_group(body, first_group + k);
    }
    set.set_contact_group(set.add(scenes::spray<D>(0.06), 1000, V::filled(-0.5)), first_group + 7);
}

template <int D, class Execution, class... Policies>
auto empty(const Execution& execution, bool periodic, const Policies&... policies) {
    Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1.0), 1.0 / 32};
    domain.periodic[0] = periodic;
    return Simulation(domain, FixedCorotated<float>::from_young_poisson(1e5, 0.3), execution,
                      CoulombContact{.friction = 0.3}, policies...);
}

template <int D, class Execution, class... Policies>
std::uint64_t hash_of_run(const Execution& execution, bool periodic, const Policies&... policies) {
    auto simulation = empty<D>(execution, periodic, policies...);
    add_bodies(simulation);
    simulation.contact_impulses.emplace();
    scenes::Hash hash;
    bool touched = false;
    for (int step = 0; step < test_support::fewer_if_quick(80, 20); ++step) {
        simulation.step();
        touched = scenes::add_impulses(hash, simulation) || touched;
    }
    CHECK(touched);
    const std::uint64_t of_particles = scenes::hash(simulation);
    hash.add(&of_particles, 1);
    return hash.value;
}

template <int D, class Execution, class... Policies>
void check_threads(bool periodic, const Policies&... policies) {
    const std::uint64_t one = hash_of_run<D>(Execution{1}, periodic, policies...);
    for (const int threads : test_support::other_threads)
        CHECK(hash_of_run<D>(Execution{threads}, periodic, policies...) == one);
}

template <class Simulation>
void check_order(const Simulation& made) {
    scenes::check_any_order(made, [](auto& simulation) { add_bodies(simulation); });
}

}  // namespace

TEST_CASE("Contact in 3D, APIC: the same bits for 1, 2, 3, 4 and 7 threads") { check_threads<3, Coloured>(false); }
TEST_CASE("Contact on one thread, across a periodic end: the same bits wherever particles lie in memory") {
    check_order(empty<2>(detail::Serial{}, true));
}

#ifdef FIRN_TEST_ALL
TEST_CASE("Contact in 2D, FLIP, across a periodic end: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<2, Coloured>(true, Flip<float>{});
}
TEST_CASE("Contact in 2D, fixed point, FMPM, F-bar: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<2, FixedPoint<std::int32_t>>(false, FBar{}, WeightGradientForce{});
}
TEST_CASE("Contact: the same bits wherever particles lie in memory") {
    check_order(empty<2>(Coloured{2}, false, Fmpm{}));
    check_order(empty<3>(ColouredFixedPoint<std::int32_t>{2}, false));
}
TEST_CASE("Contact between bodies of two materials: the same bits for 1, 3 and 7 threads") {
    const auto add = [](auto& simulation) {
        add_bodies<0>(simulation);
        add_bodies<1>(simulation, 20);
    };
    scenes::check_two_materials(add, CoulombContact{.friction = 0.3});
}
#endif

}  // namespace contact_determinism
