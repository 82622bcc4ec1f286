/// \file The fluid against its equation of state and Newton's law of viscosity, worked out here; and the bound of the
/// time step against shear waves that decay.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/force/weight_gradient.hpp>
#include <firn/material/fluid.hpp>
#include <firn/simulation.hpp>
#include <firn/transfer/pic.hpp>

using namespace materials;

namespace {

template <int D>
using FluidState = Fluid<double>::state<D>;

double pressure(double K, double gamma, double J) { return K / gamma * (std::pow(1 / J, gamma) - 1); }

struct ApicMls {
    using Transfer = Apic;
    using Force = MlsForce;
};
struct PicWeightGradient {
    using Transfer = Pic;
    using Force = WeightGradientForce;
};

/// By Simpson's rule.
template <class F>
double integral(const F& f, double from, double to) {
    constexpr int n = 4000;
    const double h = (to - from) / n;
    double sum = f(from) + f(to);
    for (int i = 1; i < n; ++i) sum += (i % 2 ? 4 : 2) * f(from + i * h);
    return sum * h / 3;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("the fluid's pressure is Tait's, and its energy the work against it", "[material]", ((int D), D),
                       2, 3) {
    for (const double gamma : {1.0, 4.0, 7.0}) {
        for (const double tension : {0.0, 2e3, 1e9}) {
            const auto fluid = Fluid<double>::from_properties({.bulk = 1e5, .gamma = gamma, .tension = tension});
            double work = 0, last = 1;
            for (const double J : {0.98, 0.9, 0.5, 0.2}) {
                const Mat<double, D> tau = kirchhoff_stress(fluid, FluidState<D>{J});
                CHECK(size_of(tau + Mat<double, D>::diagonal(J * pressure(1e5, gamma, J))) <= 1e-9 * size_of(tau));
                work += integral([&](double x) { return pressure(1e5, gamma, x); }, J, last);
                last = J;
                CHECK(energy_density(fluid, FluidState<D>{J}) == Approx(work).epsilon(1e-9));
            }
            work = 0, last = 1;
            for (const double J : {1.001, 1.01, 1.3, 3.0}) {
                const double p = std::max(-tension, pressure(1e5, gamma, J));
                const Mat<double, D> tau = kirchhoff_stress(fluid, FluidState<D>{J});
                CHECK(size_of(tau + Mat<double, D>::diagonal(J * p)) <= 1e-8 * (1 + size_of(tau)));
                work -= integral([&](double x) { return std::max(-tension, pressure(1e5, gamma, x)); }, last, J);
                last = J;
                CHECK(energy_density(fluid, FluidState<D>{J}) == Approx(work).epsilon(1e-5).margin(1e-9));
            }
        }
    }
}

TEST_CASE("viscous stress is Newton's: shear, dilatation, and the same in a plane as in space", "[material]") {
    const auto fluid = Fluid<double>::from_properties({.bulk = 1e5, .viscosity = 3});
    const Mat<double, 3> shear = Mat<double, 3>::rows(0, 0, 5, 0, 0, 0, 0, 0, 0);
    const Mat<double, 3> of_shear = stress_of(fluid, FluidState<3>{0.9}, shear);
    CHECK(of_shear(0, 2) == Approx(0.9 * 3 * 5));
    CHECK(of_shear(2, 0) == Approx(0.9 * 3 * 5));
    CHECK(of_shear(1, 1) == Approx(-0.9 * pressure(1e5, 7, 0.9)).epsilon(1e-12));
    // No resistance to a change of volume alone, none to a rotation.
    const Mat<double, 3> spin = Mat<double, 3>::rows(2, 1, -4, -1, 2, 3, 4, -3, 2);
    CHECK(size_of(stress_of(fluid, FluidState<3>{1}, spin)) <= 1e-9);
    Random random(51);
    for (int trial = 0; trial < 20; ++trial) {
        const Mat<double, 2> L = random.gaussian<2>();
        const Mat<double, 3> flat = Mat<double, 3>::rows(L(0, 0), L(0, 1), 0, L(1, 0), L(1, 1), 0, 0, 0, 0);
        const auto in_plane = stress_of(fluid, FluidState<2>{0.95}, L);
        const auto in_space = stress_of(fluid, FluidState<3>{0.95}, flat);
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) CHECK(in_plane(i, j) == Approx(in_space(i, j)).epsilon(1e-13));
        // Turned along with the flow.
        const Mat<double, 3> Q = random.rotation<3>();
        const auto turned = stress_of(fluid, FluidState<3>{0.95}, Q * flat * transpose(Q));
        CHECK(size_of(turned - Q * in_space * transpose(Q)) <= 1e-9);
        // Dissipation: viscous stress times rate.
        const auto viscous = in_space - kirchhoff_stress(fluid, FluidState<3>{0.95});
        CHECK(trace(viscous * flat) >= 0);
    }
}

TEMPLATE_TEST_CASE_SIG("J follows the flow and stays positive whatever happens", "[material]", ((class S, int D), S, D),
                       (float, 2), (float, 3), (double, 2), (double, 3)) {
    const Fluid<S> fluid;
    using State = typename Fluid<S>::template state<D>;
    const auto after = [&](double J, double rate, double dt) {
        return double(updated(fluid, State{S(J)}, Mat<S, D>::diagonal(S(rate)), S(dt)).J);
    };
    CHECK(after(0.9, 2, 0.01) == Approx(0.9 * (1 + 0.02 * D)).epsilon(1e-6));
    CHECK(after(1, -1e6, 1) == 0.125);  // a step far too long
    CHECK(after(8, 1e6, 1) == 8);
    for (const double J : {0.125, 8.0}) {
        CHECK(std::isfinite(double(kirchhoff_stress(fluid, State{S(J)})(0, 0))));
        CHECK(std::isfinite(double(wave_speed(fluid, S(1000), State{S(J)}))));
    }
}

TEST_CASE("the fluid's wave speed is √(dp/dρ)", "[material]") {
    const auto fluid = Fluid<double>::from_properties({.bulk = 2e5});
    for (const double J : {1.0, 0.97, 0.6}) {
        // p(ρ), ρ = ρ0 / J, by a difference quotient.
        const double rho = 1000 / J, step = 1e-3;
        const auto p = [&](double r) { return pressure(2e5, 7, 1000 / r); };
        const double c = std::sqrt((p(rho + step) - p(rho - step)) / (2 * step));
        CHECK(wave_speed(fluid, 1000.0, FluidState<3>{J}) == Approx(c).epsilon(1e-7));
    }
    CHECK(wave_speed(fluid, 1000.0, FluidState<3>{2.0}) == Approx(std::sqrt(200.0)).epsilon(1e-14));
}

TEMPLATE_TEST_CASE_SIG("the fluid in lanes gives the bits of plain numbers; floats near doubles", "[material]",
                       ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    const auto state_of = [](int i) {
        Random random(std::uint64_t(300 + i));
        return FluidState<D>{random.uniform(0.3, 1.4)};
    };
    const FluidProperties oil{.bulk = 1e5, .viscosity = 3, .tension = 1e3};
    check_lanes<float, D>(Fluid<float>::from_properties(oil), state_of, 160);
    check_lanes<double, D>(Fluid<double>::from_properties(oil), state_of, 160);
    for (int i = 0; i < 100; ++i) check_float<D>(Fluid<float>::from_properties(oil), state_of(i), 20);
}

TEMPLATE_TEST_CASE("at the bound of the time step a layer of honey is still, and without it it is not",
                   "[material][simulation]", ApicMls, PicWeightGradient) {
    // 4/3 μ / (ρ h²) is 1700 /s: the step of the wave speed alone is eight times longer.
    const auto honey = Fluid<float>::from_properties({.bulk = 1e4, .viscosity = 50});
    const auto fastest_after = [&](double factor) {
        const Domain<2> domain{{0, 0}, {1, 1}, 0.2 / 32};
        Simulation<2, Fluid<float>, typename TestType::Transfer, typename TestType::Force> simulation(domain, honey,
                                                                                                      {1});
        simulation.gravity = {};
        simulation.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 0.1 / 32}), 1000, {0, 0});
        auto& particles = simulation.edit_particles();
        Random random(52);
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) particles.set_velocity(slot, cast<float>(random.vector<2>(-0.1, 0.1)));
        simulation.fixed_time_step = factor * simulation.stable_time_step();
        for (int step = 0; step < 40; ++step) simulation.step();
        return simulation.report().signal_speed;
    };
    const double at_rest = fastest_after(1.0);
    CHECK(at_rest < 1.05 * (std::sqrt(10.0) + 2 * (4. / 3 * 50 / 1000) / (0.2 / 32)));
    bool broken = false;
    try {
        broken = fastest_after(8.0) > 2 * at_rest;
    } catch (const firn::error&) {
        broken = true;
    }
    CHECK(broken);
}

