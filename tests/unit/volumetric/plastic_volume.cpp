// quick: no
/// \file PlasticVolume: what a particle tells of its plastic flow, what FBar then averages, pressures in flow that
/// dilates at different rates within a cell, the same bits on two threads.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace plastic_volume_tests {
using namespace firn;

/// A boundary: all nodes move with given velocities.
struct Prescribed {
    using V = Vec<double, 2>;
    double expansion = 0;         ///< v = expansion · x [1/s], and
    double shear = 0, slope = 0;  ///< v = (1, slope) u, where du/dy = shear · (1 + sin(2π y/λ)) [1/s]
    double wavelength = 1;        ///< λ [m]

    static constexpr const char* name = "prescribed";
    static constexpr auto parameters() {
        return std::tuple{parameter{"expansion", "1/s", &Prescribed::expansion},
                          parameter{"shear", "1/s", &Prescribed::shear}, parameter{"slope", "1", &Prescribed::slope},
                          parameter{"wavelength", "m", &Prescribed::wavelength}};
    }
    template <scalar S>
    Vec<S, 2> velocity(const Vec<S, 2>& x, const Vec<S, 2>&) const {
        const S wave = S(2 * std::numbers::pi / wavelength);
        const S u = S(shear) * (x[1] - cos(wave * x[1]) * (S(1) / wave));
        return Vec<S, 2>{S(expansion) * x[0] + u, S(expansion) * x[1] + S(slope) * u};
    }
    bool reaches(const V&, const V&) const { return true; }
};

namespace {

using Soil = MohrCoulomb<double>;
constexpr double cohesion = 1e4;

/// Associated soil.
Soil soil_of(double strength, Angle friction) {
    return Soil::from_properties(
        {.young = 1e9, .poisson = 0.3, .cohesion = strength, .friction_angle = friction, .dilatancy_angle = friction});
}

constexpr double h = 0.125;

template <class M>
auto block(const M& material, const Prescribed& motion, int threads = 1) {
    SimulationWith<2, M, FBar, Prescribed> simulation({{0.0, 0.0}, {2.0, 3.0}, h}, material);
    simulation.boundary = motion;
    simulation.gravity = {0.0, 0.0};
    simulation.execution.threads = threads;
    simulation.warn = {};
    simulation.add(sample_box<2>({0.5, 0.5}, {1.5, 2.5}, {.spacing = h / 2}), 1000);
    simulation.fixed_time_step = 1e-5;
    return simulation;
}
template <class Simulation, class F>
void for_particles(const Simulation& simulation, const F& f) {
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) f(particles.exact_position(slot), particles.state(slot));
}
/// Whether a place is two cells or more inside the block, so that all averages around it are of full cells.
bool is_inside(const Vec<double, 2>& x) { return x[0] > 0.8 && x[0] < 1.2 && x[1] > 0.8 && x[1] < 2.2; }

/// The largest difference of the pressures of two particles inside [Pa], after a shear of 0.004, on average.
template <class M>
double scatter_of_pressure(const M& material, const Prescribed& motion) {
    auto simulation = block(material, motion);
    for (int i = 0; i < 400; ++i) simulation.step();
    double least = 1e300, most = -1e300;
    for_particles(simulation, [&](const auto& x, const auto& state) {
        if (!is_inside(x)) return;
        const double pressure = -0.5 * trace(kirchhoff_stress(material, state));
        least = std::min(least, pressure), most = std::max(most, pressure);
    });
    return most - least;
}

}  // namespace

TEST_CASE("A particle in PlasticVolume tells at which rate plastic flow changes its volume") {
    const Angle friction = degrees(20);
    const PlasticVolume<Soil> soil{soil_of(cohesion, friction)};
    const double sine = std::sin(friction.in_radians()), rate = 2, dt = 1e-6;
    auto state = soil.initial_state<3>();
    // Along the flow of the face between two edges, (1 + sin ψ, 0, −1 + sin ψ), all of it becomes plastic at last.
    const auto flow = Mat<double, 3>::rows((sine + 1) * rate, 0, 0, 0, 0, 0, 0, 0, (sine - 1) * rate);
    state = updated(soil, state, flow, dt);
    CHECK(state.plastic_volume_rate == Approx(0).margin(1e-9));  // elastic yet
    for (int i = 0; i < 200; ++i) {
        const auto before = state;
        state = updated(soil, state, flow, dt);
        const Mat<double, 3> F = state.F, F0 = before.F;
        const double given = determinant(Mat<double, 3>::identity() + flow * dt);
        CHECK(state.plastic_volume_rate == Approx((1 - determinant(F) / (determinant(F0) * given)) / dt).margin(1e-8));
    }
    CHECK(state.plastic_volume_rate == Approx(2 * sine * rate).epsilon(1e-5));
    // The stress and the state of one call are those of the two.
    const auto both = updated_with_stress(soil, state, flow, dt);
    CHECK(both.state.plastic_volume_rate == updated(soil, state, flow, dt).plastic_volume_rate);
    CHECK(both.stress(0, 0) == kirchhoff_stress(soil, both.state)(0, 0));
}

