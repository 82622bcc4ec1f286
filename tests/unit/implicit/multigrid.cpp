// sanitized: -O1
/// \file The multigrid preconditioner: its coarse matrices by definition, a symmetric cycle, flat iterations.
#include "support/implicit.hpp"
#include <firn/implicit/multigrid.hpp>
#include <firn/implicit/step_problem.hpp>

namespace implicit_multigrid_tests {
using namespace firn;
using namespace implicit_steps;

/// A block that stands on a floor, beside a slip wall.
template <class Scene>
struct Held {
    static constexpr int D = Scene::D;
    using S = typename Scene::S;
    using Potential = decltype(std::declval<Scene&>().potential());
    using Problem = StepProblem<Potential, S, D>;
    static constexpr std::size_t loads = 3, free_motion = 4, z1 = 5, r1 = 6, z2 = 7, r2 = 8, of_multigrid = 10;

    Scene& block;
    Potential potential;
    SmallNodes<S, D> small;
    NodeConstraints<S, D> constraints;
    std::optional<NodalInertia<S>> inertia;
    Problem problem;

    static SmallNodes<S, D> small_nodes(Scene& block, int threads) {
        const auto set = firn::detail::motion_of_set(block.set());
        const std::array sets{set};
        using View = std::remove_cvref_t<decltype(set.view)>;
        scatter_volumes<typename Scene::Kernel>(block.grid, threads, ParticleSets<View>(sets));
        return SmallNodes<S, D>(block.grid, {}, threads);
    }
    static auto walls(double floor) {
        auto all = Walls<S, D>::all(Vec<double, D>::filled(floor), Vec<double, D>::filled(4.4), {Contact::slip, 0});
        all.at_lower[1].contact = Contact::stick;
        return all;
    }
    explicit Held(Scene& of, int threads = 1, double dt = 0, double floor = 0.32)
        : block(of),
          potential(of.potential(threads)),
          small(small_nodes(of, threads)),
          constraints(of.grid, walls(floor), threads),
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
void check_levels(Scene block, double dt = 0) {
    constexpr int D = Scene::D;
    CAPTURE(D, Scene::Kernel::support, Scene::Force::name, Scene::Material::name, dt);
    const Numbers u = block.random_displacement(0.05, 5);
    block.put(u, block.of_u);
    Held<Scene> held(block, 1, dt);
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
    held.constraints.for_held([&](std::size_t node, const auto& P) {
        for (int q = 0; q < int(block.offsets.size()); ++q)
            if (block.offsets[std::size_t(q)] / node_width == node)
                for (int a = 0; a < D; ++a) {
                    T[D * q + a] *= P(a, a);
                    is_partly_free = is_partly_free || P(a, a) != P(0, 0);
                }
    });
    CHECK(is_partly_free);
    for (int q = 0; q < int(block.offsets.size()); ++q)
        for (int a = 0; a < D; ++a)
            CHECK((multigrid.free()[block.offsets[std::size_t(q)] / node_width] >> a & 1) == T[D * q + a]);
    A = T.asDiagonal() * A * T.asDiagonal();
    for (const auto& level : multigrid.levels()) {
        const Eigen::MatrixXd P = prolongation<D>(places, level->nodes()), expected = P.transpose() * A * P;
        CAPTURE(places.size(), level->size());
        A = dense(*level);
        CHECK((A - expected).norm() <= 1e-12 * expected.norm());
        places.clear();
        for (std::size_t i = 0; i < level->size(); ++i) places.push_back(level->nodes().place(i));
    }
}

TEMPLATE_TEST_CASE_SIG("Coarse matrices are those of the Hessian, weighted", "[implicit]", ((int D), D), 2, 3) {
    const int n = D == 2 ? 16 : 6;  // dense blocks and sparse ones
    using Solid = NeoHookean<double>;
    check_levels(Block<QuadraticBSpline, WeightGradientForce, Solid, D>({}, 0.1, n, 6.1));
    check_levels(Block<QuadraticBSpline, MlsForce, Solid, D>({}, 0.1, n, 6.1), 0.01);
    if (D == 2) check_levels(Block<CubicBSpline, MlsForce, Hencky<double>, D>({}, 0.1, n, 6.1));
}

}  // namespace implicit_multigrid_tests
