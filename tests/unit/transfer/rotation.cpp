// sanitized: no
/// \file What each transfer keeps of a spinning disk, against numbers computed independently (tests/reference/
/// rotation.csv), and what every transfer keeps of any cloud of particles. By the public stages, in double, with a
/// material of this test's own that has no stress.
#include "support/catch.hpp"
#include "support/csv.hpp"
#include <firn/force/weight_gradient.hpp>

#include "dust.hpp"

using namespace dust;

namespace rotation_tests {
namespace {

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
        step<Transfer>(disk, Domain<2>{{-3.0, -3.0}, {4.0, 4.0}, h}, dt);
    }
    const double start = L.front();
    for (double& l : L) l /= start;
    return L;
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
        step<decltype(transfer), decltype(force)>(cloud, domain, 1e-3);
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
        step<Apic, decltype(force)>(moved, domain, 1e-3);
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

}  // namespace rotation_tests
