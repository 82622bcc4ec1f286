// quick: no
// sanitized: -O1
/// \file Quasi-static steps of matter that nothing holds, or that has no stiffness against shear: they end at once, in
/// an error that names the cause; and what friction holds is not mistaken for it.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

namespace implicit_unheld_tests {
using namespace firn;

/// A block of 16 × 8 cells, 1 m wide, in walls that let go and rub, or in others.
template <class S = double, class Force = WeightGradientForce>
auto block(const Walls<S, 2>& walls, double lift = 0) {
    const Domain<2> domain({-1, -0.25}, {3, 3}, 1. / 16);
    Simulation simulation(domain, NeoHookean<S>::from_young_poisson(S(1e6), S(0.3)), walls, QuasiStatic{}, Force{});
    simulation.warn = {};
    simulation.add(sample_box<2>({0, lift}, {1, lift + 0.5}, {.spacing = 1. / 32}), 1000);
    return simulation;
}
template <class S = double>
Walls<S, 2> walls(const Wall& rule) {
    return Walls<S, 2>::all({-1, 0}, {3, 3}, rule);
}
/// Checks that a step ends with an error of these words, and before any product with the Hessian.
template <class Simulation>
void check_unheld(Simulation& simulation, const char* words) {
    test_support::check_refused<convergence_error>([&] { simulation.advance(1); }, words);
    CHECK(simulation.solution.products == 0);
    CHECK(simulation.solution.halvings == 0);
    CHECK(simulation.time() == 0);
}

TEST_CASE("A body that nothing holds ends a quasi-static step at once, in any direction in which it is free",
          "[implicit]") {
    const double weight = 0.5 * 1000 * 9.81;
    SECTION("in the air") {
        auto simulation = block(walls({Contact::stick}), 1);
        check_unheld(simulation, "has no equilibrium: loads and friction add up to (0, -4905) N");
        CHECK(simulation.solution.unheld[1] == Approx(-weight).epsilon(1e-12));
    }
    SECTION("above a floor that it does not touch") {
        auto simulation = block(walls({Contact::separate, 0.5}), 1);
        check_unheld(simulation, "along directions in which nothing holds the matter");
    }
    SECTION("on a smooth floor, pushed aside") {
        auto simulation = block(walls({Contact::slip}));
        simulation.gravity = {0.1, -9.81};
        check_unheld(simulation, "(50, 0) N");
        simulation.gravity = {0, -9.81};  // where nothing pushes it aside, it need not be held
        simulation.advance(1);
        CHECK(simulation.solution.unheld.empty());
    }
    SECTION("in floats, on a smooth floor that is not level") {
        Simulation simulation(Domain<2>({-1, -1}, {3, 3}, 1. / 16), NeoHookean<float>::from_young_poisson(1e6F, 0.3F),
                              Collider<HalfSpace<float, 2>>{.shape = {{0.28F, 0.96F}}, .contact = Contact::slip},
                              QuasiStatic{});
        simulation.warn = {};
        simulation.add(sample_box<2>({0, 0}, {1, 0.5}, {.spacing = 1. / 32}), 1000);
        simulation.gravity = {0, -9.81F};
        check_unheld(simulation, "has no equilibrium");
        const double along = 9.81 * 500 * 0.28;
        CHECK(std::hypot(simulation.solution.unheld[0], simulation.solution.unheld[1]) == Approx(along).epsilon(1e-3));
    }
    SECTION("along a mirrored wall") {
        auto mirrored = walls({Contact::slip});
        mirrored.nodes_behind = NodesBehind::mirrored;
        auto simulation = block(mirrored);
        simulation.gravity = {-1, -9.81};
        check_unheld(simulation, "(-500, 0) N");
    }
}

TEST_CASE("A floor holds a block by friction as far as all that presses it down allows", "[implicit]") {
    // A load presses it as much as its weight does. By its weight alone, it would slide from 4.9 m/s² on.
    auto rough = walls({Contact::separate, 0});
    rough.at_lower[1].friction = 0.5;
    for (const double side : {6.0, 9.5, 10.5}) {
        auto simulation = block(rough);
        simulation.gravity = {side, -9.81};
        const double force = 0.5 * 9810 / 64;
        simulation.add_load(simulation.bodies()[0], [=](const Vec<double, 2>& x, double) {
            return Vec<double, 2>{0, x[1] > 0.5 - 1. / 16 ? -force : 0.0};
        });
        if (side < 9.81) {
            simulation.advance(1);
            CHECK(simulation.solution.has_settled);
        } else {
            test_support::check_refused<convergence_error>([&] { simulation.advance(1); }, "has no equilibrium");
        }
        CHECK(simulation.solution.halvings == 0);
        CHECK(simulation.solution.products < 100);
    }
}

/// A pool of 16 × 8 cells between smooth walls.
template <class Material, class Time>
auto pool(const Material& material, const Time& time) {
    auto simulation = Simulation(Domain<2>({-0.25, -0.25}, {1.25, 1}, 1. / 16), material,
                                 Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::slip}), time);
    simulation.warn = {};
    simulation.add(sample_box<2>({0.0, 0.0}, {0.5, 0.5}, {.spacing = 1. / 32}), 1000);
    return simulation;
}

TEST_CASE("Quasi-static steps refuse matter without stiffness against shear, and take viscous fluids", "[implicit]") {
    constexpr const char* words = "has no stiffness against shear, as a fluid without viscosity. Quasi-static steps";
    using Water = Fluid<double>;
    const Water water = Water::from_properties({.bulk = 1e6}),
                honey = Water::from_properties({.bulk = 1e6, .viscosity = 1e4});
    auto still = pool(water, QuasiStatic{});
    test_support::check_refused<parameter_error>([&] { still.advance(1); }, words);
    CHECK(still.time() == 0);
    auto dust = pool(NoStress<double>{}, QuasiStatic{});
    test_support::check_refused<parameter_error>([&] { dust.advance(1); }, words);

    auto creeping = pool(honey, QuasiStatic{});
    creeping.advance(1e-3);
    CHECK(creeping.solution.has_converged);

    using Varied = PerParticle<Water, "viscosity">;
    auto varied = pool(Varied{{water}}, QuasiStatic{});
    auto& particles = varied.edit_particles();
    const auto thicken = [&](double viscosity) {
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            auto state = particles.state(slot);
            of<"viscosity">(state) = viscosity;
            particles.set_state(slot, state);
        }
    };
    thicken(1e4);
    varied.advance(1e-3);
    CHECK(varied.solution.has_converged);
    thicken(0);
    test_support::check_refused<parameter_error>([&] { varied.advance(1e-3); }, words);

    auto flowing = pool(water, Implicit{});
    flowing.fixed_time_step = 1e-3;
    flowing.step();
    CHECK(flowing.solution.has_converged);
}

}  // namespace implicit_unheld_tests
