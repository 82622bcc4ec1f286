/// \file What every scalar can do, held against the functions of the standard library: one body for all of them.
#include "support/each_scalar.hpp"

using namespace firn;
using test_support::Numbers;
using test_support::same_as_double;

namespace {

std::vector<std::vector<double>> pairs(std::uint64_t seed, double low, double high) {
    test_support::Random random(seed);
    std::vector<std::vector<double>> cases(97);
    for (auto& in : cases) in = {random.uniform(low, high), random.uniform(low, high)};
    return cases;
}
double size_of(const double* in) { return std::max({1.0, std::abs(in[0]), std::abs(in[1])}); }

}  // namespace

TEMPLATE_TEST_CASE("arithmetic, roots and choices of every scalar are those of double", "[core][scalar]",
                   FIRN_EVERY_SCALAR) {
    using S = TestType;
    static_assert(scalar<S>);
    const auto arithmetic = [](const auto* in) {
        using T = std::remove_cvref_t<decltype(*in)>;
        const T a = in[0], b = in[1];
        T sum = a, difference = a, product = a;
        sum += b;
        difference -= b;
        product *= b;
        return Numbers<T>{}
            .add(a + b)
            .add(a - b)
            .add(a * b)
            .add(-a)
            .add(sum)
            .add(difference)
            .add(product)
            .add(a * T(2) - T(0.5));
    };
    same_as_double<S>(arithmetic, pairs(1, -4, 4), [](const double*) { return 16; }, 1);
    const auto division = [](const auto* in) {
        using T = std::remove_cvref_t<decltype(*in)>;
        return Numbers<T>{}.add(in[0] / in[1]).add(sqrt(in[0])).add(sqrt(in[1]) / in[0]);
    };
    same_as_double<S>(division, pairs(2, 0.5, 4), [](const double*) { return 8; }, 1);
    const auto choice = [](const auto* in) {
        using T = std::remove_cvref_t<decltype(*in)>;
        const T a = in[0], b = in[1];
        const auto a_negative = a < T(0), b_negative = b < T(0);
        return Numbers<T>{}
            .add(min(a, b))
            .add(max(a, b))
            .add(abs(a))
            .add(select(a < b, a, -b))
            .add(select(a <= b, T(1), b))
            .add(select(a > b, a, T(3)))
            .add(select(a >= b, -a, b))
            .add(select(a_negative & b_negative, a, b))
            .add(select(a_negative | b_negative, a, b))
            .add(select(!a_negative, a, b))
            .add(floor(a));
    };
    same_as_double<S>(choice, pairs(3, -4, 4), size_of, 0);
}

TEMPLATE_TEST_CASE("comparisons of equal numbers", "[core][scalar]", FIRN_EVERY_SCALAR) {
    const TestType a(2), b(2), one(1), zero(0);
    const auto chosen = [&](const auto& mask) { return test_support::lane_of(select(mask, one, zero), 0) == 1; };
    CHECK(chosen(a <= b));
    CHECK(chosen(a >= b));
    CHECK(chosen(a == b));
    CHECK_FALSE(chosen(a < b));
    CHECK_FALSE(chosen(a > b));
    CHECK(any(a == b));
    CHECK_FALSE(any(a < b));
}

TEST_CASE("floor rounds down: negative, whole, large numbers", "[core][scalar]") {
    for (double x :
         {0.0, 0.5, -0.5, -1.0, 1.0, -1.5, 2.999, -2.999, 8388607.0, 8388609.0, -8388609.0, 3e9, -3e9, 1e30, -1e30}) {
        CAPTURE(x);
        CHECK(firn::floor(x) == std::floor(x));
        CHECK(floor(native_pack<double>(x))[1] == std::floor(x));
        CHECK(floor(native_pack<float>(x))[1] == std::floor(float(x)));
        CHECK(floor(strict<double>(x)).value == std::floor(x));
    }
}
