/// \file Lanes: memory, masks and reductions, for packs narrower and wider than a register.
#include "support/catch.hpp"
#include <firn/core/pack.hpp>

#include <array>
#include <cmath>
#include <limits>

using namespace firn;

namespace {
template <class T, int N>
std::array<T, std::size_t(N + 1)> ramp() {
    std::array<T, std::size_t(N + 1)> numbers{};
    for (std::size_t l = 0; l < numbers.size(); ++l) numbers[l] = T(l) - T(1.5);
    return numbers;
}
}  // namespace

TEMPLATE_TEST_CASE_SIG("lanes are consecutive numbers in memory, of any alignment", "[core][pack]",
                       ((class T, int N), T, N), (float, 2), (float, 4), (float, 8), (float, 16), (double, 2),
                       (double, 4), (double, 8)) {
    const auto numbers = ramp<T, N>();
    const auto p = pack<T, N>::load(numbers.data() + 1);
    for (int l = 0; l < N; ++l) CHECK(p[l] == numbers[std::size_t(l + 1)]);
    std::array<T, std::size_t(N + 2)> out{};
    p.store(out.data() + 1);
    CHECK(out.front() == 0);
    CHECK(out.back() == 0);
    for (std::size_t l = 0; l < std::size_t(N); ++l) CHECK(out[l + 1] == numbers[l + 1]);
    auto q = p;
    q.set(N - 1, T(7));
    for (int l = 0; l < N - 1; ++l) CHECK(q[l] == p[l]);
    CHECK(q[N - 1] == T(7));
    CHECK(scalar_traits<pack<T, N>>::lanes == N);
}

TEMPLATE_TEST_CASE_SIG("a mask chooses lane by lane; any() sees each single lane", "[core][pack]",
                       ((class T, int N), T, N), (float, 2), (float, 4), (float, 8), (float, 16), (double, 2),
                       (double, 4), (double, 8)) {
    using P = pack<T, N>;
    CHECK_FALSE(any(P(1) < P(0)));
    for (int one = 0; one < N; ++one) {
        P a(0);
        a.set(one, T(-1));
        const auto mask = a < P(0);
        CAPTURE(one);
        CHECK(any(mask));
        CHECK_FALSE(any(mask & !mask));
        CHECK(any(mask | (P(1) < P(0))));
        const P chosen = select(mask, P(5), P(3));
        for (int l = 0; l < N; ++l) {
            CHECK(mask[l] == (l == one));
            CHECK(chosen[l] == T(l == one ? 5 : 3));
        }
        a.set(one, T(2));
        CHECK(reduce_max(a) == T(2));
    }
    CHECK(reduce_max(P(-3)) == T(-3));
}

TEMPLATE_TEST_CASE("what is not a number is in no comparison, and select keeps the other lanes clean", "[core][pack]",
                   float, double) {
    using P = native_pack<TestType>;
    P a(4);
    a.set(1, std::numeric_limits<TestType>::quiet_NaN());
    CHECK(any(!(a == a)));
    CHECK_FALSE((a < P(9))[1]);
    CHECK((a < P(9))[0]);
    const P safe = select(a == a, sqrt(a), P(0));
    CHECK(safe[0] == 2);
    CHECK(safe[1] == 0);
}

TEMPLATE_TEST_CASE_SIG("roots and floors are the standard library's, in every lane", "[core][pack]",
                       ((class T, int N), T, N), (float, 2), (float, 4), (float, 8), (float, 16), (float, 32),
                       (double, 2), (double, 4), (double, 8), (double, 16)) {
    using P = pack<T, N>;
    for (const T scale : {T(0.37), T(1), T(1e4), T(3e9)}) {
        P a;
        for (int l = 0; l < N; ++l) a.set(l, (T(l) - T(N) / 2 + T(0.5)) * scale);
        const P down = floor(a), root = sqrt(a * a + P(scale));
        for (int l = 0; l < N; ++l) {
            CAPTURE(l, a[l]);
            CHECK(down[l] == std::floor(a[l]));
            CHECK(root[l] == std::sqrt((a * a + P(scale))[l]));
        }
    }
}

TEST_CASE("a number becomes equal lanes, zero and −0 included", "[core][pack]") {
    const native_pack<float> p(-2.5);
    for (int l = 0; l < scalar_traits<native_pack<float>>::lanes; ++l) CHECK(p[l] == -2.5f);
    CHECK(native_pack<double>(1e-300)[2] == 1e-300);
    CHECK(scalar_traits<native_pack<float>>::lanes >= 4);
    CHECK(scalar_traits<native_pack<double>>::lanes >= 4);
}
