/// \file The executions of P2G make the same sums, conserve what they must, and refuse what would overflow.
#include "support/by_definition.hpp"
#include "support/catch.hpp"

#include <map>

using namespace firn;
using by_definition::Case;
using by_definition::difference;
using by_definition::numbers;
using scenes::Kind;

namespace p2g_tests {
namespace {

constexpr double dt = 1e-3;

template <class C, class Execution>
SparseGrid<typename C::S, C::D> scattered(scenes::RandomCloud<typename C::S, C::D>& cloud, const Execution& execution) {
    SparseGrid<typename C::S, C::D> grid(cloud.domain);
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 2);
    grid.activate(partition);
    p2g<QuadraticBSpline, typename C::Transfer, typename C::Force>(execution, cloud.view(), partition, grid, dt);
    return grid;
}

}  // namespace

// Every pair of precision, dimension, transfer and force; fixed point on two of them.
TEMPLATE_TEST_CASE("P2G is the sum that the papers define, in every execution", "", (Case<float, 3, Apic, MlsForce>),
                   (Case<double, 3, Apic, WeightGradientForce>), (Case<float, 3, Pic, WeightGradientForce>),
                   (Case<double, 2, Pic, MlsForce>), (Case<float, 2, Apic, WeightGradientForce>)) {
    using S = typename TestType::S;
    const Kind kind = GENERATE(Kind::dense, Kind::cube, Kind::spray);
    scenes::RandomCloud<S, TestType::D> cloud(scenes::particles_of<TestType::D>(kind));
    const auto serial = scattered<TestType>(cloud, detail::Serial{});
    const auto expected = by_definition::p2g<TestType>(cloud, serial, dt);
    // Rounding: some hundred additions a node at most; the position in cells is rounded in S, too.
    const double tolerance = (sizeof(S) == 4 ? 0x1p-23 : 0x1p-52) * 64;
    CHECK(difference(numbers(serial), expected) < tolerance);
    CHECK(difference(numbers(scattered<TestType>(cloud, Coloured{2})), expected) < tolerance);
    if constexpr (std::same_as<S, float> && TestType::Transfer::affine) {
        CHECK(difference(numbers(scattered<TestType>(cloud, FixedPoint<std::int64_t>{2})), expected) < tolerance);
        // 32 bits: at most half a quantum from each of n contributions, and the a-priori bound costs some bits.
        CHECK(difference(numbers(scattered<TestType>(cloud, FixedPoint<std::int32_t>{2})), expected) < 2e-5);
    }
}

TEMPLATE_TEST_CASE("P2G reaches every node of particles that have drifted up to a cell since they were sorted", "",
                   (Case<double, 3, Apic, WeightGradientForce>), (Case<double, 2, Pic, MlsForce>)) {
    const Kind kind = GENERATE(Kind::dense, Kind::cube, Kind::spray);
    scenes::RandomCloud<double, TestType::D> cloud(scenes::particles_of<TestType::D>(kind));
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    REQUIRE(scenes::has(partition, kind));
    for (std::size_t i = 0; i < cloud.x.size(); ++i)
        cloud.x[i] += 0.999 * cloud.domain.cell_size * (2 * scenes::noise(i) - 1);
    const auto check = [&](auto execution) {
        SparseGrid<double, TestType::D> grid(cloud.domain);
        grid.activate(partition);
        p2g<QuadraticBSpline, typename TestType::Transfer, typename TestType::Force>(execution, cloud.view(), partition,
                                                                                     grid, dt);
        CHECK(difference(numbers(grid), by_definition::p2g<TestType>(cloud, grid, dt)) < 64 * 0x1p-52);
    };
    check(detail::Serial{});
    check(Coloured{2});
}

