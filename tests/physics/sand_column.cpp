// quick: no
/// \file The verification suite's columns of sand, on coarse cells, against the scalings measured by Lube et al. 2005.
#include "../../benchmarks/verification/scenes/sand_column.hpp"

#include "support/catch.hpp"

using namespace firn;
using verification::SandColumn;
namespace deposit = verification::deposit;

TEST_CASE("A column of sand runs out between what was measured of sand and of glass beads, and rests") {
    for (const double a : {1.0, 2.0}) {
        SandColumn<float> column(a, 10);
        column.simulation.advance(5 * std::sqrt(column.height() / column.g));
        CAPTURE(a, column.run_out(), column.top());
        CHECK(column.run_out() > 0.9 * deposit::run_out_of_lube(a) - 0.2);  // a tenth, as materials differ; two cells
        CHECK(column.run_out() < 1.1 * deposit::run_out_of_lajeunesse(a) + 0.2);
        CHECK(column.speed() < 0.01 * std::sqrt(column.g * column.width));
    }
}

TEST_CASE("The steeper the friction angle of sand, the less its column runs out") {
    const auto run_out = [](double angle) {
        SandColumn<float> column(1, 10, degrees(angle));
        column.simulation.advance(5 * std::sqrt(column.height() / column.g));
        return column.run_out();
    };
    const double slippery = run_out(20), rough = run_out(40);
    CAPTURE(slippery, rough);
    CHECK(rough < 0.9 * slippery);
}
