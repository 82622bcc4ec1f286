/// \file Ground at rest: elastic states under a given stress, pore water, and simulations that begin in them.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include <cmath>

namespace at_rest_tests {

using namespace firn;
using test_support::check_refused;

namespace {

/// The Cauchy stress along the axes of a state.
template <int D, class Material, class State>
Vec<double, 3> cauchy(const Material& material, const State& state) {
    const double J = 1 + volume_change(state);
    const auto tau = firn::kirchhoff_stress(material, state);
    Vec<double, 3> sigma{};
    for (int a = 0; a < D; ++a) sigma[a] = tau(a, a) / J;
    if constexpr (requires { material.output(state); }) sigma[2] = material.output(state)[0] / J;
    return sigma;
}
template <int D, class Material>
void check_elastic(const Material& material, const Vec<double, 3>& sought, int known = 3) {
    CAPTURE(Material::name);
    const Vec<double, 3> found = cauchy<D>(material, elastic_state<D>(material, sought));
    for (int a = 0; a < known; ++a) CHECK(found[a] == Approx(sought[a]).epsilon(1e-10));
}

constexpr double h = 1.0 / 16, density = 2000, g = 9.81, depth = 1;

template <class Material>
auto ground_of(const Material& material) {
    using S = material_scalar_t<Material>;
    const Domain<2> domain{{0, 0}, {4 * h, 1.5}, h};
    auto walls = Walls<S, 2>::all(domain.lower, domain.upper, {Contact::slip, 0});
    walls.at_upper[1] = {Contact::none, 0};
    walls.nodes_behind = NodesBehind::mirrored;
    Simulation simulation(domain, material, walls, Coloured{2});
    simulation.gravity = {0, S(-g)};
    simulation.add(sample_box<2>({0, 0}, {4 * h, depth}, {.spacing = h / 2}), density);
    return simulation;
}
const auto level = [](const Vec<double, 2>&) { return depth; };

}  // namespace

TEST_CASE("Every material with an elastic strain is found in the state that bears a stress") {
    const Vec<double, 3> stress{-4e3, -1e4, -6e3}, even{-1e4, -1e4, -1e4};
    check_elastic<3>(Hencky<double>::from_young_poisson(1e5, 0.3), stress);
    check_elastic<3>(FixedCorotated<double>::from_young_poisson(1e5, 0.3), stress);
    check_elastic<3>(NeoHookean<double>::from_young_poisson(1e5, 0.45), stress);
    check_elastic<3>(Sand<double>::from_properties({.young = 1e5, .friction_angle = degrees(35)}), stress);
    check_elastic<3>(VonMises<double>::from_properties({.young = 1e5, .yield_stress = 1e4}), stress);
    check_elastic<3>(Nacc<double>::from_properties({.young = 1e5, .consolidation = 3e4}), stress);
    check_elastic<3>(MohrCoulomb<double>::from_properties({.young = 1e5, .cohesion = 1e4}), stress);
    check_elastic<3>(ModifiedCamClay<double>::from_properties({}), stress);
    check_elastic<2>(PlaneStrain<ModifiedCamClay<double>>{ModifiedCamClay<double>::from_properties({})}, stress);
    check_elastic<3>(Fluid<double>::from_properties({.bulk = 1e5}), even);
    check_elastic<3>(Snow<double>::from_properties({.young = 1e6}), even);
    check_elastic<2>(Hencky<double>::from_young_poisson(1e5, 0.3), stress, 2);
    check_elastic<2>(PlaneStrain<Sand<double>>{Sand<double>::from_properties({.young = 1e5})}, stress);
    check_elastic<2>(PerParticle<PlaneStrain<Sand<double>>, "mu">{{Sand<double>::from_properties({.young = 1e5})}},
                     stress);
}

TEST_CASE("A stress that a material cannot bear is refused") {
    const auto sand = Sand<double>::from_properties({.young = 1e5, .friction_angle = degrees(30)});
    check_refused<parameter_error>([&] { elastic_state<3>(sand, {-1e3, -1e4, -1e3}); }, "it yields");
    check_refused<parameter_error>([&] { elastic_state<3>(sand, {1e3, 1e3, 1e3}); }, "it yields");
    check_refused<parameter_error>([&] { elastic_state<3>(Fluid<double>{}, {-1e3, -1e4, -1e3}); }, "fluid");
    // Hencky's Cauchy stress in compression has no bound, in tension it has one.
    check_refused<parameter_error>(
        [&] { elastic_state<3>(Hencky<double>::from_young_poisson(1e5, 0.3), {1e7, 1e7, 1e7}); }, "no elastic strain");
}

TEST_CASE("The coefficient of earth pressure at rest is that of Jaky, and of Mayne and Kulhawy") {
    CHECK(earth_pressure_at_rest(degrees(30)) == Approx(0.5));
    CHECK(earth_pressure_at_rest(degrees(30), 4) == Approx(1.0));
    CHECK_THROWS_AS(earth_pressure_at_rest(degrees(30), 0.5), parameter_error);
    CHECK_THROWS_AS(earth_pressure_at_rest(degrees(95)), parameter_error);
}

TEST_CASE("Ground at rest bears its weight, keeps its mass and its present volume") {
    const auto sand = Sand<double>::from_properties({.young = 1e5, .friction_angle = degrees(35)});
    auto simulation = ground_of(PlaneStrain<Sand<double>>{sand});
    const double before = simulation.particles().volume(0);
    set_at_rest(simulation.set(), simulation.bodies()[0], {.surface = level, .surcharge = 1e3, .earth_pressure = 0.6});
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto state = particles.state(slot);
        const double vertical = 1e3 + density * g * (depth - particles.exact_position(slot)[1]);
        const auto sigma = cauchy<2>(simulation.material(), state);
        CHECK(sigma[0] == Approx(-0.6 * vertical).epsilon(1e-9));
        CHECK(sigma[1] == Approx(-vertical).epsilon(1e-9));
        CHECK(sigma[2] == Approx(-0.6 * vertical).epsilon(1e-9));
        CHECK(particles.volume(slot) * (1 + volume_change(state)) == Approx(before).epsilon(1e-12));
    }
    CHECK(simulation.totals().mass == Approx(4 * h * depth * density));
}

