/// \file The grid costs what the matter costs, wherever it lies.
#include "support/catch.hpp"
#include "support/scenes.hpp"

using namespace firn;

namespace {

BlockPartition<3> partition_at(const Domain<3>& domain, double corner, std::vector<double>& x) {
    x.clear();
    for (int p = 0; p < 500; ++p)
        for (int a = 0; a < 3; ++a)
            x.push_back(corner + 10 * domain.cell_size * scenes::noise(std::uint64_t(3 * p + a)));
    ForeignParticles<double, 3> view{};
    view.position = StridedSpan<double>::vectors<3>(x.data());
    return partition_particles<QuadraticBSpline>(view, 500, domain);
}

}  // namespace

TEST_CASE("Memory is that of the occupied blocks, not of the box") {
    const Domain<3> small{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 0.01};
    const Domain<3> large{{0.0, 0.0, 0.0}, {40960.0, 40960.0, 40960.0}, 0.01};  // 4 million cells along an axis
    std::vector<double> x;
    SparseGrid<float, 3> in_small(small), in_large(large);
    in_small.activate(partition_at(small, 0.4, x));
    in_large.activate(partition_at(large, 40000.4, x));
    CHECK(in_large.block_count() <= in_small.block_count() * 3);  // the body may straddle more blocks
    CHECK(in_large.bytes() < 1'000'000);
}

TEST_CASE("Each range finds the 3^D blocks around it, and no node twice") {
    const Domain<3> domain{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 0.02};
    std::vector<double> x;
    const auto partition = partition_at(domain, 0.0, x);  // in the corner: ghost nodes beyond the faces are there
    SparseGrid<float, 3> grid(domain);
    grid.activate(partition);
    for (std::size_t r = 0; r < partition.ranges.size(); ++r)
        for (int n = 0; n < 27; ++n) {
            const std::array<int, 3> offset{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
            const auto& block = grid.block(grid.neighbours(partition, r)[n]);
            for (std::size_t a = 0; a < 3; ++a) CHECK(block[a] == partition.ranges[r].block[a] + offset[a]);
        }
    for (std::size_t b = 0; b < grid.block_count(); ++b) CHECK(grid.find(grid.block(b)) == b);
    CHECK(grid.find({1000, 1000, 1000}) == no_block);
    CHECK(grid.find_node({-1, -1, -1}) != nullptr);
    CHECK(grid.find_node({1000, 0, 0}) == nullptr);
}

TEST_CASE("A domain that cannot be is refused") {
    const auto grid = [](Domain<2> domain) { SparseGrid<double, 2>{domain}; };
    REQUIRE_THROWS_AS(grid({{0.0, 0.0}, {1.0, 1.0}, 0.0}), parameter_error);
    REQUIRE_THROWS_AS(grid({{0.0, 0.0}, {1.0, 1.0}, -0.1}), parameter_error);
    REQUIRE_THROWS_AS(grid({{0.0, 0.0}, {1.0, -1.0}, 0.1}), parameter_error);
    REQUIRE_THROWS_AS(grid({{0.0, std::nan("")}, {1.0, 1.0}, 0.1}), parameter_error);
    REQUIRE_THROWS_AS(grid({{0.0, 0.0}, {1.0, 1.0}, 0.9}), parameter_error);
    REQUIRE_THROWS_AS(grid({{0.0, 0.0}, {1.0, 1e9}, 0.1}), parameter_error);
    CHECK_NOTHROW(grid({{-3.0, 0.5}, {1.0, 1.0}, 0.03}));
}
