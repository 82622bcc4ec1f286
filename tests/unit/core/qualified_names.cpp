/// \file The functions of scalars by their names with firn::, as a material outside of firn writes them, in every
/// scalar.
///
/// Included is what README's own material includes, and no more: abs(x) of a float must not be C's abs(int).
#include <firn/material/concept.hpp>
#include <firn/math/elementary.hpp>
#include <firn/math/stretch_bound.hpp>

namespace {

template <class S>
S qualified(const S& a) {
    const S root = firn::sqrt(firn::max(a * a, S(0.25))), part = firn::abs(a) - firn::floor(firn::min(a, S(3)));
    return firn::select(a < S(1), root * part, firn::exp(firn::log(root)) + firn::pow(part, S(2)));
}
template <class S>
S bare(const S& a) {
    return abs(a) + sqrt(a * a);
}

}  // namespace

#include "support/catch.hpp"
#include <firn/core/dual.hpp>
#include <firn/core/lanes.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/strict.hpp>

namespace {

/// By <cmath>, in double.
double expected(double a) {
    const double root = std::sqrt(std::max(a * a, 0.25)), part = std::abs(a) - std::floor(std::min(a, 3.0));
    return a < 1 ? root * part : root + part * part;
}

}  // namespace

TEST_CASE("Functions of scalars have the same meaning by their qualified names, in every scalar", "[core]") {
    for (const double a : {-2.75, -0.7, 0.0, 0.3, 1.5, 4.25}) {
        CAPTURE(a);
        const double right = expected(double(float(a)));
        const auto near = [&](double x) { CHECK(x == Approx(right).epsilon(1e-6).margin(1e-6)); };
        near(double(qualified(float(a))));
        near(double(qualified(firn::strict<float>(float(a))).value));
        using Lanes = firn::pack<float, 16>;
        near(double(firn::lane_value(qualified(Lanes(float(a))), 7)));
        near(double(qualified(firn::dual<double>{double(float(a)), 1}).value));
        near(double(firn::lane_value(qualified(firn::dual<Lanes>{Lanes(float(a)), Lanes(1.0F)}).value, 3)));
        CHECK(qualified(a) == Approx(expected(a)).epsilon(1e-12));
    }
}

TEST_CASE("Outside of firn abs(x) and sqrt(x) of a float are those of floats, however little is included", "[core]") {
    CHECK(bare(0.5F) == 1.0F);
    CHECK(bare(-0.75) == 1.5);
}
