// release: -O0
/// \file Transfers with further passes, FLIP, AFLIP, ASFLIP and FMPM: against their definitions, what they keep, and
/// that bodies come apart.
#include "support/by_definition.hpp"
#include "support/catch.hpp"

#include "dust.hpp"
#include <Eigen/Dense>

using namespace dust;
using by_definition::for_nodes;

namespace blends_tests {
namespace {

const double h = 0.05;
const Domain<2> plane{{-3.0, -3.0}, {4.0, 4.0}, h};

}  // namespace

TEMPLATE_TEST_CASE_SIG("FLIP and its kin blend as they are defined, with the velocities before and after the forces",
                       "[transfer]", ((int D), D), 2, 3) {
    // Stress acts: nodes' velocities before and after differ. The sums by plain loops, from the kernel's own functions.
    using K = QuadraticBSpline;
    const double dt = 1e-3;
    const auto check = [&](auto transfer, auto expected_of) {
        using Transfer = decltype(transfer);
        scenes::RandomCloud<double, D> cloud(1000);
        for (double& F : cloud.F) F = 0;
        for (std::size_t i = 0; i < cloud.F.size(); ++i) cloud.F[i] = i % (D * D) % (D + 1) == 0;
        const auto start = cloud;
        const auto view = cloud.view();
        const auto partition = partition_particles<K>(view, cloud.size(), cloud.domain, 1);
        const ParticleSet set{view, partition};
        SparseGrid<double, D> grid(cloud.domain), calm(cloud.domain);
        grid.activate(partition);
        calm.activate(partition);
        before_p2g<K, Transfer>(Coloured{2}, grid, set);
        p2g<K, Transfer, MlsForce>(Coloured{2}, grid, dt, set);
        grid_update(Coloured{2}, grid, dt, Vec<double, D>::filled(1), NoBoundary{});
        auto at_rest = start;
        for (double& s : at_rest.stress) s = 0;
        p2g<K, Transfer, MlsForce>(detail::Serial{}, at_rest.view(), partition, calm, dt);
        grid_update(detail::Serial{}, calm, dt, Vec<double, D>::zero(), NoBoundary{});
        g2p<K, Transfer, MlsForce>(Coloured{2}, view, partition, grid, Dust<double>{}, dt, transfer);
        double worst = 0, differ = 0;
        for (std::size_t p = 0; p < cloud.size(); ++p) {
            const auto x = by_definition::vector<D>(start.x, p), own = by_definition::vector<D>(start.v, p);
            const auto after = by_definition::g2p<K>(grid, x), before = by_definition::g2p<K>(calm, x);
            const auto [velocity, motion] = expected_of(after, before.velocity, own);
            worst = std::max(worst, norm(by_definition::vector<D>(cloud.v, p) - velocity));
            worst = std::max(worst, norm(by_definition::vector<D>(cloud.x, p) - x - motion * dt));
            if (Transfer::affine)
                worst = std::max(worst,
                                 1e-3 * std::sqrt(squared_norm(by_definition::matrix<D>(cloud.C, p) - after.affine)));
            differ = std::max(differ, norm(after.velocity - before.velocity));
        }
        CHECK(worst < 1e-12);
        CHECK(differ > 0.05);
    };
    using V = Vec<double, D>;
    using Result = std::pair<V, V>;
    const auto flip = [](const auto& after, const V& before, const V& own) {
        return Result{(own + after.velocity - before) * 0.7 + after.velocity * (1 - 0.7), after.velocity};
    };
    check(Flip<double>{.ratio = 0.7}, flip);
    check(Aflip<double>{.ratio = 0.7}, flip);
    check(Asflip<double>{.ratio = 0.7, .separation = 0.9, .approach = 0.2},
          [&](const auto& after, const V& before, const V& own) {
              // The gradient that moves F is C here (MLS).
              const double share = trace(after.affine) >= 0 ? 0.9 : 0.2;
              return Result{flip(after, before, own).first, after.velocity + (own - before) * (0.7 * share)};
          });
}

TEST_CASE("ASFLIP counts a flow that neither grows nor shrinks, as that of a rigid body, among those that grow",
          "[transfer]") {
    const Asflip<double> transfer{.ratio = 0.5, .separation = 1, .approach = 0};
    const Vec<double, 2> taken{1, 2}, before{0, 1}, own{2, 0};
    // taken + (own − before)/2
    CHECK(transfer.blended(taken, before, own, Mat<double, 2>::zero()).motion == Vec<double, 2>{2, 1.5});
    CHECK(transfer.blended(taken, before, own, Mat<double, 2>::rows(0, -3, 3, 0)).motion == Vec<double, 2>{2, 1.5});
    CHECK(transfer.blended(taken, before, own, Mat<double, 2>::rows(-1, 0, 0, 0)).motion == taken);
}

TEST_CASE("FLIP with α = 0 and FMPM of order 1 are PIC, AFLIP with α = 0 is APIC, to the bit", "[transfer]") {
    const Domain<3> box{Vec<double, 3>::zero(), Vec<double, 3>::filled(1), 0.1};
    const auto stepped = [&](auto transfer) {
        Cloud<3> cloud = random_cloud<3>(40);
        step<decltype(transfer)>(cloud, box, 1e-3, transfer);
        step<decltype(transfer)>(cloud, box, 1e-3, transfer);
        return cloud;
    };
    const auto same = [](const Cloud<3>& a, const Cloud<3>& b) {
        for (std::size_t p = 0; p < a.x.size(); ++p) {
            CHECK(a.x[p] == b.x[p]);
            CHECK(a.v[p] == b.v[p]);
            CHECK(std::equal(a.C[p].m, a.C[p].m + 9, b.C[p].m));
            CHECK(std::equal(a.F[p].m, a.F[p].m + 9, b.F[p].m));
        }
    };
    const auto pic = stepped(Pic{}), apic = stepped(Apic{});
    same(stepped(Flip<double>{.ratio = 0}), pic);
    same(stepped(Fmpm{.order = 1}), pic);
    same(stepped(Aflip<double>{.ratio = 0}), apic);
    same(stepped(Asflip<double>{.ratio = 0}), apic);
}

TEST_CASE(
    "FMPM's momenta are the series in the matrices as they are defined, which tends to the full mass matrix's inverse",
    "[transfer]") {
    // Nodes that many particles surround, so that the mass matrix has an inverse.
    using K = QuadraticBSpline;
    Random random(5);
    Cloud<2> cloud;
    for (int p = 0; p < 600; ++p)
        cloud.add(random.vector<2>(0.2, 0.6), random.vector<2>(-1, 1), random.uniform(0.5, 1.5));
    const Domain<2> box{{0.0, 0.0}, {1.0, 1.0}, 0.1};
    const auto view = cloud.view();
    const auto partition = partition_particles<K>(view, cloud.x.size(), box, 1);
    const ParticleSet set{view, partition};
    SparseGrid<double, 2> grid(box);
    grid.activate(partition);

    const int nodes = int(grid.block_count()) * block_nodes<2>, particles = int(cloud.x.size());
    Eigen::MatrixXd N = Eigen::MatrixXd::Zero(particles, nodes);  // v_p = N v
    for (int p = 0; p < particles; ++p)
        for_nodes<K>(box, cloud.x[std::size_t(p)], [&](const auto& node) {
            N(p, int(by_definition::place_of(grid, node)) / node_width) = node.weight;
        });
    const Eigen::VectorXd m = Eigen::Map<const Eigen::VectorXd>(cloud.mass.data(), particles);
    const Eigen::VectorXd lumped = N.transpose() * m;
    const Eigen::VectorXd per_mass = lumped.unaryExpr([](double x) { return x > 0 ? 1 / x : 0; });
    Eigen::MatrixXd v(particles, 2);
    for (int p = 0; p < particles; ++p) v.row(p) << cloud.v[std::size_t(p)][0], cloud.v[std::size_t(p)][1];
    const Eigen::MatrixXd v_1 = per_mass.asDiagonal() * (N.transpose() * (m.asDiagonal() * v));
    const Eigen::MatrixXd A = per_mass.asDiagonal() * (N.transpose() * (m.asDiagonal() * N));

    TransferMemory<double> memory;
    double before = 1e300;
    for (const int order : {2, 3, 5, 40}) {
        Eigen::MatrixXd term = v_1, sum = v_1;
        for (int k = 1; k < order; ++k) {
            term -= A * term;
            sum += term;
        }
        p2g<K, Fmpm, NoForce>(Coloured{2}, grid, 0.0, set);
        after_p2g<K>(Coloured{2}, grid, Fmpm{order}, memory, set);
        double worst = 0;
        for (int i = 0; i < nodes; ++i)
            for (int a = 0; a < 2; ++a)
                worst = std::max(worst, std::abs(grid.nodes(0)[i * node_width + a] - lumped[i] * sum(i, a)));
        CHECK(worst < 1e-13 * order);
        // p = M v for the full matrix: what the series leaves of the momentum, in the mean. A's smallest eigenvalues
        // are those of nodes that hardly touch matter, and of what particles cannot see.
        const double left = (lumped.asDiagonal() * (v_1 - A * sum)).norm();
        CHECK(left < before);
        before = left;
    }
}

TEMPLATE_TEST_CASE_SIG("every blend and order keeps momentum; FMPM with two sets of particles is FMPM with both in one",
                       "[transfer]", ((int D), D), 2, 3) {
    const Domain<D> box{Vec<double, D>::zero(), Vec<double, D>::filled(1), 0.1};
    const auto check = [&](auto transfer) {
        auto cloud = random_cloud<D>(41);
        if (!decltype(transfer)::affine)
            for (auto& C : cloud.C) C = Mat<double, D>::zero();
        const auto p = cloud.momentum();
        for (int k = 0; k < 5; ++k) step<decltype(transfer)>(cloud, box, 1e-3, transfer);
        CHECK(norm(cloud.momentum() - p) <= 1e-13 * norm(p) + 1e-13);
    };
    check(Flip<double>{});
    check(Aflip<double>{});
    check(Asflip<double>{});
    check(Fmpm{.order = 4});

    using K = QuadraticBSpline;
    auto one = random_cloud<D>(42), other = random_cloud<D>(43), both = one;
    for (std::size_t p = 0; p < other.x.size(); ++p) both.add(other.x[p], other.v[p], other.mass[p]);
    auto of_one = partition_particles<K>(one.view(), one.x.size(), box, 1);
    auto of_other = partition_particles<K>(other.view(), other.x.size(), box, 1);
    const auto of_both = partition_particles<K>(both.view(), both.x.size(), box, 1);
    SparseGrid<double, D> grid(box), expected(box);
    BlockPartition<D>* const partitions[] = {&of_one, &of_other};
    grid.activate(partitions);
    expected.activate(of_both);
    TransferMemory<double> memory;
    const ParticleSet first{one.view(), of_one}, second{other.view(), of_other}, all{both.view(), of_both};
    p2g<K, Fmpm, NoForce>(Coloured{2}, grid, 0.0, first, second);
    after_p2g<K>(Coloured{2}, grid, Fmpm{3}, memory, first, second);
    p2g<K, Fmpm, NoForce>(Coloured{2}, expected, 0.0, all);
    after_p2g<K>(Coloured{2}, expected, Fmpm{3}, memory, all);
    CHECK(by_definition::difference(by_definition::numbers(grid), by_definition::numbers(expected)) < 1e-14);
}

TEST_CASE("a blend that lacks the velocities before, a share beyond one and an order of zero are refused in a sentence",
          "[transfer]") {
    using K = QuadraticBSpline;
    Cloud<2> cloud = spinning_disk(h);
    const auto view = cloud.view();
    const auto partition = partition_particles<K>(view, cloud.x.size(), plane, 1);
    const ParticleSet set{view, partition};
    SparseGrid<double, 2> grid(plane);
    grid.activate(partition);
    TransferMemory<double> memory;
    p2g<K, Flip<double>, MlsForce>(detail::Serial{}, grid, 1e-3, set);
    const auto gather = [&](const Flip<double>& flip) {
        g2p<K, Flip<double>, MlsForce>(detail::Serial{}, view, partition, grid, Dust<double>{}, 1e-3, flip);
    };
    CHECK_THROWS_AS(gather({}), usage_error);
    before_p2g<K, Flip<double>>(detail::Serial{}, grid, set);
    p2g<K, Flip<double>, MlsForce>(detail::Serial{}, grid, 1e-3, set);
    CHECK_THROWS_AS(gather({.ratio = 1.5}), parameter_error);
    CHECK_THROWS_AS(gather({.ratio = std::numeric_limits<double>::quiet_NaN()}), parameter_error);
    CHECK_NOTHROW(gather({}));
    grid.activate(partition);  // and what the layer held is lost
    CHECK_THROWS_AS(gather({}), usage_error);
    CHECK_THROWS_AS(after_p2g<K>(detail::Serial{}, grid, Fmpm{0}, memory, set), parameter_error);
    for (const double wrong : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
        CHECK_THROWS_AS(Aflip<double>{.ratio = wrong}.check(), parameter_error);
        CHECK_THROWS_AS(Asflip<double>{.ratio = wrong}.check(), parameter_error);
        CHECK_THROWS_AS(Asflip<double>{.separation = wrong}.check(), parameter_error);
        CHECK_THROWS_AS(Asflip<double>{.approach = wrong}.check(), parameter_error);
    }
}

}  // namespace blends_tests
