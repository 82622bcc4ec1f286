// sanitized: -O1
/// \file Newton's method for one step: equilibrium by definition, quadratic convergence, backward Euler.
#include "support/implicit.hpp"
#include <firn/implicit/newton.hpp>

namespace implicit_newton_tests {
using namespace firn;
using namespace implicit_steps;

/// A block that stands on a floor, or flies.
template <class Scene>
struct Step {
    static constexpr int D = Scene::D;
    using S = typename Scene::S;
    static constexpr std::size_t u = 3, loads = 4, free_motion = 5;
    static constexpr NewtonLayers layers{u, {6, 7, 8, 9}, 10};

    Scene& block;
    int threads;
    bool stands;
    Numbers masses, weights, free = Numbers::Zero(block.size());
    std::optional<SmallNodes<S, D>> small;
    std::optional<NodeConstraints<S, D>> constraints;
    std::optional<NodalInertia<S>> inertia;

    Step(Scene& of, double gravity, bool on_floor = true, int workers = 1)
        : block(of), threads(workers), stands(on_floor) {
        const auto set = firn::detail::motion_of_set(block.set());
        const std::array sets{set};
        using View = std::remove_cvref_t<decltype(set.view)>;
        p2g<typename Scene::Kernel, Pic, NoForce>(Coloured{threads}, block.grid, 0, ParticleSets<View>(sets));
        const aligned_vector<S> of_nodes = masses_of_nodes(block.grid);
        masses = weights = Numbers::Zero(block.size());
        for (int i = 0; i < block.size(); ++i) {
            masses[i] = double(of_nodes[block.offsets[std::size_t(i / D)] / node_width]);
            if (i % D == 1) weights[i] = -gravity * masses[i];
        }
        scatter_volumes<typename Scene::Kernel>(block.grid, threads, ParticleSets<View>(sets));
        small.emplace(block.grid, SmallNodeRule{}, threads);
        auto walls = Walls<S, D>::all(Vec<double, D>::filled(stands ? 0.32 : -0.2), Vec<double, D>::filled(4.4),
                                      {Contact::slip, 0});
        if (stands) walls.at_lower[1].contact = Contact::stick;
        constraints.emplace(block.grid, walls, threads);
    }
    /// Backward Euler of dt, from the velocity v.
    void set_inertia(double dt, const Vec<double, D>& v) {
        NodalInertia<S> one{aligned_vector<S>(block.grid.block_count() * std::size_t(block_nodes<D>), S(0)), dt,
                            free_motion};
        for (int i = 0; i < block.size(); ++i) {
            one.masses[block.offsets[std::size_t(i / D)] / node_width] = S(masses[i]);
            free[i] = dt * v[i % D];
        }
        inertia = one;
    }
    auto solve(const NewtonLimits& limits) {
        auto potential = block.potential(threads);
        StepProblem problem(potential, *small, *constraints, loads, inertia);
        const auto vectors = problem.vectors();
        for (const std::size_t k : {u, loads, free_motion}) vectors.make(k);
        block.put(weights, loads);
        block.put(free, free_motion);
        block.put(free, u);
        problem.to_displacement(u);
        NewtonReport report = newton(problem, layers, limits);
        vectors.copy(0, u);
        return std::pair{block.get(), report};
    }
    /// What is out of balance at u, in parts of the loads: forces on all nodes, weighted by all displacements that the
    /// unknowns allow.
    double imbalance(const Numbers& at) {
        Numbers rest = block.gradient(at) - weights;
        if (inertia) rest += masses.cwiseProduct(at - free) / (inertia->dt * inertia->dt);
        double sum = 0;
        const int n = block.size();
        auto potential = block.potential();
        LinearSystem system(potential, *small, *constraints);
        for (int i = 0; i < n; ++i) {
            system.vectors().fill(0, 0);
            block.grid.nodes(0)[block.offsets[std::size_t(i / D)] + std::size_t(i % D)] = 1;
            system.to_displacement(0);
            const double work = block.get().dot(rest);
            sum += work * work;
        }
        return std::sqrt(sum) / weights.norm();
    }
};

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
        const auto [u, report] = Step(block, 5, true, threads).solve({});
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
        Step step(block, 10, false);
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
    const auto [u, report] = Step(block, 1e5).solve({.iterations = 8});
    CHECK(!report.has_converged);
    CHECK(u.allFinite());
    for (const double residual : report.residuals) CHECK(std::isfinite(residual));
}

TEST_CASE("Floats converge, too", "[implicit]") {
    Block<QuadraticBSpline, MlsForce, NeoHookean<float>, 3> block(NeoHookean<float>::from_young_poisson(1e5, 0.3), 0, 4,
                                                                  6.1);
    const auto [u, report] = Step(block, 20).solve({});
    CHECK(report.has_converged);
    CHECK(u.norm() > 0);
}

}  // namespace implicit_newton_tests
