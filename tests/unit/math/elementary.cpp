// sanitized: -O1
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/not_finite.hpp"
#include <firn/core/pack.hpp>
#include <firn/core/strict.hpp>
#include <firn/math/elementary.hpp>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace elementary_tests {
using test_support::infinity;
using test_support::not_a_number;
namespace {

struct Random {
    std::mt19937_64 engine{7};
    double uniform(double a, double b) { return a + (b - a) * double(engine() >> 11) * 0x1p-53; }
    /// Any positive finite number, every exponent alike, subnormal numbers included.
    template <class T>
    T any_positive() {
        using integer = typename firn::binary_layout<T>::integer;
        for (;;) {
            const auto x = std::bit_cast<T>(integer(integer(engine()) & std::numeric_limits<integer>::max()));
            if (x > 0 && x <= std::numeric_limits<T>::max()) return x;
        }
    }
};

/// Distance to the exact value in units of the last place of T there (of the smallest subnormal below the normals).
template <class T>
double ulps(T got, long double exact) {
    if (std::isinf(T(exact)) && got == T(exact)) return 0;
    if (!std::isfinite(got)) return infinity;
    int exponent = 0;
    std::frexp(std::max(std::abs(exact), (long double)(std::numeric_limits<T>::min())), &exponent);
    return double(std::abs(got - exact) / std::ldexp(1.0L, exponent - std::numeric_limits<T>::digits));
}

struct Worst {
    double error = 0;
    double x = 0, y = 0;
    template <class T>
    void see(T got, long double exact, double at_x, double at_y = 0) {
        const double e = ulps(got, exact);
        if (!(e <= error)) error = e, x = at_x, y = at_y;
    }
};

template <class T>
constexpr bool single = sizeof(T) == 4;

}  // namespace

// The exact values come from the C library in long double (64 digits), 2^11 times finer than a double.

TEMPLATE_TEST_CASE("exp is within 1.1 ulp of the exact value, from overflow to the last subnormal", "", float, double) {
    using T = TestType;
    Random random;
    Worst worst;
    for (int k = 0; k < test_support::fewer_if_quick(300000, 60000); ++k) {
        const T wide = T(random.uniform(single<T> ? -105 : -750, single<T> ? 88.72 : 709.78));
        const T small = T(random.uniform(-1, 1) * std::exp(random.uniform(-40, 0)));
        worst.see(firn::exp(wide), std::exp((long double)wide), wide);
        worst.see(firn::exp(small), std::exp((long double)small), small);
    }
    INFO("worst at x = " << worst.x);
    CHECK(worst.error <= 1.1);
    CHECK(worst.error > 0.5);  // no better than correctly rounded: the measure itself works

    CHECK(firn::exp(T(0)) == T(1));
    CHECK(firn::exp(T(infinity)) == T(infinity));
    CHECK(firn::exp(T(-infinity)) == T(0));
    CHECK(firn::exp(std::numeric_limits<T>::max()) == T(infinity));
    CHECK(firn::exp(std::numeric_limits<T>::lowest()) == T(0));
    CHECK(firn::exp(T(single<T> ? 88.73 : 709.79)) == T(infinity));
    CHECK(firn::exp(T(single<T> ? -103.9 : -745.1)) == std::numeric_limits<T>::denorm_min());
    CHECK(std::isnan(firn::exp(T(not_a_number))));
}

TEMPLATE_TEST_CASE("log is within 0.9 ulp of the exact value, subnormal numbers and the surroundings of 1 included", "",
                   float, double) {
    using T = TestType;
    Random random;
    Worst worst;
    for (int k = 0; k < test_support::fewer_if_quick(300000, 60000); ++k) {
        const T any = random.any_positive<T>();
        const T near_one = T(1 + random.uniform(-0.5, 0.5) * std::exp(random.uniform(-30, 0)));
        const T subnormal = T(random.uniform(0, 1) * double(std::numeric_limits<T>::min()));
        worst.see(firn::log(any), std::log((long double)any), any);
        worst.see(firn::log(near_one), std::log((long double)near_one), near_one);
        if (subnormal > 0) worst.see(firn::log(subnormal), std::log((long double)subnormal), subnormal);
    }
    INFO("worst at x = " << worst.x);
    CHECK(worst.error <= 0.9);
    CHECK(worst.error > 0.5);

    CHECK(firn::log(T(1)) == T(0));
    CHECK(firn::log(T(0)) == T(-infinity));
    CHECK(firn::log(T(-0.0)) == T(-infinity));
    CHECK(firn::log(T(infinity)) == T(infinity));
    CHECK(std::isnan(firn::log(T(-1))));
    CHECK(std::isnan(firn::log(T(-infinity))));
    CHECK(std::isnan(firn::log(-std::numeric_limits<T>::denorm_min())));
    CHECK(std::isnan(firn::log(T(not_a_number))));
}

