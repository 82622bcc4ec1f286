// quick: no
// sanitized: -O1
/// \file The linear system of a Newton step and conjugate gradients, against dense matrices.
#include "support/implicit.hpp"
#include <firn/implicit/block_jacobi.hpp>
#include <firn/implicit/diagonal.hpp>
#include <firn/implicit/linear_system.hpp>

namespace implicit_linear_system_tests {
using namespace firn;
using namespace implicit_steps;

/// A block that is held at its lower side.
template <class Scene>
struct Held {
    static constexpr int D = Scene::D;
    using S = typename Scene::S;
    static constexpr SolverLayers layers{3, 4, 5, 6};

    Scene& block;
    SmallNodes<S, D> small;
    NodeConstraints<S, D> constraints;

    static auto walls() {
        auto all = Walls<S, D>::all(Vec<double, D>::filled(0.32), Vec<double, D>::filled(4.4), {Contact::slip, 0});
        all.at_lower[1].contact = Contact::stick;
        return all;
    }
    explicit Held(Scene& of, int threads = 1)
        : block(of), small(of.small_nodes(threads)), constraints(of.grid, walls(), threads) {}

    /// Solves for the displacement by which forces are balanced. Returns it, and the report.
    auto solve(const Numbers& forces, int threads, double tolerance = 1e-12) {
        auto potential = block.potential(threads);
        REQUIRE(potential.displace(block.of_u).is_regular());
        LinearSystem system(potential, small, constraints);
        const auto vectors = system.vectors();
        vectors.make(layers.residual);
        block.put(forces, layers.residual);
        system.to_forces(layers.residual);
        aligned_vector<S> blocks;
        hessian_diagonal(potential, blocks);
        const BlockJacobi<S, D> jacobi(blocks, threads);
        const SolverReport report = conjugate_gradients(
            system, [&](std::size_t z, std::size_t r) { jacobi.apply(vectors, z, r); }, layers, {tolerance, 2000});
        system.to_displacement(layers.solution);
        vectors.copy(0, layers.solution);
        return std::pair{block.get(), report};
    }
    /// The matrix W E, a column for each number of the nodes that particles reach.
    Eigen::MatrixXd displacements() {
        const int n = block.size();
        Eigen::MatrixXd all(n, n);
        auto potential = block.potential();
        LinearSystem system(potential, small, constraints);
        for (int i = 0; i < n; ++i) {
            system.vectors().fill(0, 0);
            block.grid.nodes(0)[block.offsets[std::size_t(i / D)] + std::size_t(i % D)] = 1;
            system.to_displacement(0);
            all.col(i) = block.get();
        }
        return all;
    }
};

TEMPLATE_TEST_CASE_SIG("Conjugate gradients solve what a dense solver solves", "[implicit]",
                       ((int D, class Force), D, Force), (2, WeightGradientForce), (2, MlsForce), (3, MlsForce)) {
    using Scene = Block<QuadraticBSpline, Force, NeoHookean<double>, D>;
    Scene block(NeoHookean<double>::from_young_poisson(1e5, 0.3), 0, D == 2 ? 10 : 4, 6.1);
    const Numbers u = Numbers::Zero(block.size());
    block.put(u, block.of_u);
    Held<Scene> held(block);
    REQUIRE(held.small.count() > 0);
    const Numbers forces = block.random_numbers(1, 8);
    const auto [x, report] = held.solve(forces, 1);
    CHECK(report.has_converged);
    CHECK(!report.has_found_negative);
    CHECK(report.residual <= 1e-12);
    CHECK(report.iterations > 5);

    // Displacements are T y; y is determined where T has columns.
    const Eigen::MatrixXd T = held.displacements();
    const Eigen::MatrixXd A = T.transpose() * block.hessian(u) * T;
    const Numbers y = A.completeOrthogonalDecomposition().solve(T.transpose() * forces);
    CHECK((T * y - x).norm() <= 1e-8 * x.norm());
    // The forces that are left do no work on any displacement.
    CHECK((T.transpose() * (block.hessian(u) * x - forces)).norm() <= 1e-10 * (T.transpose() * forces).norm());
}

TEST_CASE("Conjugate gradients have the same bits for any number of threads", "[implicit]") {
    using Scene = Block<QuadraticBSpline, WeightGradientForce, FixedCorotated<double>, 2>;
    Scene block(FixedCorotated<double>::from_young_poisson(1e5, 0.3), 0.01, 40, 6.1);
    block.put(block.random_displacement(0.001, 5), block.of_u);
    const Numbers forces = block.random_numbers(1, 8);
    Numbers expected;
    SolverReport of_one;
    for (const int threads : {1, 2, 3}) {
        Held<Scene> held(block, threads);
        const auto [x, report] = held.solve(forces, threads, 1e-6);
        CHECK(report.has_converged);
        if (threads == 1) expected = x, of_one = report;
        CHECK(x == expected);
        CHECK(report.iterations == of_one.iterations);
        CHECK(report.residual == of_one.residual);
    }
}

TEST_CASE("Conjugate gradients stop at negative curvature, and know zero", "[implicit]") {
    // Matter that is pressed to half its height buckles.
    using Scene = Block<QuadraticBSpline, WeightGradientForce, NeoHookean<double>, 2>;
    Scene block(NeoHookean<double>::from_young_poisson(1e5, 0.3), 0, 10, 6.1);
    auto& particles = block.particles;
    for (const std::uint32_t slot : slots_by_id(particles, 1)) {
        auto state = particles.state(slot);
        state.F = DeformationGradient<double, 2>(Mat<double, 2>::rows(1.0, 0.0, 0.0, 0.3));
        particles.set_state(slot, state);
    }
    block.put(Numbers::Zero(block.size()), block.of_u);
    Held<Scene> held(block);
    const auto [x, report] = held.solve(block.random_numbers(1, 8), 1);
    CHECK(report.has_found_negative);
    CHECK(!report.has_converged);
    CHECK(x.allFinite());
    const auto [zero, of_zero] = held.solve(Numbers::Zero(block.size()), 1);
    CHECK(of_zero.has_converged);
    CHECK(of_zero.iterations == 0);
    CHECK(zero.norm() == 0);
}

TEST_CASE("Block Jacobi inverts definite blocks, and bounds the others", "[implicit]") {
    Block<QuadraticBSpline, MlsForce, NeoHookean<double>, 2> block({}, 0.05);
    const NodeVectors<double, 2> vectors(block.grid, 1);
    aligned_vector<double> blocks(block.grid.block_count() * std::size_t(block_nodes<2> * 4), 0.0);
    const auto set = [&](std::size_t node, std::array<double, 4> numbers) {
        std::copy(numbers.begin(), numbers.end(), blocks.begin() + std::ptrdiff_t(node * 4));
    };
    set(0, {2, 1, 1, 3});
    set(1, {1, 2, 2, 1});  // eigenvalues 3 and −1
    set(2, {2e-9, 1e-9, 1e-9, 3e-9});
    vectors.fill(0, 1);
    vectors.make(3);
    BlockJacobi<double, 2>(blocks, 1).apply(vectors, 3, 0);
    const double* const z = block.grid.layer(3);
    CHECK(z[0] == Approx(0.4));
    CHECK(z[1] == Approx(0.2));
    CHECK(z[4] == Approx(1. / 6));
    CHECK(z[5] == Approx(1. / 6));
    CHECK(z[8] == Approx(0.4e9));
    CHECK(z[9] == Approx(0.2e9));
    for (std::size_t i = 12; i < vectors.size(); ++i) CHECK(z[i] == 0);
    CHECK(z[2] == 0);
}

}  // namespace implicit_linear_system_tests