TEST_CASE("FBar averages the rates of volume change less those of plastic flow, and gives these back") {
    // No flow: the soil is too strong. Columns of particles have plastic rates b + a and b − a from before, which a
    // uniform lattice averages to b. All expand at 2 k, so a particle is given 2 k − b + (b ± a).
    const double k = 3, a = 0.7, b = 0.4;
    auto simulation = block(PlasticVolume<Soil>{soil_of(1e12, degrees(20))}, {.expansion = k});
    const auto sign = [](const auto& x) { return std::lround(x[0] / (h / 2) - 0.5) % 2 == 0 ? 1.0 : -1.0; };
    simulation.set_states(simulation.bodies()[0],
                          [&](const auto& x, auto& state) { state.plastic_volume_rate = b + a * sign(x); });
    simulation.step();
    int inside = 0;
    const double dt = 1e-5;
    for_particles(simulation, [&](const auto& x, const auto& state) {
        if (!is_inside(x)) return;
        ++inside;
        const double given = ((Mat<double, 2>(state.F)(0, 0) - 1) + (Mat<double, 2>(state.F)(1, 1) - 1)) / dt;
        CHECK(given == Approx(2 * k + a * sign(x)).epsilon(1e-8));
        CHECK(state.plastic_volume_rate == Approx(0).margin(1e-8));
    });
    CHECK(inside > 100);
}

TEST_CASE("Soil that dilates at different rates within a cell keeps an even pressure with PlasticVolume and FBar") {
    // Shear of soil between planes y = const: it rises with tan ψ times the shear rate, so the motion that is
    // prescribed is one of plastic flow, and pressures should stay near c cot φ. The rates vary over two cells.
    const Angle friction = degrees(20);
    const Prescribed motion{.shear = 1, .slope = std::tan(friction.in_radians()), .wavelength = 2 * h};
    const Soil soil = soil_of(cohesion, friction);
    const double alone = scatter_of_pressure(soil, motion),
                 with = scatter_of_pressure(PlasticVolume<Soil>{soil}, motion);
    CAPTURE(alone, with);
    CHECK(alone > 5 * cohesion);
    CHECK(with < cohesion);
}

TEST_CASE("A simulation with FBar warns of soil that dilates, once, unless PlasticVolume is there") {
    const auto warnings = [](const auto& material) {
        auto simulation = block(material, {});
        std::vector<std::string> all;
        simulation.warn = [&](const std::string& text) { all.push_back(text); };
        for (int i = 0; i < 3; ++i) simulation.step();
        return std::ranges::count_if(all, [](const auto& text) { return text.find("PlasticVolume") < text.size(); });
    };
    const Soil dilating = soil_of(cohesion, degrees(20));
    CHECK(warnings(dilating) == 1);
    CHECK(warnings(PlasticVolume<Soil>{dilating}) == 0);
    CHECK(warnings(soil_of(cohesion, degrees(0))) == 0);
}

TEST_CASE("A simulation of PlasticVolume with FBar has the same bits on two threads") {
    const Prescribed motion{.shear = 1, .slope = 0.36, .wavelength = 2 * h};
    const PlasticVolume<Soil> soil{soil_of(cohesion, degrees(20))};
    auto one = block(soil, motion, 1), two = block(soil, motion, 2);
    for (int i = 0; i < 20; ++i) one.step(), two.step();
    std::vector<double> of_one, of_two;
    const auto list = [](auto& all) {
        return [&all](const auto& x, const auto& state) {
            all.insert(all.end(), {x[0], x[1], state.plastic_volume_rate});
            const Mat<double, 2> F = state.F;
            all.insert(all.end(), {F(0, 0), F(0, 1), F(1, 0), F(1, 1)});
        };
    };
    for_particles(one, list(of_one));
    for_particles(two, list(of_two));
    CHECK(of_one == of_two);
    CHECK(std::ranges::any_of(of_one, [](double x) { return std::abs(x) > 0.1 && std::abs(x) < 0.5; }));
}

}  // namespace plastic_volume_tests
