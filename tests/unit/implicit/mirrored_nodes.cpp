// sanitized: -O1
/// \file The nodes beside mirrored walls as linear constraints of an implicit step.
#include "support/implicit.hpp"
#include "support/message.hpp"
#include <firn/implicit/linear_system.hpp>
#include <firn/implicit/mirrored_nodes.hpp>

namespace implicit_mirrored_nodes_tests {
using namespace firn;
using namespace implicit_steps;

/// Walls on planes of nodes: the lower one of axis 0 slips, that of axis 1 sticks.
template <int D>
Walls<double, D> mirrored_walls(const Domain<D>& domain, int lower, int upper) {
    const auto at = [&](int node) { return domain.lower + Vec<double, D>::filled(node * domain.cell_size); };
    auto walls = Walls<double, D>::all(at(lower), at(upper), {Contact::slip, 0});
    walls.at_lower[1].contact = Contact::stick;
    walls.nodes_behind = NodesBehind::mirrored;
    return walls;
}

/// A block that fills a corner of mirrored walls, and the system of its unknowns.
template <class Scene, class Boundary>
struct Cornered {
    static constexpr int D = Scene::D;
    Scene& block;
    MirroredNodes<double, D> mirrored;
    std::optional<SmallNodes<double, D>> small;
    NodeConstraints<double, D> constraints;
    decltype(std::declval<Scene&>().potential()) potential;
    LinearSystem<decltype(potential), double, D> system;