TEMPLATE_TEST_CASE("pow is within 1.3 ulp of the exact value wherever the result is finite", "", float, double) {
    using T = TestType;
    Random random;
    Worst worst;
    for (int k = 0; k < test_support::fewer_if_quick(300000, 60000); ++k) {
        const double exponent = random.uniform(single<T> ? -104 : -745, single<T> ? 88.7 : 709.7);
        const T x = random.any_positive<T>();
        const T y = T(exponent / double(std::log((long double)x)));
        const T near_one = T(1 + random.uniform(-0.5, 0.5) * std::exp(random.uniform(-8, 0)));
        const T large = T(exponent / double(std::log((long double)near_one)));
        if (x != 1) worst.see(firn::pow(x, y), std::pow((long double)x, (long double)y), x, y);
        if (near_one != 1) {
            worst.see(firn::pow(near_one, large), std::pow((long double)near_one, (long double)large), near_one, large);
        }
    }
    INFO("worst at x = " << worst.x << ", y = " << worst.y);
    CHECK(worst.error <= 1.3);
    CHECK(worst.error > 0.5);

    CHECK(firn::pow(T(3), T(4)) == T(81));
    CHECK(firn::pow(T(2), T(-3)) == T(0.125));
    CHECK(firn::pow(T(7), T(0)) == T(1));
    CHECK(firn::pow(T(0), T(0)) == T(1));
    CHECK(firn::pow(T(1), T(infinity)) == T(1));
    CHECK(firn::pow(T(0), T(2)) == T(0));
    CHECK(firn::pow(T(0), T(-2)) == T(infinity));
    CHECK(firn::pow(T(infinity), T(2)) == T(infinity));
    CHECK(firn::pow(T(infinity), T(-2)) == T(0));
    CHECK(firn::pow(T(2), T(infinity)) == T(infinity));
    CHECK(firn::pow(T(2), T(-infinity)) == T(0));
    CHECK(firn::pow(T(0.5), T(infinity)) == T(0));
    CHECK(firn::pow(T(0.5), T(-infinity)) == T(infinity));
    CHECK(firn::pow(T(10), T(1000)) == T(infinity));
    CHECK(firn::pow(T(10), T(-1000)) == T(0));
    CHECK(firn::pow(T(1.5), std::numeric_limits<T>::max()) == T(infinity));
    CHECK(std::isnan(firn::pow(T(-8), T(2))));
    CHECK(std::isnan(firn::pow(T(not_a_number), T(0))));
    CHECK(std::isnan(firn::pow(T(1), T(not_a_number))));
}

TEMPLATE_TEST_CASE("sin and cos are within 1.1 ulp of the exact value, tan within 3, next to their zeros too", "",
                   float, double) {
    using T = TestType;
    const double limit = single<T> ? 1e5 : 1e8;
    Random random;
    Worst sine, cosine, tangent;
    for (int k = 0; k < test_support::fewer_if_quick(300000, 60000); ++k) {
        const T wide = T(random.uniform(-limit, limit));
        const T small = T(random.uniform(-1, 1) * std::exp(random.uniform(-30, 3)));
        const T quarters = T(std::floor(random.uniform(0, limit / 1.5708)) * 1.57079632679489661923L);
        for (const T x : {wide, small, quarters}) {
            sine.see(firn::sin(x), std::sin((long double)x), x);
            cosine.see(firn::cos(x), std::cos((long double)x), x);
            tangent.see(firn::tan(x), std::tan((long double)x), x);
        }
    }
    INFO("worst at x = " << sine.x << " and " << cosine.x);
    CHECK(sine.error <= 1.1);
    CHECK(cosine.error <= 1.1);
    CHECK(tangent.error <= 3);
    CHECK(sine.error > 0.5);

    CHECK(firn::sin(T(0)) == T(0));
    CHECK(firn::cos(T(0)) == T(1));
    CHECK(firn::sin(T(limit)) == Approx(std::sin(limit)));
    CHECK(std::isnan(firn::sin(T(2 * limit))));
    CHECK(std::isnan(firn::cos(T(-2 * limit))));
    CHECK(std::isnan(firn::sin(T(infinity))));
    CHECK(std::isnan(firn::cos(T(not_a_number))));
}

TEMPLATE_TEST_CASE("The sine up to a quarter turn is within 3 ulp of the exact value", "", float, double) {
    using T = TestType;
    Random random;
    Worst sine;
    for (int k = 0; k < test_support::fewer_if_quick(300000, 60000); ++k) {
        const T wide = T(random.uniform(-1, 1) * 1.57079632679489661923);
        const T small = T(random.uniform(-1, 1) * std::exp(random.uniform(-30, 0)));
        for (const T x : {wide, small}) sine.see(firn::detail::sine_up_to_quarter_turn(x), std::sin((long double)x), x);
    }
    INFO("worst at x = " << sine.x << ": " << sine.error);
    CHECK(sine.error <= 3);
    CHECK(firn::detail::sine_up_to_quarter_turn(T(0)) == T(0));
    CHECK(firn::detail::sine_up_to_quarter_turn(firn::dual<T>(T(1.2), T(1))).derivative == Approx(std::cos(1.2)));
}