TEST_CASE("Much spray is scattered band by band: each block is cleared before the first group adds to it") {
    // About 17 cubes of blocks along each axis, with some particles each, and among them a dense body.
    constexpr int D = 3;
    scenes::RandomCloud<float, D> cloud(12000);
    cloud.domain = {{0, 0, 0}, {8.0, 8.0, 8.0}, 1.0 / 16};
    for (std::size_t i = 0; i < cloud.x.size(); ++i)
        cloud.x[i] = i % 60 < 3 ? 3 + 0.4f * float(scenes::noise(i)) : 0.2f + 7.6f * float(scenes::noise(i));
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    REQUIRE(std::any_of(partition.groups.begin(), partition.groups.end(), [](auto& g) { return !g.sparse; }));
    SparseGrid<float, D> grid(cloud.domain);
    grid.activate(partition);

    const auto bands = detail::bands(grid, partition);
    REQUIRE(bands.size() > 4);
    std::size_t phase = 0;
    for (const detail::Band& band : bands) {
        CHECK(band.phases.first == phase);
        for (; phase < band.phases.last; ++phase)
            for (std::size_t i = phase == 0 ? 0 : partition.phase_ends[phase - 1]; i < partition.phase_ends[phase];
                 ++i) {
                const BlockGroup& group = partition.groups[partition.by_phase[i]];
                for (std::uint32_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
                    const std::uint32_t* const around = grid.neighbours(partition, r);
                    CHECK(*std::max_element(around, around + grid.neighbour_count) < band.blocks);
                }
            }
    }
    CHECK(phase == partition.phase_ends.size());
    CHECK(bands.front().blocks < grid.block_count());

    const auto scattered = [&](const auto& execution) {
        std::fill_n(grid.nodes(0), 4 * block_nodes<D> * grid.block_count(), std::numeric_limits<float>::quiet_NaN());
        p2g<QuadraticBSpline, Apic, MlsForce>(execution, cloud.view(), partition, grid, dt);
        return numbers(grid);
    };
    const auto serial = scattered(detail::Serial{}), coloured = scattered(Coloured{1});
    CHECK(difference(serial, by_definition::p2g<Case<float, D, Apic, MlsForce>>(cloud, grid, dt)) < 64 * 0x1p-23);
    CHECK(difference(coloured, serial) < 64 * 0x1p-23);
    CHECK(scattered(Coloured{3}) == coloured);
}

TEMPLATE_TEST_CASE("P2G conserves mass and momentum to rounding", "", (Case<float, 3, Apic, MlsForce>),
                   (Case<float, 2, Apic, WeightGradientForce>)) {
    using S = typename TestType::S;
    constexpr int D = TestType::D;
    scenes::RandomCloud<S, D> cloud(2000, 2);
    double expected[4] = {}, speed_scale = 0;
    for (std::size_t p = 0; p < cloud.size(); ++p) {
        for (int a = 0; a < D; ++a) expected[a] += double(cloud.mass[p]) * double(cloud.v[p * D + std::size_t(a)]);
        expected[node_mass] += double(cloud.mass[p]);
        speed_scale += 2 * double(cloud.mass[p]);
    }
    const auto check_sums = [&](const auto& grid, double tolerance, double mass_tolerance) {
        double sums[4] = {};
        const auto all = numbers(grid);
        for (std::size_t i = 0; i < all.size(); ++i) sums[i % 4] += all[i];
        for (int c = 0; c < 4; ++c)
            if (c < D) CHECK(std::abs(sums[c] - expected[c]) < tolerance * speed_scale);
        CHECK(std::abs(sums[node_mass] - expected[node_mass]) < mass_tolerance * expected[node_mass]);
    };
    const double epsilon = sizeof(S) == 4 ? 0x1p-23 : 0x1p-52;
    check_sums(scattered<TestType>(cloud, detail::Serial{}), 8 * epsilon, 8 * epsilon);
    check_sums(scattered<TestType>(cloud, Coloured{2}), 8 * epsilon, 8 * epsilon);
    check_sums(scattered<TestType>(cloud, FixedPoint<std::int64_t>{2}), 8 * epsilon, 8 * epsilon);
    // Rounding to nearest errs by half a quantum either way, √(n/12) quanta in all for n = 54,000 contributions;
    // cutting off would lose n/2 quanta of mass, 1e-7 of it here.
    check_sums(scattered<TestType>(cloud, FixedPoint<std::int32_t>{2}), 2e-7, 2e-8);
}

TEST_CASE("Fixed-point sums have the same bits for any order of the particles") {
    using C = Case<float, 3, Apic, MlsForce>;
    scenes::RandomCloud<float, 3> cloud(2000, 3), reversed = cloud;
    for (std::size_t p = 0; p < cloud.size(); ++p) {
        const std::size_t q = (p * 1103 + 17) % cloud.size();  // 1103 is prime to 2000
        std::copy_n(&cloud.x[3 * p], 3, &reversed.x[3 * q]);
        std::copy_n(&cloud.v[3 * p], 3, &reversed.v[3 * q]);
        std::copy_n(&cloud.C[9 * p], 9, &reversed.C[9 * q]);
        std::copy_n(&cloud.stress[9 * p], 9, &reversed.stress[9 * q]);
        reversed.mass[q] = cloud.mass[p];
        reversed.volume[q] = cloud.volume[p];
    }
    CHECK(numbers(scattered<C>(cloud, FixedPoint<std::int32_t>{2})) ==
          numbers(scattered<C>(reversed, FixedPoint<std::int32_t>{1})));
    CHECK(numbers(scattered<C>(cloud, FixedPoint<std::int64_t>{2})) ==
          numbers(scattered<C>(reversed, FixedPoint<std::int64_t>{7})));
    // Floating-point sums do depend on it: the test can see a difference.
    CHECK(numbers(scattered<C>(cloud, detail::Serial{})) != numbers(scattered<C>(reversed, detail::Serial{})));
}