    Cornered(Scene& of, const Boundary& walls, int threads = 1)
        : block(of),
          mirrored(of.grid, mirrors_of<typename Scene::Kernel>(walls, of.domain), threads),
          small(found(threads)),
          constraints(of.grid, walls, mirrored, threads),
          potential(of.potential(threads)),
          system(potential, *small, constraints) {
        for (std::size_t k = 1; k < 8; ++k) system.vectors().make(k);
        block.put(block.random_displacement(0.02, 5), block.of_u);
        REQUIRE(potential.displace(block.of_u).is_regular());
    }
    SmallNodes<double, D> found(int threads) {
        block.small_nodes(threads);  // leaves the volumes
        mirrored.mirror_volumes(block.grid.nodes(0), threads);
        return SmallNodes<double, D>(block.grid, {}, threads);
    }
    void fill(std::size_t k, std::uint64_t seed) {
        Random random(seed);
        double* const numbers = system.vectors().numbers(k);
        for (std::size_t i = 0; i < system.vectors().size(); ++i)
            numbers[i] = i % node_width < std::size_t(D) ? random.uniform(-1, 1) : 0;
    }
    double difference(std::size_t a, std::size_t b) {
        system.vectors().add(a, -1, b);
        return std::sqrt(system.vectors().dot(a, a) / system.vectors().dot(b, b));
    }
    /// The numbers of the node at a place, if the grid has it.
    const double* node(std::size_t k, const std::array<int, std::size_t(D)>& place) {
        const double* const found = block.grid.find_node(place);
        return found ? system.vectors().numbers(k) + (found - block.grid.nodes(0)) : nullptr;
    }
};

TEMPLATE_TEST_CASE_SIG("Beside mirrored walls displacements are even or odd, and the Hessian is symmetric",
                       "[implicit]", ((class Kernel, int D), Kernel, D), (QuadraticBSpline, 2), (CubicBSpline, 2),
                       (QuadraticBSpline, 3)) {
    using Scene = Block<Kernel, WeightGradientForce, NeoHookean<double>, D>;
    // Matter between two walls along each axis, with ragged ends in the other case, so that there are small nodes.
    for (const bool is_between : {true, false}) {
        CAPTURE(D, Kernel::support, is_between);
        const int n = D == 2 ? 10 : 6, lower = 5, upper = is_between ? lower + n / 2 : 40;
        Scene block(NeoHookean<double>::from_young_poisson(1e5, 0.3), 0, n, lower);
        const auto walls = mirrored_walls(block.domain, lower, upper);
        Cornered<Scene, Walls<double, D>> held(block, walls);
        auto& system = held.system;
        const auto vectors = system.vectors();
        constexpr std::size_t x = 3, y = 4, again = 5, forces = 6, kept = 7;
        if (!is_between) CHECK(held.small->count() > 0);

        held.fill(x, 1);
        held.fill(y, 2);
        vectors.copy(kept, y);
        system.to_displacement(x);
        system.to_displacement(y);
        vectors.copy(again, x);
        system.to_displacement(again);
        CHECK(held.difference(again, x) < 1e-15);

        // Every node beside a wall, by its place.
        std::size_t behind = 0, on = 0;
        for (std::size_t b = 0; b < block.grid.block_count(); ++b)
            for (int i = 0; i < block_nodes<D>; ++i) {
                std::array<int, std::size_t(D)> place{};
                for (int a = 0; a < D; ++a)
                    place[std::size_t(a)] = block_size * block.grid.block(b)[std::size_t(a)] + place_in_block<D>(i, a);
                for (int axis = 0; axis < D; ++axis)
                    for (const int plane : {lower, upper}) {
                        const bool sticks = axis == 1 && plane == lower;
                        auto image = place;
                        image[std::size_t(axis)] = 2 * plane - place[std::size_t(axis)];
                        const double *const one = held.node(x, place), *const other = held.node(x, image);
                        const int depth = std::abs(place[std::size_t(axis)] - plane);
                        if (depth > 1 || !other) continue;
                        (depth == 0 ? on : behind) += 1;
                        for (int a = 0; a < D; ++a) {
                            const double sign = sticks || a == axis ? -1 : 1;
                            if (other[a] != sign * one[a]) CHECK(other[a] == sign * one[a]);
                        }
                    }
            }
        CHECK(behind > 0);
        CHECK(on > 0);

        // f · Q v = Qᵀ f · v, and forces on nodes that follow others are zero.
        held.fill(forces, 3);
        const double work = vectors.dot(forces, y);
        system.to_forces(forces);
        CHECK(vectors.dot(forces, kept) == Approx(work).epsilon(1e-12));
        for (const std::uint32_t i : held.mirrored.nodes())
            for (int a = 0; a < D; ++a) CHECK(vectors.numbers(forces)[i * node_width + std::size_t(a)] == 0);

        // x · A y = y · A x.
        system.multiply(y);
        const double one = vectors.dot(x, 0);
        system.multiply(x);
        const double other = vectors.dot(y, 0), size = vectors.dot(x, 0);
        CHECK(size > 0);
        CHECK(std::abs(one - other) < 1e-12 * size);
        // The vectors of unknowns alone have the same products: forces have zeros elsewhere.
        CHECK(vectors.dot(kept, 0) == Approx(other).epsilon(1e-10));

        // What is dropped of forces does no work in displacements that the walls allow, and nothing else is dropped.
        held.fill(forces, 3);
        vectors.copy(again, forces);
        vectors.make(8);
        vectors.make(9);
        system.to_reactions(forces, 8, 9);
        vectors.add(forces, 1, 9);
        CHECK(vectors.dot(forces, forces) > 0);
        CHECK(std::abs(vectors.dot(forces, x)) < 1e-12 * vectors.dot(forces, forces));
        vectors.add(again, -1, forces);
        held.system.to_forces(again);
        held.fill(forces, 3);
        held.system.to_forces(forces);
        CHECK(held.difference(again, forces) < 1e-12);

        for (const int threads : {2, 3}) {
            Scene same(NeoHookean<double>::from_young_poisson(1e5, 0.3), 0, n, lower);
            Cornered<Scene, Walls<double, D>> there(same, walls, threads);
            CHECK(there.mirrored.nodes() == held.mirrored.nodes());
            there.fill(forces, 3);
            there.system.to_forces(forces);
            CHECK(std::equal(vectors.numbers(forces), vectors.numbers(forces) + vectors.size(),
                             there.system.vectors().numbers(forces)));
        }
    }
}

TEST_CASE("Volumes beside mirrored walls are those of matter with its mirror image", "[implicit]") {
    using Scene = Block<QuadraticBSpline, MlsForce, NeoHookean<double>, 2>;
    constexpr int lower = 5, upper = 10;
    Scene block({}, 0, 10, lower);
    const auto walls = mirrored_walls(block.domain, lower, upper);
    Cornered<Scene, Walls<double, 2>> held(block, walls);
    held.block.small_nodes();
    const auto at = [&](int i, int j) { return held.node(0, {i, j})[node_mass]; };
    double before[3][3], after[3][3];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) before[i][j] = at(lower - 1 + i, upper - 1 + j);
    held.mirrored.mirror_volumes(block.grid.nodes(0), 2);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) after[i][j] = at(lower - 1 + i, upper - 1 + j);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            CHECK(after[i][j] ==
                  Approx(before[i][j] + before[2 - i][j] + before[i][2 - j] + before[2 - i][2 - j]).epsilon(1e-12));
}

