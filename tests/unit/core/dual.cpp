/// \file Forward derivatives against the rules of calculus.
#include "support/catch.hpp"
#include <firn/core/dual.hpp>
#include <firn/core/pack.hpp>

using namespace firn;
using D1 = dual<double>;

TEST_CASE("derivatives of each operation, by its rule", "[core][dual]") {
    const D1 x(3, 1), y(2, -0.5);
    CHECK((x + y).derivative == 0.5);
    CHECK((x - y).derivative == 1.5);
    CHECK((x * y).derivative == 1 * 2 + 3 * -0.5);
    CHECK((x / y).derivative == Approx((1 * 2 - 3 * -0.5) / 4).epsilon(1e-15));
    CHECK((-x).derivative == -1);
    CHECK(sqrt(x).derivative == Approx(0.5 / std::sqrt(3.0)).epsilon(1e-15));
    CHECK(sqrt(dual<double>(0)).derivative == 0);  // as of the norm of a zero vector
    CHECK(std::isinf(sqrt(dual<double>(0, 1)).derivative));
    CHECK(abs(-x).derivative == 1);
    CHECK(abs(x).derivative == 1);
    CHECK(floor(D1(2.5, 1)).derivative == 0);
    CHECK(min(x, y).derivative == -0.5);
    CHECK(max(x, y).derivative == 1);
    CHECK((D1(4) * x).derivative == 4);  // a literal is constant
}

TEST_CASE("a derivative of a derivative: dual numbers of dual numbers", "[core][dual]") {
    // d²/dx² of x³ + 1/x at 2: 6 x + 2/x³
    using D2 = dual<D1>;
    const D2 x(D1(2, 1), D1(1, 0));
    const D2 f = x * x * x + D2(1) / x;
    CHECK(f.value.value == Approx(8.5).epsilon(1e-15));
    CHECK(f.derivative.value == Approx(12 - 0.25).epsilon(1e-15));
    CHECK(f.derivative.derivative == Approx(12.25).epsilon(1e-15));
}

TEST_CASE("lanes of dual numbers", "[core][dual]") {
    using P = native_pack<double>;
    P value(1), direction(0);
    value.set(1, 4.0);
    direction.set(1, 1.0);
    const dual<P> root = sqrt(dual<P>(value, direction));
    CHECK(root.value[1] == 2);
    CHECK(root.derivative[1] == 0.25);
    CHECK(root.derivative[0] == 0);
    CHECK(scalar_traits<dual<P>>::lanes == scalar_traits<P>::lanes);
}
