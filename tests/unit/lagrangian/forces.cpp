/// \file Points under forces, against closed forms: fall, oscillation, drag, stretched sheets; order and momentum.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/lagrangian/particle_system.hpp>
#include <firn/material/fixed_corotated.hpp>

#include <cmath>
#include <cstring>

using namespace firn;

namespace forces_tests {

namespace {

using V = Vec<double, 2>;

/// A mass of 1 kg on a spring to a pin at the origin, from x = 1.5 m at rest; l₀ = 1 m.
template <class Integrator>
double oscillator(double k, double c, double dt, int steps) {
    ParticleSystem<2, double, Integrator> system;
    system.gravity = V::zero();
    system.points.add({.position = {{0, 0}}});
    system.points.add({.position = {{1.5, 0}}});
    system.points.pin(0);
    Springs<double, 2> spring;
    spring.add({0, 1}, {1, k, c});
    system.add_force(std::move(spring));
    for (int i = 0; i < steps; ++i) system.step(dt);
    return system.points.position[1][0] - 1;
}

/// Of x″ = −k x − c x′ from ½ at rest.
double damped(double k, double c, double t) {
    const double decay = c / 2, omega = std::sqrt(k - decay * decay);
    return 0.5 * std::exp(-decay * t) * (std::cos(omega * t) + decay / omega * std::sin(omega * t));
}

/// A sheet of n × n squares of side a, two triangles each, in the plane z = 0.
Net<3> sheet(int n, double a) {
    Net<3> net;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) net.positions.push_back({{a * i, a * j, 0}});
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            const auto p = std::uint32_t(j * (n + 1) + i), q = p + std::uint32_t(n + 1);
            net.facets.push_back({p, p + 1, q + 1});
            net.facets.push_back({p, q + 1, q});
            net.links.push_back({p, p + 1});
            net.links.push_back({p, q});
            net.links.push_back({p, q + 1, LinkKind::shear});
        }
    return net;
}

}  // namespace

TEST_CASE("Verlet follows a throw exactly, in steps of any length, and Euler is off by g t dt/2", "[lagrangian]") {
    ParticleSystem<3, double, Verlet> system;
    const Vec<double, 3> v{{3, 4, -1}};
    system.points.add({.position = {{1, 2, 3}}, .velocity = v});
    for (const double dt : {0.1, 0.03, 0.2, 0.07, 0.1}) system.step(dt);
    const double t = system.time();
    CHECK(t == Approx(0.5));
    CHECK(norm(system.points.position[0] - Vec<double, 3>{{1 + 3 * t, 2 + 4 * t - 9.81 * t * t / 2, 3 - t}}) < 1e-14);

    ParticleSystem<3, double, SymplecticEuler> first_order;
    first_order.points.add({});
    first_order.advance(0.5, 0.1);
    CHECK(first_order.points.position[0][1] == Approx(-9.81 * (0.125 + 0.5 * 0.1 / 2)).epsilon(1e-13));
    CHECK(first_order.points.velocity[0][1] == Approx(-9.81 * 0.5).epsilon(1e-13));
}

TEST_CASE("an oscillator's error falls with the square of Verlet's step, and with Euler's step", "[lagrangian]") {
    const auto error = []<class I>(I, double dt) {
        return std::abs(oscillator<I>(25, 0, dt, int(std::lround(1 / dt))) - damped(25, 0, 1));
    };
    CHECK(std::log2(error(Verlet{}, 0.01) / error(Verlet{}, 0.005)) == Approx(2).margin(0.03));
    CHECK(std::log2(error(SymplecticEuler{}, 0.01) / error(SymplecticEuler{}, 0.005)) == Approx(1).margin(0.05));
    CHECK(error(Verlet{}, 0.005) < 2e-4);
}

TEST_CASE("a damped oscillator has the frequency and the decay of its equation", "[lagrangian]") {
    for (const double c : {0.5, 2.0})
        for (const double t : {0.5, 1.0, 2.0}) {
            CHECK(std::abs(oscillator<Verlet>(100, c, 1e-4, int(std::lround(t * 1e4))) - damped(100, c, t)) < 2e-4);
            CHECK(std::abs(oscillator<SymplecticEuler>(100, c, 1e-4, int(std::lround(t * 1e4))) - damped(100, c, t)) <
                  5e-4);
        }
}

