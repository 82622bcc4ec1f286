// quick: no
// sanitized: -O1
/// \file F-bar in implicit and quasi-static steps.
#include "support/implicit.hpp"
#include <firn/implicit.hpp>

namespace implicit_f_bar_tests {
using namespace firn;
using namespace implicit_steps;

template <int D, class Force = WeightGradientForce, class M>
auto block_of(const M& material, double strain, double dt = 1) {
    return Block<QuadraticBSpline, Force, M, D, FBarOfStep>(material, strain, 4, 5.3, dt);
}

TEMPLATE_TEST_CASE_SIG("Gradient and Hessian with averaged volume changes", "[implicit]", ((int D), D), 2, 3) {
    const auto check = [](auto block, double displacement) { check_block(block, displacement); };
    check(block_of<D>(FixedCorotated<double>::from_young_poisson(1e5, 0.45), 0.1), 0.1);
    check(block_of<D, MlsForce>(Hencky<double>::from_young_poisson(1e5, 0.3), 0.05), 0.05);
    check(block_of<D>(VonMises<double>::from_properties({.young = 1e5, .poisson = 0.45, .yield_stress = 1e3}), 0.02),
          0.02);
    check(block_of<D>(Sand<double>::from_properties({.young = 1e5}), 0.01), 0.01);
    check(block_of<D>(Fluid<double>::from_properties({.bulk = 1e5, .viscosity = 10}), 0.05, 0.01), 0.01);
    // Where nothing is strained and moduli are the same, the average leaves the Hessian symmetric.
    auto block = block_of<D>(FixedCorotated<double>::from_young_poisson(1e5, 0.45), 0);
    const Eigen::MatrixXd K = block.hessian(Numbers::Zero(block.size()));
    CHECK((K - K.transpose()).norm() <= 1e-13 * K.norm());
    auto strained = block_of<D>(FixedCorotated<double>::from_young_poisson(1e5, 0.45), 0.1);
    const Eigen::MatrixXd other = strained.hessian(Numbers::Zero(strained.size()));
    CHECK((other - other.transpose()).norm() > 1e-3 * other.norm());
}

TEMPLATE_TEST_CASE_SIG("A step has the average volume ratio and the particle's shape; short ones are FBar's",
                       "[implicit]", ((class S, int D), S, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    test_support::Random random(3);
    const auto size_of = [](const Mat<double, D>& M) { return std::sqrt(squared_norm(M)); };
    for (const double size : {1e-4, 1e-2, 0.2}) {
        const Mat<double, D> gradient = random.gaussian<D>() * size;
        const double average = size, dt = 0.5;
        const Mat<double, D> got =
            cast<double>(FBarOfStep::velocity_gradient(cast<S>(gradient * (1 / dt)), S(average / dt), S(dt))) * dt;
        const Mat<double, D> I = Mat<double, D>::identity();
        CAPTURE(size);
        // Rounding is that of numbers of the size of the strain, not of 1.
        const double rounding = 16 * size * double(std::numeric_limits<S>::epsilon());
        CHECK(std::abs(volume_change(DeformationGradient<double, D>::from_displacement(got)) - average) <= rounding);
        const double change = volume_change(DeformationGradient<double, D>::from_displacement(gradient)),
                     stretch = std::expm1((std::log1p(average) - std::log1p(change)) / D);
        CHECK(size_of(got - (gradient * (1 + stretch) + I * stretch)) <= rounding);
        CHECK(size_of(got - FBar::velocity_gradient(gradient, average)) <= 10 * size * size + rounding);
    }
}

/// A block of 8 × 8 cells, ν = 0.49, that sticks to a floor.
template <class... Policies>
auto block_on_floor(const Policies&... policies) {
    const double h = 0.125;
    const Domain<2> domain({-4 * h, -4 * h}, {1 + 4 * h, 1 + 8 * h}, h);
    auto walls = Walls<double, 2>::all({-4 * h, 0}, {1 + 4 * h, 1 + 8 * h}, {Contact::none, 0});
    walls.at_lower[1].contact = Contact::stick;
    Simulation simulation(domain, FixedCorotated<double>::from_young_poisson(5e6, 0.49), walls, policies...);
    simulation.warn = {};
    simulation.add(sample_box<2>({0, 0}, {1, 1}, {.spacing = h / 2}), 1000);
    return simulation;
}
template <class Simulation>
std::vector<Vec<double, 2>> places(const Simulation& simulation) {
    std::vector<Vec<double, 2>> of(simulation.particles().size());
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
        if (simulation.particles().is_particle(slot))
            of[simulation.particles().id(slot)] = simulation.particles().exact_position(slot);
    return of;
}
/// The largest distance between two lists of places.
double apart(const std::vector<Vec<double, 2>>& a, const std::vector<Vec<double, 2>>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, norm(a[i] - b[i]));
    return largest;
}

TEST_CASE("A load step with averages ends where explicit steps with FBar come to rest", "[implicit]") {
    auto at_rest = block_on_floor(FBar{}, WeightGradientForce{});
    const auto before = places(at_rest);
    const double period = 4 * std::sqrt(1000 * 3 / 5e6);  // of shear
    at_rest.advance(4 * period, Damped<double, 2>{{{0.0, -9.81}}, 4 / period});
    const auto expected = places(at_rest);
    const double way = apart(before, expected);
    const auto after_load = [&](const auto& volume) {
        auto simulation = block_on_floor(volume, WeightGradientForce{}, QuasiStatic{});
        simulation.integration.newton.tolerance = 1e-8;
        simulation.integration.small_nodes.threshold = 0;  // explicit steps know no small nodes
        simulation.advance(1);
        CHECK(simulation.solution.halvings == 0);
        return apart(expected, places(simulation));
    };
    // Strains are 2e-3; without averages, matter locks.
    CHECK(after_load(FBar{}) < 4e-3 * way);
    CHECK(after_load(OwnVolume{}) > 4e-2 * way);
}

TEST_CASE("Half-solved Newton steps cost less than restarts of GMRES", "[implicit]") {
    const double h = 1.0 / 16;
    Simulation simulation(Domain<2>({-1, -4 * h}, {2, 2}, h), NeoHookean<double>::from_young_poisson(1e6, 0.4999),
                          Walls<double, 2>::all({-1, 0}, {2, 2}, {Contact::stick}), WeightGradientForce{},
                          QuasiStatic{}, FBar{});
    simulation.warn = {};
    simulation.add(sample_box<2>({0, 0}, {1, 1}, {.spacing = h / 2}), 1000);
    simulation.advance(1);
    CHECK(simulation.solution.halvings == 0);
    CHECK(simulation.solution.products <= 700);  // 550; with up to 500 products a solve 1025
}

TEST_CASE("A short implicit step with averages is an explicit one; all threads have the same bits", "[implicit]") {
    const auto run = [](const auto& time, double dt, int threads) {
        auto simulation = block_on_floor(FBar{}, Flip<double>{1.0}, WeightGradientForce{}, time);
        simulation.execution.threads = threads;
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            const auto x = particles.exact_position(slot);
            if (particles.is_particle(slot)) particles.set_velocity(slot, {0.3 * x[1], 0.2 * x[0] * x[1]});
        }
        // The first step strains matter without forces; the second one begins with these.
        for (int k = 0; k < 2; ++k) {
            simulation.fixed_time_step = dt;
            simulation.step();
        }
        return simulation;
    };
    const auto difference = [&](double dt) {
        auto explicitly = run(Explicit{}, dt, 1);
        Implicit time;
        time.newton.tolerance = 1e-10;
        time.small_nodes.threshold = 0;
        auto implicitly = run(time, dt, 1);
        return apart(places(explicitly), places(implicitly)) / (dt * dt);
    };
    // Backward Euler differs by forces at the end in place of the start of a step: by O(dt³) in positions.
    const double coarse = difference(2e-5), fine = difference(1e-5);
    CHECK(fine < 0.6 * coarse);
    CHECK(fine > 0.4 * coarse);

    const auto one = run(Implicit{}, 1e-3, 1);
    for (const int threads : {2, 3}) CHECK(places(one) == places(run(Implicit{}, 1e-3, threads)));
}

}  // namespace implicit_f_bar_tests
