/// \file What the stages are given by a foreign program that is of no use.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/firn.hpp>

using namespace firn;
using test_support::holds;
using test_support::infinity;
using test_support::message;
using test_support::not_a_number;

namespace {

/// Three particles of a program that keeps all in one array.
struct Program {
    Domain<2> domain{{0, 0}, {1, 1}, 1.0 / 16};
    std::vector<float> x{0.4F, 0.4F, 0.5F, 0.5F, 0.6F, 0.6F},
        v = std::vector<float>(6), C = std::vector<float>(12), stress = std::vector<float>(12),
        F{1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, mass{1, 1, 1}, volume{1e-3F, 1e-3F, 1e-3F};
    ForeignParticles<float, 2> view{
        StridedSpan<float>::vectors<2>(x.data()),          StridedSpan<float>::vectors<2>(v.data()),
        StridedSpan<float>::matrices<2>(C.data(), false),  symmetric_matrices<2>(stress.data()),
        StridedSpan<float>::scalars(mass.data()),          StridedSpan<float>::scalars(volume.data()),
        {StridedSpan<float>::matrices<2>(F.data(), false)}};

    BlockPartition<2> partition() const { return partition_particles<QuadraticBSpline>(view, 3, domain); }
};

}  // namespace

TEST_CASE("masses that are not positive are refused where particles are sorted, by number") {
    for (const float wrong : {0.0F, -1.0F, float(not_a_number), float(infinity)}) {
        Program program;
        program.mass[1] = program.mass[2] = wrong;
        const std::string said = message<particle_error>([&] { program.partition(); });
        CAPTURE(said);
        CHECK(holds(said, "2 of 3 particles have no mass"));
        CHECK(holds(said, sentence("the first: 1 of ", double(wrong), " kg, 2 of ")));
    }
}

TEMPLATE_TEST_CASE("steps that are no time, and grids without nodes, are refused before anything is written", "",
                   detail::Serial, Coloured, FixedPoint<>) {
    Program program;
    const auto partition = program.partition();
    SparseGrid<float, 2> grid(program.domain);
    const TestType execution{};
    const auto scatter = [&](double dt) {
        p2g<QuadraticBSpline, Apic, MlsForce>(execution, program.view, partition, grid, dt);
    };
    const auto gather = [&](double dt) {
        g2p<QuadraticBSpline, Apic, MlsForce>(execution, program.view, partition, grid, FixedCorotated<float>{}, dt);
    };
    CHECK(holds(message<usage_error>([&] { scatter(1e-4); }), "Call activate()"));
    CHECK(holds(message<usage_error>([&] { gather(1e-4); }), "Call activate()"));
    grid.activate(partition);
    const auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {});
    for (const double dt : {-1.0, not_a_number, infinity}) {
        CHECK_THROWS_AS(scatter(dt), parameter_error);
        CHECK_THROWS_AS(gather(dt), parameter_error);
        CHECK_THROWS_AS(grid_update(execution, grid, dt, Vec<float, 2>{}, walls), parameter_error);
    }
    CHECK_NOTHROW(scatter(1e-4));
    CHECK_NOTHROW(grid_update(execution, grid, 1e-4, Vec<float, 2>{{0, -9.81F}}, walls));
    CHECK_NOTHROW(gather(1e-4));
}

TEST_CASE("what a foreign program's particles have become is told with number, place and quantity") {
    Program program;
    const auto partition = program.partition();
    program.F[4] = float(not_a_number);
    const std::string said = message<particle_error>([&] {
        update_stress(detail::Serial{}, program.view, partition, FixedCorotated<float>{}, program.domain.cell_size);
    });
    CAPTURE(said);
    CHECK(holds(said, "1 of 3 particles is not finite"));
    CHECK(holds(said, "particle 1 at (0.5, 0.5) m with velocity (0, 0) m/s, J = nan: not finite: its deformation"));
}