TEST_CASE("a system's own damping lets velocities fall by e^(-c t)", "[lagrangian]") {
    ParticleSystem<2, double, Verlet> system;
    system.gravity = V::zero();
    system.damping = 3;
    system.points.add({.velocity = {{2, 0}}});
    system.advance(1, 0.01);
    // the velocity is that of half a step before
    CHECK(system.points.velocity[0][0] == Approx(2 * std::exp(-3 * 0.995)).epsilon(1e-12));
    CHECK(system.points.position[0][0] == Approx(2.0 / 3 * (1 - std::exp(-3.0))).epsilon(1e-4));
}

TEMPLATE_TEST_CASE_SIG("drag lets a ball fall at its terminal speed, and wind carries it along", "[lagrangian]",
                       ((int D), D), 2, 3) {
    const double m = 0.01, r = 0.02, density = 1.2, coefficient = 0.47;
    ParticleSystem<D, double> system;
    system.points.add({.mass = m, .radius = r});
    Vec<double, D> wind = Vec<double, D>::zero();
    wind[0] = 2;
    system.add_force(DragOnPoints<double, D>{{density, coefficient, wind}});
    system.advance(20, 0.01);
    const double area = D == 3 ? 3.14159265358979 * r * r : 2 * r;
    CHECK(system.points.velocity[0][1] == Approx(-std::sqrt(2 * m * 9.81 / (density * coefficient * area))));
    CHECK(system.points.velocity[0][0] == Approx(2).epsilon(1e-3));
}

TEST_CASE("a point on an anchor hangs m g / k below its place, and swings with sqrt(k/m)", "[lagrangian]") {
    const double m = 0.5, k = 40;
    ParticleSystem<2, double> system;
    system.points.add({.position = {{1, 2 - m * 9.81 / k}}, .mass = m});
    Anchors<double, 2> anchors;
    anchors.add({0}, {{{1, 2}}, k, 0});
    auto& held = system.add_force(std::move(anchors));
    CHECK(system.stable_time_step() == Approx(2 / std::sqrt(k / m)));
    system.advance(0.5, 1e-3);
    CHECK(norm(system.points.position[0] - V{{1, 2 - m * 9.81 / k}}) < 1e-12);
    held.element(0).place[0] = 1.2;  // moved: half a period later it is as far on the other side
    system.advance(3.14159265358979 / std::sqrt(k / m), 1e-4);
    CHECK(norm(system.points.position[0] - V{{1.4, 2 - m * 9.81 / k}}) < 1e-3);
    held.element(0).damping = 5;
    system.advance(5, 1e-3);
    CHECK(norm(system.points.position[0] - V{{1.2, 2 - m * 9.81 / k}}) < 1e-6);
}

TEST_CASE("wind pushes a plate along its normal, by the square of its speed, a part to every corner", "[lagrangian]") {
    // ½ ρ c_d A |v| (v·n) n: a triangle of ½ m² across the wind, then at 60 degrees to it
    Net<3> plate{{{{0, 0, 0}}, {{1, 0, 0}}, {{0, 1, 0}}}, {}, {{0, 1, 2}}};
    AerodynamicDrag<double, 3> law{1.2, 1.1, {{0, 0, 5}}};
    ParticleSystem<3, double> system;
    system.add(plate, {});
    auto surface = aerodynamic_surface_of(plate, law);
    std::vector<Vec<double, 3>> force(3, Vec<double, 3>::zero());
    surface.add_forces(system.points.view(), force, 1);
    for (const auto& f : force) CHECK(norm(f - Vec<double, 3>{{0, 0, 0.5 * 1.2 * 1.1 * 0.5 * 25 / 3}}) < 1e-14);
    surface.law.wind = {{5 * std::sqrt(0.75), 0, 5 * 0.5}};
    std::fill(force.begin(), force.end(), Vec<double, 3>::zero());
    surface.add_forces(system.points.view(), force, 1);
    for (const auto& f : force) CHECK(norm(f - Vec<double, 3>{{0, 0, 0.5 * 1.2 * 1.1 * 0.5 * 25 * 0.5 / 3}}) < 1e-14);
    // The plate's own mean velocity counts: with the wind it feels nothing.
    for (auto& v : system.points.velocity) v = surface.law.wind;
    std::fill(force.begin(), force.end(), Vec<double, 3>::zero());
    surface.add_forces(system.points.view(), force, 1);
    for (const auto& f : force) CHECK(norm(f) == 0);
    // Without area: no force, and nothing that is not a number.
    system.points.position[2] = {{0.5, 0, 0}};
    system.points.velocity[0] = {{1, 2, 3}};
    surface.add_forces(system.points.view(), force, 1);
    for (const auto& f : force) CHECK(norm(f) == 0);

    // 2D: an edge of 2 m, half to each end
    const Net<2> edge{{{{0, 0}}, {{2, 0}}}, {}, {{0, 1}}};
    ParticleSystem<2, double> flat;
    flat.add(edge, {});
    auto line = aerodynamic_surface_of(edge, AerodynamicDrag<double, 2>{1, 1, {{0, 3}}});
    std::vector<V> both(2, V::zero());
    line.add_forces(flat.points.view(), both, 1);
    for (const auto& f : both) CHECK(norm(f - V{{0, 0.5 * 2 * 9 / 2}}) < 1e-14);
}

