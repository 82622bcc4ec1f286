// Wrappers of models: parameters for each particle, and the energy that plastic flow takes.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/io/restart.hpp>
#include <firn/io/simulation_state.hpp>

using namespace firn;

namespace {

/// A material of a user's own that says nothing of its energy.
template <scalar S = double>
struct OfUnknownEnergy {
    FixedCorotated<S> elastic{};
    static constexpr auto parameters() { return std::tuple{parameter{"elastic", "", &OfUnknownEnergy::elastic}}; }
    template <int D>
    Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const {
        return elastic.kirchhoff_stress(F);
    }
    template <int D>
    S wave_speed(const S& density, const Mat<S, D>& F) const {
        return elastic.wave_speed(density, F);
    }
};

template <int D>
Mat<double, D> some_gradient() {
    auto F = Mat<double, D>::identity();
    F(0, 0) = 1.1;
    F(0, 1) = 0.2;
    F(1, 0) = -0.05;
    F(1, 1) = 0.97;
    return F;
}

template <int D>
void require_equal(const Mat<double, D>& a, const Mat<double, D>& b) {
    for (int k = 0; k < D * D; ++k) REQUIRE(a.m[k] == b.m[k]);
}

template <int D>
void a_particle_obeys_its_own_parameters() {
    using Varied = PerParticle<FixedCorotated<double>, "mu">;
    static_assert(material<Varied, D>);
    static_assert(std::same_as<with_scalar_t<Varied, float>, PerParticle<FixedCorotated<float>, "mu">>);
    Varied varied;
    varied.mu = 3;
    varied.lambda = 5;
    auto particle = initial_state<D>(varied);
    REQUIRE(of<"mu">(particle) == 3);
    particle.F = some_gradient<D>();
    of<"mu">(particle) = 7;
    const FixedCorotated<double> own{7, 5};
    require_equal(kirchhoff_stress(varied, particle), own.kirchhoff_stress(particle.F));
    REQUIRE(energy_density(varied, particle) == own.energy_density(particle.F));
    REQUIRE(wave_speed(varied, 1000.0, particle) == own.wave_speed(1000.0, particle.F));
    auto after = updated(varied, particle, some_gradient<D>(), 0.01);
    require_equal(after.F, updated(own, ElasticState<double, D>{particle.F}, some_gradient<D>(), 0.01).F);
    REQUIRE(of<"mu">(after) == 7);
}

/// A bar that is pressed against the left wall.
template <class Material>
Simulation<2, Material> bar(const Material& material) {
    Simulation<2, Material> simulation({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32}, material);
    simulation.add(sample_box<2>({0.0, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 64}), 1000, {-0.5, 0.0});
    simulation.gravity = {0.0, 0.0};
    simulation.fixed_time_step = 5e-4;
    return simulation;
}

}  // namespace

TEST_CASE("a particle with parameters of its own obeys the model with these parameters, to the bit") {
    a_particle_obeys_its_own_parameters<2>();
    a_particle_obeys_its_own_parameters<3>();
}

