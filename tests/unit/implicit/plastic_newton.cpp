// quick: no
// sanitized: -O1
/// \file Newton's method for matter without a potential: sand, metal, clay, snow and fluids.
#include "support/implicit_step.hpp"

namespace implicit_plastic_newton_tests {
using namespace firn;
using namespace implicit_steps;

constexpr NewtonLimits exact{.tolerance = 1e-11, .forcing = 1e-8, .restarts = 9};

template <int D, class Force = WeightGradientForce, class M>
auto block_of(const M& material, int n = D == 2 ? 10 : 4, double strain = 0, double dt = 1) {
    return Block<QuadraticBSpline, Force, M, D>(material, strain, n, 6.1, dt);
}
/// Which particles of a block flow in a step.
template <class Block>
std::vector<bool> flowing(const Block& block, const Numbers& u) {
    std::vector<bool> all;
    for (const auto& p : block.of) {
        const auto trial = followed(p.state, block.gradient_at(p, u), 1.0);
        all.push_back(squared_norm(returned_by(block.material, trial).F - trial.F) > 1e-24);
    }
    return all;
}
template <class Block>
auto count_flowing(const Block& block, const Numbers& u) {
    const auto all = flowing(block, u);
    return std::count(all.begin(), all.end(), true);
}
/// The largest excess(‖dev τ‖, tr τ, plastic strain) [Pa] of the particles of a block after a step.
template <class Block, class Excess>
double largest_excess(const Block& block, const Numbers& u, const Excess& excess) {
    constexpr int D = Block::D;
    double largest = -1e30;
    for (const auto& p : block.of) {
        const auto after = updated(block.material, p.state, block.gradient_at(p, u), 1.0);
        const Mat<double, D> stress = kirchhoff_stress(block.material, after);
        const Mat<double, D> deviator = stress - Mat<double, D>::diagonal(trace(stress) / D);
        largest = std::max(largest, excess(std::sqrt(squared_norm(deviator)), trace(stress), after.plastic_strain));
    }
    return largest;
}
/// Checks that steps converge quadratically once the same particles flow in them.
template <class Step>
void check_quadratic(Step& step, const NewtonReport& report) {
    const auto& r = report.residuals;
    int checked = 0;
    std::vector<bool> last;
    for (int k = std::max(report.steps() - 3, 1); k < report.steps(); ++k) {
        NewtonLimits limits = exact;
        limits.iterations = k;
        const auto [u, of_less] = step.solve(limits);
        CHECK(of_less.end == NewtonEnd::too_many_steps);
        const auto now = flowing(step.block, u);
        if (now == last && r[std::size_t(k)] < 1e-2) {
            CHECK(r[std::size_t(k) + 1] < 40 * r[std::size_t(k)] * r[std::size_t(k)] + 1e-11);
            ++checked;
        }
        last = now;
    }
    CHECK(checked > 0);
}

TEMPLATE_TEST_CASE_SIG("Sand between smooth walls yields under its weight", "[implicit]",
                       ((int D, class Force), D, Force), (2, WeightGradientForce), (3, MlsForce)) {
    const auto sand = Sand<double>::from_properties({.young = 1e5, .poisson = 0.2, .friction_angle = degrees(30)});
    auto block = block_of<D, Force>(sand);
    const double gravity = GENERATE(1., 10., 30.);
    Step step(block, gravity, Floor::trough);
    const auto [u, report] = step.solve(exact);
    CAPTURE(report.residuals);
    CHECK(report.has_converged);
    CHECK(report.end == NewtonEnd::converged);
    CHECK(report.steps() <= 8);
    CHECK(std::isnan(report.last.energy));
    CHECK(step.imbalance(u) < 1e-9);
    CHECK(count_flowing(block, u) > int(block.of.size()) * 3 / 4);
    const double slope = friction_slope<D>(std::sin(sand.friction_angle));
    const auto beyond = [&](double shear, double trace, double) { return shear + slope * trace; };
    CHECK(largest_excess(block, u, beyond) < 1e-12 * sand.mu);
    // Without flow it would be far outside of the cone.
    auto elastic = block_of<D, Force>(Hencky<double>::from_young_poisson(1e5, 0.2));
    CHECK(largest_excess(block, Step(elastic, gravity, Floor::trough).solve(exact).first, beyond) > 0);
    check_quadratic(step, report);
}

TEMPLATE_TEST_CASE_SIG("Metal is pressed beyond yield", "[implicit]", ((int D, class Force), D, Force),
                       (2, WeightGradientForce), (3, MlsForce)) {
    const auto metal =
        VonMises<double>::from_properties({.young = 1e5, .poisson = 0.3, .yield_stress = 2e3, .hardening = 2e4});
    auto block = block_of<D, Force>(metal);
    const auto beyond = [&](double shear, double, double plastic) {
        return shear - std::sqrt(2. / 3) * (metal.yield_stress + metal.hardening * plastic);
    };
    Step light(block, 3);
    const auto [within, of_light] = light.solve(exact);
    CHECK(of_light.has_converged);
    CHECK(count_flowing(block, within) == 0);
    CHECK(largest_excess(block, within, beyond) < 0);
    Step step(block, 30);
    const auto [u, report] = step.solve(exact);
    CAPTURE(report.residuals);
    CHECK(report.has_converged);
    CHECK(report.steps() <= 7);
    CHECK(step.imbalance(u) < 1e-9);
    CHECK(count_flowing(block, u) > int(block.of.size()) / 2);
    CHECK(std::abs(largest_excess(block, u, beyond)) < 1e-12 * metal.mu);
    check_quadratic(step, report);
}

TEST_CASE("Clay and snow find equilibrium in flow", "[implicit]") {
    const auto check = [](const auto& material, double gravity) {
        auto block = block_of<2>(material);
        Step step(block, gravity, Floor::trough);
        const auto [u, report] = step.solve(exact);
        CAPTURE(material.name, report.residuals);
        CHECK(report.has_converged);
        CHECK(step.imbalance(u) < 1e-9);
        CHECK(count_flowing(block, u) > 10);
        check_quadratic(step, report);
    };
    check(
        Nacc<double>::from_properties({.young = 1e5, .poisson = 0.2, .friction_angle = degrees(10), .cohesion = 0.05}),
        10);
    check(Nacc<double>::from_properties({.young = 1e5, .poisson = 0.2, .consolidation = 3e3}), 10);
    check(Snow<double>::from_properties({}), 30);
}

TEST_CASE("Fluids with inertia, with and without viscosity", "[implicit]") {
    const double viscosity = GENERATE(0., 10., 1000.), dt = 0.05;
    auto block = block_of<2>(Fluid<double>::from_properties({.bulk = 1e5, .viscosity = viscosity}), 10, 0.01, dt);
    Step step(block, 10, Floor::trough);
    step.set_inertia(dt, {0.3, -0.5});
    const auto [u, report] = step.solve(exact);
    CAPTURE(viscosity, report.residuals);
    CHECK(report.has_converged);
    CHECK(step.imbalance(u) < 1e-9);
    CHECK((u - step.free).norm() > 0.1 * u.norm());
    const auto& r = report.residuals;
    CHECK(r.end()[-1] < 40 * r.end()[-2] * r.end()[-2] + 1e-11);
}

TEST_CASE("Sand and an elastic solid share nodes", "[implicit]") {
    auto sand =
        block_of<2>(Sand<double>::from_properties({.young = 1e5, .poisson = 0.2, .friction_angle = degrees(30)}));
    auto solid = block_of<2>(NeoHookean<double>::from_young_poisson(3e4, 0.3));
    using Sand_ = decltype(sand);
    using Solid = decltype(solid);
    REQUIRE(sand.nodes == solid.nodes);
    Step step(sand, 10, Floor::trough);
    DisplacedSet<Sand_::Kernel, Sand_::Force, decltype(sand.particles.view()), Sand_::Material> first(sand.set(),
                                                                                                      sand.material);
    DisplacedSet<Solid::Kernel, Solid::Force, decltype(solid.particles.view()), Solid::Material> second(solid.set(),
                                                                                                        solid.material);
    const auto [u, report] = step.solve(exact, IncrementalPotential(sand.grid, 1, 1, first, second));
    CAPTURE(report.residuals);
    CHECK(report.has_converged);
    CHECK(step.imbalance(u, sand.gradient(u) + solid.gradient(u)) < 1e-9);
    CHECK(step.imbalance(u) > 0.1);
    CHECK(count_flowing(sand, u) > 50);
    const auto [alone, of_alone] = step.solve(exact);
    CHECK(of_alone.has_converged);
    CHECK(u.norm() < 0.9 * alone.norm());
}

TEST_CASE("Inexact steps in sand have the same bits for any number of threads", "[implicit]") {
    auto block =
        block_of<2>(Sand<double>::from_properties({.young = 1e5, .poisson = 0.2, .friction_angle = degrees(30)}), 24);
    Numbers expected;
    for (const int threads : {1, 2, 3}) {
        Step step(block, 5, Floor::trough, threads);
        const auto [u, report] = step.solve({.iterations = 2, .solver_iterations = 25, .restart = 10, .restarts = 2});
        CHECK(report.residuals.back() < 0.5 * report.residuals[0]);
        if (threads == 1) expected = u;
        CHECK(u == expected);
    }
}

TEST_CASE("Sand of floats converges, too", "[implicit]") {
    Block<QuadraticBSpline, MlsForce, Sand<float>, 3> block(
        Sand<float>::from_properties({.young = 1e5, .poisson = 0.2, .friction_angle = degrees(30)}), 0, 4, 6.1);
    const auto [u, report] = Step(block, 20, Floor::trough).solve({});
    CHECK(report.has_converged);
    CHECK(u.norm() > 0);
}

TEST_CASE("Sand that cannot stand ends in a report that names a node, not in NaN", "[implicit]") {
    auto block = block_of<2>(Sand<double>::from_properties({.young = 1e5, .friction_angle = degrees(30)}));
    Step step(block, 10);
    const auto [u, report] = step.solve({.iterations = 8});
    CHECK(!report.has_converged);
    CHECK((report.end == NewtonEnd::no_descent || report.end == NewtonEnd::too_many_steps));
    CHECK(u.allFinite());
    for (std::size_t k = 1; k < report.residuals.size(); ++k) CHECK(report.residuals[k] <= report.residuals[k - 1]);
    CHECK(report.worst == step.worst(u));
}

TEST_CASE("Matter without a potential needs layers for GMRES", "[implicit]") {
    auto block = block_of<2>(Sand<double>::from_properties({.young = 1e5}), 4);
    Step step(block, 10);
    step.layers.basis = 0;
    CHECK_THROWS_AS(step.solve({}), usage_error);
}

}  // namespace implicit_plastic_newton_tests
