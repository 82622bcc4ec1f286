/// \file firn/math/rotor.hpp: the rotor of a matrix is the one from which the matrix was made, with w ≥ 0.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/math/rotor.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>

using firn::Vec;

namespace {

template <class S>
double worst_error(int runs) {
    test_support::Random random(3);
    double worst = 0;
    for (int i = 0; i < runs; ++i) {
        Vec<S, 4> q;
        for (S& x : q.v) x = S(random.uniform(-1, 1));
        if (i % 3 == 0) q[0] *= S(1e-9);                                  // nearly half a turn
        if (i % 5 == 0) q[1 + i % 3] = q[0] = S(0);                       // half a turn about an axis in a plane
        if (i % 7 == 0) q = Vec<S, 4>{S(1), q[1] * S(1e-6), S(0), S(0)};  // nearly none
        q = q * (S(1) / norm(q));
        const Vec<S, 4> again = firn::rotor_of(firn::matrix_of(q));
        CHECK(again[0] >= 0);
        const double apart = std::min(double(norm(again - q)), double(norm(again + q)));
        worst = std::max(worst, apart / double(std::numeric_limits<S>::epsilon()));
    }
    return worst;
}

}  // namespace

TEST_CASE("The rotor of a matrix is that from which the matrix was made", "[math]") {
    CHECK(worst_error<float>(2000) < 4);
    CHECK(worst_error<double>(2000) < 4);
    CHECK(firn::rotor_of(firn::Mat<double, 3>::identity()) == firn::no_rotation<double, 3>());
}