TEST_CASE("particles of any material carry further numbers, which move with them and with their states") {
    using Model = Sand<double>;
    using Warm = With<Model, Carried<"temperature", "K">, Carried<"wetness">>;
    static_assert(
        material<Warm, 3> &&
        std::same_as<with_scalar_t<Warm, float>, With<Sand<float>, Carried<"temperature", "K">, Carried<"wetness">>>);
    const Model sand = Model::from_properties({.young = 2e5, .friction_angle = degrees(30)});
    const auto run = [](const auto& model) {
        Simulation simulation(Domain<2>{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, model);
        simulation.add(sample_box<2>({0.3, 0.1}, {0.7, 0.5}, {.spacing = 1.0 / 32}), 1600, {0.5, 0.0});
        simulation.most_steps_between_sorts = 3;
        return simulation;
    };
    auto warm = run(Warm{{sand, {293}, {0.1}}});
    auto plain = run(sand);
    warm.set_states(warm.bodies()[0], [](const auto& x, auto& state) { of<"temperature">(state) += x[0]; });
    std::vector<double> given(warm.particles().size());
    for (std::size_t slot = 0; slot < warm.particles().slots(); ++slot)
        if (warm.particles().is_particle(slot))
            given[warm.particles().id(slot)] = 293 + warm.particles().exact_position(slot)[0];
    for (int i = 0; i < 60; ++i) warm.step(), plain.step();
    const auto& particles = warm.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        REQUIRE(of<"temperature">(particles.state(slot)) == given[particles.id(slot)]);
        REQUIRE(of<"wetness">(particles.state(slot)) == 0.1);
    }
    CHECK(warm.totals().momentum[1] == Approx(plain.totals().momentum[1]).epsilon(1e-9));  // it is the same matter
    auto again = run(Warm{{sand, {293}, {0.1}}});
    again.remove_if([](const auto&, std::uint32_t) { return true; });
    const firn::State<double> state = firn::state_of(warm);
    restore(again, state);
    CHECK(firn::state_of(again) == state);
    const auto field = std::ranges::find(state.fields, "temperature", &firn::StateField<double>::name);
    REQUIRE(field != state.fields.end());
    CHECK(field->unit == "K");
}

TEST_CASE("a fluid whose viscosity is the particle's own flows by that one, and spreads momentum by it") {
    PerParticle<Fluid<double>, "viscosity"> varied;
    varied.viscosity = 2;
    Fluid<double> own;
    own.viscosity = 30;
    auto particle = initial_state<2>(varied);
    of<"viscosity">(particle) = 30;
    particle.J = 0.9;
    const Fluid<double>::state<2> alone{0.9};
    require_equal(stress_of(varied, particle, some_gradient<2>()), own.kirchhoff_stress(alone, some_gradient<2>()));
    REQUIRE(varied.diffusivity(1000.0, particle) == own.diffusivity(1000.0, alone));
    REQUIRE(of<"viscosity">(updated(varied, particle, some_gradient<2>(), 0.01)) == 30);
}

TEST_CASE(
    "parameters for each particle: with one value for all a run is that of the plain model; a stiff half strains "
    "less") {
    const auto model = FixedCorotated<float>::from_young_poisson(1e4, 0.3);
    PerParticle<FixedCorotated<float>, "mu", "lambda"> varied{};
    varied.mu = model.mu;
    varied.lambda = model.lambda;
    auto plain = bar(model);
    auto same = bar(varied), halves = bar(varied);
    halves.set_states(halves.bodies()[0], [&](const Vec<double, 2>& x, auto& state) {
        if (x[0] > 0.3) {
            of<"mu">(state) *= 4;
            of<"lambda">(state) *= 4;
        }
    });
    for (int step = 0; step < 300; ++step) {  // sound has passed the bar once
        plain.step();
        same.step();
        halves.step();
    }
    // Of the particles with moduli above those of the model, and of the others.
    double stiff = 0, soft = 0, of_same = 0;
    for (const auto* simulation : {&halves, &same}) {
        const auto& particles = simulation->particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const auto state = particles.state(slot);
            const double strain = (1 - double(state.F(0, 0))) / double(particles.size());
            (simulation == &same ? of_same : of<"mu">(state) > model.mu ? stiff : soft) += 2 * strain;
        }
    }
    for (std::size_t slot = 0; slot < same.particles().slots(); ++slot) {
        if (!same.particles().is_particle(slot)) continue;
        for (int a = 0; a < 2; ++a) REQUIRE(same.particles().position(slot)[a] == plain.particles().position(slot)[a]);
    }
    REQUIRE(of_same / 2 > 0.1);  // v/c = 0.136, and the wave has come almost to the end and back
    REQUIRE(soft > 1.2 * of_same / 2);
    REQUIRE(stiff < 0.35 * of_same / 2);  // to four times the modulus passes a third: 2 Z₂/(Z₁ + Z₂)/4
}