TEST_CASE("Fixed-point sums are the same integers with atomics and, by colours, without") {
    using C = Case<float, 3, Apic, MlsForce>;
    scenes::RandomCloud<float, 3> cloud(3000, 5);
    CHECK(numbers(scattered<C>(cloud, ColouredFixedPoint<std::int32_t>{2})) ==
          numbers(scattered<C>(cloud, FixedPoint<std::int32_t>{2})));
    CHECK(numbers(scattered<C>(cloud, ColouredFixedPoint<std::int64_t>{1})) ==
          numbers(scattered<C>(cloud, FixedPoint<std::int64_t>{2})));
}

TEST_CASE("Coloured sums have the same bits for 1, 2, 3, 4 and 7 threads") {
    using C = Case<float, 3, Apic, MlsForce>;
    scenes::RandomCloud<float, 3> cloud(5000, 4);
    const auto one = numbers(scattered<C>(cloud, Coloured{1}));
    for (int threads : {2, 3, 4, 7}) CHECK(numbers(scattered<C>(cloud, Coloured{threads})) == one);
}

TEST_CASE("What a node gets from a group is one number, whatever came to it before") {
    using Cloud = scenes::RandomCloud<float, 3>;
    Cloud before(4000);
    const auto partition_of = [](Cloud& cloud) {
        return partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    };
    const auto check = [&](Kind kind, std::size_t count, float cells) {
        Cloud group(count, 3);
        for (float& x : group.x) x = -0.25f + 0.05f * (8.6f + (cells - 0.2f) * (x + 0.2f) / 0.9f);
        BlockPartition<3> first = partition_of(before), second = partition_of(group);
        REQUIRE((second.groups.size() == 1 && scenes::has(second, kind)));
        SparseGrid<float, 3> grid(before.domain);
        grid.activate(std::array{&first, &second});
        const auto sums_of = [&](const auto&... sets) {
            p2g<QuadraticBSpline, Apic, MlsForce>(Coloured{1}, grid, dt, sets...);
            return numbers(grid);
        };
        const ParticleSet a{before.view(), first}, b{group.view(), second};
        auto sums = sums_of(a);
        const auto of_group = sums_of(b);
        for (std::size_t i = 0; i < sums.size(); ++i) sums[i] = double(float(sums[i]) + float(of_group[i]));
        CHECK(sums_of(a, b) == sums);
    };
    check(Kind::dense, 100, 4);
    check(Kind::cube, 134, 8);
    check(Kind::spray, 40, 8);
}

namespace {

/// All particles at one node, all with one velocity: every contribution has the same sign.
scenes::RandomCloud<float, 3> heap(std::size_t count, float speed) {
    scenes::RandomCloud<float, 3> cloud(count);
    for (std::size_t p = 0; p < count; ++p) {
        for (std::size_t a = 0; a < 3; ++a) {
            cloud.x[3 * p + a] = 0.25f;
            cloud.v[3 * p + a] = speed;
        }
        cloud.mass[p] = 1;
    }
    std::fill(cloud.C.begin(), cloud.C.end(), 0.0f);
    std::fill(cloud.stress.begin(), cloud.stress.end(), 0.0f);
    return cloud;
}

}  // namespace

TEST_CASE("The fixed-point scale fits the worst heap of particles and is not needlessly small") {
    using C = Case<float, 3, Apic, MlsForce>;
    for (const std::size_t count : {std::size_t(1), std::size_t(10), std::size_t(5000)}) {
        auto cloud = heap(count, 3.0f);
        const auto exact = numbers(scattered<C>(cloud, detail::Serial{}));
        CHECK(difference(numbers(scattered<C>(cloud, FixedPoint<std::int32_t>{})), exact) < 1e-6);
        CHECK(difference(numbers(scattered<C>(cloud, ColouredFixedPoint<std::int32_t>{})), exact) < 1e-6);
    }
    // The bound of the docstring for ten particles with one base node: W³ n (q + …), W = 1.75; nothing in the way but a
    // power of two.
    FixedPointLoad<double> load{3.0, 0.0, 1.0, 10};
    const auto scale = fixed_point_scale<QuadraticBSpline, 3, std::int32_t>(load, {}, {});
    const double bound = 1.75 * 1.75 * 1.75 * 10.0;
    CHECK(scale.mass * bound < 0x1p31);
    CHECK(scale.mass * bound > 0x1p29);
    CHECK(scale.momentum * 3 * bound < 0x1p31);
    CHECK(scale.momentum * 3 * bound > 0x1p29);
}