TEST_CASE("Below a water table the soil bears the effective stress, and water the rest, and nothing moves") {
    const auto sand = Sand<double>::from_properties({.young = 1.5e5, .friction_angle = degrees(35)});
    auto simulation = ground_of(PlaneStrain<Undrained<Sand<double>>>{{sand, 1e6}});
    set_at_rest(simulation.set(), simulation.bodies()[0], {.surface = level, .water_table = 0.75});
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto state = particles.state(slot);
        const double y = particles.exact_position(slot)[1], J = 1 + volume_change(state);
        const double water = 1000 * g * std::max(0.0, 0.75 - y), vertical = density * g * (depth - y);
        CHECK(state.pore_pressure / J == Approx(water).margin(1e-9));
        const auto sigma = cauchy<2>(simulation.material(), state);
        CHECK(sigma[1] == Approx(-vertical).epsilon(1e-9));
        CHECK(sigma[0] == Approx(-0.5 * (vertical - water) - water).epsilon(1e-9));
    }
    double fastest = 0;
    for (int i = 0; i < 50; ++i) {
        simulation.advance(0.01);
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) fastest = std::max(fastest, norm(particles.velocity(slot)));
    }
    CHECK(fastest < 2e-3);  // without stress at the start it is √(g × depth) and more
}

