/// \file Slow straining in float: no material loses the strain of a step that is smaller than the last digit of 1.
#include "support/catch.hpp"
#include "support/materials.hpp"
#include <firn/material/fixed_corotated.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/hencky.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/neo_hookean.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>

#include <cmath>

namespace small_strain_tests {
namespace {

using namespace firn;

/// The stress along axis 0 after `steps` steps that strain by `rate` along axis 0.
template <int D, class Model>
double stress_after(const Model& model, double rate, int steps) {
    using S = material_scalar_t<Model>;
    auto state = initial_state<D>(model);
    auto gradient = Mat<S, D>::zero();
    gradient(0, 0) = S(rate);
    for (int i = 0; i < steps; ++i) state = updated(model, state, gradient, S(1));
    return double(kirchhoff_stress(model, state)(0, 0));
}

/// The same run in double is the reference: there a step is 5e-9 or more of what 1 can hold.
template <template <class> class M>
void check(double strain) {
    for (const double rate : {2e-8, 7e-8, 2e-7}) {
        const double signed_rate = strain < 0 ? -rate : rate;
        const int steps = int(std::abs(strain) / rate);
        CAPTURE(rate, strain);
        const double in_plane = stress_after<2>(M<double>{}, signed_rate, steps);
        CHECK(stress_after<2>(M<float>{}, signed_rate, steps) == Approx(in_plane).epsilon(3e-3));
        const double in_space = stress_after<3>(M<double>{}, signed_rate, steps);
        CHECK(stress_after<3>(M<float>{}, signed_rate, steps) == Approx(in_space).epsilon(3e-3));
    }
}

/// A user's elastic solid, τ = λ (J − 1) I, with a state of its own. Gradient: the type of its F
template <scalar S, template <class, int> class Gradient>
struct OfUser {
    static constexpr const char* name = "of_user";
    static constexpr auto parameters() { return std::tuple<>{}; }
    using scalar_type = S;

    template <int D>
    struct state {
        Gradient<S, D> F = Mat<S, D>::identity();
        static constexpr auto fields() { return std::tuple{parameter{"deformation_gradient", "1", &state::F}}; }
    };
    template <int D>
    Mat<S, D> kirchhoff_stress(const state<D>& of) const {
        return Mat<S, D>::diagonal(volume_change(of.F));
    }
    template <int D>
    S wave_speed(const S&, const state<D>&) const {
        return S(1);
    }
};

}  // namespace

TEST_CASE("Every material follows 5,000 to 50,000 steps that strain by less than float's last digit of 1", "[slow]") {
    check<FixedCorotated>(1e-3);
    check<FixedCorotated>(-1e-3);
    check<NeoHookean>(1e-3);
    check<Hencky>(1e-3);
    check<VonMises>(1e-3);
    check<VonMises>(-5e-2 * 2e-1);  // beyond the yield stress: the return follows, too
    check<MohrCoulomb>(1e-3);
    check<MohrCoulomb>(5e-3);  // beyond the tension that its cohesion bears
    check<Sand>(-1e-3);
    check<Snow>(-1e-3);
    check<Nacc>(-1e-3);
    check<ModifiedCamClay>(-1e-3);
    check<Fluid>(-1e-3);
}

TEST_CASE("A bar of steel strained by 5e-8 bears 10 kPa, and not 0 or 24 kPa") {
    const auto steel = Hencky<float>::from_young_poisson(2e11, 0);
    CHECK(stress_after<3>(steel, 5e-8, 1) == Approx(1e4).epsilon(1e-5));
    CHECK(stress_after<2>(steel, -5e-8, 1) == Approx(-1e4).epsilon(1e-5));
}

TEST_CASE("Water of a true bulk modulus bears 22 Pa at a compression of 1e-8") {
    const auto water = Fluid<float>::from_properties({.bulk = 2.2e9});
    CHECK(stress_after<3>(water, -1e-8, 1) == Approx(-22).epsilon(1e-5));
    CHECK(water.pressure(VolumeRatio<float>::from_excess(-1e-8F)) == Approx(22).epsilon(1e-5));
}

TEST_CASE("A state of the user's own with a Mat F works as before, and with a DeformationGradient loses nothing") {
    CHECK(stress_after<3>(OfUser<float, Mat>{}, 2e-8, 1000) == 0);
    CHECK(stress_after<3>(OfUser<float, DeformationGradient>{}, 2e-8, 1000) == Approx(2e-5).epsilon(1e-3));
    CHECK(stress_after<3>(OfUser<float, Mat>{}, 1e-3, 10) == Approx(std::pow(1.001, 10) - 1).epsilon(1e-4));
}

}  // namespace small_strain_tests
