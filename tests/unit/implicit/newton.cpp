// quick: no
// sanitized: -O1
/// \file Newton's method for one step: equilibrium by definition, quadratic convergence, backward Euler.
#include "support/implicit_step.hpp"

namespace implicit_newton_tests {
using namespace firn;
using namespace implicit_steps;

template <int D, class M = NeoHookean<double>, class Force = WeightGradientForce>
auto soft_block(int n) {
    using Scene = Block<QuadraticBSpline, Force, M, D>;
    return Scene(M::from_young_poisson(1e5, 0.3), 0, n, 6.1);
}

TEMPLATE_TEST_CASE_SIG("A block sinks under its weight: Newton converges quadratically to equilibrium", "[implicit]",
                       ((int D, class M, class Force), D, M, Force), (2, NeoHookean<double>, WeightGradientForce),
                       (2, FixedCorotated<double>, MlsForce), (3, Hencky<double>, MlsForce)) {
    auto block = soft_block<D, M, Force>(D == 2 ? 10 : 4);
    Step step(block, D == 2 ? 20 : 60);
    const auto [u, report] = step.solve({.tolerance = 1e-11, .forcing = 1e-12});
    CAPTURE(report.residuals);
    CHECK(report.has_converged);
    CHECK(report.negative == 0);
    CHECK(report.cuts == 0);
    CHECK(report.steps() <= 7);
    CHECK(step.imbalance(u) < 1e-9);
    CHECK(u.template lpNorm<Eigen::Infinity>() > 0.1 * block.domain.cell_size);
    CHECK(std::isfinite(report.last.energy));
    const auto& r = report.residuals;
    for (std::size_t k = 1; k + 1 < r.size(); ++k)
        if (r[k] < 1e-2) CHECK(r[k + 1] < 30 * r[k] * r[k] + 1e-11);
}

TEST_CASE("Inexact steps find the same equilibrium, with the same bits for any number of threads", "[implicit]") {
    auto block = soft_block<2>(24);
    const auto [exact, of_exact] = Step(block, 5).solve({.tolerance = 1e-10, .forcing = 1e-12});
    CHECK(of_exact.has_converged);
    Numbers expected;
    for (const int threads : {1, 2, 3}) {
        const auto [u, report] = Step(block, 5, Floor::stick, threads).solve({});
        CHECK(report.has_converged);
        CHECK(report.products < of_exact.products);
        CHECK((u - exact).norm() < 3e-3 * exact.norm());
        if (threads == 1) expected = u;
        CHECK(u == expected);
    }
}

TEST_CASE("Backward Euler: free fall is exact, and a floor brakes it", "[implicit]") {
    auto block = soft_block<2>(10);
    const double dt = 0.02;
    const Vec<double, 2> v{0.3, -0.5};
    {
        Step step(block, 10, Floor::none);
        step.set_inertia(dt, v);
        const auto [u, report] = step.solve({.tolerance = 1e-10, .forcing = 1e-12});
        CHECK(report.has_converged);
        for (int i = 0; i < u.size(); ++i)
            CHECK(std::abs(u[i] - (dt * v[i % 2] - (i % 2 == 1 ? 10 * dt * dt : 0))) < 1e-9);
    }
    Step step(block, 10);
    step.set_inertia(dt, v);
    const auto [u, report] = step.solve({.tolerance = 1e-10, .forcing = 1e-12});
    CHECK(report.has_converged);
    CHECK(step.imbalance(u) < 1e-8);
}

TEST_CASE("A load that matter cannot bear ends in a report, not in NaN", "[implicit]") {
    auto block = soft_block<2>(10);
    Step step(block, 1e5);
    const auto [u, report] = step.solve({.iterations = 8});
    CHECK(!report.has_converged);
    CHECK(report.end != NewtonEnd::converged);
    CHECK(u.allFinite());
    for (const double residual : report.residuals) CHECK(std::isfinite(residual));
    CHECK(report.worst == step.worst(u));
}

TEST_CASE("A report says why Newton's method has ended, and where it is worst out of balance", "[implicit]") {
    auto block = soft_block<2>(10);
    Step step(block, 20);
    const auto [u, report] = step.solve({.iterations = 1});
    CHECK(!report.has_converged);
    CHECK(report.end == NewtonEnd::too_many_steps);
    CHECK(report.worst == step.worst(u));
    const auto [v, converged] = step.solve({});
    CHECK(converged.end == NewtonEnd::converged);
    CHECK(converged.worst == step.worst(v));
    // Two cells of motion turn particles at the floor inside out.
    step.set_inertia(0.1, {0, -3});
    const auto [w, inverted] = step.solve({});
    CHECK(inverted.end == NewtonEnd::inverted_at_start);
    CHECK(!inverted.has_converged);
    CHECK(inverted.last.inverted > 0);
    CHECK(inverted.worst.empty());
}

TEST_CASE("Negative curvature: a step goes on to the radius, and the second one ends the search", "[implicit]") {
    // Matter that is pressed to a third of its height buckles.
    auto block = soft_block<2>(10);
    for (auto& p : block.of) {
        p.state.F = DeformationGradient<double, 2>(Mat<double, 2>::rows(1.0, 0.0, 0.0, 0.3));
        block.particles.set_state(p.slot, p.state);
    }
    Step step(block, 10);
    const double h = block.domain.cell_size;
    const auto largest = [&](const Numbers& u) {
        double motion = 0;
        for (int i = 0; i < u.size(); i += 2) motion = std::max(motion, u.segment<2>(i).norm());
        return motion;
    };
    for (const double radius : {0.03, 0.1}) {
        const auto [u, report] = step.solve({.iterations = 1, .radius = radius});
        CHECK(report.negative == 1);
        CHECK(report.cuts == 0);
        CHECK(largest(u) == Approx(radius * h).epsilon(1e-9));
    }
    const auto [u, report] = step.solve({.radius = 0.1, .negative = 2});
    CHECK(!report.has_converged);
    CHECK(report.end == NewtonEnd::negative_curvature);
    CHECK(report.negative == 2);
    CHECK(report.worst == step.worst(u));
    const auto [v, of_more] = step.solve({.iterations = 5, .radius = 0.1, .negative = 100});
    CHECK(of_more.negative > 2);
    CHECK(of_more.last.energy < report.last.energy);
}

TEST_CASE("A step is continued along a direction to a radius, or shortened to it", "[implicit]") {
    auto block = soft_block<2>(10);
    Step step(block, 10);
    auto potential = block.potential();
    StepProblem problem(potential, *step.small, *step.constraints, step.loads, step.inertia);
    const auto vectors = problem.vectors();
    constexpr SolverLayers layers{6, 7, 8, 9};
    const auto put = [&](std::size_t layer, std::uint64_t seed, double size) {
        vectors.make(layer);
        block.put(block.random_displacement(size, seed), layer);
        problem.to_displacement(layer);
        vectors.copy(0, layer);
        return block.get();
    };
    const double h = block.domain.cell_size;
    for (const double radius : {0.7 * h, 0.01 * h}) {
        const Numbers x = put(layers.solution, 5, 0.2), p = put(layers.direction, 6, 3);
        detail::step_to_radius(problem, layers, radius);
        CHECK(detail::largest_motion(vectors, layers.solution).second == Approx(radius).epsilon(1e-12));
        vectors.copy(0, layers.solution);
        const Numbers change = block.get() - x, along = radius > 0.1 * h ? p : -x;
        CHECK(change.dot(along) == Approx(change.norm() * along.norm()).epsilon(1e-12));
    }
}

/// A problem whose gradient has the size f(x), where x is one number of the displacement; x < 0 inverts a particle.
template <class F>
struct Scripted {
    using scalar_type = double;
    NodeVectors<double, 2> of;
    F f;

