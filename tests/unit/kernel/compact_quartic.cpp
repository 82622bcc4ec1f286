/// \file What the compact quartic kernel promises beyond what every kernel does (every_kernel.cpp): it is the
/// antiderivative of the weights of MLS forces, and a stress that leaves an inclined surface free moves no nodes.
#include "support/catch.hpp"
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/compact_quartic.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>

#include "../../../benchmarks/verification/scenes/free_surface.hpp"

using namespace firn;
using verification::power_at_free_surface;

TEST_CASE("The compact quartic's slope is the weight with which MLS forces of the quadratic spline reach a node",
          "[kernel]") {
    for (int place = 0; place <= 1200; ++place) {
        const double f = 0.5 + place / 1200.0;
        const auto slopes = CompactQuartic::gradients(f), weights = QuadraticBSpline::weights(f);
        CAPTURE(f);
        for (std::size_t i = 0; i < 3; ++i)
            CHECK(std::abs(slopes[i] - weights[i] * QuadraticBSpline::inverse_inertia * (double(i) - f)) <= 1e-15);
    }
}

TEST_CASE(
    "A stress that leaves an inclined surface free moves nodes with MLS forces, however many particles there are; "
    "with weight gradients only as much as particles fail to be an integral",
    "[kernel][force]") {
    // MLS forces tend to 4.6e-4 and 1.7e-3; measured with the same sums in NumPy: 8.9e-4, 4.8e-4 and 1.76e-3.
    CHECK(power_at_free_surface<QuadraticBSpline, MlsForce>(0.1, 2) == Approx(8.87e-4).epsilon(0.01));
    CHECK(power_at_free_surface<QuadraticBSpline, MlsForce>(0.1, 8) == Approx(4.78e-4).epsilon(0.01));
    CHECK(power_at_free_surface<QuadraticBSpline, MlsForce>(0.25, 8) == Approx(1.757e-3).epsilon(0.01));
    // Measured: 5.5e-7 and 6.5e-11 with the compact quartic, 6.4e-6 and 2.0e-8 with the quadratic spline.
    CHECK(power_at_free_surface<CompactQuartic, WeightGradientForce>(0.1, 2) < 1e-6);
    CHECK(power_at_free_surface<CompactQuartic, WeightGradientForce>(0.1, 8) < 1e-10);
    CHECK(power_at_free_surface<QuadraticBSpline, WeightGradientForce>(0.1, 2) < 1e-5);
    CHECK(power_at_free_surface<QuadraticBSpline, WeightGradientForce>(0.1, 8) < 1e-7);
}
