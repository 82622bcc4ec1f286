/// \file P2G and G2P with the narrowest and the widest kernel: by definition, conserving. (The quadratic one: p2g.cpp,
/// g2p.cpp.)
#include "support/by_definition.hpp"
#include "support/catch.hpp"
#include "support/effort.hpp"

using namespace firn;
using by_definition::Case;
using by_definition::difference;
using by_definition::numbers;

namespace every_kernel_tests {
namespace {

constexpr double dt = 1e-3;

/// A cloud that has drifted up to a cell since it was sorted, and its grid: dense blocks, or cubes of sparse ones.
template <class C>
struct Drifted {
    using S = typename C::S;
    static constexpr int D = C::D;
    scenes::RandomCloud<S, D> cloud;
    BlockPartition<D> partition;
    SparseGrid<S, D> grid;

    explicit Drifted(std::size_t count)
        : cloud(count),
          partition(partition_particles<typename C::Kernel>(cloud.view(), cloud.size(), cloud.domain, 2)),
          grid(cloud.domain) {
        grid.activate(partition);
        for (std::size_t i = 0; i < cloud.x.size(); ++i)
            cloud.x[i] += S(0.999 * cloud.domain.cell_size * (2 * scenes::noise(i + 7) - 1));
    }
    std::size_t sparse_groups() const {
        std::size_t sparse = 0;
        for (const BlockGroup& group : partition.groups) sparse += std::size_t(group.sparse);
        return sparse;
    }
    template <class Execution>
    const SparseGrid<S, D>& scattered(const Execution& execution) {
        p2g<typename C::Kernel, typename C::Transfer, typename C::Force>(execution, cloud.view(), partition, grid, dt);
        return grid;
    }
    template <class Execution>
    void gather(const Execution& execution) {
        g2p<typename C::Kernel, typename C::Transfer, typename C::Force>(execution, cloud.view(), partition, grid,
                                                                         FixedCorotated<S>{}, dt);
    }
};

/// x × v and the part of C that turns: one component in 2D, three in 3D.
template <int D>
Vec<double, 3> turning(const Mat<double, D>& m) {
    if constexpr (D == 2)
        return {0, 0, m(1, 0) - m(0, 1)};
    else
        return {m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)};
}

template <int D>
struct Sums {
    double mass = 0;
    Vec<double, D> momentum = Vec<double, D>::zero();
    Vec<double, 3> angular = Vec<double, 3>::zero();
};

}  // namespace

TEMPLATE_TEST_CASE(
    "P2G with linear, cubic and compact quartic weights is the sum that the papers define, in every execution, for "
    "dense and for sparse matter that has drifted",
    "",
    FIRN_TEST_FIRST_2((Case<float, 3, Apic, WeightGradientForce, Linear>),
                      (Case<float, 2, Apic, MlsForce, CubicBSpline>),
                      (Case<double, 2, Pic, WeightGradientForce, Linear>),
                      (Case<double, 3, Pic, MlsForce, CubicBSpline>),
                      (Case<float, 3, Apic, WeightGradientForce, CubicBSpline>),
                      (Case<double, 3, Apic, WeightGradientForce, CompactQuartic>))) {
    using S = typename TestType::S;
    const double tolerance = (sizeof(S) == 4 ? 0x1p-23 : 0x1p-52) * 64;  // as for the quadratic kernel
    for (const std::size_t count : {std::size_t(200), std::size_t(3000)}) {
        Drifted<TestType> matter(count);
        REQUIRE((count == 200 ? matter.sparse_groups() > 0 : matter.partition.groups.size() > matter.sparse_groups()));
        const auto expected = by_definition::p2g<TestType>(matter.cloud, matter.grid, dt);
        CHECK(difference(numbers(matter.scattered(detail::Serial{})), expected) < tolerance);
        CHECK(difference(numbers(matter.scattered(Coloured{2})), expected) < tolerance);
        if constexpr (std::same_as<S, float>) {
            CHECK(difference(numbers(matter.scattered(ColouredFixedPoint<std::int64_t>{2})), expected) < tolerance);
            CHECK(difference(numbers(matter.scattered(FixedPoint<std::int32_t>{2})), expected) < 2e-5);
        }
    }
}

