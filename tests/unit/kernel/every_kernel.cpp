/// \file What the transfers rest on, for every kernel: its sums, its derivative, the bounds that the fixed-point scale
/// uses, and the limit that the time step comes from.
#include "support/catch.hpp"
#include <firn/core/dual.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/kernel/compact_quartic.hpp>
#include <firn/kernel/cubic_b_spline.hpp>
#include <firn/kernel/linear.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/stage/time_step.hpp>

#include <numbers>

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

constexpr int places = 1200;  // fractional positions looked at, both ends of [base_shift, base_shift + 1] among them

}  // namespace

TEMPLATE_TEST_CASE(
    "weights are positive, sum to one, reproduce linear fields, have the inertia that is stated, if one is; their "
    "gradients sum to zero and reproduce a slope of one",
    "[kernel]", Linear, QuadraticBSpline, CubicBSpline, CompactQuartic) {
    using K = TestType;
    for (int place = 0; place <= places; ++place) {
        const double f = K::base_shift + double(place) / places;
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
        if constexpr (has_inertia<K>)
            CHECK(std::abs(second - 1 / K::inverse_inertia) <= 4e-16);  // Σ N (x_i − x)² = h²/4, h²/3
        else if constexpr (has_local_inertia<K>)
            CHECK(std::abs(second - K::inertia(f - centre_node<K>)) <= 4e-16);
        else
            for (std::size_t i = 0; i < w.size(); ++i)  // N (x_i − x) D⁻¹ = ∇N, away from where D vanishes
                if (second > 0.01) CHECK(std::abs(w[i] * (double(i) - f) / second - g[i]) <= 1e-13);
        CHECK(std::abs(slope_sum) <= 4e-16);
        CHECK(std::abs(slope - 1) <= 1e-15);
    }
}

TEMPLATE_TEST_CASE("gradients are the derivatives of the weights, by dual numbers", "[kernel]", Linear,
                   QuadraticBSpline, CubicBSpline, CompactQuartic) {
    using K = TestType;
    for (int place = 0; place <= places; ++place) {
        const double f = K::base_shift + double(place) / places;
        const auto w = K::weights(dual<double>(f, 1.0));
        const auto g = K::gradients(f);
        CAPTURE(f);
        for (std::size_t i = 0; i < w.size(); ++i) CHECK(std::abs(w[i].derivative - g[i]) <= 4e-16);
    }
}

TEMPLATE_TEST_CASE("a node's weight, and a spline's slope, is continuous where a particle changes its base node",
                   "[kernel]", Linear, QuadraticBSpline, CubicBSpline, CompactQuartic) {
    using K = TestType;
    constexpr double gap = 1e-9;
    double jump = 0;
    for (int shift = 0; shift <= K::support; ++shift) {
        const double u = K::base_shift - shift + 1;
        CAPTURE(u);
        CHECK(std::abs(of_node<K>(u - gap, false) - of_node<K>(u + gap, false)) <= 4 * gap);
        jump = std::max(jump, std::abs(of_node<K>(u - gap, true) - of_node<K>(u + gap, true)));
    }
    if (K::support == 2)
        CHECK(jump == 2);
    else
        CHECK(jump <= 8 * gap);
}

TEMPLATE_TEST_CASE("largest_weight and largest_gradient are reached and not exceeded", "[kernel][bounds]", Linear,
                   QuadraticBSpline, CubicBSpline, CompactQuartic) {
    using K = TestType;
    double gradient = 0;
    for (std::size_t node = 0; node < K::support; ++node) {
        double weight = 0;
        for (int place = 0; place <= 4 * places; ++place) {
            // All places of one base node, the upper end excluded.
            const double f = K::base_shift + double(place) / (4 * places) * (1 - 1e-12);
            weight = std::max(weight, K::weights(f)[node]);
            gradient = std::max(gradient, std::abs(K::gradients(f)[node]));
        }
        CAPTURE(node);
        CHECK(weight <= K::largest_weight[node] * (1 + 4e-16));
        CHECK(weight >= K::largest_weight[node] - 1e-9);
    }
    CHECK(gradient <= K::largest_gradient * (1 + 4e-16));
    CHECK(gradient >= K::largest_gradient - 1e-9);
}

TEMPLATE_TEST_CASE(
    "courant_limit is 2/ω of the stiffness of matter without gaps, integrated from the gradients, and half of it for "
    "the linear kernel",
    "[kernel]", Linear, QuadraticBSpline, CubicBSpline, CompactQuartic) {
    using K = TestType;
    // Σ_j e^{ijθ} ∫ N'(u) N'(u − j) du = ∫ |Σ_k e^{ikθ} N'_k(f)|² df over one cell: a polynomial in f, of degree six
    // at most, which four points of Gauss integrate exactly.
    const double near = std::sqrt(3 - 2 * std::sqrt(1.2)) / std::sqrt(28),
                 far = std::sqrt(3 + 2 * std::sqrt(1.2)) / std::sqrt(28);
    const double points[] = {0.5 - far, 0.5 - near, 0.5 + near, 0.5 + far};
    const double of_near = (18 + std::sqrt(30)) / 72, shares[] = {0.5 - of_near, of_near, of_near, 0.5 - of_near};
    double largest = 0;
    constexpr int angles = 20'000;
    for (int angle = 0; angle <= angles; ++angle) {
        double symbol = 0;
        for (int q = 0; q < 4; ++q) {
            const auto g = K::gradients(K::base_shift + points[q]);
            double real = 0, imaginary = 0;
            for (std::size_t k = 0; k < g.size(); ++k) {
                real += g[k] * std::cos(double(k) * angle * std::numbers::pi / angles);
                imaginary += g[k] * std::sin(double(k) * angle * std::numbers::pi / angles);
            }
            symbol += shares[q] * (real * real + imaginary * imaginary);
        }
        largest = std::max(largest, symbol);
    }
    CHECK((K::support == 2 ? 1 : 2) / std::sqrt(largest) == Approx(K::courant_limit).epsilon(1e-8));
}

TEMPLATE_TEST_CASE("of a single particle, Σ N'²/N bounds ω² as the safety of the time step says", "[kernel]",
                   QuadraticBSpline, CubicBSpline, CompactQuartic) {
    using K = TestType;
    double largest = 0;
    for (int place = 1; place < places; ++place) {
        const double f = K::base_shift + double(place) / places;
        const auto w = K::weights(f), g = K::gradients(f);
        double sum = 0;
        for (std::size_t i = 0; i < w.size(); ++i) sum += g[i] * g[i] / w[i];
        largest = std::max(largest, sum);
    }
    const double limit = 2 / std::sqrt(largest);
    const double expected = std::same_as<K, CompactQuartic> ? 0.866 : K::support == 3 ? 0.82 : 1.13;
    CHECK(limit == Approx(expected).epsilon(0.01));
    CHECK(time_step_safety<K> < limit);
}
