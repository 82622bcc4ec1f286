#include "support/catch.hpp"
#include <firn/core/repeat.hpp>

TEST_CASE("repeat applies a function N times to its own result") {
    CHECK(firn::repeat<0>(5, [](int x) { return 2 * x; }) == 5);
    CHECK(firn::repeat<4>(1, [](int x) { return 2 * x + 1; }) == 31);
    // Newton's √2, three steps from 1.5
    CHECK(firn::repeat<3>(1.5, [](double x) { return (x + 2 / x) / 2; }) == Approx(1.4142135623730951));
}
