#include "support/catch.hpp"
#include <firn/core/bits.hpp>
#include <firn/core/pack.hpp>

#include <cmath>

TEMPLATE_TEST_CASE("Binary digits of a number: x = m 2^e, and 2^n, exactly, in lanes too", "", float, double) {
    using T = TestType;
    using P = firn::native_pack<T>;
    using limits = std::numeric_limits<T>;
    for (int n = limits::min_exponent - 1; n < limits::max_exponent; ++n) {
        const T two_to_n = std::ldexp(T(1), n);
        REQUIRE(firn::power_of_two(T(n)) == two_to_n);
        REQUIRE(power_of_two(P(n))[1] == two_to_n);
        for (const T m : {T(1), T(1.25), 2 - limits::epsilon()}) {
            REQUIRE(firn::exponent_of(m * two_to_n) == T(n));
            REQUIRE(firn::significand_of(m * two_to_n) == m);
            REQUIRE(exponent_of(P(m * two_to_n))[1] == T(n));
            REQUIRE(significand_of(P(m * two_to_n))[1] == m);
        }
    }
}

TEMPLATE_TEST_CASE("The product of two leading halves is exact", "", float, double) {
    using T = TestType;
    for (int k = 1; k < 1000; ++k) {
        const T a = firn::leading_half(T(1) / T(k));
        const T b = firn::leading_half(std::sqrt(T(k)));
        REQUIRE((long double)(a * b) == (long double)a * (long double)b);
        REQUIRE(std::abs(a - T(1) / T(k)) <= T(sizeof(T) == 4 ? 0x1p-11 : 0x1p-25) / T(k));
        REQUIRE(leading_half(firn::native_pack<T>(T(1) / T(k)))[1] == a);
    }
}
