// quick: no
// sanitized: -O1
/// \file The multigrid preconditioner: its coarse matrices by definition, a symmetric cycle, flat iterations.
#include "support/implicit.hpp"
#include <firn/implicit/multigrid.hpp>
#include <firn/implicit/step_problem.hpp>

namespace implicit_multigrid_tests {
using namespace firn;
using namespace implicit_steps;

/// A block that stands on a floor, beside a slip wall. The nodes behind these are held or mirrored.
template <class Scene>
struct Held {
    static constexpr int D = Scene::D;
    using S = typename Scene::S;
    using Potential = decltype(std::declval<Scene&>().potential());
    using Problem = StepProblem<Potential, S, D>;
    static constexpr std::size_t loads = 3, free_motion = 4, z1 = 5, r1 = 6, z2 = 7, r2 = 8, of_multigrid = 10;

    Scene& block;
    Potential potential;
    MirroredNodes<S, D> mirrored;
    SmallNodes<S, D> small;
    NodeConstraints<S, D> constraints;
    std::optional<NodalInertia<S>> inertia;
    Problem problem;

    static auto walls(const Domain<D>& domain, NodesBehind behind) {
        auto all = Walls<S, D>::all(Vec<double, D>::filled(behind == NodesBehind::held ? 0.32 : 0.3),
                                    Vec<double, D>::filled(4.4), {Contact::slip, 0});
        all.nodes_behind = behind;
        all.at_lower[1].contact = Contact::stick;
        for (std::size_t a = 0; a < std::size_t(D); ++a)
            if (domain.periodic[a]) all.at_lower[a].contact = all.at_upper[a].contact = Contact::none;
        return all;
    }
    static SmallNodes<S, D> small_of(Scene& of, const MirroredNodes<S, D>& mirrored, int threads) {
        of.small_nodes(threads);  // leaves volumes
        mirrored.mirror_volumes(of.grid.nodes(0), threads);
        return SmallNodes<S, D>(of.grid, {}, threads);
    }
    explicit Held(Scene& of, int threads = 1, double dt = 0, NodesBehind behind = NodesBehind::held)
        : block(of),
          potential(of.potential(threads)),
          mirrored(of.grid, mirrors_of<typename Scene::Kernel>(walls(of.domain, behind), of.domain), threads),
          small(small_of(of, mirrored, threads)),
          constraints(of.grid, walls(of.domain, behind), mirrored, threads),
          problem(potential, small, constraints, loads, inertia) {
        if (dt > 0) {
            inertia = NodalInertia<S>{masses_of_nodes(block.grid), dt, free_motion};
            for (S& mass : inertia->masses) mass *= S(1000);
        }
        for (std::size_t k = loads; k <= r2; ++k) problem.vectors().make(k);
        REQUIRE(potential.displace(block.of_u).is_regular());
    }
};

/// The matrix by which nodes at some places move by those of the next level.
template <int D>
Eigen::MatrixXd prolongation(const std::vector<std::array<int, std::size_t(D)>>& fine, const NodeSet<D>& coarse) {
    Eigen::MatrixXd P = Eigen::MatrixXd::Zero(D * int(fine.size()), D * int(coarse.size()));
    for (std::size_t j = 0; j < coarse.size(); ++j)
        for (std::size_t i = 0; i < fine.size(); ++i) {
            double weight = 1;
            for (std::size_t a = 0; a < std::size_t(D); ++a) {
                int distance = fine[i][a] - (2 * coarse.place(j)[a] - 3);
                if (const int period = coarse.periods()[a]; period > 0) distance = modulo(distance, 2 * period);
                weight *= distance == 0 || distance == 3 ? 0.25 : distance == 1 || distance == 2 ? 0.75 : 0;
            }
            for (int a = 0; a < D; ++a) P(D * int(i) + a, D * int(j) + a) = weight;
        }
    return P;
}
template <class Level>
Eigen::MatrixXd dense(const Level& level) {
    const std::vector<double> all = level.dense();
    const int n = int(std::sqrt(double(all.size())) + 0.5);
    return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(all.data(), n, n);
}

template <class Scene>
void check_levels(Scene block, double dt = 0, NodesBehind behind = NodesBehind::held) {
    constexpr int D = Scene::D;
    CAPTURE(D, Scene::Kernel::support, Scene::Force::name, Scene::Material::name, dt, int(behind));
    const Numbers u = block.random_displacement(0.02, 5);
    block.put(u, block.of_u);
    Held<Scene> held(block, 1, dt, behind);
    Multigrid<typename Held<Scene>::Problem> multigrid({.coarsest = 10}, held.of_multigrid);
    multigrid.renew(held.problem);
    REQUIRE(multigrid.levels().size() >= 2);

    Eigen::MatrixXd A = block.hessian(u);
    std::vector<std::array<int, std::size_t(D)>> places(block.nodes.size());
    for (const auto& [place, q] : block.nodes) places[std::size_t(q)] = place;
    Numbers T = Numbers::Ones(block.size());
    bool is_partly_free = false;
    for (int i = 0; i < block.size(); ++i) {
        const auto node = std::uint32_t(block.offsets[std::size_t(i / D)] / node_width);
        if (dt > 0) A(i, i) += double(held.inertia->masses[node]) / (dt * dt);
    }
    // Nodes whose particles have no stiffness at all, such as those of broken sand, take no part.
    for (int q = 0; q < int(block.offsets.size()); ++q)
        if (A.template block<D, D>(D * q, D * q).norm() <= 1e-14 * A.norm()) T.template segment<D>(D * q).setZero();
    const auto hold = [&](std::size_t node, const auto& P) {
        for (int q = 0; q < int(block.offsets.size()); ++q)
            if (block.offsets[std::size_t(q)] / node_width == node)
                for (int a = 0; a < D; ++a) {
                    T[D * q + a] *= P(a, a);
                    is_partly_free = is_partly_free || P(a, a) != P(0, 0);
                }
    };
    held.constraints.for_held(hold);
    held.mirrored.for_on_walls(hold);
    // Nodes behind mirrored walls move with their images.
    Eigen::MatrixXd M = Eigen::MatrixXd::Identity(block.size(), block.size());
    Numbers is_own = Numbers::Ones(block.size());
    if (behind == NodesBehind::mirrored)
        for (const auto& [place, q] : block.nodes) {
            auto image = place;
            Vec<double, D> sign = Vec<double, D>::filled(1);
            for (int axis = 0; axis < D; ++axis) {
                if (place[std::size_t(axis)] != 5) continue;  // the walls lie at node 6, and that of axis 1 sticks
                image[std::size_t(axis)] = 7;
                for (int a = 0; a < D; ++a) sign[a] *= axis == 1 || a == axis ? -1 : 1;
            }
            if (image == place) continue;
            const int of = block.nodes.at(image);
            for (int a = 0; a < D; ++a) {
                M(D * q + a, D * q + a) = is_own[D * q + a] = 0;
                M(D * q + a, D * of + a) = sign[a];
                T[D * q + a] *= T[D * of + a];
            }
        }
    CHECK(is_partly_free == !is_periodic(block.domain));
    for (int q = 0; q < int(block.offsets.size()); ++q)
        for (int a = 0; a < D; ++a)
            CHECK((multigrid.free()[block.offsets[std::size_t(q)] / node_width] >> a & 1) == T[D * q + a]);
    T = T.cwiseProduct(is_own);
    A = T.asDiagonal() * M.transpose() * A * M * T.asDiagonal();
    for (const auto& level : multigrid.levels()) {
        const Eigen::MatrixXd P = prolongation<D>(places, level->nodes()), expected = P.transpose() * A * P;
        CAPTURE(places.size(), level->size());
        A = dense(*level);
        CHECK((A - expected).norm() <= 1e-12 * expected.norm());
        const bool is_symmetric = (A - A.transpose()).norm() <= 1e-12 * A.norm();
        CHECK(is_symmetric == decltype(held.potential)::is_symmetric);
        places.clear();
        for (std::size_t i = 0; i < level->size(); ++i) places.push_back(level->nodes().place(i));
    }
}

TEMPLATE_TEST_CASE_SIG("Coarse matrices are those of the Hessian, weighted", "[implicit]", ((int D), D), 2, 3) {
    const int n = D == 2 ? 16 : 6;  // dense blocks and sparse ones
    using Solid = NeoHookean<double>;
    check_levels(Block<QuadraticBSpline, WeightGradientForce, Solid, D>({}, 0.1, n, 6.1));
    check_levels(Block<QuadraticBSpline, WeightGradientForce, Solid, D>({}, 0.1, n, 6.1), 0.01, NodesBehind::mirrored);
    if (D == 3) return;
    check_levels(Block<QuadraticBSpline, MlsForce, Solid, D>({}, 0.1, n, 6.1), 0.01);
    check_levels(Block<CubicBSpline, MlsForce, Hencky<double>, D>({}, 0.1, n, 6.1));
    check_levels(Block<CubicBSpline, MlsForce, Solid, D>({}, 0.1, n, 6.1), 0, NodesBehind::mirrored);
    // Plastic flow: the matrix is not symmetric.
    check_levels(Block<QuadraticBSpline, MlsForce, Sand<double>, D>(Sand<double>::from_properties({}), 0.01, n, 6.1));
}

/// The preconditioner of a problem as a dense matrix on the unknowns: z = B r.
template <class Scene, class Preconditioner>
auto applied(Held<Scene>& held, Preconditioner& multigrid, std::uint64_t seed, std::size_t z, std::size_t r) {
    held.block.put(held.block.random_numbers(1, seed), r);
    held.problem.to_forces(r);
    multigrid.apply(held.problem, z, r);
}

template <class Scene>
void check_cycle(Scene block, const MultigridRule& rule, double dt = 0, NodesBehind behind = NodesBehind::held) {
    CAPTURE(Scene::D, Scene::Force::name, rule.degree, rule.coarsest, dt, int(behind));
    block.put(block.random_displacement(0.01, 5), block.of_u);
    Held<Scene> held(block, 1, dt, behind);
    Multigrid<typename Held<Scene>::Problem> multigrid(rule, held.of_multigrid);
    multigrid.renew(held.problem);
    REQUIRE(multigrid.report().is_definite);
    const auto vectors = held.problem.vectors();
    for (const std::uint64_t seed : {1, 2, 3}) {
        applied(held, multigrid, 2 * seed, held.z1, held.r1);
        applied(held, multigrid, 2 * seed + 1, held.z2, held.r2);
        const double one = vectors.dot(held.z1, held.r2), other = vectors.dot(held.z2, held.r1),
                     own = vectors.dot(held.z1, held.r1), own_of_other = vectors.dot(held.z2, held.r2);
        CHECK(own > 0);
        CHECK(own_of_other > 0);
        CHECK(std::abs(one - other) <= 1e-12 * std::sqrt(own * own_of_other));
    }
    CHECK(multigrid.report().is_definite);
}

TEMPLATE_TEST_CASE_SIG("A cycle is symmetric and definite", "[implicit]", ((int D), D), 2, 3) {
    const int n = D == 2 ? 20 : 6;
    using Solid = NeoHookean<double>;
    using Scene = Block<QuadraticBSpline, WeightGradientForce, Solid, D>;
    check_cycle(Scene({}, 0.01, n, 6.1), {.coarsest = 20});
    check_cycle(Block<QuadraticBSpline, MlsForce, Solid, D>({}, 0.01, n, 6.1), {.degree = 3, .range = 8}, 1e-3);
    check_cycle(Scene({}, 0.01, n, 6.1), {.coarsest = 20}, 0, NodesBehind::mirrored);
    if (D == 3) return;
    check_cycle(Scene({}, 0.01, n, 6.1), {.degree = 1});
    check_cycle(Scene({}, 0.01, n, 6.1), {.coarsest = 10'000});  // no coarse level
    check_cycle(Block<CubicBSpline, MlsForce, Solid, D>({}, 0.01, n, 6.1), {});
}

/// Iterations of conjugate gradients for a block under its own weight.
template <class Scene>
SolverReport solve(Scene& block, int threads, double tolerance, Numbers* solution = nullptr, double dt = 0,
                   NodesBehind behind = NodesBehind::held) {
    block.put(Numbers::Zero(block.size()), block.of_u);
    Held<Scene> held(block, threads, dt, behind);
    Multigrid<typename Held<Scene>::Problem> multigrid({}, held.of_multigrid);
    multigrid.renew(held.problem);
    Numbers weights = Numbers::Zero(block.size());
    for (int i = 1; i < block.size(); i += Scene::D) weights[i] = -1;
    block.put(weights, held.r1);
    held.problem.to_forces(held.r1);
    const SolverReport report =
        conjugate_gradients(held.problem, [&](std::size_t z, std::size_t r) { multigrid.apply(held.problem, z, r); },
                            {held.z2, held.r1, held.r2, held.z1}, {tolerance, 200});
    CHECK(report.has_converged);
    CHECK(multigrid.report().is_definite);
    if (solution) {
        held.problem.to_displacement(held.z2);
        held.problem.vectors().copy(0, held.z2);
        *solution = block.get();
    }
    return report;
}

TEST_CASE("Iterations do not grow with the number of cells", "[implicit]") {
    const auto iterations = [](auto block) { return solve(block, 1, 1e-8).iterations; };
    using Solid = FixedCorotated<double>;
    const auto material = Solid::from_young_poisson(1e5, 0.3);
    using Plane = Block<QuadraticBSpline, WeightGradientForce, Solid, 2>;
    std::vector<int> all;
    for (const int n : {10, 20, 40}) all.push_back(iterations(Plane(material, 0, n, 6.1)));
    CAPTURE(all);
    CHECK(all.back() <= 1.5 * all.front());
    CHECK(all.back() <= 20);
    Plane mirrored(material, 0, 40, 6.1);
    CHECK(solve(mirrored, 1, 1e-8, nullptr, 0, NodesBehind::mirrored).iterations <= all.back() + 1);
    CHECK(iterations(Block<QuadraticBSpline, MlsForce, Solid, 2>(material, 0, 16, 6.1)) <= 20);
    CHECK(iterations(Block<CubicBSpline, MlsForce, Solid, 2>(material, 0, 16, 6.1)) <= 25);
    CHECK(iterations(Block<QuadraticBSpline, WeightGradientForce, Solid, 3>(material, 0, 6, 6.1)) <= 30);
    Block<QuadraticBSpline, WeightGradientForce, FixedCorotated<float>, 2> in_float(
        FixedCorotated<float>::from_young_poisson(1e5, 0.3), 0, 16, 6.1);
    CHECK(solve(in_float, 1, 1e-4).iterations <= 12);
}

TEST_CASE("A multigrid has the same bits for any number of threads", "[implicit]") {
    const auto check = [](auto block) {
        Numbers expected, got;
        for (const int threads : {1, 2, 3}) {
            solve(block, threads, 1e-5, threads == 1 ? &expected : &got, 1);
            if (threads > 1) CHECK(got == expected);
        }
    };
    check(Block<QuadraticBSpline, WeightGradientForce, FixedCorotated<double>, 2>(
        FixedCorotated<double>::from_young_poisson(1e5, 0.3), 0.01, 32, 6.1));
    check(Block<QuadraticBSpline, MlsForce, FixedCorotated<float>, 3>(
        FixedCorotated<float>::from_young_poisson(1e5, 0.3), 0.01, 6, 6.1));
}

/// A ring of 16 cells, 8 cells high.
auto ring(double strain) {
    using Scene = Block<QuadraticBSpline, WeightGradientForce, FixedCorotated<double>, 2>;
    Domain<2> domain = Scene::make_domain();
    domain.upper[0] = domain.lower[0] + 1.6;
    domain.periodic[0] = true;
    return Scene(FixedCorotated<double>::from_young_poisson(1e5, 0.3), strain, 32, 6.1, 1, 1, domain);
}
TEST_CASE("A multigrid closes rings", "[implicit]") {
    check_levels(ring(0.01));
    auto block = ring(0);
    CHECK(solve(block, 1, 1e-8).iterations <= 20);
    check_cycle(ring(0.01), {.coarsest = 10});
}

TEST_CASE("Where a Hessian is not definite, block Jacobi stands in", "[implicit]") {
    // Matter that is pressed to 0.3 of its height buckles.
    using Scene = Block<QuadraticBSpline, WeightGradientForce, NeoHookean<double>, 2>;
    Scene block(NeoHookean<double>::from_young_poisson(1e5, 0.3), 0, 16, 6.1);
    for (const std::uint32_t slot : slots_by_id(block.particles, 1)) {
        auto state = block.particles.state(slot);
        state.F = DeformationGradient<double, 2>(Mat<double, 2>::rows(1.0, 0.0, 0.0, 0.3));
        block.particles.set_state(slot, state);
    }
    Held<Scene> held(block);
    Multigrid<typename Held<Scene>::Problem> multigrid({}, held.of_multigrid);
    multigrid.renew(held.problem);
    CHECK(!multigrid.report().is_definite);
    for (const std::uint64_t seed : {1, 2, 3}) {
        applied(held, multigrid, seed, held.z1, held.r1);
        CHECK(held.problem.vectors().dot(held.z1, held.r1) > 0);
    }
}

TEST_CASE("A multigrid goes on where the grid and the problem have changed", "[implicit]") {
    using Scene = Block<QuadraticBSpline, WeightGradientForce, FixedCorotated<double>, 2>;
    const auto material = FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    using Problem = typename Held<Scene>::Problem;
    Multigrid<Problem> reused({.first_iterations = 60, .later_iterations = 60}, Held<Scene>::of_multigrid);
    for (const auto& [n, at, dt] : {std::tuple{20, 6.1, 0.0}, {20, 6.1, 1e-4}, {20, 7.4, 0.0}, {26, 7.4, 0.0}}) {
        CAPTURE(n, at, dt);
        Scene block(material, 0.01, n, at);
        block.put(block.random_displacement(0.01, 5), block.of_u);
        Held<Scene> held(block, 1, dt);
        Multigrid<Problem> fresh({.first_iterations = 60}, held.of_multigrid + 5);
        const auto vectors = held.problem.vectors();
        for (int k = 0; k < 2; ++k) {
            reused.renew(held.problem);
            fresh.renew(held.problem);
            CHECK(reused.report().nodes == fresh.report().nodes);
            applied(held, reused, 2, held.z1, held.r1);
            applied(held, fresh, 2, held.z2, held.r1);
            const double size = std::sqrt(vectors.dot(held.z2, held.z2));
            vectors.add(held.z1, -1, held.z2);
            CHECK(std::sqrt(vectors.dot(held.z1, held.z1)) < 0.01 * size);
        }
    }
}

TEST_CASE("A multigrid refuses rules without sense", "[implicit]") {
    using Scene = Block<QuadraticBSpline, WeightGradientForce, FixedCorotated<double>, 2>;
    using M = Multigrid<typename Held<Scene>::Problem>;
    CHECK_THROWS_AS(M({.degree = 0}, 1), parameter_error);
    CHECK_THROWS_AS(M({.range = 1}, 1), parameter_error);
    CHECK_THROWS_AS(M({.safety = 0.9}, 1), parameter_error);
    CHECK_THROWS_AS(M({.later_iterations = 0}, 1), parameter_error);
}

TEST_CASE("Dense systems are solved", "[implicit]") {
    for (const bool is_symmetric : {true, false}) {
        test_support::Random random(3);
        constexpr int n = 7;
        Eigen::MatrixXd A(n, n);
        for (int i = 0; i < n * n; ++i) A(i / n, i % n) = random.uniform(-1, 1);
        if (is_symmetric) A = A * A.transpose().eval();
        if (!is_symmetric) A(0, 0) = 0;
        Numbers b = Numbers::LinSpaced(n, -1, 2);
        std::vector<double> x(b.begin(), b.end());
        const Eigen::MatrixXd rows = A.transpose();
        DenseSolver solver;
        CHECK(solver.factor(n, {rows.data(), rows.data() + n * n}, is_symmetric));
        solver.solve(x);
        CHECK((Eigen::Map<Numbers>(x.data(), n) - A.partialPivLu().solve(b)).norm() < 1e-11);
    }
    DenseSolver solver;
    CHECK(!solver.factor(2, {1, 2, 2, 1}, true));
    CHECK(solver.factor(2, {1, 2, 2, 1}, false));
    CHECK(!solver.factor(2, {1, 2, 2, 4}, false));
}

}  // namespace implicit_multigrid_tests
