// part: memory
/// \file The stages on a foreign program's arrays: any layout, not moved, not copied, the same motion as firn's own.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/message.hpp"
#include "support/scenes.hpp"

using namespace firn;

namespace foreign_tests {
namespace {

constexpr double dt = 2e-3;

template <class S, int D>
void step(const ForeignParticles<S, D>& view, std::size_t count, const Domain<D>& domain, int steps) {
    const auto material = FixedCorotated<S>::from_young_poisson(1e3, 0.3);
    const auto walls = Walls<S, D>::all(cast<S>(domain.lower), cast<S>(domain.upper), {});
    Vec<double, D> gravity{};
    gravity[1] = -9.81;
    auto partition = partition_particles<QuadraticBSpline>(view, count, domain);
    SparseGrid<S, D> grid(domain);
    grid.activate(partition);
    update_stress(Coloured{2}, view, partition, material, domain.cell_size);
    for (int i = 0; i < steps; ++i) {
        p2g<QuadraticBSpline, Apic, MlsForce>(Coloured{2}, view, partition, grid, dt);
        grid_update(Coloured{2}, grid, dt, gravity, walls);
        if (!g2p<QuadraticBSpline, Apic, MlsForce>(Coloured{2}, view, partition, grid, material, dt).sort_needed)
            continue;
        partition = partition_particles<QuadraticBSpline>(view, count, domain);
        grid.activate(partition);
    }
}

}  // namespace

TEMPLATE_TEST_CASE("A foreign program's particles move as firn's own do", "", FIRN_TEST_PRECISIONS) {
    using S = TestType;
    const Domain<3> domain{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 1.0 / 16};
    const double side = test_support::fewer_if_slow(0.3, 0.15);
    const auto samples = sample_box<3>({0.3, 0.02, 0.3}, {0.3 + side, 0.3, 0.3 + side}, {.spacing = 1.0 / 32});
    Simulation<3, FixedCorotated<S>> own(domain, FixedCorotated<S>::from_young_poisson(1e3, 0.3));
    own.add(samples, 10.0, {0.3, -1.0, 0.2});
    own.fixed_time_step = dt;

    struct Particle {  // an array of structures, matrices by rows, with a field that is not firn's
        S x[3], v[3], C[3][3], F[3][3], stress[3][3], mass, volume;
        int yours;
    };
    static_assert(sizeof(Particle) % sizeof(S) == 0);
    std::vector<Particle> theirs(samples.positions.size());
    for (std::size_t i = 0; i < theirs.size(); ++i) {
        theirs[i] = Particle{};
        for (int a = 0; a < 3; ++a) {
            theirs[i].x[a] = S(samples.positions[i][a]);
            theirs[i].F[a][a] = 1;
        }
        theirs[i].v[0] = S(0.3), theirs[i].v[1] = S(-1.0), theirs[i].v[2] = S(0.2);
        theirs[i].mass = S(10.0 * samples.volume);
        theirs[i].volume = S(samples.volume);
        theirs[i].yours = int(i);
    }
    using Span = StridedSpan<S>;
    constexpr std::ptrdiff_t stride = sizeof(Particle) / sizeof(S);
    Particle& first = theirs[0];
    const ForeignParticles<S, 3> view{Span::template vectors<3>(first.x, stride),
                                      Span::template vectors<3>(first.v, stride),
                                      Span::template matrices<3>(&first.C[0][0], true, stride),
                                      symmetric_matrices<3>(&first.stress[0][0], stride),
                                      Span::scalars(&first.mass, stride),
                                      Span::scalars(&first.volume, stride),
                                      {Span::template matrices<3>(&first.F[0][0], true, stride)}};
    const int steps = test_support::fewer_if_slow(100, 40);
    step<S, 3>(view, theirs.size(), domain, steps);
    for (int i = 0; i < steps; ++i) own.step();

    double moved = 0, of_x = 0, of_F = 0;
    for (std::size_t slot = 0; slot < own.particles().slots(); ++slot) {
        if (!own.particles().is_particle(slot)) continue;
        const Particle& p = theirs[own.particles().id(slot)];
        for (int a = 0; a < 3; ++a) {
            of_x = std::max(of_x, std::abs(double(p.x[a] - own.particles().position(slot)[a])));
            for (int b = 0; b < 3; ++b)
                of_F = std::max(of_F, std::abs(double(p.F[a][b] - own.particles().state(slot).F(a, b))));
        }
        moved = std::max(moved, std::abs(double(p.x[0]) - samples.positions[own.particles().id(slot)][0]));
        CHECK(p.yours == int(own.particles().id(slot)));
    }
    CHECK(moved > 0.84 * steps * dt * 0.3);
    // Particles are added up in another order (theirs are never moved): rounding, grown over a hundred steps.
    CHECK(of_x < (sizeof(S) == 4 ? 1e-5 : 1e-13));
    CHECK(of_F < (sizeof(S) == 4 ? 1e-3 : 1e-12));
}

TEST_CASE("Arrays of each component, and matrices by columns, are seen as well") {
    scenes::RandomCloud<double, 2> rows(400);
    const Domain<2> domain = rows.domain;
    for (auto& F : rows.F) F = std::round(F);  // undeformed
    scenes::RandomCloud<double, 2> columns = rows;
    const std::size_t n = rows.size();
    std::vector<double> x(2 * n), vx(n), vy(n);
    for (std::size_t p = 0; p < n; ++p) {
        for (std::size_t a = 0; a < 2; ++a) {
            x[a * n + p] = rows.x[2 * p + a];
            (a == 0 ? vx : vy)[p] = rows.v[2 * p + a];
        }
        std::swap(columns.C[4 * p + 1], columns.C[4 * p + 2]);
        std::swap(columns.F[4 * p + 1], columns.F[4 * p + 2]);
    }
    auto view = columns.view();
    view.position = StridedSpan<double>::arrays(x.data(), 2, std::ptrdiff_t(n));
    view.velocity = StridedSpan<double>::arrays({vx.data(), vy.data()});
    view.affine = StridedSpan<double>::matrices<2>(columns.C.data(), false);
    view.state = {StridedSpan<double>::matrices<2>(columns.F.data(), false)};
    step<double, 2>(rows.view(), n, domain, 3);
    step<double, 2>(view, n, domain, 3);
    for (std::size_t p = 0; p < n; ++p) {
        for (std::size_t a = 0; a < 2; ++a) CHECK(x[a * n + p] == rows.x[2 * p + a]);
        CHECK(vx[p] == rows.v[2 * p]);
        CHECK(vy[p] == rows.v[2 * p + 1]);
        CHECK(columns.F[4 * p + 1] == rows.F[4 * p + 2]);
        CHECK(columns.C[4 * p + 2] == rows.C[4 * p + 1]);
    }
}

TEST_CASE("Arrays that cannot be the components of a field are refused") {
    double numbers[2] = {};
    auto* const between = reinterpret_cast<double*>(reinterpret_cast<char*>(numbers) + 4);
    CHECK_THROWS_AS(StridedSpan<double>::arrays({}), parameter_error);
    CHECK_THROWS_AS(StridedSpan<double>::arrays({numbers, between}), parameter_error);
}

TEMPLATE_TEST_CASE("P2G with a partition that is stale is refused, however its particles are scattered", "",
                   detail::Serial, Coloured, FixedPoint<std::int32_t>, ColouredFixedPoint<std::int32_t>) {
    // 16 particles a cell: blocks of their own; 1: sparse blocks that share an arena; few of them: spray.
    using Kernel = QuadraticBSpline;
    for (const double apart : {1.0 / 128, 1.0 / 32, 1.0 / 4})
        for (const bool by_hand : {false, true}) {
            const Domain<2> domain{{0.0, 0.0}, {4.0, 1.0}, 1.0 / 32};
            const auto samples = sample_box<2>({0.1, 0.3}, {0.9, 0.7}, {.spacing = apart});
            const std::size_t n = samples.positions.size();
            std::vector<float> x(2 * n), v(2 * n), C(4 * n), F(4 * n), stress(4 * n), mass(n, 1), volume(n, 1e-3F);
            for (std::size_t i = 0; i < n; ++i) {
                for (std::size_t a = 0; a < 2; ++a) x[2 * i + a] = float(samples.positions[i][int(a)]);
                v[2 * i] = 10;
                F[4 * i] = F[4 * i + 3] = 1;
            }
            using Span = StridedSpan<float>;
            const ForeignParticles<float, 2> view{
                Span::vectors<2>(x.data()),           Span::vectors<2>(v.data()), Span::matrices<2>(C.data(), true),
                symmetric_matrices<2>(stress.data()), Span::scalars(mass.data()), Span::scalars(volume.data()),
                {Span::matrices<2>(F.data(), true)}};
            const FixedCorotated<float> material;
            TestType execution{};
            auto partition = partition_particles<Kernel>(view, n, domain);
            SparseGrid<float, 2> grid(domain);
            grid.activate(partition);
            const auto scatter = [&] { p2g<Kernel, Apic, MlsForce>(execution, view, partition, grid, 1e-3); };
            CAPTURE(apart, by_hand);
            bool sort_needed = by_hand;
            if (by_hand) {
                scatter();
                for (std::size_t i = 0; i < n; ++i) x[2 * i + 1] += 0.2F;
            }
            for (int step = 0; step < 100 && !sort_needed; ++step) {
                REQUIRE_NOTHROW(scatter());
                grid_update(detail::Serial{}, grid, 1e-3, Vec<double, 2>::zero(), NoBoundary{});
                sort_needed =
                    g2p<Kernel, Apic, MlsForce>(detail::Serial{}, view, partition, grid, material, 1e-3).sort_needed;
            }
            REQUIRE(sort_needed);
            test_support::check_refused<usage_error>(scatter, "P2G is given a partition that is stale");
            test_support::check_refused<usage_error>(scatter, "partition_particles()");
            partition = partition_particles<Kernel>(view, n, domain);
            grid.activate(partition);
            CHECK_NOTHROW(scatter());
        }
}

}  // namespace foreign_tests