TEMPLATE_TEST_CASE("Lanes give what the scalar gives", "", float, double) {
    using T = TestType;
    using P = firn::native_pack<T>;
    constexpr int lanes = firn::scalar_traits<P>::lanes;
    const T special[] = {T(0), T(-1),  T(infinity), T(-infinity), T(not_a_number), std::numeric_limits<T>::denorm_min(),
                         T(1), T(-0.5)};
    const auto same = [](T a, T b) {
        if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
        if (std::isinf(a) || std::isinf(b)) return a == b;
        return ulps(a, (long double)b) <= 2;  // products may be fused with sums differently
#else
        return std::bit_cast<typename firn::binary_layout<T>::integer>(a) ==
               std::bit_cast<typename firn::binary_layout<T>::integer>(b);
#endif
    };
    Random random;
    for (int k = 0; k < test_support::fewer_if_quick(20000, 4000); ++k) {
        P x(0), y(0);
        for (int i = 0; i < lanes; ++i) {
            const int which = int(random.uniform(0, 24));
            x.set(i, which < 8 ? special[which] : which < 16 ? random.any_positive<T>() : T(random.uniform(-100, 100)));
            y.set(i, int(random.uniform(0, 10)) == 0 ? special[which % 8] : T(random.uniform(-5, 5)));
        }
        const P results[] = {exp(x), log(x), pow(x, y), sin(x), cos(x)};
        for (int i = 0; i < lanes; ++i) {
            const T a = x[i], b = y[i];
            INFO("x = " << a << ", y = " << b);
            const T expected[] = {firn::exp(a), firn::log(a), firn::pow(a, b), firn::sin(a), firn::cos(a)};
            for (int f = 0; f < 5; ++f) REQUIRE(same(results[f][i], expected[f]));
        }
    }
}

TEST_CASE("The derivatives of exp, log, pow, sin and cos") {
    using S = firn::dual<double>;
    for (const double a : {0.1, 0.7, 1.0, 2.5, 6.0}) {
        const S x(a, 1.0), c(a);
        CHECK(exp(x).value == firn::exp(a));
        CHECK(exp(x).derivative == Approx(std::exp(a)));
        CHECK(log(x).derivative == Approx(1 / a));
        CHECK(sin(x).derivative == Approx(std::cos(a)));
        CHECK(cos(x).derivative == Approx(-std::sin(a)));
        CHECK(tan(x).derivative == Approx(1 + std::tan(a) * std::tan(a)));
        CHECK(pow(x, 2.5).value == firn::pow(a, 2.5));
        CHECK(pow(x, 2.5).derivative == Approx(2.5 * std::pow(a, 1.5)));
        CHECK(pow(S(3.0), x).derivative == Approx(std::log(3.0) * std::pow(3.0, a)));
        CHECK(pow(x, x).derivative == Approx(std::pow(a, a) * (1 + std::log(a))));
        CHECK(pow(c, 2.5).derivative == 0.0);
    }
    CHECK(pow(S(0.0, 1.0), 2).derivative == 0.0);
    CHECK(pow(S(0.0, 1.0), 1).derivative == 1.0);
    CHECK(pow(S(0.0, 1.0), 0).derivative == 0.0);
    // Twice: d²/dx² sin(exp x)
    using SS = firn::dual<S>;
    const SS twice = sin(exp(SS(S(0.3, 1.0), S(1.0))));
    const double e = std::exp(0.3);
    CHECK(twice.derivative.derivative == Approx(e * std::cos(e) - e * e * std::sin(e)));
}

TEST_CASE("The five functions need no more of a scalar than every scalar has") {
    using S = firn::strict<float>;
    const S x = 1.7;
    CHECK(exp(x).value == Approx(std::exp(1.7)));
    CHECK(log(x).value == Approx(std::log(1.7)));
    CHECK(pow(x, 0.3).value == Approx(std::pow(1.7, 0.3)));
    CHECK(sin(x).value == Approx(std::sin(1.7)));
    CHECK(cos(x).value == Approx(std::cos(1.7)));
}

namespace stranger {

/// A scalar with its own builtins, as one that records a program.
struct Builtin {
    int called;
};
int exp(Builtin) { return 1; }
int pow(Builtin, Builtin) { return 2; }

template <class S>
auto both(S x) {
    using firn::exp;
    using firn::pow;
    return exp(x) + pow(x, x);
}

}  // namespace stranger

TEST_CASE("A scalar's own exp and pow are found before those made of arithmetic") {
    CHECK(stranger::both(stranger::Builtin{}) == 3);
    CHECK(stranger::both(1.0) == Approx(std::exp(1.0) + 1));
}

}  // namespace elementary_tests
