/// \file What one particle gives to the nodes around it: the record contracted axis by axis, and moved to each node and
/// weighted there, against the formulas of the papers, summed plainly over all 9 or 27 nodes.
#include "support/catch.hpp"
#include "support/one_particle.hpp"
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/stage/p2g.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/pic.hpp>

using namespace firn;
using namespace test_support;

namespace p2g_tests {
namespace {

using Kernel = QuadraticBSpline;
constexpr double h = 0.1, dt = 0.25;

/// Momentum in the first D, mass in the last.
template <int D>
using NodeSum = Vec<double, D + 1>;

template <int D>
NodeSum<D> with_mass(const Vec<double, D>& momentum, double mass) {
    NodeSum<D> r{};
    for (int i = 0; i < D; ++i) r[i] = momentum[i];
    r[D] = mass;
    return r;
}

template <int D, bool Gradients>
OpenRecord<NodeSum<D>, D, Gradients> opened(const P2GRecord<double, D>& record) {
    OpenRecord<NodeSum<D>, D, Gradients> open;
    open.value = with_mass(record.momentum, record.mass);
    for (int a = 0; a < D; ++a) {
        open.column[std::size_t(a)] = with_mass(record.affine.column(a), 0);
        if constexpr (Gradients) open.gradient[std::size_t(a)] = with_mass(record.gradient.column(a), 0);
    }
    return open;
}

/// Closes the axes from the last to the first, the order of the row kernels. Offsets as constants where `Constant`.
template <int D, bool Gradients, bool Constant, class Sink>
void for_each_node(const P2GRecord<double, D>& record, const OneParticle<Kernel, D>& place, const Sink& sink) {
    const auto open = opened<D, Gradients>(record);
    const auto close = [&](auto axis, const auto& rest, std::size_t number, std::size_t scale,
                           const auto& self) -> void {
        constexpr std::size_t a = std::size_t(int(axis));
        unroll<Kernel::support>([&](auto k) {
            constexpr int offset = k - centre_node<Kernel>;
            const std::size_t node = number + std::size_t(int(k)) * scale;
            const auto next = [&] {
                if constexpr (Constant)
                    return rest.contract(std::integral_constant<int, offset>{}, place.w[a][std::size_t(int(k))],
                                         place.g[a][std::size_t(int(k))]);
                else
                    return rest.contract(double(offset), place.w[a][std::size_t(int(k))],
                                         place.g[a][std::size_t(int(k))]);
            }();
            if constexpr (a == 0)
                sink(place.nodes[node], next.value);
            else
                self(std::integral_constant<int, int(a) - 1>{}, next, node, scale * Kernel::support, self);
        });
    };
    close(std::integral_constant<int, D - 1>{}, open, 0, 1, close);
}

/// Moves to each node and weighs what it receives: alone, and onto another sum.
template <int D, bool Gradients, class Sink>
void for_each_node_moved_to(const P2GRecord<double, D>& record, const OneParticle<Kernel, D>& place, const Sink& sink) {
    for (const Node<D>& node : place.nodes) {
        auto there = opened<D, Gradients>(record);
        for (int a = 0; a < D; ++a) there = there.moved(a, node.offset[a]);
        std::array<double, std::size_t(Gradients ? D : 0)> gradients{};
        for (std::size_t a = 0; a < gradients.size(); ++a) gradients[a] = node.gradient[int(a)];
        const auto sum = NodeSum<D>::filled(0.5);
        sink(node, there.weighted(node.weight, gradients));
        sink(node, there.added_to(sum, node.weight, gradients) - sum);
    }
}

/// m N (v + C (x_i − x_p)) − dt V0 τ ∇N_i, with ∇N_i by the form of the forces. Jiang et al. 2016, eqs. (172), (173);
/// Hu et al. 2018, eq. (18).
template <int D, class Transfer, class Force>
Vec<double, D> by_the_paper(const P2GParticle<double, D>& particle, const Node<D>& node, const Vec<double, D>& d) {
    const Vec<double, D> r = (node.offset - d) * h;
    const Vec<double, D> v = Transfer::affine ? particle.velocity + particle.affine * r : particle.velocity;
    const Vec<double, D> gradient = Force::weight_gradients ? node.gradient * (1 / h) : r * (node.weight * 4 / (h * h));
    return v * (particle.mass * node.weight) - particle.stress * gradient * (dt * particle.volume);
}

template <int D, class Transfer, class Force>
void check_against_the_paper() {
    Random random(50);
    for (int trial = 0; trial < 50; ++trial) {
        const auto particle = random_particle<D>(random);
        const OneParticle<Kernel, D> place(random.vector<D>(0.5, 1.5));
        const auto record = make_record<Kernel, Transfer, Force>(particle, place.d, h, dt);
        int visited = 0;
        const auto check = [&](const Node<D>& node, const NodeSum<D>& given) {
            ++visited;
            const auto expected =
                with_mass(by_the_paper<D, Transfer, Force>(particle, node, place.d), particle.mass * node.weight);
            CHECK(norm(given - expected) <= 1e-13 * 40);  // dt V0 τ 4/h ≈ 40
        };
        for_each_node<D, Force::weight_gradients, true>(record, place, check);
        for_each_node<D, Force::weight_gradients, false>(record, place, check);
        for_each_node_moved_to<D, Force::weight_gradients>(record, place, check);
        CHECK(visited == 4 * int(place.nodes.size()));
    }
}

Vec<double, 3> cross_product(const Vec<double, 2>& a, const Vec<double, 2>& b) {
    return {0, 0, a[0] * b[1] - a[1] * b[0]};
}
Vec<double, 3> cross_product(const Vec<double, 3>& a, const Vec<double, 3>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec<double, 3> axial(const Mat<double, 2>& C) { return {0, 0, C(1, 0) - C(0, 1)}; }
Vec<double, 3> axial(const Mat<double, 3>& C) { return {C(2, 1) - C(1, 2), C(0, 2) - C(2, 0), C(1, 0) - C(0, 1)}; }

}  // namespace

TEMPLATE_TEST_CASE_SIG("a node receives what the papers say: APIC and PIC, forces by weight gradients and by MLS",
                       "[stage]", ((int D), D), 2, 3) {
    check_against_the_paper<D, Apic, MlsForce>();
    check_against_the_paper<D, Apic, WeightGradientForce>();
    check_against_the_paper<D, Pic, MlsForce>();
    check_against_the_paper<D, Pic, WeightGradientForce>();
}

TEMPLATE_TEST_CASE_SIG("P2G of one particle keeps mass, momentum and angular momentum; its stress adds none of them",
                       "[stage]", ((int D), D), 2, 3) {
    // L about the particle is m h²/4 (C10 − C01): the moment of inertia of the kernel (Jiang et al. 2015, §5.3). A
    // symmetric stress has no torque.
    Random random(51);
    const auto check = [&](auto transfer, auto force) {
        using Transfer = decltype(transfer);
        using Force = decltype(force);
        for (int trial = 0; trial < 50; ++trial) {
            const auto particle = random_particle<D>(random);
            const OneParticle<Kernel, D> place(random.vector<D>(0.5, 1.5));
            const auto record = make_record<Kernel, Transfer, Force>(particle, place.d, h, dt);
            NodeSum<D> sum = NodeSum<D>::zero();
            Vec<double, 3> L = Vec<double, 3>::zero();
            for_each_node<D, Force::weight_gradients, true>(
                record, place, [&](const Node<D>& node, const NodeSum<D>& given) {
                    sum += given;
                    Vec<double, D> momentum{};
                    for (int i = 0; i < D; ++i) momentum[i] = given[i];
                    L += cross_product((node.offset - place.d) * h, momentum);
                });
            const double allowed = 1e-13 * 40;
            CHECK(norm(sum - with_mass(particle.velocity * particle.mass, particle.mass)) <= allowed);
            const Vec<double, 3> spin =
                axial(particle.affine) * (particle.mass * h * h / 4 * (Transfer::affine ? 1 : 0));
            CHECK(norm(L - spin) <= allowed * h);
        }
    };
    check(Apic{}, MlsForce{});
    check(Apic{}, WeightGradientForce{});
    check(Pic{}, MlsForce{});
    check(Pic{}, WeightGradientForce{});
}

TEST_CASE("PIC does not read the particle's affine field", "[stage]") {
    Random random(52);
    auto particle = random_particle<2>(random);
    const Vec<double, 2> d{0.25, -0.5};
    const auto before = make_record<Kernel, Pic, MlsForce>(particle, d, h, dt);
    particle.affine = Mat<double, 2>::diagonal(std::numeric_limits<double>::quiet_NaN());
    const auto after = make_record<Kernel, Pic, MlsForce>(particle, d, h, dt);
    CHECK(before.momentum == after.momentum);
}

}  // namespace p2g_tests
