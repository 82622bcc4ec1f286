/// \file Materials that ask for the surroundings of their particles, and those that return state and stress together.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/firn.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/soil.hpp>

namespace surroundings_tests {

using namespace firn;

namespace {

/// Hencky's solid that keeps what it was told last, and is stiffer to the right.
template <scalar S>
struct Curious {
    S mu = S(1e4), lambda = S(1e4);          // [Pa]
    S gain = S(1);                           // of mu along x [1/m]
    S x = S(0), y = S(0), speed = S(0);      // [m], [m], [m/s]: velocity along y
    S size = S(0), time = S(0), rho = S(0);  // [m], [s], [kg/m³]

    static constexpr const char* name = "curious";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &Curious::mu}, parameter{"lambda", "Pa", &Curious::lambda},
                          parameter{"gain", "1/m", &Curious::gain}};
    }
    template <int D>
    struct state {
        DeformationGradient<S, D> F;
        Vec<S, 3> told = Vec<S, 3>::zero(), told_too = Vec<S, 3>::zero();
        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F}, parameter{"told", "1", &state::told},
                              parameter{"told_too", "1", &state::told_too}};
        }
    };
    template <int D>
    FIRN_INLINE Curious at(const Surroundings<S, D>& here) const {
        Curious there = *this;
        there.mu = mu * (S(1) + gain * here.position[0]);
        there.x = here.position[0], there.y = here.position[1], there.speed = here.velocity[1];
        there.size = here.cell_size, there.time = here.time, there.rho = here.density;
        return there;
    }
    FIRN_INLINE Hencky<S> elastic() const { return {mu, lambda}; }
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        state<D> after = trial;
        after.told = {x, y, speed};
        after.told_too = {size, time, rho};
        return after;
    }
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& of) const {
        return elastic().kirchhoff_stress(of.F);
    }
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& of) const {
        return elastic().energy_density(of.F);
    }
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& of) const {
        return elastic().wave_speed(density, of.F);
    }
};

/// Sand that updates its state itself, and returns the stress with it.
template <scalar S>
struct OwnSand : Sand<S> {
    using scalar_type = S;
    template <class T>
    using with_scalar = OwnSand<T>;
    template <int D>
    using state = typename Sand<S>::template state<D>;

    template <int D>
    FIRN_INLINE state<D> updated(const state<D>& before, const Mat<S, D>& velocity_gradient, const S& dt) const {
        return updated_with_stress(before, velocity_gradient, dt).state;
    }
    template <int D>
    FIRN_INLINE StateAndStress<state<D>, S, D> updated_with_stress(const state<D>& before,
                                                                   const Mat<S, D>& velocity_gradient,
                                                                   const S& dt) const {
        return Sand<S>::template returned_with_stress<D>(followed(before, velocity_gradient, dt));
    }
};

/// A block that flies, shears and turns.
template <class Model, class Policy = Apic>
auto flying(const Model& model) {
    using S = material_scalar_t<Model>;
    Simulation simulation(Domain<2>{{-1, -1}, {1, 1}, 1.0 / 16}, model, Policy{}, Coloured{2});
    simulation.add(sample_box<2>({-0.3, -0.3}, {0.4, 0.2}, {.spacing = 1.0 / 32}), 500, {0.3, -1});
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto x = particles.exact_position(slot);
        particles.set_velocity(slot, {S(0.3 + x[1]), S(-1 + x[0] + 0.2 * scenes::noise(slot))});
    }
    return simulation;
}
/// f(state, position) of all particles, by id.
template <class Simulation, class F>
auto by_id(const Simulation& simulation, const F& f) {
    const auto& particles = simulation.particles();
    std::vector<decltype(f(particles, std::size_t(0)))> all(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) all[particles.id(slot)] = f(particles, slot);
    return all;
}
const auto position = [](const auto& particles, std::size_t slot) { return particles.exact_position(slot); };
const auto velocity = [](const auto& particles, std::size_t slot) { return particles.velocity(slot); };
const auto state = [](const auto& particles, std::size_t slot) { return particles.state(slot); };

}  // namespace

TEST_CASE("A material is told where its particle was, how nodes move there, and when the step began") {
    auto told = flying<Curious<double>, Flip<double>>({.gain = 0});
    auto moved = flying<Curious<double>, Pic>({.gain = 0});  // a particle takes Σ N v as its velocity
    const double dt = 1e-3;
    told.fixed_time_step = moved.fixed_time_step = dt;
    for (int i = 0; i < 3; ++i) told.step();
    const auto before = by_id(told, position), start = by_id(told, velocity);
    const double time = told.time();
    auto& particles = moved.edit_particles();
    std::vector<std::size_t> slot_of(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) slot_of[particles.id(slot)] = slot;
    const auto states = by_id(told, state);
    for (std::size_t i = 0; i < before.size(); ++i) {
        particles.set_position(slot_of[i], before[i]);
        particles.set_velocity(slot_of[i], start[i]);
        particles.set_state(slot_of[i], states[i]);
    }
    told.step();
    moved.step();
    const auto after = by_id(told, state);
    const auto nodes = by_id(moved, velocity);
    double farthest = 0, blended = 0;
    const auto flip = by_id(told, velocity);
    for (std::size_t i = 0; i < after.size(); ++i) {
        farthest = std::max({farthest, std::abs(after[i].told[0] - before[i][0]),
                             std::abs(after[i].told[1] - before[i][1]), std::abs(after[i].told[2] - nodes[i][1])});
        blended = std::max(blended, std::abs(flip[i][1] - nodes[i][1]));
        CHECK(after[i].told_too[0] == 1.0 / 16);
        CHECK(after[i].told_too[1] == time);
        CHECK(after[i].told_too[2] == Approx(500).epsilon(1e-14));
    }
    CHECK(farthest < 1e-12);
    CHECK(blended > 0.01);
}