TEST_CASE("springs between random points keep momentum and angular momentum to rounding", "[lagrangian]") {
    test_support::Random random(5);
    ParticleSystem<2, double> system;
    system.gravity = V::zero();
    for (int i = 0; i < 300; ++i)
        system.points.add({.position = {{random.uniform(-1, 1), random.uniform(-1, 1)}},
                           .velocity = {{random.uniform(-1, 1), random.uniform(-1, 1)}},
                           .mass = random.uniform(0.5, 2)});
    Springs<double, 2> springs;
    for (std::uint32_t i = 0; i < 900; ++i) {
        const auto a = std::uint32_t(random.uniform(0, 300)), b = std::uint32_t(random.uniform(0, 300));
        if (a != b) springs.add({a, b}, {0.5, 20, 0.3});
    }
    system.add_force(std::move(springs));
    const auto momenta = [&] {
        Vec<double, 3> sum{};
        for (std::size_t i = 0; i < system.points.size(); ++i) {
            const V &x = system.points.position[i], &v = system.points.velocity[i];
            sum += Vec<double, 3>{{v[0], v[1], x[0] * v[1] - x[1] * v[0]}} * system.points.mass[i];
        }
        return sum;
    };
    const auto before = momenta();
    system.advance(1, 1e-3);
    CHECK(norm(momenta() - before) < 1e-10);
    CHECK(system.points.velocity[0] != V::zero());
}

TEST_CASE("springs at one place give no force, and zero lengths of links are refused", "[lagrangian]") {
    ParticleSystem<2, double> system;
    system.gravity = V::zero();
    system.points.add({});
    system.points.add({});
    Springs<double, 2> spring;
    spring.add({0, 1}, {1, 10, 1});
    system.add_force(std::move(spring));
    system.step(0.1);
    CHECK(system.points.position[0] == V::zero());
    const Net<2> folded{{{{1, 1}}, {{1, 1}}}, {{0, 1}}, {}};
    CHECK_THROWS_AS(springs_of<double>(folded, SpringOptions{10, 0}), parameter_error);
    CHECK_THROWS_AS(springs_of<double>(Net<2>{{{{0, 0}}}, {{0, 7}}, {}}, SpringOptions{10, 0}), parameter_error);
}

TEST_CASE("forces of a net join the points from the place that is given; what only damps is a spring, too",
          "[lagrangian]") {
    const Net<3> net = sheet(1, 1);
    const auto springs = springs_of<double>(net, SpringOptions{0, 3}, 7);
    REQUIRE(springs.size() == 3);
    CHECK(springs.corners(2) == std::array<std::uint32_t, 2>{7, 10});
    CHECK(springs.element(2).damping == 3);
    CHECK(springs_of<double>(net, SpringOptions{0, 0}).size() == 0);
    const std::array<std::uint32_t, 3> moved{7, 8, 10};
    CHECK(membranes_of(net, FixedCorotated<double>{}, 0.1, 7).corners(0) == moved);
    CHECK(aerodynamic_surface_of(net, AerodynamicDrag<double, 3>{}, 7).corners(0) == moved);
}

