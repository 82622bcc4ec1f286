/// \file Matter without stress, for tests of transfers: what it is, and a step by the public stages, in double.
#pragma once

#include "support/random_numbers.hpp"
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/loops/g2p.hpp>
#include <firn/loops/transfer_passes.hpp>
#include <firn/sort/partition.hpp>
#include <firn/transfer/aflip.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/flip.hpp>
#include <firn/transfer/fmpm.hpp>
#include <firn/transfer/pic.hpp>

namespace dust {

using namespace firn;
using test_support::Random;

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

/// a × b: the one component of it in 2D, all three in 3D.
inline Vec<double, 3> cross_product(const Vec<double, 2>& a, const Vec<double, 2>& b) {
    return {0, 0, a[0] * b[1] - a[1] * b[0]};
}
inline Vec<double, 3> cross_product(const Vec<double, 3>& a, const Vec<double, 3>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vec<double, 3> axial(const Mat<double, 2>& C) { return {0, 0, C(1, 0) - C(0, 1)}; }
inline Vec<double, 3> axial(const Mat<double, 3>& C) {
    return {C(2, 1) - C(1, 2), C(0, 2) - C(2, 0), C(1, 0) - C(0, 1)};
}

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

/// One step in which nothing acts.
template <class Transfer, class Force = MlsForce, int D>
void step(Cloud<D>& cloud, const Domain<D>& domain, double dt, const Transfer& transfer = {}) {
    using K = QuadraticBSpline;
    const auto view = cloud.view();
    const auto partition = partition_particles<K>(view, cloud.x.size(), domain, 1);
    const ParticleSet set{view, partition};
    SparseGrid<double, D> grid(domain);
    grid.activate(partition);
    TransferMemory<double> memory;
    before_p2g<K, Transfer>(detail::Serial{}, grid, set);
    p2g<K, Transfer, Force>(detail::Serial{}, grid, dt, set);
    after_p2g<K>(detail::Serial{}, grid, transfer, memory, set);
    grid_update(detail::Serial{}, grid, dt, Vec<double, D>::zero(), NoBoundary{});
    g2p<K, Transfer, Force>(detail::Serial{}, view, partition, grid, Dust<double>{}, dt, transfer);
}

/// 316 particles on a lattice of half a cell, which spin as a rigid body.
inline Cloud<2> spinning_disk(double h) {
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

/// Particles of unequal mass, moving and turning at random.
template <int D>
Cloud<D> random_cloud(std::uint64_t seed) {
    Random random(seed);
    Cloud<D> cloud;
    for (int p = 0; p < 200; ++p)
        cloud.add(random.vector<D>(0.2, 0.8), random.vector<D>(-1, 1), random.uniform(0.1, 2), random.gaussian<D>());
    return cloud;
}

}  // namespace dust
