/// \file Sand sheared in two dimensions, with and without the third direction: at which angle it slips.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>

#include <cmath>
#include <numbers>

namespace plane_strain_tests {

using namespace firn;

namespace {

/// Shears a material that bears an even pressure, at constant volume, until it flows.
/// \return the angle whose tangent is the shear stress over the pressure in the plane [degrees]
template <class Material>
double slip_angle(const Material& material) {
    auto state = initial_state<2>(material);
    for (int i = 0; i < dimension_of<decltype(state.F)>; ++i) state.F(i, i) = 0.99;
    auto shear = Mat<double, 2>::zero();
    shear(0, 1) = shear(1, 0) = 0.5;
    for (int i = 0; i < 4000; ++i) state = updated(material, state, shear, 1e-4);
    const auto tau = kirchhoff_stress(material, state);
    return std::atan(tau(0, 1) / (-trace(tau) / 2)) * 180 / std::numbers::pi;
}

}  // namespace

TEST_CASE("Sand of 30 degrees slips at 26.6 degrees in two dimensions, at 34.7 in plane strain") {
    const auto sand = Sand<double>::from_properties({.young = 1e6, .poisson = 0.3, .friction_angle = degrees(30)});
    // In 2D τ/p = sin φ. In plane strain without dilatancy the stress across the plane is the mean, and τ/p = 3 α/√2.
    CHECK(slip_angle(sand) == Approx(26.565).epsilon(1e-3));
    CHECK(slip_angle(PlaneStrain<Sand<double>>{sand}) == Approx(34.715).epsilon(1e-3));
    // The cone with α = (√2/3) sin φ slips at τ/p = sin φ in plane strain.
    const double sine = 0.5, alpha = std::numbers::sqrt2 / 3 * sine, k = 2 * std::sqrt(2.0 / 3);
    const double matched = std::asin(3 * alpha / (k + alpha));  // α = k sin φ / (3 − sin φ)
    auto other = sand;
    other.friction_angle = matched;
    CHECK(slip_angle(PlaneStrain<Sand<double>>{other}) == Approx(26.565).epsilon(1e-3));
}

TEST_CASE("Plane strain in a simulation that runs on nodes keeps what the material knows of its parameters") {
    using Model = PlaneStrain<Sand<float>>;
    CHECK(std::string(Model::name) == "plane_strain_sand");
    CHECK_THROWS_AS(check_material<2>(Model{Sand<float>{.friction_angle = -1}}), parameter_error);
    const auto lifted = lift<double>(Model{Sand<float>{.mu = 5}});
    CHECK(lifted.mu == 5);
}

}  // namespace plane_strain_tests
