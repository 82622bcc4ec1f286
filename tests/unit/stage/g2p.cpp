/// \file What one particle takes from the nodes around it: sums made axis by axis against the plain double and triple
/// sum.
#include "support/catch.hpp"
#include "support/one_particle.hpp"
#include <firn/force/mls.hpp>
#include <firn/force/none.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/linear.hpp>
#include <firn/stage/g2p.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/pic.hpp>

using namespace firn;
using namespace test_support;

namespace g2p_tests {
namespace {

using Kernel = QuadraticBSpline;
constexpr double h = 0.1;

template <int D>
double size_of(const Mat<double, D>& a) {
    return std::sqrt(squared_norm(a));
}

/// Σ N v, Σ N v oᵀ, Σ v ∇Nᵀ by sum_axis, the first axis first.
template <int D>
G2PSums<double, D> by_axes(const OneParticle<Kernel, D>& place, const std::vector<Vec<double, D>>& v) {
    using V = Vec<double, D>;
    constexpr int K = Kernel::support, centre = centre_node<Kernel>;
    const auto along = [&](auto axis, std::size_t number, const auto& self) {
        constexpr int a = axis;
        std::array<PartialSums<V, a, true, true>, std::size_t(K)> parts;
        unroll<K>([&](auto k) {
            const std::size_t node = number * std::size_t(K) + std::size_t(int(k));
            if constexpr (a == 0) {
                // `number` holds the indices of the last axis first; nodes are numbered with the last axis fastest.
                std::size_t n = 0, rest = node;
                for (int b = 0; b < D; ++b, rest /= std::size_t(K)) n = n * std::size_t(K) + rest % std::size_t(K);
                parts[std::size_t(int(k))].value = v[n];
            } else {
                parts[std::size_t(int(k))] = self(std::integral_constant<int, a - 1>{}, node, self);
            }
        });
        return sum_axis<centre>(parts, place.w[std::size_t(a)], place.g[std::size_t(a)]);
    };
    const auto sums = along(std::integral_constant<int, D - 1>{}, 0, along);
    G2PSums<double, D> r{sums.value, {}, {}};
    for (int i = 0; i < D; ++i)
        for (int a = 0; a < D; ++a) {
            r.moment(i, a) = sums.moment[std::size_t(a)][i];
            r.gradient(i, a) = sums.gradient[std::size_t(a)][i];
        }
    return r;
}

template <int D>
G2PSums<double, D> plain(const OneParticle<Kernel, D>& place, const std::vector<Vec<double, D>>& v) {
    G2PSums<double, D> r{Vec<double, D>::zero(), Mat<double, D>::zero(), Mat<double, D>::zero()};
    for (std::size_t n = 0; n < v.size(); ++n) {
        const Node<D>& node = place.nodes[n];
        r.velocity += v[n] * node.weight;
        r.moment += outer(v[n] * node.weight, node.offset);
        r.gradient += outer(v[n], node.gradient);
    }
    return r;
}

template <int D>
std::vector<Vec<double, D>> random_velocities(Random& random, std::size_t count) {
    std::vector<Vec<double, D>> v;
    for (std::size_t n = 0; n < count; ++n) v.push_back(random.vector<D>(-1, 1));
    return v;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("sums made axis by axis are the sums over all nodes", "[stage]", ((int D), D), 2, 3) {
    Random random(60);
    for (int trial = 0; trial < 100; ++trial) {
        const OneParticle<Kernel, D> place(random.vector<D>(0.5, 1.5));
        const auto v = random_velocities<D>(random, place.nodes.size());
        const auto sums = by_axes<D>(place, v), expected = plain<D>(place, v);
        CHECK(norm(sums.velocity - expected.velocity) <= 2e-15);
        CHECK(size_of(sums.moment - expected.moment) <= 4e-15);
        CHECK(size_of(sums.gradient - expected.gradient) <= 8e-15);
    }
}

TEMPLATE_TEST_CASE_SIG(
    "a particle takes v = Σ N v_i, C = 4/h² Σ N v_i (x_i − x_p)ᵀ, and ∇v by C or by weight gradients", "[stage]",
    ((int D), D), 2, 3) {
    Random random(61);
    for (int trial = 0; trial < 50; ++trial) {
        const OneParticle<Kernel, D> place(random.vector<D>(0.5, 1.5));
        const auto v = random_velocities<D>(random, place.nodes.size());
        const auto sums = plain<D>(place, v);
        Mat<double, D> C = Mat<double, D>::zero(), gradient = Mat<double, D>::zero();
        for (std::size_t n = 0; n < v.size(); ++n) {
            C += outer(v[n], (place.nodes[n].offset - place.d) * h) * (place.nodes[n].weight * 4 / (h * h));
            gradient += outer(v[n], place.nodes[n].gradient * (1 / h));
        }
        const double allowed = 1e-14 * 4 / h;
        const auto apic_mls = take_from_grid<Kernel, Apic, MlsForce>(sums, place.d, h);
        const auto apic_gradient = take_from_grid<Kernel, Apic, WeightGradientForce>(sums, place.d, h);
        const auto pic_mls = take_from_grid<Kernel, Pic, MlsForce>(sums, place.d, h);
        for (const auto& taken : {apic_mls, apic_gradient, pic_mls}) CHECK(taken.velocity == sums.velocity);
        CHECK(size_of(apic_mls.affine - C) <= allowed);
        CHECK(size_of(apic_mls.velocity_gradient - C) <= allowed);
        CHECK(size_of(apic_gradient.affine - C) <= allowed);
        CHECK(size_of(apic_gradient.velocity_gradient - gradient) <= allowed);
        CHECK(size_of(pic_mls.affine) == 0);
        CHECK(size_of(pic_mls.velocity_gradient - C) <= allowed);  // PIC keeps no C, but MLS forces are dual to it
    }
}

TEMPLATE_TEST_CASE_SIG("an affine velocity field a + G x is taken over exactly, wherever the particle lies", "[stage]",
                       ((int D), D), 2, 3) {
    Random random(62);
    for (int trial = 0; trial < 50; ++trial) {
        const OneParticle<Kernel, D> place(random.vector<D>(0.5, 1.5));
        const Vec<double, D> a = random.vector<D>(-1, 1);
        const Mat<double, D> G = random.gaussian<D>();
        std::vector<Vec<double, D>> v;
        for (const auto& node : place.nodes) v.push_back(a + G * (node.offset * h));
        const auto sums = by_axes<D>(place, v);
        const auto mls = take_from_grid<Kernel, Apic, MlsForce>(sums, place.d, h);
        const auto gradients = take_from_grid<Kernel, Pic, WeightGradientForce>(sums, place.d, h);
        CHECK(norm(mls.velocity - (a + G * (place.d * h))) <= 1e-14);
        CHECK(size_of(mls.affine - G) <= 1e-12);
        CHECK(size_of(mls.velocity_gradient - G) <= 1e-12);
        CHECK(size_of(gradients.velocity_gradient - G) <= 1e-12);
    }
}

// dt Σ f_i · v_i = −dt V0 τ : ∇v, where ∇v is what updates F: the energy that matter stores is what the nodes lose.
TEMPLATE_TEST_CASE("the work of a particle's forces on the nodes is the work of its stress", "[stage]",
                   (std::pair<Apic, MlsForce>), (std::pair<Pic, MlsForce>), (std::pair<Apic, WeightGradientForce>),
                   (std::pair<Pic, WeightGradientForce>)) {
    using Force = typename TestType::second_type;
    constexpr int D = 3;
    Random random(63);
    for (int trial = 0; trial < 50; ++trial) {
        const OneParticle<Kernel, D> place(random.vector<D>(0.5, 1.5));
        const auto v = random_velocities<D>(random, place.nodes.size());
        const Mat<double, D> any = random.gaussian<D>(), impulse = any + transpose(any);
        const Mat<double, D> A = Force::affine_part(impulse, inverse_inertia<Kernel>(h), h);
        const Mat<double, D> G = Force::gradient_part(impulse, h);
        double work = 0;
        for (std::size_t n = 0; n < v.size(); ++n) {
            const auto& node = place.nodes[n];
            work += dot(A * (node.offset - place.d) * node.weight + G * node.gradient, v[n]);
        }
        const auto taken =
            take_from_grid<Kernel, typename TestType::first_type, Force>(by_axes<D>(place, v), place.d, h);
        CHECK(std::abs(work - trace(impulse * taken.velocity_gradient)) <= 1e-14 * size_of(impulse) / h * 4);
    }
}

TEST_CASE("what G2P must sum is told by kernel, transfer and force form", "[stage]") {
    STATIC_REQUIRE((g2p_needs_moment<QuadraticBSpline, Apic, WeightGradientForce>));
    STATIC_REQUIRE((g2p_needs_moment<QuadraticBSpline, Pic, MlsForce>));
    STATIC_REQUIRE_FALSE((g2p_needs_moment<QuadraticBSpline, Pic, WeightGradientForce>));
    STATIC_REQUIRE_FALSE((g2p_needs_moment<Linear, Apic, NoForce>));
    STATIC_REQUIRE((g2p_needs_gradient<Linear, Apic, NoForce>));
    STATIC_REQUIRE_FALSE((g2p_needs_gradient<QuadraticBSpline, Apic, MlsForce>));
    STATIC_REQUIRE((g2p_needs_gradient<QuadraticBSpline, Apic, WeightGradientForce>));
    STATIC_REQUIRE_FALSE((g2p_needs_gradient<QuadraticBSpline, Pic, MlsForce>));
    STATIC_REQUIRE((g2p_needs_gradient<QuadraticBSpline, Pic, WeightGradientForce>));
}

}  // namespace g2p_tests
