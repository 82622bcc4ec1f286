// sanitized: -O1
/// \file Small nodes that follow large ones, and the nodes that a boundary holds.
#include "support/implicit.hpp"
#include <firn/implicit/node_constraints.hpp>
#include <firn/implicit/small_nodes.hpp>

namespace implicit_nodes_tests {
using namespace firn;
using namespace implicit_steps;

TEST_CASE("Linear weights continue linear functions, and only these", "[implicit]") {
    using Place = std::array<int, 2>;
    const auto weights = [](std::vector<Place> nodes) { return linear_weights<2>(nodes); };
    CHECK(weights({{1, 0}, {2, 0}}).empty());
    CHECK(weights({{1, 0}, {2, 0}, {5, 0}}).empty());
    CHECK(weights({{1, 1}, {2, 2}, {3, 3}, {-4, -4}}).empty());
    const auto plain = weights({{1, 0}, {2, 0}, {1, 1}});
    REQUIRE(plain.size() == 3);
    CHECK(plain[0] == Approx(2).margin(1e-14));
    CHECK(plain[1] == Approx(-1).margin(1e-14));
    CHECK(plain[2] == Approx(0).margin(1e-14));
    using Space = std::array<int, 3>;
    CHECK(linear_weights<3>(std::vector<Space>{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}}).empty());
    Random random(3);
    for (int run = 0; run < 100; ++run) {
        std::vector<Space> nodes;
        Eigen::MatrixXd B(9, 4);
        for (int i = 0; i < 9; ++i) {
            Space node{};
            for (int& along : node) along = int(random.uniform(-5, 6));
            nodes.push_back(node);
            B.row(i) << 1, node[0], node[1], node[2];
        }
        const auto got = linear_weights<3>(nodes);
        REQUIRE(got.size() == 9);
        const Eigen::MatrixXd inverse = B.completeOrthogonalDecomposition().pseudoInverse();
        for (int i = 0; i < 9; ++i) CHECK(std::abs(got[std::size_t(i)] - inverse(0, i)) < 1e-12);
    }
}

/// A block of particles whose nodes hold their volumes.
template <int D>
struct Volumes {
    Block<QuadraticBSpline, MlsForce, NeoHookean<double>, D> block{{}, 0, D == 2 ? 12 : 8, 6.1};

    SmallNodes<double, D> found(double threshold = 0.1, int threads = 1) {
        return block.small_nodes(threads, {threshold});
    }
    std::size_t numbers() const { return block.grid.block_count() * std::size_t(block_nodes<D> * node_width); }
};

TEMPLATE_TEST_CASE_SIG("Small nodes follow large ones as a linear function", "[implicit]", ((int D), D), 2, 3) {
    Volumes<D> scene;
    const SmallNodes<double, D> small = scene.found();
    auto& grid = scene.block.grid;
    std::size_t filled = 0, below = 0;
    for (std::size_t i = node_mass; i < scene.numbers(); i += node_width) {
        filled += grid.nodes(0)[i] > 0;
        below += grid.nodes(0)[i] > 0 && grid.nodes(0)[i] < 0.1 * small.largest_volume();
    }
    CHECK(filled == scene.block.nodes.size());
    CHECK(small.alone() == 0);
    CHECK(small.count() == below);
    CHECK(5 * small.count() > filled);

    // A motion of the whole body with a uniform strain.
    Random random(4);
    const Mat<double, D> A = random.gaussian<D>();
    const std::size_t nodes = std::size_t(block_nodes<D>);
    aligned_vector<double> u(scene.numbers(), 0.0);
    const auto expected = [&](std::size_t i, int a) {
        return 3 + (A * node_position(grid, i / nodes, int(i % nodes)))[a];
    };
    for (std::size_t i = 0; i < u.size() / node_width; ++i)
        for (int a = 0; a < D; ++a) u[i * node_width + std::size_t(a)] = expected(i, a);
    for (const std::uint32_t i : small.nodes())
        for (int a = 0; a < D; ++a) u[i * node_width + std::size_t(a)] = 1e3;
    small.extend(u.data(), 1);
    for (const std::uint32_t i : small.nodes())
        for (int a = 0; a < D; ++a) CHECK(std::abs(u[i * node_width + std::size_t(a)] - expected(i, a)) < 1e-12);

    // fold() is the transpose of extend(), and leaves no force on small nodes.
    aligned_vector<double> v(scene.numbers()), f(scene.numbers());
    for (std::size_t i = 0; i < v.size(); ++i) {
        const bool counts = i % node_width < D;
        v[i] = counts ? random.uniform(-1, 1) : 0, f[i] = counts ? random.uniform(-1, 1) : 0;
    }
    aligned_vector<double> extended = v, folded = f;
    small.extend(extended.data(), 1);
    small.fold(folded.data(), 1);
    for (const std::uint32_t i : small.nodes())
        for (int a = 0; a < D; ++a) {
            v[i * node_width + std::size_t(a)] = 0;
            CHECK(folded[i * node_width + std::size_t(a)] == 0);
        }
    double one = 0, other = 0;
    for (std::size_t i = 0; i < v.size(); ++i) one += f[i] * extended[i], other += folded[i] * v[i];
    CHECK(std::abs(one - other) < 1e-12 * double(v.size()));

    for (const int threads : {2, 3}) {
        const SmallNodes<double, D> again = scene.found(0.1, threads);
        aligned_vector<double> u_2 = f, f_2 = f;
        again.extend(u_2.data(), threads);
        again.fold(f_2.data(), threads);
        CHECK(f_2 == folded);
        aligned_vector<double> u_1 = f;
        small.extend(u_1.data(), 1);
        CHECK(u_2 == u_1);
    }
    CHECK(scene.found(0).count() == 0);
}

