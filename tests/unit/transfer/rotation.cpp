/// \file What each transfer keeps of a spinning disk, against numbers computed independently (tests/reference/
/// rotation.csv), and what every transfer keeps of any cloud of particles. By the public stages, in double, with a
/// material of this test's own that has no stress.
#include "support/catch.hpp"
#include "support/csv.hpp"
#include "support/random_numbers.hpp"
#include <firn/exec/g2p.hpp>
#include <firn/exec/grid_update.hpp>
#include <firn/exec/p2g.hpp>
#include <firn/exec/partition.hpp>
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/pic.hpp>

using namespace firn;
using test_support::Random;

namespace {

/// Matter that feels no force: no stress, no sound.
template <scalar S>
struct Dust {
    S unused = S(0);
    static constexpr auto parameters() { return std::tuple{parameter{"unused", "1", &Dust::unused}}; }
    template <int D>
    Mat<S, D> kirchhoff_stress(const Mat<S, D>&) const {
        return Mat<S, D>::zero();
    }
    template <int D>
    S wave_speed(const S&, const Mat<S, D>&) const {
        return S(0);
    }
};

struct Nowhere {
    template <class S, int D>
    Vec<S, D> velocity(const Vec<S, D>&, const Vec<S, D>& v) const {
        return v;
    }
    template <int D>
    bool reaches(const Vec<double, D>&, const Vec<double, D>&) const {
        return false;
    }
};

/// a × b: the one component of it in 2D, all three in 3D.
Vec<double, 3> cross_product(const Vec<double, 2>& a, const Vec<double, 2>& b) {
    return {0, 0, a[0] * b[1] - a[1] * b[0]};
}
Vec<double, 3> cross_product(const Vec<double, 3>& a, const Vec<double, 3>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec<double, 3> axial(const Mat<double, 2>& C) { return {0, 0, C(1, 0) - C(0, 1)}; }
Vec<double, 3> axial(const Mat<double, 3>& C) { return {C(2, 1) - C(1, 2), C(0, 2) - C(2, 0), C(1, 0) - C(0, 1)}; }

template <int D>
struct Cloud {
    std::vector<Vec<double, D>> x, v;
    std::vector<Mat<double, D>> C, F, stress;
    std::vector<double> mass, volume;

    void add(const Vec<double, D>& position, const Vec<double, D>& velocity, double m,
             const Mat<double, D>& affine = {}) {
        x.push_back(position);
        v.push_back(velocity);
        C.push_back(affine);
        F.push_back(Mat<double, D>::identity());
        stress.push_back(Mat<double, D>::zero());
        mass.push_back(m);
        volume.push_back(1e-3);
    }
    ForeignParticles<double, D> view() {
        using Span = StridedSpan<double>;
        return {Span::template vectors<D>(x[0].v),
                Span::template vectors<D>(v[0].v),
                Span::template matrices<D>(C[0].m, false),
                symmetric_matrices<D>(stress[0].m),
                Span::scalars(mass.data()),
                Span::scalars(volume.data()),
                {Span::template matrices<D>(F[0].m, false)}};
    }
    Vec<double, D> momentum() const {
        Vec<double, D> sum = Vec<double, D>::zero();
        for (std::size_t p = 0; p < x.size(); ++p) sum += v[p] * mass[p];
        return sum;
    }
    /// What a particle's own field turns included: m h²/4 (C10 − C01). Jiang et al. 2015, §5.3.
    Vec<double, 3> angular_momentum(double h) const {
        Vec<double, 3> sum = Vec<double, 3>::zero();
        for (std::size_t p = 0; p < x.size(); ++p)
            sum += (cross_product(x[p], v[p]) + axial(C[p]) * (h * h / 4)) * mass[p];
        return sum;
    }
};

template <class Transfer, class Force, int D>
void transfer_there_and_back(Cloud<D>& cloud, const Domain<D>& domain, double dt) {
    using K = QuadraticBSpline;
    const auto view = cloud.view();
    const auto partition = partition_particles<K>(view, cloud.x.size(), domain, 1);
    SparseGrid<double, D> grid(domain);
    grid.activate(partition);
    p2g<K, Transfer, Force>(Serial{}, view, partition, grid, dt);
    grid_update(Serial{}, grid, dt, Vec<double, D>::zero(), Nowhere{});
    g2p<K, Transfer, Force>(Serial{}, view, partition, grid, Dust<double>{}, dt);
}

/// 316 particles on a lattice of half a cell, which spin as a rigid body.
Cloud<2> spinning_disk(double h) {
    const double radius = 0.25, omega = 2, spacing = h / 2;
    const Vec<double, 2> centre{0.5, 0.5};
    Cloud<2> disk;
    for (int i = -20; i < 20; ++i) {
        for (int j = -20; j < 20; ++j) {
            const Vec<double, 2> r{(i + 0.5) * spacing, (j + 0.5) * spacing};
            if (norm(r) > radius) continue;
            disk.add(centre + r, {-omega * r[1], omega * r[0]}, 1, Mat<double, 2>::rows(0, -omega, omega, 0));
        }
    }
    return disk;
}

template <class Transfer>
std::vector<double> spin_history(int steps) {
    const double h = 0.05, dt = 0.01;
    Cloud<2> disk = spinning_disk(h);
    REQUIRE(disk.x.size() == 316);
    if (!Transfer::affine)
        for (auto& C : disk.C) C = Mat<double, 2>::zero();
    std::vector<double> L;
    for (int k = 0; k <= steps; ++k) {
        L.push_back(disk.angular_momentum(h)[2]);
        transfer_there_and_back<Transfer, MlsForce>(disk, Domain<2>{{-3.0, -3.0}, {4.0, 4.0}, h}, dt);
    }
    const double start = L.front();
    for (double& l : L) l /= start;
    return L;
}

/// Particles of unequal mass, moving and turning at random.
template <int D>
Cloud<D> random_cloud(std::uint64_t seed) {
    Random random(seed);
    Cloud<D> cloud;
    for (int p = 0; p < 200; ++p)
        cloud.add(random.vector<D>(0.2, 0.8), random.vector<D>(-1, 1), random.uniform(0.1, 2), random.gaussian<D>());
    return cloud;
}

}  // namespace

TEST_CASE("APIC keeps the angular momentum of a spinning disk over 200 transfers, PIC loses it as listed",
          "[transfer][reference]") {
    const auto rows = csv::read("rotation.csv");
    const auto apic = spin_history<Apic>(200), pic = spin_history<Pic>(200);
    for (const auto& row : rows) {
        const auto k = std::size_t(std::stoi(row.at("k")));
        CAPTURE(k);
        CHECK(std::abs(apic[k] - 1) <= 3e-14);
        CHECK(pic[k] == Approx(csv::number(row, "pic")).epsilon(1e-11).margin(0));
    }
    CHECK(rows.size() == 200);
}

TEMPLATE_TEST_CASE_SIG("every transfer keeps momentum, APIC the angular momentum too, of any particles", "[transfer]",
                       ((int D), D), 2, 3) {
    // 200 particles that share nodes; L ≈ 100 kg m²/s is a sum of terms of both signs.
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1), 0.1};
    const auto before = random_cloud<D>(40);
    const auto check = [&](auto transfer, auto force, bool affine) {
        auto cloud = before;
        if (!affine)
            for (auto& C : cloud.C) C = Mat<double, D>::zero();
        const auto p = cloud.momentum();
        const auto L = cloud.angular_momentum(domain.cell_size);
        transfer_there_and_back<decltype(transfer), decltype(force)>(cloud, domain, 1e-3);
        CHECK(norm(cloud.momentum() - p) <= 1e-13 * norm(p) + 1e-13);
        const double lost = norm(cloud.angular_momentum(domain.cell_size) - L);
        if (affine)
            CHECK(lost <= 1e-13 * norm(L) + 1e-13);
        else
            CHECK(lost > 1e-3 * norm(L));
    };
    check(Apic{}, MlsForce{}, true);
    check(Apic{}, WeightGradientForce{}, true);
    check(Pic{}, MlsForce{}, false);
    check(Pic{}, WeightGradientForce{}, false);
}