TEST_CASE("A collider that leans on a mirrored wall leaves nodes what both leave them", "[implicit]") {
    using Scene = Block<QuadraticBSpline, MlsForce, NeoHookean<double>, 3>;
    constexpr int lower = 5;
    Scene block({}, 0, 6, lower);
    auto walls = mirrored_walls(block.domain, lower, 40);
    walls.at_lower[1].contact = walls.at_lower[2].contact = Contact::none;
    const auto projected = [&](const Vec<double, 3>& n, const Vec<double, 3>& v) {
        Collider<HalfSpace<double, 3>> collider{.shape = {n}, .contact = Contact::slip};
        collider.position = Vec<double, 3>::filled(4);  // its matter is everywhere here
        const Together all(walls, collider);
        Cornered<Scene, std::remove_const_t<decltype(all)>> held(block, all);
        double* const numbers = block.grid.nodes(0);
        for (std::size_t i = 0; i < held.system.vectors().size(); i += node_width)
            for (int a = 0; a < 3; ++a) numbers[i + std::size_t(a)] = v[a];
        held.system.to_displacement(0);
        const double* const found = held.node(0, {lower, lower + 2, lower + 2});
        return Vec<double, 3>{found[0], found[1], found[2]};
    };
    const Vec<double, 3> v{1, 2, 3};
    // The collider's plane crosses the wall at right angles, then in a line, along (0, 0.8, −0.6)/1 each time.
    for (const auto& n : {Vec<double, 3>{0, 0.6, 0.8}, Vec<double, 3>{0.8, 0.36, 0.48}}) {
        const Vec<double, 3> found = projected(n, v), expected = Vec<double, 3>{0, 0.8, -0.6} * (0.8 * 2 - 0.6 * 3);
        CHECK(norm(found - expected) < 1e-12);
    }
    CHECK(norm(projected({1, 0, 0}, v) - Vec<double, 3>{0, 2, 3}) < 1e-12);
}

TEST_CASE("Mirrored walls that are not linear, or that meet, are refused", "[implicit]") {
    const Domain<2> domain({0, 0}, {1, 1}, 0.1);
    const SparseGrid<double, 2> grid(domain);
    auto walls = Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::slip, 0});
    walls.nodes_behind = NodesBehind::mirrored;
    const auto make = [&](const auto& boundary) {
        return MirroredNodes<double, 2>(grid, mirrors_of<QuadraticBSpline>(boundary, domain), 1);
    };
    CHECK_NOTHROW(make(walls));
    test_support::check_refused<usage_error>([&] { NodeConstraints<double, 2>(grid, walls, 1); }, "mirrored walls");
    CHECK_NOTHROW(make(Together(walls, walls)));
    auto other = walls;
    other.upper[0] = 0.2;
    other.lower[0] = -1;
    test_support::check_refused<parameter_error>([&] { make(Together(walls, other)); }, "2 cells apart");
    walls.at_upper[1] = {Contact::stick, 0.3};
    CHECK_NOTHROW(make(walls));
    walls.at_upper[1] = {Contact::slip, 0.3};
    test_support::check_refused<parameter_error>([&] { make(walls); }, "at 1 m along axis 1 has the contact slip");
    walls.at_upper[1] = {Contact::separate, 0};
    test_support::check_refused<parameter_error>([&] { make(walls); }, "NodesBehind::held");
    walls.at_upper[1] = {Contact::none, 0};
    CHECK_NOTHROW(make(walls));
}

}  // namespace implicit_mirrored_nodes_tests