TEMPLATE_TEST_CASE(
    "G2P with linear, cubic and compact quartic weights takes what the papers define: v, C and the gradient that moves "
    "F",
    "",
    FIRN_TEST_FIRST_2((Case<float, 3, Apic, WeightGradientForce, Linear>),
                      (Case<float, 2, Pic, MlsForce, CubicBSpline>),
                      (Case<double, 2, Pic, WeightGradientForce, Linear>),
                      (Case<double, 3, Apic, MlsForce, CubicBSpline>),
                      (Case<float, 3, Apic, WeightGradientForce, CompactQuartic>))) {
    using S = typename TestType::S;
    constexpr int D = TestType::D;
    constexpr double epsilon = double(std::numeric_limits<S>::epsilon());
    for (const std::size_t count : {std::size_t(200), std::size_t(3000)}) {
        Drifted<TestType> matter(count);
        auto& cloud = matter.cloud;
        for (std::size_t i = 0; i < cloud.F.size(); ++i) cloud.F[i] = S(i % (D * D) % (D + 1) == 0);
        for (std::size_t i = 0; i < matter.grid.block_count() * std::size_t(block_nodes<D> * node_width); ++i)
            matter.grid.nodes(0)[i] = S(scenes::noise(i) - 0.5);
        const auto before = cloud;
        matter.gather(Coloured{2});
        double worst = 0, worst_C = 0, worst_F = 0;
        for (std::size_t p = 0; p < cloud.size(); ++p) {
            const auto x = by_definition::vector<D>(before.x, p);
            const auto taken = by_definition::g2p<typename TestType::Kernel>(matter.grid, x);
            worst = std::max(worst, norm(by_definition::vector<D>(cloud.v, p) - taken.velocity));
            worst = std::max(worst, norm(by_definition::vector<D>(cloud.x, p) - x - taken.velocity * dt));
            const auto size = [](const Mat<double, D>& m) { return std::sqrt(squared_norm(m)); };
            const auto C = by_definition::matrix<D>(cloud.C, p);
            if (!TestType::Transfer::affine)
                CHECK(cloud.C[p * D * D] == before.C[p * D * D]);  // is not written
            else if (taken.smallest_inertia > 0.02)
                worst_C = std::max(worst_C, size(C - taken.affine));
            constexpr bool of_C = !TestType::Force::weight_gradients;
            const auto F = Mat<double, D>::identity() + (of_C ? taken.affine : taken.gradient) * dt;
            worst_F = std::max(worst_F, size(by_definition::matrix<D>(cloud.F, p) - F));
        }
        // Sums of up to 64 numbers below 1, whose weights come from a position of up to 20 cells, rounded; C: over h.
        CHECK(worst < 64 * epsilon);
        CHECK(worst_C < 64 * epsilon / cloud.domain.cell_size * 4);
        CHECK(worst_F < 64 * epsilon);
    }
}

TEMPLATE_TEST_CASE("Mass, momentum and, with APIC, angular momentum go from particles to grid and back", "",
                   (Case<double, 3, Apic, WeightGradientForce, Linear>),
                   (Case<double, 2, Apic, WeightGradientForce, Linear>),
                   (Case<double, 3, Apic, MlsForce, CubicBSpline>), (Case<double, 2, Apic, MlsForce, CubicBSpline>),
                   (Case<double, 3, Apic, WeightGradientForce, CompactQuartic>)) {
    constexpr int D = TestType::D;
    Drifted<TestType> matter(3000);
    auto& cloud = matter.cloud;
    const auto before = cloud;
    // Of the particles as they lie before they move: m x × v + m C D, D = Σ N (x_i − x)(x_i − x)ᵀ.
    const auto of_particles = [&](const auto& moving) {
        Sums<D> sums;
        for (std::size_t p = 0; p < cloud.size(); ++p) {
            const auto x = by_definition::vector<D>(before.x, p), v = by_definition::vector<D>(moving.v, p);
            Mat<double, D> inertia = Mat<double, D>::zero();
            by_definition::for_nodes<typename TestType::Kernel>(
                cloud.domain, x, [&](const auto& node) { inertia += outer(node.offset, node.offset) * node.weight; });
            sums.mass += cloud.mass[p];
            sums.momentum += v * cloud.mass[p];
            sums.angular += turning<D>(outer(v, x) + by_definition::matrix<D>(moving.C, p) * inertia) * cloud.mass[p];
        }
        return sums;
    };
    const Sums<D> start = of_particles(before);
    matter.scattered(Coloured{2});
    grid_update(Coloured{2}, matter.grid, dt, Vec<double, D>::zero(),
                Walls<double, D>::all(cloud.domain.lower - Vec<double, D>::filled(9),
                                      cloud.domain.upper + Vec<double, D>::filled(9), {}));
    Sums<D> of_grid;
    for (std::size_t b = 0; b < matter.grid.block_count(); ++b)
        for (int i = 0; i < block_nodes<D>; ++i) {
            const double* node = matter.grid.nodes(b) + i * node_width;
            Vec<double, D> x{}, v{};
            for (int a = 0; a < D; ++a) {
                x[a] = position_of_place(cloud.domain, matter.grid.block(b), a, i >> 2 * (D - 1 - a) & 3);
                v[a] = node[a];
            }
            of_grid.mass += node[node_mass];
            of_grid.momentum += v * node[node_mass];
            of_grid.angular += turning<D>(outer(v, x)) * node[node_mass];
        }
    matter.gather(Coloured{2});
    const Sums<D> end = of_particles(cloud);
    const double scale = 2 * start.mass;
    for (const Sums<D>& later : {of_grid, end}) {
        CHECK(std::abs(later.mass - start.mass) < 1e-13 * start.mass);
        CHECK(norm(later.momentum - start.momentum) < 1e-14 * scale);
        CHECK(norm(later.angular - start.angular) < 1e-14 * scale);
    }
}

}  // namespace every_kernel_tests