TEST_CASE("what plastic flow takes is the elastic energy before the return less that after it") {
    using Plain = Snow<double>;
    using Counted = Dissipating<Plain>;
    static_assert(material<Counted, 3>);
    const Counted snow{};
    auto state = initial_state<3>(snow);
    const Plain& plain = snow;
    auto other = initial_state<3>(plain);
    auto gradient = Mat<double, 3>::zero();
    gradient(0, 0) = -1;
    gradient(0, 1) = 0.5;
    double taken = 0;
    for (int step = 0; step < 20; ++step) {
        auto trial = other;
        trial.F = other.F + (gradient * other.F) * 0.005;  // 10 % in all: from the fifth step on it yields
        const auto after = plain.returned(trial);
        taken += plain.energy_density(trial) - plain.energy_density(after);
        other = updated(plain, other, gradient, 0.005);
        state = updated(snow, state, gradient, 0.005);
        if (step == 3) REQUIRE(state.dissipated == 0);
    }
    require_equal(state.F, other.F);
    REQUIRE(state.plastic_volume == other.plastic_volume);
    REQUIRE(state.plastic_volume < 0.95);
    REQUIRE(state.dissipated == Approx(taken).epsilon(1e-12));
    REQUIRE(state.dissipated > 0);
}

TEST_CASE("totals of a body that turns: momenta and energies in closed form, the affine field's share included") {
    Simulation<2, FixedCorotated<double>> simulation({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32},
                                                     FixedCorotated<double>::from_young_poisson(1e4, 0.3));
    const auto square = sample_box<2>({0.25, 0.25}, {0.75, 0.75}, {.spacing = 1.0 / 64});
    simulation.add(square, 1000);
    constexpr double w = 2;  // [rad/s]
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto x = particles.exact_position(slot);
        particles.set_velocity(slot, {-w * (x[1] - 0.5), w * (x[0] - 0.5)});
        particles.set_affine(slot, Mat<double, 2>::rows(0, -w, w, 0));
    }
    const Totals<2> sums = simulation.totals();
    // 32² particles of 1000/64² kg; Σ r² = m s²/6 (1 − 1/32²); each turns with the inertia m (h²/4) 2
    constexpr double mass = 250, side = 0.5, h = 1.0 / 32;
    const double inertia = mass * side * side / 6 * (1 - 1.0 / 1024) + mass * h * h / 2;
    CHECK(sums.particles == 1024);
    CHECK(sums.mass == Approx(mass).epsilon(1e-12));
    CHECK(std::abs(sums.momentum[0]) < 1e-12 * mass);
    CHECK(sums.first_moment[1] / sums.mass == Approx(0.5).epsilon(1e-12));
    CHECK(sums.angular_momentum == Approx(w * inertia).epsilon(1e-12));
    CHECK(sums.kinetic_energy == Approx(w * w * inertia / 2).epsilon(1e-12));
    CHECK(sums.elastic_energy == 0);

    for (auto slot = std::size_t(0); slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            simulation.edit_particles().set_state(slot, {Mat<double, 2>::rows(1.1, 0, 0, 1)});
    // ψ = μ ε² + λ/2 ε², ε = 0.1, over 0.25 m²
    const auto& model = simulation.material();
    CHECK(simulation.totals().elastic_energy == Approx(0.25 * 0.01 * (model.mu + model.lambda / 2)).epsilon(1e-10));
}

TEST_CASE("elastic energy that nobody knows is no number; points without stress have none") {
    const Domain<2> box{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16};
    Simulation<2, Materials<OfUnknownEnergy<double>, NoStress<double>>> simulation(box);
    CHECK(simulation.set<0>().totals().elastic_energy == 0);  // of no particles
    simulation.set<0>().add(sample_box<2>({0.3, 0.3}, {0.5, 0.5}, {.spacing = 1.0 / 32}), 1000);
    simulation.set<1>().add(sample_box<2>({0.6, 0.3}, {0.7, 0.5}, {.spacing = 1.0 / 32}), 1000);
    CHECK(std::isnan(simulation.set<0>().totals().elastic_energy));
    CHECK(simulation.set<1>().totals().elastic_energy == 0);
}
