// part: arithmetic
// release: -O3
/// \file G2P takes from the grid what the definition says, for dense matter and for spray.
#include "support/by_definition.hpp"
#include "support/catch.hpp"

using namespace firn;
using scenes::Kind;

namespace {

/// Leaves numbers that are no numbers where the next functions have their arenas.
[[gnu::noinline]] void poison_stack() {
    volatile double stack[1 << 15];
    for (std::size_t i = 0; i < std::size(stack); ++i) stack[i] = std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("G2P interpolates by definition, for dense blocks, cubes of sparse ones and spray", "",
                       ((class S, int D), S, D), (float, 3), (double, 2)) {
    const Kind kind = GENERATE(Kind::dense, Kind::cube, Kind::spray);
    scenes::RandomCloud<S, D> cloud(scenes::particles_of<D>(kind));
    for (std::size_t i = 0; i < cloud.F.size(); ++i) cloud.F[i] = S(i % (D * D) % (D + 1) == 0);
    const auto view = cloud.view();
    const auto partition = partition_particles<QuadraticBSpline>(view, cloud.size(), cloud.domain, 1);
    REQUIRE(scenes::has(partition, kind));
    SparseGrid<S, D> grid(cloud.domain);
    grid.activate(partition);
    for (std::size_t i = 0; i < grid.block_count() * std::size_t(block_nodes<D> * node_width); ++i)
        grid.nodes(0)[i] = S(scenes::noise(i) - 0.5);

    for (std::size_t i = 0; i < cloud.x.size(); ++i)  // drifted up to a cell since they were sorted
        cloud.x[i] += S(0.999 * cloud.domain.cell_size * (2 * scenes::noise(i + 7) - 1));
    std::vector<Vec<double, D>> expected;
    const double dt = 1e-3;
    const auto before = cloud.x;
    for (std::size_t p = 0; p < cloud.size(); ++p)
        expected.push_back(by_definition::g2p<QuadraticBSpline>(grid, by_definition::vector<D>(cloud.x, p)).velocity);
    poison_stack();
    g2p<QuadraticBSpline, Apic, MlsForce>(Coloured{1}, view, partition, grid, FixedCorotated<S>{}, dt);
    for (std::size_t p = 0; p < cloud.size(); ++p)
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            const std::size_t i = p * std::size_t(D) + a;
            // A sum of 27 numbers below 1, whose weights come from a position of up to 20 cells, rounded.
            constexpr double epsilon = double(std::numeric_limits<S>::epsilon());
            CHECK(std::abs(double(cloud.v[i]) - expected[p][int(a)]) < 64 * epsilon);
            CHECK(std::abs(double(cloud.x[i]) - (double(before[i]) + dt * expected[p][int(a)])) < epsilon);
        }
}