    const NodeVectors<double, 2>& vectors() const { return of; }
    DisplacementReport displace(std::size_t u) const { return {.inverted = of.numbers(u)[0] < 0}; }
    double gradient(std::size_t u) const {
        of.fill(0, 0);
        of.numbers(0)[0] = f(of.numbers(u)[0]);
        return 1;
    }
};

TEST_CASE("A line search on the gradient takes the first that is small enough, else the smallest", "[implicit]") {
    auto block = soft_block<2>(4);
    const NodeVectors<double, 2> vectors(block.grid, 1);
    const NewtonLayers layers{3, {4, 5, 6, 7}, 8};
    for (const std::size_t k : {layers.displacement, layers.solver.solution, layers.trial}) vectors.make(k);
    struct Found {
        bool is_accepted;
        double x, gradient;
        int cuts;
    };
    // From x = 2 by a step of 1.
    const auto search = [&](const auto& f, double step = 1) {
        Scripted<std::remove_cvref_t<decltype(f)>> problem{vectors, f};
        vectors.numbers(layers.displacement)[0] = 2;
        vectors.numbers(layers.solver.solution)[0] = step;
        const NewtonLimits limits{.cuts = 5};  // the search refers to it
        detail::LineSearch<decltype(problem)> line(problem, layers, limits);
        const bool is_accepted = line.run(10);
        return Found{is_accepted, vectors.numbers(layers.trial)[0], vectors.numbers(0)[0], line.cuts};
    };
    const Found whole = search([](double) { return 9.0; });
    CHECK((whole.is_accepted && whole.x == 3 && whole.gradient == 9 && whole.cuts == 0));
    const Found quarter = search([](double x) { return x > 2.3 ? 11.0 : 9.5; });
    CHECK((quarter.is_accepted && quarter.x == 2.25 && quarter.gradient == 9.5 && quarter.cuts == 2));
    const Found least = search([](double x) { return x == 2.5 ? 9.9999 : 9.99999; });
    CHECK((least.is_accepted && least.x == 2.5 && least.gradient == 9.9999));
    const Found inverted = search([](double) { return 9.0; }, -9);
    CHECK((inverted.is_accepted && inverted.x == 2 - 9. / 8 && inverted.cuts == 3));
    CHECK(!search([](double) { return 10.0; }).is_accepted);
    CHECK(!search([](double) { return std::nan(""); }).is_accepted);
}

TEST_CASE("Floats converge, too", "[implicit]") {
    Block<QuadraticBSpline, MlsForce, NeoHookean<float>, 3> block(NeoHookean<float>::from_young_poisson(1e5, 0.3), 0, 4,
                                                                  6.1);
    const auto [u, report] = Step(block, 20).solve({});
    CHECK(report.has_converged);
    CHECK(u.norm() > 0);
}

}  // namespace implicit_newton_tests
