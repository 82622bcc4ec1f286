/// \file The verification suite's column, coarse: an elastic column under its own weight.
#include "../../benchmarks/verification/scenes/column.hpp"

#include "support/catch.hpp"

using namespace firn;
using verification::Column;

TEST_CASE("A column at rest bears its weight: with linear weights it has the stress that cb-geo/mpm reports") {
    Column<double, WeightGradientForce, Linear> column(0.01);
    column.settle(6);
    CHECK(-column.rows().front().stress == Approx(1680.182).epsilon(1e-4));  // mpm-doc, hydrostatic-column.md, USL
    CHECK(column.errors().support == Approx(1).epsilon(1e-5));
    CHECK(column.errors().across < 1e-12);
}

TEST_CASE("Away from its ends a column has the stress of the weight above, and settles in first order of the cells",
          "[slow]") {
    const auto errors = [](double h) {
        Column<double, MlsForce, QuadraticBSpline> column(h);
        column.settle(6);
        return column.errors();
    };
    const auto coarse = errors(0.01), fine = errors(0.005);
    CAPTURE(coarse.inner, fine.inner, coarse.displacement, fine.displacement);
    CHECK(coarse.inner < 0.015);
    CHECK(fine.inner < 0.0075);
    CHECK(coarse.displacement < 0.1);  // h/H
    CHECK(fine.displacement == Approx(coarse.displacement / 2).epsilon(0.1));
}