TEST_CASE("What ground at rest cannot be is refused, and nothing is changed") {
    auto simulation = ground_of(Sand<double>::from_properties({.young = 1e5, .friction_angle = degrees(30)}));
    const Body soil = simulation.bodies()[0];
    const auto rest = [&](GroundAtRest<2> ground) { set_at_rest(simulation.set(), soil, ground); };
    check_refused<parameter_error>([&] { rest({}); }, "needs a surface");
    check_refused<parameter_error>([&] { rest({.surface = level, .earth_pressure = -1}); }, "must be positive");
    check_refused<parameter_error>([&] { rest({.surface = level, .earth_pressure = 0.1}); }, "it yields");
    check_refused<parameter_error>([&] { rest({.surface = level, .water_table = 0.5}); }, "has no pore pressure");
    check_refused<parameter_error>([&] { rest({.surface = [](const auto&) { return NAN; }}); }, "give finite ones");
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) CHECK(volume_change(particles.state(slot)) == 0);
}

TEST_CASE("Pore water resists each change of volume by its bulk modulus, and none of shape") {
    const auto solid = Hencky<double>::from_young_poisson(1e5, 0.3);
    const Undrained<Hencky<double>> wet{solid, 5e5};
    auto state = initial_state<3>(wet);
    const auto rate = Mat<double, 3>::rows(-0.3, 0.1, 0, 0.2, -0.2, 0.4, 0, 0.1, 0.05);
    for (int i = 0; i < 50; ++i) state = updated(wet, state, rate, 1e-2);
    const double log_J = std::log(determinant(state.F));
    CHECK(log_J < -0.1);
    CHECK(state.pore_pressure == Approx(-5e5 * log_J).epsilon(1e-12));
    const auto apart = kirchhoff_stress(wet, state) - kirchhoff_stress(solid, ElasticState<double, 3>{state.F});
    CHECK(squared_norm(apart + Mat<double, 3>::diagonal(state.pore_pressure)) < 1e-12);
    CHECK(energy_density(wet, state) == Approx(solid.energy_density(state.F) + 5e5 / 2 * log_J * log_J));
    CHECK(wave_speed(wet, 1000.0, initial_state<3>(wet)) ==
          Approx(std::sqrt((solid.lambda + 2 * solid.mu + 5e5) / 1000)));

    const auto sand = Sand<double>::from_properties({});
    const Undrained<Sand<double>> dry{sand, 0};
    auto one = initial_state<3>(dry);
    auto other = initial_state<3>(sand);
    const auto shear = Mat<double, 3>::rows(-0.1, 0.6, 0, 0.5, -0.1, 0.4, 0, 0.1, 0.05);
    for (int i = 0; i < 50; ++i) {
        const auto after = updated_with_stress(dry, one, shear, 1e-2);
        one = after.state;
        other = updated(sand, other, shear, 1e-2);
        CHECK(squared_norm(after.stress - kirchhoff_stress(sand, other)) < 1e-12);
    }
    CHECK(one.plastic_strain == other.plastic_strain);
    CHECK(one.plastic_strain > 0.01);
    CHECK_THROWS_AS(check_material<3>(Undrained<Sand<double>>{sand, -1}), parameter_error);
}

TEST_CASE("A factor of safety lies where ground begins to fail") {
    const auto block = ground_of(VonMises<double>::from_properties({.young = 1e5, .yield_stress = 1e3}));
    const auto weaken = [](auto& clay, double factor) { clay.yield_stress /= factor; };
    int trials = 0;
    const auto fails = [&](auto& trial) {
        ++trials;
        return trial.material().yield_stress < 625;  // at 1.6
    };
    const FactorOfSafety safety = factor_of_safety(block, weaken, fails, {.tolerance = 0.01});
    CHECK(safety.stands <= 1.6);
    CHECK(safety.fails > 1.6);
    CHECK(safety.fails - safety.stands <= 0.01);
    CHECK(trials == 10);
    CHECK(block.material().yield_stress == 1e3);
    const auto find = [&](StrengthReduction how) { factor_of_safety(block, weaken, fails, how); };
    check_refused<parameter_error>([&] { find({.lowest = 2}); }, "fails at the lowest");
    check_refused<parameter_error>([&] { find({.highest = 1.5}); }, "stands at the highest");
    check_refused<parameter_error>([&] { find({.lowest = 3, .highest = 2}); }, "smaller than the second");
}

}  // namespace at_rest_tests
