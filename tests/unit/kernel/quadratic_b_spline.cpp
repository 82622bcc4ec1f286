/// \file The quadratic B-spline against numbers made of exact rationals.
#include "support/catch.hpp"
#include "support/csv.hpp"
#include <firn/data/block_partition.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>

using namespace firn;

TEST_CASE("quadratic B-spline: base node, weights and gradients of the table, from exact rationals",
          "[kernel][reference]") {
    for (const csv::Row& row : csv::read("bspline_quadratic.csv")) {
        const double x = csv::number(row, "x");
        CAPTURE(x);
        const double base = base_node<QuadraticBSpline>(x);
        CHECK(base == csv::number(row, "base"));
        CHECK(std::abs(x - base - csv::number(row, "fx")) <= 1e-15);
        const auto w = QuadraticBSpline::weights(x - base), g = QuadraticBSpline::gradients(x - base);
        const char* const weight[] = {"w0", "w1", "w2"};
        const char* const gradient[] = {"dw0", "dw1", "dw2"};
        for (std::size_t i = 0; i < 3; ++i) {
            CHECK(std::abs(w[i] - csv::number(row, weight[i])) <= 1e-15);
            CHECK(std::abs(g[i] - csv::number(row, gradient[i])) <= 1e-15);
        }
    }
}