TEST_CASE("A particle alone stays free, and a row of particles follows its own nodes", "[implicit]") {
    Volumes<2> scene;
    scene.block.particles.push_back({3.5, 3.5}, Vec<double, 2>::zero(), 1, 1e-7);
    scene.block.partition = sort_particles<QuadraticBSpline>(scene.block.particles, 1);
    scene.block.grid.activate(scene.block.partition, 1);
    CHECK(scene.found().alone() == 9);
}

TEMPLATE_TEST_CASE_SIG("A boundary holds nodes: stick all of their motion, slip that along the normal", "[implicit]",
                       ((class S, int D), S, D), (double, 2), (float, 3)) {
    Block<QuadraticBSpline, MlsForce, NeoHookean<S>, D> block({}, 0, 6, 6.1);
    const Vec<double, D> low = Vec<double, D>::filled(0.42), high = Vec<double, D>::filled(4);
    const auto walls_of = [&](Contact contact, double friction) {
        auto walls = Walls<S, D>::all(low, high, {Contact::slip, 0});
        walls.at_lower[0] = WallOf<typename Walls<S, D>::P>{contact, friction};
        return walls;
    };
    const std::size_t numbers = block.grid.block_count() * std::size_t(block_nodes<D> * node_width);
    const std::size_t nodes = std::size_t(block_nodes<D>);
    for (const Contact contact : {Contact::stick, Contact::slip}) {
        const NodeConstraints<S, D> constraints(block.grid, walls_of(contact, 0), 1);
        aligned_vector<S> u(numbers), before;
        for (std::size_t i = 0; i < numbers; ++i) u[i] = i % node_width < D ? S(scenes::noise(i) - 0.5) : S(0);
        before = u;
        constraints.project(u.data(), 2);
        std::size_t held = 0;
        for (std::size_t i = 0; i < numbers; ++i) {
            if (i % node_width >= D) {
                CHECK(u[i] == 0);
                continue;
            }
            const std::size_t node = i / node_width;
            const Vec<double, D> x = node_position(block.grid, node / nodes, int(node % nodes));
            const int axis = int(i % node_width);
            const bool sticks = contact == Contact::stick && x[0] < 0.46;
            held += sticks || x[axis] < 0.46;
            CHECK(u[i] == (sticks || x[axis] < 0.46 ? S(0) : before[i]));
        }
        CHECK(held > 0);
        CHECK(constraints.count() > 0);
    }
    CHECK(!NodeConstraints<S, D>(block.grid, walls_of(Contact::slip, 0), 1).are_nonlinear());
    CHECK(NodeConstraints<S, D>(block.grid, walls_of(Contact::separate, 0), 1).are_nonlinear());
    CHECK(NodeConstraints<S, D>(block.grid, walls_of(Contact::slip, 0.3), 1).are_nonlinear());
}

TEST_CASE("A turned and moving collider holds nodes along its normal, and carries them", "[implicit]") {
    Block<QuadraticBSpline, MlsForce, NeoHookean<double>, 2> block({}, 0, 6, 6.1);
    const Vec<double, 2> n{0.6, 0.8}, velocity{0.2, 0.5};
    Collider<HalfSpace<double, 2>> collider{.shape = {n}, .contact = Contact::slip};
    collider.position = {0.6, 0.6};
    collider.linear_velocity = velocity;
    const NodeConstraints<double, 2> constraints(block.grid, collider, 1);
    REQUIRE(constraints.count() > 0);
    aligned_vector<double> u(block.grid.block_count() * std::size_t(block_nodes<2> * node_width), 0.0);
    for (std::size_t i = 0; i < u.size(); i += node_width) u[i] = 0.8, u[i + 1] = -0.6;  // along the surface
    constraints.impose(u.data(), 0.1, 1);
    std::size_t carried = 0;
    for (std::size_t i = 0; i < u.size(); i += node_width) {
        const double along = 0.8 * u[i] - 0.6 * u[i + 1], across = 0.6 * u[i] + 0.8 * u[i + 1];
        CHECK(std::abs(along - 1) < 1e-14);
        carried += std::abs(across - 0.1 * dot(n, velocity)) < 1e-14;
    }
    CHECK(carried == constraints.count());
}

}  // namespace implicit_nodes_tests
