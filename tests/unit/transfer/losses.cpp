// sanitized: no
/// \file What transfers lose in many steps, of the energy of waves and of the spin of a disk; and whether they let
/// bodies come apart.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/material/fixed_corotated.hpp>

#include "dust.hpp"

#include <numbers>

using namespace dust;

namespace losses_tests {
namespace {

const double h = 0.05;
const Domain<2> plane{{-3.0, -3.0}, {4.0, 4.0}, h};

/// Two shear waves of ten cells in a square of 20 × 20 cells (not optimised 10 × 10), four particles a cell.
Cloud<2> waves() {
    constexpr int n = test_support::fewer_if_slow(40, 20);
    Cloud<2> cloud;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const Vec<double, 2> x{(i + 0.5) * h / 2, (j + 0.5) * h / 2};
            const double k = 4 * std::numbers::pi;
            cloud.add(x, {std::sin(k * x[1]), std::sin(k * x[0])}, 1);
        }
    return cloud;
}

template <int D>
double energy(const Cloud<D>& cloud) {
    double sum = 0;
    for (std::size_t p = 0; p < cloud.x.size(); ++p) sum += cloud.mass[p] * dot(cloud.v[p], cloud.v[p]) / 2;
    return sum;
}

/// The share of the energy of waves that is left after 100 steps in which nothing acts.
template <class Transfer>
double energy_left(const Transfer& transfer) {
    Cloud<2> cloud = waves();
    const double start = energy(cloud);
    for (int k = 0; k < 100; ++k) step(cloud, plane, 1e-4, transfer);
    return energy(cloud) / start;
}

/// The share of the angular momentum of a spinning disk that is left after 200 steps.
template <class Transfer>
double spin_left(const Transfer& transfer) {
    Cloud<2> disk = spinning_disk(h);
    if (!Transfer::affine)
        for (auto& C : disk.C) C = Mat<double, 2>::zero();
    const double start = disk.angular_momentum(h)[2];
    for (int k = 0; k < 200; ++k) step(disk, plane, 0.01, transfer);
    return disk.angular_momentum(h)[2] / start;
}

}  // namespace

const std::vector<int> orders = test_support::full    ? std::vector{2, 4, 8}
                                : test_support::quick ? std::vector{2}
                                                      : std::vector{2, 4};

TEST_CASE("FLIP with α = 1 keeps the energy that PIC loses, FMPM loses less with every order", "[transfer]") {
    const double pic = energy_left(Pic{}), apic = energy_left(Apic{});
    CHECK(pic < 0.05);
    CHECK(std::abs(energy_left(Flip<double>{.ratio = 1}) - 1) < 1e-12);
    CHECK(std::abs(energy_left(Aflip<double>{.ratio = 1}) - 1) < 1e-12);
    const double flip = energy_left(Flip<double>{.ratio = 0.95}), aflip = energy_left(Aflip<double>{.ratio = 0.95});
    CHECK((flip > pic && flip < 1));
    CHECK((aflip > apic && aflip < 1));
    double before = pic;
    for (const int order : orders) {
        const double fmpm = energy_left(Fmpm{order});
        CHECK(1 - fmpm < (1 - before) * 0.7);
        before = fmpm;
    }
    if (test_support::full) CHECK(before > 0.99);  // of order 8
}

TEST_CASE("of a spinning disk FLIP with α = 1 keeps the angular momentum, FMPM the more the higher its order",
          "[transfer]") {
    CHECK(std::abs(spin_left(Flip<double>{.ratio = 1}) - 1) < 1e-12);
    CHECK(spin_left(Aflip<double>{.ratio = 1}) > 0.95);
    double before = spin_left(Pic{});
    CHECK(before < 0.01);
    for (const int order : orders) {
        const double fmpm = spin_left(Fmpm{order});
        CHECK(1 - fmpm < (1 - before) / 3);
        before = fmpm;
    }
}

namespace {

/// The gap, in cells, between two soft blocks that touch and fly apart for 0.24 s; freely it would be 10.1.
template <class Transfer>
double gap_after_pulling(const Transfer& transfer) {
    using K = QuadraticBSpline;
    const auto material = FixedCorotated<double>::from_young_poisson(1e3, 0.3);
    Cloud<2> cloud;
    for (int i = -12; i < 12; ++i)
        for (int j = 0; j < 10; ++j) {
            cloud.add({0.5 + (i + 0.5) * h / 2, 0.2 + (j + 0.5) * h / 2}, {i < 0 ? -1.0 : 1.0, 0.0}, 1000 * h * h / 4);
            cloud.volume.back() = h * h / 4;
        }
    const auto view = cloud.view();
    SparseGrid<double, 2> grid(plane);
    TransferMemory<double> memory;
    for (int k = 0; k < 240; ++k) {
        const double dt = 1e-3;
        const auto partition = partition_particles<K>(view, cloud.x.size(), plane, 1);
        const ParticleSet set{view, partition};
        grid.activate(partition);
        before_p2g<K, Transfer>(detail::Serial{}, grid, set);
        p2g<K, Transfer, MlsForce>(detail::Serial{}, grid, dt, set);
        after_p2g<K>(detail::Serial{}, grid, transfer, memory, set);
        grid_update(detail::Serial{}, grid, dt, Vec<double, 2>::zero(), NoBoundary{});
        g2p<K, Transfer, MlsForce>(detail::Serial{}, view, partition, grid, material, dt, transfer);
    }
    double left = -1e9, right = 1e9;
    for (std::size_t p = 0; p < cloud.x.size(); ++p)
        if (p < cloud.x.size() / 2)
            left = std::max(left, cloud.x[p][0]);
        else
            right = std::min(right, cloud.x[p][0]);
    return (right - left) / h;
}

}  // namespace

TEST_CASE("ASFLIP lets two bodies go that are pulled apart, where APIC and AFLIP hold them together", "[transfer]") {
    CHECK(gap_after_pulling(Apic{}) < 1.5);
    CHECK(gap_after_pulling(Aflip<double>{.ratio = 0.99}) < 1.5);
    CHECK(gap_after_pulling(Asflip<double>{.ratio = 0.99}) > 6);
}

}  // namespace losses_tests