TEMPLATE_TEST_CASE_SIG("APIC hands an affine velocity field back unchanged, and its gradient", "[transfer]",
                       ((int D), D), 2, 3) {
    // v = a + G x on the grid: exact for particles whose nodes all carry it (Jiang et al. 2015, §5.3).
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1), 0.1};
    Random random(41);
    const Vec<double, D> a = random.vector<D>(-1, 1);
    const Mat<double, D> G = random.gaussian<D>();
    Cloud<D> cloud;
    for (int p = 0; p < 100; ++p) {
        const auto x = random.vector<D>(0.2, 0.8);
        cloud.add(x, a + G * x, random.uniform(0.1, 2), G);
    }
    const auto check = [&](auto force) {
        auto moved = cloud;
        transfer_there_and_back<Apic, decltype(force)>(moved, domain, 1e-3);
        for (std::size_t p = 0; p < moved.x.size(); ++p) {
            CHECK(norm(moved.v[p] - cloud.v[p]) <= 1e-12);
            CHECK(std::sqrt(squared_norm(moved.C[p] - G)) <= 1e-11);
            CHECK(norm(moved.x[p] - cloud.x[p] - cloud.v[p] * 1e-3) <= 1e-14);
            const Mat<double, D> F = Mat<double, D>::identity() + G * 1e-3;  // F ← (I + dt ∇v) F
            CHECK(std::sqrt(squared_norm(moved.F[p] - F)) <= 1e-13);
        }
    };
    check(MlsForce{});
    check(WeightGradientForce{});
}
