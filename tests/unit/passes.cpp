// The passes of a step: their order, passes of the program's own, and what a list refuses.
#include <firn/firn.hpp>
#include <support/catch.hpp>
#include <support/message.hpp>

#include <string>
#include <vector>

namespace passes_tests {

using namespace firn;
using test_support::message;

template <class Simulation>
std::vector<std::string> names(const Simulation& simulation) {
    std::vector<std::string> all;
    for (const auto& pass : simulation.passes()) all.push_back(pass.name);
    return all;
}
using Names = std::vector<std::string>;

const Domain<2> domain{{0, 0}, {1, 1}, 1.0 / 16};

template <class... Policies>
auto falling_block(const Policies&... policies) {
    Simulation simulation(domain, FixedCorotated<float>{}, policies...);
    simulation.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000);
    return simulation;
}

TEST_CASE("Each policy adds its passes to a step", "[passes]") {
    CHECK(names(falling_block()) == Names{"sort", "push", "p2g", "grid update", "g2p", "end g2p", "sinks and sources"});
    CHECK(names(falling_block(Fmpm{2})) ==
          Names{"sort", "push", "p2g", "refine velocities", "grid update", "g2p", "end g2p", "sinks and sources"});
    const Names all{"sort",    "push",           "find gaps",  "p2g",
                    "contact", "grid update",    "act by gap", "average volumes",
                    "g2p",     "restore masses", "end g2p",    "sinks and sources"};
    const auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {});
    CHECK(names(falling_block(Flip<>{}, FBar{}, CoulombContact{}, GapContact{walls})) == all);
    CHECK(names(falling_block(GapContact{walls}, CoulombContact{}, FBar{}, Flip<>{})) == all);  // in any order
}

TEST_CASE("A pass of the program acts once a step, at its place, also in a copy", "[passes]") {
    auto simulation = falling_block();
    simulation.fixed_time_step = 1e-4;
    std::vector<double> before, after;  // momentum along y
    const auto sum = [](const auto& grid) {
        double all = 0;
        for (std::size_t b = 0; b < grid.block_count(); ++b)
            for (int i = 0; i < block_nodes<2>; ++i) all += double(grid.nodes(b)[i * node_width + 1]);
        return all;
    };
    simulation.add_pass("momenta", "p2g", [&](auto& run, const auto& now) {
        CHECK(now.dt == 1e-4);
        before.push_back(sum(run.grid()));
    });
    simulation.add_pass(
        "velocities", "grid update", [&](auto& run, const auto&) { after.push_back(sum(run.grid())); }, PassKind::node,
        Data::node_velocities);
    CHECK(names(simulation) ==
          Names{"sort", "push", "p2g", "momenta", "grid update", "velocities", "g2p", "end g2p", "sinks and sources"});
    simulation.step();
    REQUIRE(before == std::vector<double>{0});  // the block is at rest, and its stress is 0
    CHECK(after.at(0) < 0);                     // gravity has moved the nodes
    auto copy = simulation;
    copy.step();
    CHECK(before.size() == 2);
    auto plain = falling_block();
    plain.fixed_time_step = 1e-4;
    plain.step(), plain.step();
    for (std::size_t slot = 0; slot < plain.particles().slots(); ++slot)
        REQUIRE(copy.particles().velocity(slot).v[1] == plain.particles().velocity(slot).v[1]);
}

TEST_CASE("A pass can change the run for the rest of the step", "[passes]") {
    auto simulation = falling_block();
    simulation.add_pass("stop", "push", [](auto& run, const auto&) { run.gravity = {0, 0}; });
    simulation.step();
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
        REQUIRE(simulation.particles().velocity(slot).v[1] == 0);
}

TEST_CASE("Passes of two sets act set by set", "[passes]") {
    Simulation simulation(domain, Materials{FixedCorotated<float>{}, NeoHookean<float>{}}, FBar{});
    simulation.set<0>().add(sample_box<2>({0.2, 0.4}, {0.4, 0.6}, {.spacing = 1.0 / 32}), 1000);
    simulation.set<1>().add(sample_box<2>({0.6, 0.4}, {0.8, 0.6}, {.spacing = 1.0 / 32}), 1000);
    std::vector<std::size_t> seen;
    // A pass that acts on the run stands behind all that act set by set, wherever among them it was put.
    simulation.add_pass("probe", "average volumes", [&](auto&, const auto& now) { seen.push_back(now.set); });
    simulation.step();
    CHECK(seen == std::vector<std::size_t>{2});
    CHECK(names(simulation).at(7) == "probe");
}

TEST_CASE("A list refuses passes that it cannot order", "[passes]") {
    auto simulation = falling_block();
    const auto nothing = [](auto&, const auto&) {};
    const auto before = names(simulation);
    CHECK(message<parameter_error>([&] { simulation.add_pass("p2g", "sort", nothing); }) ==
          "There is a pass 'p2g' already: give this one another name.");
    CHECK(message<parameter_error>([&] { simulation.add_pass("probe", "contact", nothing); }) ==
          "There is no pass 'contact' in this simulation. It has 'sort', 'push', 'p2g', 'grid update', 'g2p', 'end "
          "g2p', 'sinks and sources'.");
    CHECK(message<parameter_error>([&] {
              simulation.add_pass("probe", "p2g", nothing, PassKind::node, Data::node_velocities);
          }) == "The pass 'probe' reads the velocities of nodes, which no pass before it writes.");
    CHECK(message<parameter_error>([&] {
              simulation.add_pass("probe", "p2g", nothing, PassKind::node, Data::node_loads);
          }) == "The pass 'probe' reads the loads on nodes, which no pass before it writes.");
    CHECK_THROWS_AS(simulation.add_pass("", "p2g", nothing), parameter_error);
    CHECK(names(simulation) == before);
}

TEST_CASE("A run measures the times of its passes", "[passes]") {
    auto simulation = falling_block();
    simulation.times.emplace();
    simulation.step();
    REQUIRE(simulation.times->seconds.size() == simulation.passes().size());
    for (std::size_t i = 0; i < simulation.passes().size(); ++i) {
        CHECK(simulation.times->seconds[i].first == simulation.passes()[i].name);
        CHECK(simulation.times->seconds[i].second >= 0);
    }
    // A pass that is added later has a time of its own, and leaves those of the others alone.
    const auto before = simulation.times->seconds;
    simulation.add_pass("late", "sort", [](auto&, const auto&) {});
    simulation.step();
    REQUIRE(simulation.times->seconds.size() == before.size() + 1);
    for (std::size_t i = 0; i < before.size(); ++i) CHECK(simulation.times->seconds[i].first == before[i].first);
    CHECK(simulation.times->seconds.back().first == "late");
}

}  // namespace passes_tests