TEMPLATE_TEST_CASE(
    "the first stress takes the rate from C, and G2P from the velocity gradient; both see the viscosity in "
    "the signal speed",
    "[material][simulation]", ApicMls, PicWeightGradient) {
    // A flow v = L (x − ½), which both transfers keep exact inside the body. C is zero with PIC at first.
    using Transfer = typename TestType::Transfer;
    const auto honey = Fluid<float>::from_properties({.bulk = 1e4, .viscosity = 50});
    const double h = 1. / 32;
    Simulation<2, Fluid<float>, Transfer, typename TestType::Force> simulation({{0, 0}, {1, 1}, h}, honey, {1});
    simulation.gravity = {};
    simulation.add(sample_box<2>({0.3, 0.3}, {0.7, 0.7}, {.spacing = h / 2}), 1000, {0, 0});
    const Mat<double, 2> L = Mat<double, 2>::rows(0, 2, 1, 0);
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        particles.set_velocity(slot, cast<float>(L * (particles.exact_position(slot) - Vec<double, 2>{{0.5, 0.5}})));
        if (Transfer::affine) particles.set_affine(slot, cast<float>(L));
    }
    const double bound = simulation.stable_time_step();
    const double d = 4. / 3 * 50 / 1000;
    // The fastest corner: |L (0.2, 0.2)| = 0.2 √5, less up to half a spacing.
    CHECK(time_step_safety<QuadraticBSpline> * h / bound ==
          Approx(0.2 * std::sqrt(5.0) + std::sqrt(10.0) + 2 * d / h).epsilon(0.01));
    const auto stress_of_middle = [&] {
        const auto& now = simulation.particles();
        double sum = 0;
        int count = 0;
        for (std::size_t slot = 0; slot < now.slots(); ++slot) {
            if (!now.is_particle(slot)) continue;
            const Vec<double, 2> x = now.exact_position(slot) - Vec<double, 2>{{0.5, 0.5}};
            if (norm(x) > 0.05) continue;
            sum += double(now.stress(slot)(0, 1));
            ++count;
        }
        REQUIRE(count > 20);
        return sum / count;
    };
    CHECK(stress_of_middle() == Approx(Transfer::affine ? 50 * 3 : 0).epsilon(1e-5));
    simulation.fixed_time_step = 1e-6;
    simulation.step();
    CHECK(stress_of_middle() == Approx(50 * 3).epsilon(1e-3));
}

TEST_CASE("the fluid refuses properties that are none", "[material][error]") {
    const auto from = [](const FluidProperties& p) { return Fluid<float>::from_properties(p); };
    for (const double wrong : {0.0, -1.0, std::nan(""), 1e39}) CHECK_THROWS_AS(from({.bulk = wrong}), parameter_error);
    for (const double wrong : {0.5, 16.0, std::nan("")}) CHECK_THROWS_AS(from({.gamma = wrong}), parameter_error);
    for (const double wrong : {-1.0, std::nan(""), double(INFINITY)}) {
        CHECK_THROWS_AS(from({.viscosity = wrong}), parameter_error);
        CHECK_THROWS_AS(from({.tension = wrong}), parameter_error);
    }
    CHECK_NOTHROW(from({}));
}
