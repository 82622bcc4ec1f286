/// \file Boundaries that act by the gap of particles: the same bits of particles and reactions for any number of
/// threads and for any order of the particles in memory, with held and mirrored walls, colliders, contact groups,
/// several materials and a periodic axis. contact.cpp says which combinations need `--full`.
#include "support/contact_bodies.hpp"
#include "support/effort.hpp"
#include <firn/contact/coulomb.hpp>
#include <firn/firn.hpp>

namespace gap_contact_determinism {

using namespace firn;

namespace {

template <int D>
auto boundary(bool periodic, NodesBehind nodes_behind) {
    auto walls = Walls<float, D>::all(Vec<float, D>::zero(), Vec<float, D>::filled(1), {Contact::separate, 0.3});
    walls.nodes_behind = nodes_behind;
    if (periodic) walls.at_lower[0] = walls.at_upper[0] = {Contact::none, 0};
    Collider<Sphere<float, D>> ball{.shape = {0.1f}, .friction = 0.2};
    ball.position = Vec<double, D>::filled(0.02);
    ball.linear_velocity = Vec<double, D>::filled(0.3);
    BoundaryList<Collider<Sphere<float, D>>> balls;
    balls.all.push_back(ball);
    ball.contact = Contact::slip;
    ball.position[D - 1] = 0.3;
    balls.all.push_back(ball);
    return GapContact{Together(walls, balls)};
}

/// Adds two bodies and spray that fly into the corner of the domain.
template <std::size_t I = 0, class Simulation>
void add_bodies(Simulation& simulation, int first_group = 0) {
    constexpr int D = Simulation::dimension;
    using V = Vec<double, D>;
    simulation.warn = {};
    simulation.most_steps_between_sorts = 7;
    auto set = simulation.template set<I>();
    const SamplingOptions filling{.spacing = 1.0 / 64, .pattern = Pattern::jittered, .jitter = 0.2};
    for (int k = 0; k < 2; ++k) {
        V lower = V::filled(0.03 + 0.2 * double(I));
        lower[0] += 0.22 * k;
        const Body body = set.add(sample_box<D>(lower, lower + V::filled(0.18), filling), 1000, V::filled(-2));
        if constexpr (Simulation::has_contact_groups) set.set_contact_group(body, first_group + k);
    }
    set.add(scenes::spray<D>(0.02), 1000, V::filled(-0.5));
}

template <int D, class Execution, class... Policies>
auto empty(const Execution& execution, bool periodic, NodesBehind nodes_behind, const Policies&... policies) {
    Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1.0), 1.0 / 32};
    domain.periodic[0] = periodic;
    return Simulation(domain, FixedCorotated<float>::from_young_poisson(1e5, 0.3), execution,
                      boundary<D>(periodic, nodes_behind), policies...);
}

template <class Simulation>
std::uint64_t hash_of_run(Simulation simulation) {
    constexpr int D = Simulation::dimension;
    add_bodies(simulation);
    simulation.reactions.emplace();
    if constexpr (Simulation::has_contact_groups) simulation.contact_impulses.emplace();
    scenes::Hash hash;
    std::array<bool, 3> acted{};
    bool touched = !Simulation::has_contact_groups;
    for (int step = 0; step < test_support::fewer_if_quick(60, 40); ++step) {
        simulation.step();
        for (std::size_t k = 0; k < 3; ++k) {
            const auto& part = simulation.reactions->parts[k];
            for (int a = 0; a < D; ++a) {
                hash.add(&part.impulse[a], 1);
                acted[k] = acted[k] || part.impulse[a] != 0;
            }
        }
        if constexpr (Simulation::has_contact_groups) touched = scenes::add_impulses(hash, simulation) || touched;
    }
    CHECK(touched);
    CHECK(acted[0]);
    CHECK(acted[1]);
    CHECK(acted[2]);
    const std::uint64_t of_particles = scenes::hash(simulation);
    hash.add(&of_particles, 1);
    return hash.value;
}

template <int D, class Execution, class... Policies>
void check_threads(bool periodic, NodesBehind nodes_behind, const Policies&... policies) {
    const std::uint64_t one = hash_of_run(empty<D>(Execution{1}, periodic, nodes_behind, policies...));
    for (const int threads : test_support::other_threads)
        CHECK(hash_of_run(empty<D>(Execution{threads}, periodic, nodes_behind, policies...)) == one);
}

template <class Simulation>
void check_order(const Simulation& made) {
    scenes::check_any_order(made, [](auto& simulation) { add_bodies(simulation); });
}

template <class... Policies>
void check_two_materials(const Policies&... policies) {
    const auto add = [](auto& simulation) {
        add_bodies<0>(simulation);
        add_bodies<1>(simulation, 20);
    };
    scenes::check_two_materials(add, boundary<2>(false, NodesBehind::mirrored), policies...);
}

}  // namespace

TEST_CASE(
    "By the gap in 2D, FLIP, mirrored walls, a periodic axis, groups: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<2, Coloured>(true, NodesBehind::mirrored, Flip<float>{}, CoulombContact{.friction = 0.3});
}
TEST_CASE("By the gap in 2D, fixed point, FMPM, F-bar, groups: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<2, FixedPoint<std::int32_t>>(false, NodesBehind::mirrored, Fmpm{}, FBar{}, WeightGradientForce{},
                                               CoulombContact{.friction = 0.3});
}
TEST_CASE("By the gap: the same bits wherever particles lie in memory") {
    check_order(empty<2>(Coloured{2}, false, NodesBehind::mirrored, Fmpm{}));
}
TEST_CASE("By the gap in 3D, groups: the same bits wherever particles lie in memory", "[slow]") {
    check_order(empty<3>(ColouredFixedPoint<std::int32_t>{2}, false, NodesBehind::held, CoulombContact{}));
}
TEST_CASE("By the gap, bodies of two materials in groups: the same bits for 1, 3 and 7 threads") {
    check_two_materials(CoulombContact{.friction = 0.3});
}

#ifdef FIRN_TEST_ALL
TEST_CASE("By the gap in 3D, APIC, held walls: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<3, Coloured>(false, NodesBehind::held);
}
TEST_CASE("By the gap in 2D, fixed point, FMPM, F-bar: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<2, FixedPoint<std::int32_t>>(false, NodesBehind::mirrored, Fmpm{}, FBar{}, WeightGradientForce{});
}
TEST_CASE("By the gap, without groups, in other executions: the same bits wherever particles lie in memory") {
    check_order(empty<2>(detail::Serial{}, true, NodesBehind::held));
    check_order(empty<3>(ColouredFixedPoint<std::int32_t>{2}, false, NodesBehind::mirrored));
}
TEST_CASE("By the gap, bodies of two materials: the same bits for 1, 3 and 7 threads") { check_two_materials(); }
#endif

}  // namespace gap_contact_determinism