TEST_CASE("springs that are left keep their own numbers when others lose an end or tear", "[lagrangian]") {
    Springs<double, 2> springs;
    for (std::uint32_t i = 0; i < 4; ++i) springs.add({i, i + 1}, {1.0 + i, 10, 0});
    const std::uint32_t new_place[] = {no_particle, 0, 1, 2, 3};
    springs.renumber(new_place);
    REQUIRE(springs.size() == 3);
    for (std::uint32_t e = 0; e < 3; ++e) CHECK(springs.element(e).rest == 2.0 + e);
    const Torn torn[] = {{2, 1}};  // whichever end is named first
    springs.tear(torn);
    REQUIRE(springs.size() == 2);
    CHECK(springs.element(0).rest == 2);
    CHECK(springs.element(1).rest == 4);
}

TEST_CASE("the corners on a point are in the order of the elements, in which it sums", "[lagrangian]") {
    using Ends = std::array<std::uint32_t, 2>;
    const std::vector<Ends> elements{{0, 1}, {1, 2}, {1, 0}};
    const firn::detail::Incidence incidence(std::span<const Ends>(elements), 3);
    const auto at_1 = incidence.of(1);
    CHECK(std::vector<std::uint32_t>(at_1.begin(), at_1.end()) == std::vector<std::uint32_t>{1, 2, 4});
}

TEST_CASE("a stretched sheet has its material's energy, and pulls with its stress times its width", "[lagrangian]") {
    // Fixed corotated, plane: stretched by s along x and held across, ψ = (μ + λ/2)(s − 1)², P_xx = (2μ + λ)(s − 1);
    // in this model λ goes with (J − 1)², J = s, so that both hold exactly (Stomakhin et al. 2012).
    const double thickness = 0.002, s = 1.25;
    const auto material = FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    const Net<3> net = sheet(4, 0.25);  // a square metre
    ParticleSystem<3, double> system;
    system.add(net, {});
    auto membranes = membranes_of(net, material, thickness);
    const double angle = 0.7;  // and turned about y
    for (auto& x : system.points.position) x = {{s * x[0] * std::cos(angle), x[1], s * x[0] * std::sin(angle)}};
    const double strain = s - 1;
    CHECK(membranes.energy(system.points.view()) ==
          Approx(thickness * (material.mu + material.lambda / 2) * strain * strain).epsilon(1e-12));
    std::vector<Vec<double, 3>> force(system.points.size(), Vec<double, 3>::zero());
    membranes.add_forces(system.points.view(), force, 1);
    double pull = 0;
    for (std::size_t i = 0; i < force.size(); i += 5)
        pull += force[i][0] * std::cos(angle) + force[i][2] * std::sin(angle);
    CHECK(pull == Approx(thickness * (2 * material.mu + material.lambda) * strain).epsilon(1e-12));

    // Springs: half k Δl² each.
    auto springs = springs_of<double>(net, SpringsOfKinds{{{300, 0}, {0, 0}, {0, 0}, {0, 0}}});
    for (std::size_t i = 0; i < net.positions.size(); ++i) system.points.position[i] = net.positions[i] * 1.1;
    CHECK(springs.energy(system.points.view()) == Approx(32 * 0.5 * 300 * 0.025 * 0.025).epsilon(1e-12));
}

TEST_CASE("a membrane's forces are the negative gradient of its energy", "[lagrangian]") {
    test_support::Random random(9);
    const Net<3> net = sheet(2, 0.5);
    ParticleSystem<3, double> system;
    system.add(net, {});
    auto membranes = membranes_of(net, FixedCorotated<double>::from_young_poisson(1e4, 0.2), 0.01);
    for (auto& x : system.points.position)
        for (int a = 0; a < 3; ++a) x[a] += random.uniform(-0.1, 0.1);
    std::vector<Vec<double, 3>> force(9, Vec<double, 3>::zero());
    membranes.add_forces(system.points.view(), force, 1);
    for (std::size_t i = 0; i < 9; ++i)
        for (int a = 0; a < 3; ++a) {
            const double eps = 1e-6, x = system.points.position[i][a];
            system.points.position[i][a] = x + eps;
            const double above = membranes.energy(system.points.view());
            system.points.position[i][a] = x - eps;
            const double below = membranes.energy(system.points.view());
            system.points.position[i][a] = x;
            CHECK(force[i][a] == Approx(-(above - below) / (2 * eps)).margin(1e-6));
        }
    CHECK_THROWS_AS(
        membranes_of(Net<3>{{{{0, 0, 0}}, {{1, 1, 1}}, {{2, 2, 2}}}, {}, {{0, 1, 2}}}, FixedCorotated<double>{}, 0.1),
        mesh_error);
}

