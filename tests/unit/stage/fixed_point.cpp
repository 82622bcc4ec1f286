/// \file The scale of fixed-point sums, worked out by hand, and that what it is made for fits.
#include "support/catch.hpp"
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/cubic_b_spline.hpp>
#include <firn/kernel/linear.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/stage/fixed_point.hpp>

using namespace firn;

namespace fixed_point_tests {

TEST_CASE("what a particle may give: its momentum, and what the affine part adds at the farthest node", "[stage]") {
    // The larger of 3 + o (1 + 2) and 5 + o (0.5 + 0.25), o = 1, with the cubic kernel 2; of G that of 4 + 1 and 2.
    const P2GRecord<double, 2> record{
        0.5, {3, -5}, Mat<double, 2>::rows(1, -2, 0.5, 0.25), Mat<double, 2>::rows(-4, 1, 0, 2)};
    CHECK(load_of<Linear, WeightGradientForce>(record).momentum == 6);
    CHECK(load_of<QuadraticBSpline, MlsForce>(record).momentum == 6);
    CHECK(load_of<CubicBSpline, MlsForce>(record).momentum == 9);
    CHECK(load_of<CubicBSpline, MlsForce>(record).mass == 0.5);
    CHECK(load_of<CubicBSpline, MlsForce>(record).gradient == 0);
    CHECK(load_of<CubicBSpline, WeightGradientForce>(record).gradient == 5);
}

TEST_CASE("the scale leaves room for the rounding of each contribution, and is the largest that does", "[stage]") {
    const double room = 0x1p31 - 1;
    for (const double contributions : {0.0, 1000.0, 0x1p30}) {
        const FixedPointBound<double> bound{3, 0.7, contributions};
        const auto scale = largest_scale(bound, room);
        CAPTURE(contributions);
        CHECK(bound.momentum * scale.momentum + contributions <= room);
        CHECK(bound.mass * scale.mass + contributions <= room);
        CHECK(bound.momentum * 2 * scale.momentum + contributions > room);
        CHECK(bound.mass * 2 * scale.mass + contributions > room);
    }
}

}  // namespace fixed_point_tests