TEST_CASE("Stress, bound of the time step and energy are those of the material at the particle's place") {
    auto simulation = flying<Curious<double>>({});
    simulation.set_states({}, [](const Vec<double, 2>&, auto& of) { of.F(0, 1) = 0.1; });
    static_cast<void>(simulation.stable_time_step());  // computes the stresses
    const auto& particles = simulation.particles();
    double fastest = 0, energy = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const double x = particles.exact_position(slot)[0];
        const Hencky<double> there{1e4 * (1 + x), 1e4};
        const auto F = particles.state(slot).F;
        const auto expected = there.kirchhoff_stress(F);
        CHECK(particles.stress(slot)(0, 1) == Approx(expected(0, 1)).epsilon(1e-12));
        fastest = std::max(fastest, norm(particles.velocity(slot)) + there.wave_speed(500, F));
        energy += particles.volume(slot) * there.energy_density(F);
    }
    CHECK(simulation.stable_time_step() == Approx(time_step_safety<QuadraticBSpline> / 16 / fastest).epsilon(1e-12));
    CHECK(simulation.totals().elastic_energy == Approx(energy).epsilon(1e-12));
}

TEST_CASE("Ground at rest, and the stress across the plane, are those of the material at the particle's place") {
    using Model = PlaneStrain<Curious<double>>;
    auto simulation = flying<Model>({});
    set_at_rest(simulation.set(), simulation.bodies()[0], {.surface = [](const auto&) { return 0.2; }});
    const auto saved = state_of(simulation);
    const auto& across = saved.field("kirchhoff_stress_zz").values;
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto x = particles.exact_position(slot);
        const auto F = particles.state(slot).F;
        const auto tau = Hencky<double>{1e4 * (1 + x[0]), 1e4}.kirchhoff_stress(F);
        const double vertical = 500 * 9.81 * (0.2 - x[1]), J = determinant(F);
        CHECK(tau(1, 1) == Approx(-J * vertical).epsilon(1e-9));
        CHECK(tau(0, 0) == Approx(-J * vertical / 2).epsilon(1e-9));
        CHECK(across[particles.id(slot)] == Approx(tau(2, 2)).epsilon(1e-12));
    }
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("Wrappers of a material that asks hand the surroundings on") {
    const auto told = [](const auto& model) {
        auto simulation = flying(model);
        simulation.fixed_time_step = 1e-3;
        for (int i = 0; i < 5; ++i) simulation.step();
        std::vector<double> all;
        for (const auto& one : by_id(simulation, state))
            for (int k = 0; k < 3; ++k) all.push_back(one.told[k]), all.push_back(one.told_too[k]);
        return all;
    };
    using Model = Curious<double>;
    const auto own = told(Model{});
    CHECK(told(PerParticle<Model, "lambda">{{}}) == own);
    CHECK(told(Dissipating<Model>{{}}) == own);
    CHECK(told(With<Model, Carried<"temperature", "K">>{{}}) == own);
    CHECK(told(PlaneStrain<Model>{{}}) == told(PlaneStrain<Dissipating<Model>>{{}}));
}

TEST_CASE("A material that updates its state may return the stress with it, and be counted") {
    const Sand<double> sand = Sand<double>::from_properties({.young = 1e5});
    const auto end = [](const auto& model) {
        auto simulation = flying(model);
        simulation.gravity = {0, -10};
        simulation.advance(0.3);
        return by_id(simulation, [](const auto& particles, std::size_t slot) {
            double dissipated = 0;
            if constexpr (requires { particles.state(slot).dissipated; }) dissipated = particles.state(slot).dissipated;
            const auto x = particles.exact_position(slot);
            return std::array{x[0], x[1], particles.stress(slot)(0, 1), dissipated};
        });
    };
    STATIC_REQUIRE(has_updated_with_stress<OwnSand<double>, 2>);
    STATIC_REQUIRE(!has_returned_with_stress<OwnSand<double>, 2>);
    STATIC_REQUIRE(has_updated_with_stress<PerParticle<OwnSand<double>, "mu">, 2>);
    CHECK(end(OwnSand<double>{sand}) == end(sand));
    CHECK(end(PerParticle<OwnSand<double>, "mu">{{sand}}) == end(sand));
    const auto counted = end(Dissipating<Sand<double>>{sand});
    CHECK(end(Dissipating<OwnSand<double>>{{sand}}) == counted);
    CHECK(std::ranges::any_of(counted, [](const auto& of) { return of[3] > 1; }));
}
#endif

}  // namespace surroundings_tests