TEST_CASE("a membrane's stiffness is rho c^2 by the squared gradients of all three corners", "[lagrangian]") {
    // Of the triangle (0, 0), (1, 0), (0, 1) they are (−1, −1), (1, 0), (0, 1): 4 in all. ρ c² = λ + 2μ at rest.
    const Net<3> net{{{{0, 0, 0}}, {{1, 0, 0}}, {{0, 1, 0}}}, {}, {{0, 1, 2}}};
    const auto material = FixedCorotated<double>::from_young_poisson(1e4, 0.2);
    ParticleSystem<3, double> system;
    system.add(net, {});
    auto membranes = membranes_of(net, material, 0.01);
    std::vector<double> stiffness(3), damping(3);
    membranes.add_stiffness(system.points.view(), stiffness, damping, 1);
    for (const double each : stiffness)
        CHECK(each == Approx(0.5 * 0.01 * (material.lambda + 2 * material.mu) * 4).epsilon(1e-12));

    // Pressed together to a line it still has forces that are numbers.
    system.points.position[2] = {{0.5, 0, 0}};
    std::vector<Vec<double, 3>> force(3, Vec<double, 3>::zero());
    membranes.add_forces(system.points.view(), force, 1);
    for (const auto& f : force) CHECK(std::isfinite(norm(f)));
}

TEST_CASE("the bound of the step by drag: its derivative along the flow is rho c_d A |v|, v relative to the wind",
          "[lagrangian]") {
    const double m = 0.01, r = 0.02, density = 1.2, coefficient = 0.47;
    ParticleSystem<2, double> system;
    system.points.add({.velocity = {{3, 0}}, .mass = m, .radius = r});
    system.add_force(DragOnPoints<double, 2>{{density, coefficient, {{-1, 0}}}});
    CHECK(system.stable_time_step() == Approx(2 * m / (density * coefficient * 2 * r * 4)));
}

TEST_CASE("a point that is let go falls as one that is new", "[lagrangian]") {
    ParticleSystem<2, double, Verlet> system;
    system.points.add({});
    system.points.pin(0);
    system.step(0.1);
    system.points.unpin(0);
    for (const double dt : {0.1, 0.2}) system.step(dt);
    CHECK(system.points.position[0][1] == Approx(-9.81 * 0.3 * 0.3 / 2).epsilon(1e-13));
}

TEST_CASE("the bound of the step is where an oscillator begins to grow, and a step above it is warned of",
          "[lagrangian]") {
    // k dt²/m + 2 c dt/m = 4, of two free masses: 2k and 2c act on their distance
    for (const double c : {0.0, 3.0}) {
        const auto largest = [&](double factor, std::string& said, double& bound) {
            ParticleSystem<2, double> system;
            system.gravity = V::zero();
            system.warn = [&](const std::string& text) { said = text; };
            system.points.add({.position = {{0, 0}}, .mass = 0.5});
            system.points.add({.position = {{1.001, 0}}, .mass = 0.5});
            Springs<double, 2> spring;
            spring.add({0, 1}, {1, 200, c});
            system.add_force(std::move(spring));
            bound = system.stable_time_step();
            double reached = 0;
            for (int i = 0; i < 400 && reached < 0.5; ++i) {
                system.step(factor * bound);
                reached = std::abs(system.points.position[1][0] - system.points.position[0][0] - 1);
            }
            return reached;
        };
        std::string said;
        double bound = 0;
        CHECK(largest(0.98, said, bound) < 0.02);
        CHECK(said.empty());
        CHECK(bound == Approx(c == 0 ? 2 / std::sqrt(800.0) : 4 / (12 + std::sqrt(144 + 3200.0))));
        CHECK(largest(1.1, said, bound) > 0.4);
        CHECK(said.find("times the bound") != std::string::npos);
    }
}