TEST_CASE("A fixed-point scale that could overflow is refused, and the sentence says what fits") {
    using C = Case<float, 3, Apic, MlsForce>;
    auto cloud = heap(1000, 3.0f);
    FixedPoint<std::int32_t> execution;
    execution.mass_scale = 0x1p30;
    REQUIRE_THROWS_AS(scattered<C>(cloud, execution), overflow_error);
    execution.mass_scale = {};
    execution.momentum_scale = 0x1p24;
    REQUIRE_THROWS_AS(scattered<C>(cloud, execution), overflow_error);
    execution.momentum_scale = 0x1p10;
    CHECK_NOTHROW(scattered<C>(cloud, execution));
    execution.momentum_scale = 1000.0;  // not a power of two: scaling would round
    REQUIRE_THROWS_AS(scattered<C>(cloud, execution), parameter_error);
    execution.momentum_scale = {};
    cloud.v[0] = std::numeric_limits<float>::infinity();
    REQUIRE_THROWS_AS(scattered<C>(cloud, execution), overflow_error);
}

TEMPLATE_TEST_CASE("What a refused fixed-point P2G leaves is an empty grid, not its integers", "",
                   FixedPoint<std::int32_t>, ColouredFixedPoint<std::int32_t>, ColouredFixedPoint<std::int64_t>) {
    auto cloud = heap(1000, 3.0f);
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    SparseGrid<float, 3> grid(cloud.domain);
    grid.activate(partition);
    TestType execution{2};
    const auto add = [&] {
        p2g<QuadraticBSpline, Apic, MlsForce>(execution, cloud.view(), partition, grid, dt);
        return numbers(grid);
    };
    const auto sums = add();
    execution.mass_scale = 0x1p62;
    REQUIRE_THROWS_AS(add(), overflow_error);
    CHECK(numbers(grid) == std::vector<double>(sums.size()));
    execution.mass_scale = {};
    CHECK(add() == sums);
}

TEMPLATE_TEST_CASE("What scale was right the last time makes no difference to fixed-point sums", "",
                   (Case<float, 3, Apic, MlsForce>), (Case<float, 2, Pic, WeightGradientForce>)) {
    // The scale is a function of the particles alone: a restarted run, whose grid knows of no last time, goes on to the
    // bit. Too large a guess would overflow in the sums, or in one number already.
    scenes::RandomCloud<float, TestType::D> cloud(3000);
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    const auto check = [&](auto execution) {
        SparseGrid<float, TestType::D> grid(cloud.domain);
        grid.activate(partition);
        const auto bits = [&] {
            p2g<QuadraticBSpline, typename TestType::Transfer, typename TestType::Force>(execution, cloud.view(),
                                                                                         partition, grid, dt);
            return numbers(grid);
        };
        const auto expected = bits();
        const FixedPointScale<float> right = *grid.last_scale;
        CHECK(bits() == expected);
        for (const float momentum : {0.5f, 1.0f, 2.0f, 64.0f, 0x1p40f})
            for (const float mass : {0.5f, 1.0f, 2.0f, 64.0f, 0x1p40f}) {
                CAPTURE(momentum, mass);
                grid.last_scale = {right.momentum * momentum, right.mass * mass};
                CHECK(bits() == expected);
                CHECK(*grid.last_scale == right);
            }
    };
    check(ColouredFixedPoint<std::int32_t>{2});
    check(ColouredFixedPoint<std::int64_t>{1});
}

