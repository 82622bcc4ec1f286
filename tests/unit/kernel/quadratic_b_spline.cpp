/// \file What the transfers rest on: the kernel's sums, its derivative, and the bounds that the fixed-point scale uses.
#include "support/catch.hpp"
#include "support/csv.hpp"
#include <firn/core/dual.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>

using namespace firn;

namespace {

/// The weight (or gradient) that the node at 0 has for a particle at u cells from it; 0 beyond the support.
template <class K>
double of_node(double u, bool gradient) {
    const double base = base_node<K>(u);
    if (base > 0 || -base >= K::support) return 0;
    const double f = u - base;
    return gradient ? K::gradients(f)[std::size_t(-base)] : K::weights(f)[std::size_t(-base)];
}

constexpr double lowest_f = QuadraticBSpline::base_shift;
constexpr int places = 1000;  // fractional positions looked at, both ends of [½, 3/2] among them

}  // namespace

TEMPLATE_TEST_CASE(
    "weights are positive, sum to one, reproduce linear fields, have the inertia that is stated; their "
    "gradients sum to zero and reproduce a slope of one",
    "[kernel]", QuadraticBSpline) {
    using K = TestType;
    for (int place = 0; place <= places; ++place) {
        const double f = lowest_f + double(place) / places;
        const auto w = K::weights(f), g = K::gradients(f);
        double sum = 0, first = 0, second = 0, slope_sum = 0, slope = 0;
        for (std::size_t i = 0; i < w.size(); ++i) {
            const double offset = double(i) - f;
            CHECK(w[i] >= 0);
            sum += w[i];
            first += w[i] * offset;
            second += w[i] * offset * offset;
            slope_sum += g[i];
            slope += g[i] * offset;
        }
        CAPTURE(f);
        CHECK(std::abs(sum - 1) <= 4e-16);
        CHECK(std::abs(first) <= 4e-16);
        CHECK(std::abs(second - 1 / K::inverse_inertia) <= 4e-16);  // Σ N (x_i − x)² = h²/4
        CHECK(std::abs(slope_sum) <= 4e-16);
        CHECK(std::abs(slope - 1) <= 1e-15);
    }
}

TEMPLATE_TEST_CASE("gradients are the derivatives of the weights, by dual numbers", "[kernel]", QuadraticBSpline) {
    using K = TestType;
    for (int place = 0; place <= places; ++place) {
        const double f = lowest_f + double(place) / places;
        const auto w = K::weights(dual<double>(f, 1.0));
        const auto g = K::gradients(f);
        CAPTURE(f);
        for (std::size_t i = 0; i < w.size(); ++i) CHECK(std::abs(w[i].derivative - g[i]) <= 4e-16);
    }
}

TEMPLATE_TEST_CASE("a node's weight and its slope are continuous where a particle changes its base node", "[kernel]",
                   QuadraticBSpline) {
    using K = TestType;
    constexpr double gap = 1e-9;
    for (int shift = 0; shift <= K::support; ++shift) {
        const double u = K::base_shift - shift + 1;
        CAPTURE(u);
        CHECK(std::abs(of_node<K>(u - gap, false) - of_node<K>(u + gap, false)) <= 4 * gap);
        CHECK(std::abs(of_node<K>(u - gap, true) - of_node<K>(u + gap, true)) <= 8 * gap);
    }
}

TEMPLATE_TEST_CASE("largest_weight and largest_gradient are reached and not exceeded", "[kernel][bounds]",
                   QuadraticBSpline) {
    using K = TestType;
    constexpr int cells = K::support + 1;
    double gradient = 0;
    for (int cell = 0; cell < cells; ++cell) {
        double weight = 0;
        for (int place = 0; place <= 4 * places; ++place) {
            // Particles of the cell, its upper end excluded.
            const double u = cell - cells / 2 + double(place) / (4 * places) * (1 - 1e-12);
            weight = std::max(weight, of_node<K>(u, false));
            gradient = std::max(gradient, std::abs(of_node<K>(u, true)));
        }
        CAPTURE(cell);
        CHECK(weight <= K::largest_weight[std::size_t(cell)]);
        CHECK(weight >= K::largest_weight[std::size_t(cell)] - 1e-9);
    }
    CHECK(gradient <= K::largest_gradient);
    CHECK(gradient >= K::largest_gradient - 1e-9);
}

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
