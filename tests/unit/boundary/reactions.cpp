/// \file What each part of a boundary gave to matter in a step: against the momentum of the matter, and the same bits
/// whatever the number of threads and ranks, and the order of the blocks.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/scenes.hpp"
#include "support/watched_run.hpp"

#include <cstring>

using namespace firn;
using scenes::WatchedRun;

namespace three_ranks {

/// An execution of three ranks in one program, one after the other. Each counts every third block, and adds its sums to
/// those of the ranks before it.
struct Ranks {
    int threads = 1;
    std::size_t rank = 0;
    std::vector<std::int64_t>* of_ranks_before = nullptr;
};
struct Told : OneRank {
    const Ranks& of;

    void merge(std::span<ExactSum> sums) const {
        for (ExactSum& sum : sums) sum.normalise();
        const auto digits = digits_of(sums);
        of.of_ranks_before->resize(digits.size());
        for (std::size_t k = 0; k < digits.size(); ++k) digits[k] = (*of.of_ranks_before)[k] += digits[k];
    }
    template <int D>
    bool counts(std::size_t block) const {
        return block % 3 == of.rank;
    }
};
Told ranks_of(const Ranks& ranks) { return {{}, ranks}; }

}  // namespace three_ranks

namespace {

template <int D>
bool same_bits(const Reactions<D>& a, const Reactions<D>& b) {
    if (a.parts.size() != b.parts.size()) return false;
    for (std::size_t k = 0; k < a.parts.size(); ++k)
        if (std::memcmp(&a.parts[k], &b.parts[k], sizeof a.parts[k]) != 0) return false;
    return true;
}

/// Nodes with mass, and the velocities that the boundary is given: by one thread, without registers.
template <class Boundary, int D>
Reactions<D> by_definition(const SparseGrid<double, D>& momenta, double dt, const Vec<double, D>& gravity,
                           const Boundary& everywhere, const Vec<double, D>& about) {
    const Boundary boundary = on_grid(everywhere, momenta.domain().cell_size);
    Reactions<D> sum;
    sum.parts.resize(std::size_t(part_count(boundary)));
    for (std::size_t b = 0; b < momenta.block_count(); ++b)
        for (int i = 0; i < block_nodes<D>; ++i) {
            const double* node = momenta.nodes(b) + i * node_width;
            if (!(node[node_mass] > 0)) continue;
            Vec<double, D> x{}, v{};
            for (int a = 0; a < D; ++a) {
                x[a] = position_of_place(momenta.domain(), momenta.block(b), a, 0) +
                       (i >> 2 * (D - 1 - a) & 3) * momenta.domain().cell_size;
                v[a] = node[a] / node[node_mass] + gravity[a] * dt;
            }
            const auto add = [&](int k, const Vec<double, D>& before, const Vec<double, D>& after) {
                const auto impulse = (after - before) * node[node_mass];
                sum.parts[std::size_t(k)].impulse += impulse;
                sum.parts[std::size_t(k)].angular_impulse += axial_product(x - about, impulse);
            };
            velocity_among(boundary, x, v, NoOthers{}, add);
        }
    return sum;
}

template <int D>
auto scene() {
    using V = Vec<double, D>;
    const auto walls = Walls<double, D>::all(V::zero(), V::filled(1), {Contact::separate, 0.2});
    Collider<Sphere<double, D>> ball{.shape = {0.2}, .friction = 0.4, .position = V::filled(0.4)};
    ball.linear_velocity = V::filled(0.5);
    Collider<Box<double, D>> block{.contact = Contact::stick, .position = V::filled(0.6)};
    return Together(walls, ball, BoundaryList<Collider<Box<double, D>>>{{block, {}}});
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("reactions are the sums of their definition over the nodes, part by part",
                       "[boundary][reactions]", ((int D), D), 2, 3) {
    Simulation<D, FixedCorotated<double>> simulation({Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 16});
    simulation.add(sample_box<D>(Vec<double, D>::filled(0.01), Vec<double, D>::filled(0.7), {.spacing = 1.0 / 32}),
                   1000, Vec<double, D>::filled(-1));
    SparseGrid<double, D> grid(simulation.domain());
    grid.activate(simulation.partition());
    auto particles = simulation.particles();
    const double dt = 1e-3;
    p2g<QuadraticBSpline, Apic, MlsForce>(detail::Serial{}, particles.view(), simulation.partition(), grid, dt);
    const auto boundary = scene<D>();
    const auto expected = by_definition(grid, dt, simulation.gravity, boundary, Vec<double, D>::filled(0.3));
    auto without = grid;
    Reactions<D> reactions{.about = Vec<double, D>::filled(0.3)};
    grid_update(detail::Serial{}, grid, dt, simulation.gravity, boundary, reactions);
    grid_update(detail::Serial{}, without, dt, simulation.gravity, boundary);

    REQUIRE(reactions.parts.size() == 4);
    for (std::size_t k = 0; k < 4; ++k) {
        const auto &mine = reactions.parts[k], &its = expected.parts[k];
        CAPTURE(k, norm(its.impulse));
        if (k != 3) CHECK(norm(its.impulse) > 1);  // the last is where there is no matter
        CHECK(norm(mine.impulse - its.impulse) <= 1e-12 * (1 + norm(its.impulse)));
        CHECK(squared_norm(skew(mine.angular_impulse) - skew(its.angular_impulse)) <= 1e-22);
        CHECK(mine.about == Vec<double, D>::filled(0.3));
    }
    // Watching changes nothing.
    for (std::size_t b = 0; b < grid.block_count(); ++b)
        REQUIRE(std::memcmp(grid.nodes(b), without.nodes(b),
                            sizeof(double) * std::size_t(block_nodes<D> * node_width)) == 0);
}

TEMPLATE_TEST_CASE("reactions have the same bits for any number of threads", "[boundary][reactions]",
                   FIRN_TEST_PRECISIONS) {
    using S = TestType;
    constexpr int D = 2;
    const auto walls = Walls<S, D>::all({S(0), S(0)}, {S(1), S(1)}, {Contact::separate, 0.2});
    const Collider<Sphere<S, D>> ball{.shape = {S(0.2)}, .friction = 0.4, .position = {0.5, 0.5}};
    std::vector<Reactions<D>> of_threads;
    for (const int threads : {1, 2, 3, 8}) {
        WatchedRun<D, S, Together<Walls<S, D>, Collider<Sphere<S, D>>>> run(
            {{0.0, 0.0}, {1.0, 1.0}, 1.0 / 64}, FixedCorotated<S>::from_young_poisson(S(1e4), S(0.3)), {walls, ball});
        run.execution.threads = threads;
        run.gravity = {0.0, -9.81};
        const auto matter = sample_box<2>({0.01, 0.01}, {0.9, 0.9}, {.spacing = 1.0 / 128});
        run.add(matter, 1000, {1.0, 0.3});
        for (int i = 0; i < 5; ++i) run.step(2e-4);
        CHECK(norm(run.reaction(1).impulse) > 0);
        of_threads.push_back(*run.reactions);
    }
    for (const auto& other : of_threads) CHECK(same_bits(other, of_threads[0]));
}

TEMPLATE_TEST_CASE_SIG("reactions have the same bits for any number of ranks, and in any order of the blocks",
                       "[boundary][reactions]", ((int D), D), 2, 3) {
    SparseGrid<double, D> grid({Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 16});
    Simulation<D, FixedCorotated<double>> simulation(grid.domain());
    simulation.add(sample_box<D>(Vec<double, D>::filled(0.01), Vec<double, D>::filled(0.9), {.spacing = 1.0 / 20}),
                   1000);
    grid.activate(simulation.partition());
    const std::size_t numbers = std::size_t(block_nodes<D> * node_width);
    for (std::size_t b = 0; b < grid.block_count(); ++b)
        for (std::size_t k = 0; k < numbers; ++k)
            grid.nodes(b)[k] =
                (k % node_width == node_mass ? 1 : 1e3 / double(b + 1)) * std::sin(double(1 + k % 89 + 31 * b));
    const auto boundary = scene<D>();
    const auto reactions_of = [&](const auto& execution) {
        auto momenta = grid;
        Reactions<D> reactions;
        grid_update(execution, momenta, 1e-3, Vec<double, D>::filled(-1), boundary, reactions);
        return reactions;
    };
    const Reactions<D> whole = reactions_of(detail::Serial{});
    for (std::size_t k = 0; k < 3; ++k) CHECK(norm(whole.parts[k].impulse) > 0);
    std::vector<std::int64_t> sums;
    for (const std::size_t rank : {2, 0, 1}) {
        const Reactions<D> of_ranks = reactions_of(three_ranks::Ranks{1, rank, &sums});
        CHECK(same_bits(of_ranks, whole) == (rank == 1));  // of the last rank
    }

    // The impulses of blocks, with many orders of magnitude, as they might lie in the grid.
    std::vector<std::array<Reaction<D>, 2>> blocks(500);
    std::uint64_t seed = 1;
    for (auto& of_parts : blocks)
        for (Reaction<D>& reaction : of_parts)
            detail::for_impulses(reaction, [&](double& number) {
                number = (scenes::noise(seed) - 0.4) * std::pow(10, 20 * scenes::noise(seed + 1));
                seed += 2;
            });
    std::vector<Reactions<D>> of_orders;
    for (int order = 0; order < 4; ++order) {
        of_orders.emplace_back().parts.resize(2);
        const std::span<const Reaction<D>> all(blocks[0].data(), 2 * blocks.size());
        detail::sum_reactions<D>(detail::one_rank<double, D>(), all, of_orders.back().parts);
        CHECK(same_bits(of_orders.back(), of_orders[0]));
        for (std::size_t i = blocks.size(); i > 1; --i)
            std::swap(blocks[i - 1], blocks[std::size_t(scenes::noise(seed++) * double(i))]);
    }
}

TEST_CASE("a list of joined solids has the parts of all of them, in order", "[boundary][reactions]") {
    using Ball = Collider<Sphere<double, 2>>;
    const auto ball_at = [](double x, double spin) {
        return Ball{.shape = {0.1}, .contact = Contact::stick, .position = {x, 0.3}, .angular_velocity = spin};
    };
    const auto reactions_of = [](const auto& boundary) {
        Simulation simulation(Domain<2>{.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 32},
                              FixedCorotated<double>{}, boundary);
        simulation.gravity = {0, 0};
        simulation.warn = {};
        simulation.add(sample_box<2>({0.1, 0.2}, {0.9, 0.4}, {.spacing = 1.0 / 64}), 1000);
        simulation.reactions.emplace();
        simulation.step();
        return *simulation.reactions;
    };
    const Ball a = ball_at(0.2, 1), b = ball_at(0.4, 2), c = ball_at(0.6, 3), d = ball_at(0.8, 4);
    const auto joined = reactions_of(Together(a, b, c, d));
    CHECK(same_bits(reactions_of(BoundaryList<Together<Ball, Ball>>{{Together(a, b), Together(c, d)}}), joined));
    REQUIRE(joined.parts.size() == 4);
    for (int k = 0; k < 4; ++k) CHECK(joined.parts[std::size_t(k)].about[0] == Approx(0.2 * (k + 1)));
}

TEST_CASE("torques are about each part's position where no point is given", "[boundary][reactions]") {
    const auto boundary = scene<2>();
    SparseGrid<double, 2> grid({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16});
    Reactions<2> reactions;
    grid_update(detail::Serial{}, grid, 1e-3, Vec<double, 2>{}, boundary, reactions);
    CHECK(reactions.parts[0].about == Vec<double, 2>{});
    CHECK(reactions.parts[1].about == Vec<double, 2>::filled(0.4));
    CHECK(reactions.parts[2].about == Vec<double, 2>::filled(0.6));
}

TEST_CASE("a ball bounces off a floor: what the floor gave is what its momentum changed by", "[boundary][reactions]") {
    const Collider<HalfSpace<double, 2>> floor{};
    WatchedRun<2, double, Collider<HalfSpace<double, 2>>> run(
        {{-0.5, -0.5}, {0.5, 0.5}, 1.0 / 32}, FixedCorotated<double>::from_young_poisson(1e4, 0.3), floor);
    const auto ball = sample_sphere<2>({0.0, 0.2}, 0.15, {.spacing = 1.0 / 64});
    run.add(ball, 1000, {0.0, -0.8});
    const auto before = run.momentum();
    Vec<double, 2> given{};
    double torque = 0;
    for (int i = 0; i < 400; ++i) {
        run.step(1e-3);
        given += run.reaction(0).impulse;
        torque += run.reaction(0).angular_impulse;
    }
    const auto after = run.momentum();
    CHECK(norm(after - before - given) <= 1e-11 * norm(before));
    CHECK(after[1] > -0.6 * before[1]);  // it does bounce
    CHECK(std::abs(given[0]) <= 1e-8 * given[1]);
    CHECK(std::abs(torque) <= 1e-8 * given[1]);  // its place is above the floor's origin
    CHECK(norm(run.reaction(0).impulse) == 0);
}

TEST_CASE("a region of nodes with a prescribed velocity: a solid that sticks", "[boundary][reactions]") {
    // The left end of a bar is drawn out at 0.2 m/s, the right end is held.
    Collider<Box<double, 2>> left{.shape = {{0.1, 0.3}}, .contact = Contact::stick};
    left.position = {0.1, 0.5};
    auto right = left;
    right.position = {0.9, 0.5};
    left.linear_velocity = {-0.2, 0.0};
    using Grips = Together<Collider<Box<double, 2>>, Collider<Box<double, 2>>>;
    WatchedRun<2, double, Grips> run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 20},
                                     FixedCorotated<double>::from_young_poisson(1e5, 0.0), {left, right});
    const auto bar = sample_box<2>({0.15, 0.4}, {0.85, 0.6}, {.spacing = 1.0 / 40});
    run.add(bar, 1000);
    Vec<double, 2> given{};
    for (int i = 0; i < 200; ++i) {
        run.step(2e-4);
        given += run.reaction(0).impulse + run.reaction(1).impulse;
        REQUIRE(norm(given - run.momentum()) <= 1e-12);
        std::size_t held = 0, drawn = 0;
        for (std::size_t b = 0; b < run.grid().block_count(); ++b)
            for (int n = 0; n < 16; ++n) {
                const double* node = run.grid().nodes(b) + n * node_width;
                if (!(node[node_mass] > 0)) continue;
                const double x =
                    position_of_place(run.grid().domain(), run.grid().block(b), 0, 0) + (n >> 2 & 3) / 20.0;
                const double edge = 0.2 - 0.2 * 2e-4 * i;  // of the left solid, which has moved
                if (x > 0.81) {
                    REQUIRE((node[0] == 0 && node[1] == 0));
                    ++held;
                } else if (x < edge - 1e-9) {
                    REQUIRE((std::abs(node[0] + 0.2) <= 1e-15 && node[1] == 0));
                    ++drawn;
                }
            }
        REQUIRE(held > 5);
        REQUIRE(drawn > 5);
    }
    CHECK(run.reaction(0).impulse[0] < 0);  // it draws on
}