TEMPLATE_TEST_CASE_SIG("the air's damping on a facet is the largest singular value of its matrix", "[lagrangian]",
                       ((int D), D), 2, 3) {
    using W = Vec<double, D>;
    using Corners = std::array<W, std::size_t(D)>;
    test_support::Random random(6);
    for (int k = 0; k < 30; ++k) {
        const AerodynamicDrag<double, D> law{1.2, 1.1, random.vector<D>(-5, 5)};
        Corners x, v;
        for (auto& each : x) each = random.vector<D>(-1, 1);
        for (auto& each : v) each = random.vector<D>(-3, 3);
        const auto change = [&](const Corners& by) {  // −∂f/∂v times it, by differences
            Corners above = v, below = v, all;
            for (std::size_t i = 0; i < D; ++i) above[i] += by[i] * 1e-5, below[i] -= by[i] * 1e-5;
            const auto at_above = law.forces({}, x, above), at_below = law.forces({}, x, below);
            for (std::size_t i = 0; i < D; ++i) all[i] = (at_below[i] - at_above[i]) * 5e4;
            return all;
        };
        Mat<double, D * D> matrix{};  // column by column
        for (int column = 0; column < D * D; ++column) {
            Corners one{};
            one.fill(W::zero());
            one[std::size_t(column / D)][column % D] = 1;
            const Corners felt = change(one);
            for (int row = 0; row < D * D; ++row) matrix(row, column) = felt[std::size_t(row / D)][row % D];
        }
        Vec<double, D * D> u = Vec<double, D * D>::filled(1);
        u[0] = 0.3;
        double largest = 0;
        for (int i = 0; i < 200; ++i) {  // powers of AᵀA
            u = transpose(matrix) * (matrix * u);
            largest = std::sqrt(norm(u));
            u = u * (1 / norm(u));
        }
        CHECK(law.damping({}, x, v) == Approx(largest).epsilon(1e-6));
    }
}

TEST_CASE("the air bounds the step: below the bound no cloth overtakes the wind, beyond it the system warns",
          "[lagrangian]") {
    const Net<3> net = sheet(8, 0.1);
    const auto fastest = [&](double dt, std::string& said, double& bound) {
        ParticleSystem<3, double> system;
        system.gravity = Vec<double, 3>::zero();
        system.warn = [&](const std::string& text) { said += text; };
        system.add(net, {.masses = facet_masses(net, 0.05)});
        system.add_force(aerodynamic_surface_of<double>(net, {.wind = {0, 0, 50}}));
        bound = system.stable_time_step();
        double most = 0;
        for (int i = 0; i < 60; ++i) {
            system.step(dt);
            for (const auto& v : system.points.velocity) most = std::max(most, v[2]);
        }
        return most;
    };
    // dv/dt = ½ ρ c_d (50 − v)²/0.05 = 12 (50 − v)², whose rate of decay is 1,200/s at first: 2/1,200 s.
    std::string said;
    double bound = 0;
    CHECK(fastest(8e-4, said, bound) <= 50);
    CHECK(bound == Approx(2.0 / 1200));
    CHECK(said.empty());
    CHECK(fastest(5e-3, said, bound) > 60);
    CHECK(said.find("3 times the bound of 0.00166") != std::string::npos);
}

namespace {

/// Drag by the cube of the speed, on an element of one point.
struct CubicDrag {
    using scalar_type = double;
    static constexpr int corners = 1;
    struct Element {};
    std::array<V, 1> forces(const Element&, const std::array<V, 1>&, const std::array<V, 1>& v) const {
        return {v[0] * -dot(v[0], v[0])};
    }
    double damping(const Element&, const std::array<V, 1>&, const std::array<V, 1>& v) const {
        return 3 * dot(v[0], v[0]);
    }
};
/// The same, as a function of points.
struct CubicDragOnEach {
    V operator()(const PointView<double, 2>& points, std::size_t i) const {
        return points.velocity[i] * -dot(points.velocity[i], points.velocity[i]);
    }
    double damping(const PointView<double, 2>& points, std::size_t i) const {
        return 3 * dot(points.velocity[i], points.velocity[i]);
    }
    double stiffness(const PointView<double, 2>&, std::size_t) const { return 800; }
};

}  // namespace

