// quick: no
/// \file Plane strain: a simulation in two dimensions moves as a slab between mirrored walls in three.
#include "../../benchmarks/verification/scenes/plane_strain.hpp"

#include "support/catch.hpp"
#include <firn/soil.hpp>

using namespace firn;
using namespace verification;

namespace {

/// \param speed  of the top [m/s];  \param least_flown  share of particles that must have flown
template <class Model, class Flown>
void check(const Model& model, double speed, const Flown& flown, double least_flown, int steps = 500) {
    const PlaneStrainErrors errors = compare_with_slab(model, steps, 2e-4, speed, flown);
    CAPTURE(errors.position, errors.plane, errors.across, errors.share, errors.flown);
    CHECK(errors.position < 1e-9);
    CHECK(errors.plane < 1e-9);
    CHECK(errors.across < 1e-9);
    CHECK(errors.share > 0.1);
    CHECK(errors.flown >= least_flown);
}

}  // namespace

TEST_CASE("In plane strain every material moves as a slab between mirrored walls, over 500 steps") {
    const auto elastic = [](const auto&) { return true; };
    SECTION("Hencky") { check(Hencky<double>::from_young_poisson(1e6, 0.3), 1, elastic, 0.99); }
    SECTION("von Mises") {
        check(
            VonMises<double>::from_properties({.young = 1e6, .poisson = 0.3, .yield_stress = 5e3}), 2,
            [](const auto& s) { return s.plastic_strain > 0.01; }, 0.5);
    }
    SECTION("Sand") {
        check(
            Sand<double>::from_properties({.young = 1e6, .poisson = 0.3, .friction_angle = degrees(30)}), 2,
            [](const auto& s) { return s.plastic_strain > 0.001; }, 0.5);
    }
    SECTION("Mohr–Coulomb") {
        check(
            MohrCoulomb<double>::from_properties(
                {.young = 1e6, .cohesion = 3e3, .dilatancy_angle = degrees(5), .tension = 2e3}),
            2, [](const auto& s) { return s.plastic_strain > 0.001; }, 0.5);
    }
    // Where the pressure reaches the tip of its ellipse, NACC jumps to no shear, and rounding decides on which step:
    // the first particle does after 400 steps.
    SECTION("NACC") {
        check(
            Nacc<double>::from_properties({.young = 1e6, .poisson = 0.3}), 0.7,
            [](const auto& s) { return s.log_volume != 0; }, 0.07, 400);
    }
}
