// quick: no
// sanitized: -O1
/// \file GMRES, against dense matrices.
#include "support/implicit_step.hpp"
#include <firn/implicit/gmres.hpp>

namespace implicit_gmres_tests {
using namespace firn;
using namespace implicit_steps;

/// Sand that is pressed and sheared until it flows: its Hessian is not symmetric.
template <class Force, int D>
struct Flowing {
    using Scene = Block<QuadraticBSpline, Force, Sand<double>, D>;
    static constexpr GmresLayers layers{3, 4, 5};

    Scene block;
    Step<Scene> step;
    Numbers u;
    explicit Flowing(int n, int threads = 1)
        : block(Sand<double>::from_properties({.young = 1e5, .friction_angle = degrees(25)}), 0, n, 6.1),
          step(block, 0, Floor::trough, threads),
          u(block.random_displacement(0.002, 5)) {
        for (const auto& [index, number] : block.nodes) {
            const double y = block.domain.cell_size * (index[1] - 6);
            u[D * number] += 0.03 * y;
            u[D * number + 1] -= 0.02 * y;
        }
        block.put(u, Scene::of_u);
    }
    /// Solves for the displacement by which forces are balanced. Returns it, and the report.
    auto solve(const Numbers& forces, const GmresLimits& limits) {
        auto potential = block.potential(step.threads);
        REQUIRE(potential.displace(Scene::of_u).is_regular());
        StepProblem problem(potential, *step.small, *step.constraints, Scene::of_v, step.inertia);
        const auto vectors = problem.vectors();
        vectors.make(layers.residual);
        block.put(forces, layers.residual);
        problem.to_forces(layers.residual);
        JacobiPreconditioner<double, D> jacobi;
        jacobi.renew(problem);
        const SolverReport report =
            gmres(problem, [&](std::size_t z, std::size_t r) { jacobi.apply(problem, z, r); }, layers, limits);
        vectors.copy(0, layers.solution);
        return std::pair{block.get(), report};
    }
    /// The displacements that the unknowns allow, a column for each number of the nodes that particles reach.
    Eigen::MatrixXd displacements() {
        Eigen::MatrixXd all(block.size(), block.size());
        for (int i = 0; i < block.size(); ++i) all.col(i) = step.allowed(i);
        return all;
    }
};

TEMPLATE_TEST_CASE_SIG("GMRES solves what a dense solver solves", "[implicit]", ((int D, class Force), D, Force),
                       (2, WeightGradientForce), (3, MlsForce)) {
    Flowing<Force, D> sand(D == 2 ? 8 : 4);
    const Numbers forces = sand.block.random_numbers(1, 8);
    const auto [x, report] = sand.solve(forces, {.tolerance = 1e-14, .restart = 400});
    CAPTURE(report.iterations, report.residual);
    CHECK(report.has_converged);
    CHECK(report.iterations > 5);

    const Eigen::MatrixXd T = sand.displacements(), K = sand.block.hessian(sand.u), A = T.transpose() * K * T;
    CHECK((A - A.transpose()).norm() > 0.05 * A.norm());
    const Numbers right = T.transpose() * forces, y = A.completeOrthogonalDecomposition().solve(right);
    CHECK((T * y - x).norm() <= 1e-10 * x.norm());
    CHECK((A * y - right).norm() <= 1e-10 * right.norm());

    // The same solution with restarts, which take more products.
    const auto [restarted, of_restarted] = sand.solve(forces, {.tolerance = 1e-14, .restart = 12});
    CAPTURE(of_restarted.iterations, of_restarted.residual);
    CHECK(of_restarted.has_converged);
    CHECK(of_restarted.iterations > report.iterations);
    CHECK((restarted - x).norm() <= 1e-10 * x.norm());
}

TEST_CASE("GMRES reports the residual that is left, also where it stops before", "[implicit]") {
    Flowing<WeightGradientForce, 2> sand(8);
    const Numbers forces = sand.block.random_numbers(1, 8);
    const Eigen::MatrixXd T = sand.displacements(), K = sand.block.hessian(sand.u);
    const auto residual = [&](const Numbers& x) {
        return (T.transpose() * (forces - K * x)).norm() / (T.transpose() * forces).norm();
    };
    double last = 1;
    for (const int iterations : {1, 5, 13, 40}) {
        const auto [x, report] = sand.solve(forces, {.iterations = iterations, .restart = 6});
        CHECK(!report.has_converged);
        CHECK(report.iterations == iterations);
        CHECK(report.residual < last);
        CHECK(report.residual == Approx(residual(x)).epsilon(1e-8));
        last = report.residual;
    }
    const auto [x, report] = sand.solve(forces, {.tolerance = 1e-3});
    CHECK(report.has_converged);
    CHECK(report.residual <= 1e-3);
    CHECK(report.residual == Approx(residual(x)).epsilon(1e-8));
    const auto [zero, of_zero] = sand.solve(Numbers::Zero(sand.block.size()), {});
    CHECK(of_zero.has_converged);
    CHECK(of_zero.iterations == 0);
    CHECK(zero.norm() == 0);
}

TEST_CASE("GMRES has the same bits for any number of threads", "[implicit]") {
    Numbers expected;
    SolverReport of_one;
    for (const int threads : {1, 2, 3}) {
        Flowing<WeightGradientForce, 2> sand(36, threads);
        const auto [x, report] = sand.solve(sand.block.random_numbers(1, 8), {.iterations = 15, .restart = 6});
        if (threads == 1) expected = x, of_one = report;
        CHECK(report.iterations == 15);
        CHECK(x.norm() > 0);
        CHECK(x == expected);
        CHECK(report.residual == of_one.residual);
    }
}

}  // namespace implicit_gmres_tests