TEST_CASE("forces of one's own bound the step by what they say of themselves", "[lagrangian]") {
    ParticleSystem<2, double> system;
    system.points.add({.velocity = {3, 4}, .mass = 5});
    CHECK(std::isinf(system.stable_time_step()));
    ElementForces<CubicDrag, 2> law;
    law.add({0});
    system.add_force(std::move(law));
    CHECK(system.stable_time_step() == Approx(2 / 15.0));  // 2 m/c, c = 75 kg/s
    system.add_force(ForceOnEach{CubicDragOnEach{}});
    CHECK(system.stable_time_step() == Approx(4 / (30 + std::sqrt(900 + 4 * 160.0))));
    system.add_force(ForceOnEach{[](const PointView<double, 2>&, std::size_t) { return V{1, 0}; }});
    CHECK(system.stable_time_step() == Approx(4 / (30 + std::sqrt(900 + 4 * 160.0))));
}

TEST_CASE("what blows up stops with the point, the step and the likely cause, and nothing has moved", "[lagrangian]") {
    ParticleSystem<2, double> system;
    for (int i = 0; i < 3000; ++i) system.points.add({.position = {{double(i), 0}}});
    system.add_force(ForceOnEach{[](const PointView<double, 2>& points, std::size_t i) {
        return i == 2500 && points.time > 0.15 ? V{{1.0 / 0.0, 0}} : V::zero();
    }});
    system.step(0.1);
    system.step(0.1);
    const auto before = system.points.position.copy();
    CHECK_THROWS_WITH(system.step(0.1), Catch::Contains("point 2500") && Catch::Contains("step 2"));
    CHECK(std::memcmp(before.data(), system.points.position.data(), before.size() * sizeof(V)) == 0);
    CHECK(system.steps() == 2);
}

TEST_CASE("bad points, pins and steps are refused, and nothing is added", "[lagrangian]") {
    ParticleSystem<3> system;
    const double nan = std::nan("");
    CHECK_THROWS_AS(system.points.add({.position = {{nan, 0, 0}}}), parameter_error);
    CHECK_THROWS_AS(system.points.add({.mass = 0}), parameter_error);
    CHECK_THROWS_AS(system.points.add({.mass = -1}), parameter_error);
    CHECK_THROWS_AS(system.points.add({.mass = 1e-40}), parameter_error);  // 1/m is no float
    CHECK_THROWS_AS(system.points.add({.radius = -1}), parameter_error);
    CHECK(system.points.size() == 0);
    CHECK_THROWS_WITH(system.points.pin(3), Catch::Contains("no point 3"));
    CHECK_THROWS_AS(system.step(0), parameter_error);
    CHECK_THROWS_AS(system.step(nan), parameter_error);
    CHECK_THROWS_AS(system.add(sheet(1, 1), {.masses = {1, 2}}), parameter_error);
    Net<3> broken = sheet(1, 1);
    broken.positions[3][1] = nan;
    CHECK_THROWS_AS(system.add(broken, {}), parameter_error);
    CHECK(system.points.size() == 0);
    CHECK(system.points.next_id() == 0);
    CHECK(system.facets.empty());
    Springs<float, 3> springs;
    springs.add({0, 5}, {1, 1, 0});
    system.points.add({});
    system.add_force(std::move(springs));
    CHECK_THROWS_WITH(system.step(0.1), Catch::Contains("point 5"));
    system.points.skip_ids(9);
    system.points.skip_ids(5);  // no way back
    CHECK(system.points.next_id() == 9);
}

TEST_CASE("points that are taken out take their springs and facets along; ids stay", "[lagrangian]") {
    ParticleSystem<3> system;
    const Net<3> net = sheet(2, 1);
    system.add(net, {});
    auto& springs = system.add_force(springs_of<float>(net, SpringOptions{1, 0}));
    system.constraints.add(net);
    CHECK(system.remove_if([&](std::size_t i) { return system.points.id[i] == 0; }) == 1);
    CHECK(system.points.size() == 8);
    CHECK(springs.size() == net.links.size() - 3);
    CHECK(system.constraints.size() == net.links.size() - 3);
    CHECK(system.facets.size() == net.facets.size() - 2);
    CHECK(system.points.place(1) == 0);
    CHECK_THROWS_AS(system.points.place(0), parameter_error);
    // Every spring still has the two ends of its length.
    for (std::size_t e = 0; e < springs.size(); ++e) {
        const auto [a, b] = springs.corners(e);
        CHECK(norm(system.points.position[b] - system.points.position[a]) == Approx(springs.element(e).rest));
    }
    system.points.end[3] = 0.1;
    system.step(0.05);
    CHECK(system.points.size() == 8);
    system.step(0.05);
    CHECK(system.points.size() == 7);
}

}  // namespace forces_tests