TEMPLATE_TEST_CASE_SIG("The fixed-point scale is that of the fullest base node, wherever particles have drifted", "",
                       ((int D), D), 2, 3) {
    scenes::RandomCloud<float, D> cloud(2000);
    const float h = float(cloud.domain.cell_size);
    std::fill(cloud.mass.begin(), cloud.mass.end(), 0.75f);
    for (std::size_t heap = 0; heap < 40; ++heap) {
        // A hundred particles at the place of one, all sorted, and then moved by up to 0.9 cells.
        auto moved = cloud;
        for (std::size_t p = 0; p < 100; ++p)
            std::copy_n(&cloud.x[std::size_t(D) * 40 * heap], D, &moved.x[std::size_t(D) * (p + 1)]);
        const auto partition = partition_particles<QuadraticBSpline>(moved.view(), moved.size(), moved.domain, 1);
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            const float drift = 0.9f * h * float(2 * scenes::noise(std::size_t(D) * heap + a) - 1);
            for (std::size_t p = 0; p < moved.size(); ++p) moved.x[std::size_t(D) * p + a] += drift;
        }

        std::map<std::array<int, std::size_t(D)>, int> counts;
        for (std::size_t p = 0; p < moved.size(); ++p) {
            std::array<int, std::size_t(D)> base;
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                base[a] =
                    int(std::floor((moved.x[std::size_t(D) * p + a] - float(moved.domain.lower[int(a)])) / h - 0.5f));
            ++counts[base];
        }
        FixedPointLoad<float> load;
        load.mass = 0.75f;
        for (const auto& [base, count] : counts) load.particles = std::max(load.particles, float(count));
        REQUIRE(load.particles >= 100);

        for (const int threads : {1, 3}) {
            SparseGrid<float, D> grid(cloud.domain);
            grid.activate(partition);
            p2g<QuadraticBSpline, Pic, MlsForce>(ColouredFixedPoint<>{threads}, moved.view(), partition, grid, dt);
            CHECK(grid.last_scale->mass == fixed_point_scale<QuadraticBSpline, D, std::int32_t>(load, {}, {}).mass);
        }
    }
}

TEST_CASE("A mass that has become not a number is reported by fixed-point sums, whatever was right the last time") {
    scenes::RandomCloud<float, 3> cloud(100);
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    SparseGrid<float, 3> grid(cloud.domain);
    grid.activate(partition);
    const auto scatter = [&](auto execution) {
        p2g<QuadraticBSpline, Apic, MlsForce>(execution, cloud.view(), partition, grid, dt);
    };
    scatter(ColouredFixedPoint<>{1});
    cloud.mass[50] = std::numeric_limits<float>::quiet_NaN();
    REQUIRE_THROWS_AS(scatter(ColouredFixedPoint<>{1}), overflow_error);
    REQUIRE_THROWS_AS(scatter(FixedPoint<>{1}), overflow_error);
    cloud.mass[50] = 1;
    CHECK_NOTHROW(scatter(ColouredFixedPoint<>{1}));
}

TEST_CASE("Particles at rest and without stress have a mass scale of their own") {
    using C = Case<float, 3, Apic, MlsForce>;
    auto cloud = heap(20, 0.0f);
    const auto grid = numbers(scattered<C>(cloud, FixedPoint<std::int32_t>{}));
    double mass = 0;
    for (std::size_t i = 3; i < grid.size(); i += 4) mass += grid[i];
    CHECK(mass == Approx(20).epsilon(1e-7));
    for (std::size_t i = 0; i < grid.size(); ++i)
        if (i % 4 != 3) CHECK(grid[i] == 0);
}

TEST_CASE("The nodes around a group are those of the cell that its particle is in, not of the next by rounding",
          "[exec]") {
    // Nodes left out are neither cleared nor read from the grid. The particle is alone in its group, which begins at
    // the block before its own, and has moved by half a cell since it was sorted: 4 + 0.49999997 would be 4.5.
    const Domain<3> domain{{0.0, 0.0, 0.0}, {16.0, 16.0, 16.0}, 1.0};
    for (int axis = 0; axis < 3; ++axis) {
        CAPTURE(axis);
        Particles<float, 3> particles(domain);
        particles.push_back({5.0, 5.0, 5.0}, {{1, 2, 3}}, 1.0f, 1.0f);
        const auto partition = sort_particles<QuadraticBSpline>(particles);
        REQUIRE(partition.groups.size() == 1);
        const BlockGroup& group = partition.groups[0];
        REQUIRE(group.sparse);
        const auto view = particles.view();
        *view.position.at(group.first_slot, axis) = std::nextafter(0.5f, 0.0f);
        const Positions<Particles<float, 3>::View> positions(domain);
        const auto box = GroupPlaces(view, partition, group, positions).box<QuadraticBSpline>(group);
        for (int a = 0; a < 3; ++a) {
            // Base node −1, or 0, of the second block; the arena begins one node before the first.
            CHECK(box.first[a] == (a == axis ? 4 : 5));
            CHECK(box.last[a] >= (a == axis ? 6 : 7));
        }
    }
}

}  // namespace p2g_tests
