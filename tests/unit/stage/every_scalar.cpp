// quick: no
// sanitized: no
/// \file Every policy, every scalar, one test body: kernel, transfers, forces, material, boundary and the stages give
/// in float, double, SIMD lanes, dual numbers and the strict scalar what they give in plain double. No number is
/// stored: the double evaluation itself is held to reference numbers by the tests of each policy.
#include "support/each_scalar.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/stage/g2p.hpp>
#include <firn/stage/grid_update.hpp>
#include <firn/stage/p2g.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/pic.hpp>

using namespace firn;
using test_support::Numbers;
using test_support::Random;
using test_support::Reader;
using test_support::same_as_double;

namespace {

constexpr double h = 0.125, dt = 0.0009765625;

std::vector<std::vector<double>> random_cases(std::uint64_t seed, std::size_t inputs, double low, double high) {
    Random random(seed);
    std::vector<std::vector<double>> cases(67);  // odd: every case visits every lane
    for (auto& in : cases)
        for (std::size_t k = 0; k < inputs; ++k) in.push_back(random.uniform(low, high));
    return cases;
}
template <int D>
std::vector<std::vector<double>> deformations(std::uint64_t seed) {
    Random random(seed);
    std::vector<std::vector<double>> cases(67);
    for (auto& in : cases) {
        const Mat<double, D> F = random.deformation<D>();
        in.assign(F.m, F.m + D * D);
    }
    return cases;
}
double one(const double*) { return 1; }
template <int D>
double squared(const double* F) {
    double sum = 0;
    for (int k = 0; k < D * D; ++k) sum += F[k] * F[k];
    return sum;
}

template <class S>
Walls<double, 2> different_walls(std::integral_constant<int, 2>) {
    Walls<double, 2> walls{{{0, 0.25}}, {{1, 0.75}}, {}, {}};
    walls.at_lower = {Wall{Contact::separate, 0.25}, Wall{Contact::slip, 0.5}};
    walls.at_upper = {Wall{Contact::stick, 0}, Wall{Contact::separate, 2}};
    return walls;
}
template <class S>
Walls<double, 3> different_walls(std::integral_constant<int, 3>) {
    Walls<double, 3> walls{{{0, 0.25, 0.125}}, {{1, 0.75, 0.875}}, {}, {}};
    walls.at_lower = {Wall{Contact::separate, 0.25}, Wall{Contact::slip, 0.5}, Wall{Contact::stick, 0}};
    walls.at_upper = {Wall{Contact::stick, 0}, Wall{Contact::separate, 2}, Wall{Contact::slip, 0}};
    return walls;
}

template <class S, int D, class Transfer, class Force>
void check_record() {
    const auto definition = [](const auto* in) {
        using T = std::remove_cvref_t<decltype(*in)>;
        Reader<T> read{in};
        P2GParticle<T, D> particle;
        particle.mass = read.scalar() + T(2);
        particle.volume = read.scalar() + T(2);
        particle.velocity = read.template vector<D>();
        particle.affine = read.template matrix<D>();
        particle.stress = read.template matrix<D>();
        const Vec<T, D> d = read.template vector<D>();
        const auto record = make_record<QuadraticBSpline, Transfer, Force>(particle, d, T(h), T(1));
        return Numbers<T>{}.add(record.mass).add(record.momentum).add(record.affine).add(record.gradient);
    };
    // The largest terms: D⁻¹ h τ V0 dt = 4/h · 3, of D columns.
    same_as_double<S>(
        definition, random_cases(11, 2 + 2 * D + 2 * D * D, -1, 1), [](const double*) { return 12 / h * D; }, 4);
}

template <class S, int D, class Transfer, class Force>
void check_taken() {
    const auto definition = [](const auto* in) {
        using T = std::remove_cvref_t<decltype(*in)>;
        Reader<T> read{in};
        G2PSums<T, D> sums;
        sums.velocity = read.template vector<D>();
        sums.moment = read.template matrix<D>();
        sums.gradient = read.template matrix<D>();
        const Vec<T, D> d = read.template vector<D>();
        const auto taken = take_from_grid<QuadraticBSpline, Transfer, Force>(sums, d, T(h));
        return Numbers<T>{}.add(taken.velocity).add(taken.affine).add(taken.velocity_gradient);
    };
    same_as_double<S>(definition, random_cases(12, 2 * D + 2 * D * D, -1, 1), [](const double*) { return 8 / h; }, 4);
}

template <class S, int D>
void check_every_policy() {
    CAPTURE(D);
    SECTION("transfers and forces, in the record that P2G scatters and in what G2P takes" + std::to_string(D)) {
        check_record<S, D, Apic, MlsForce>();
        check_record<S, D, Apic, WeightGradientForce>();
        check_record<S, D, Pic, MlsForce>();
        check_record<S, D, Pic, WeightGradientForce>();
        check_taken<S, D, Apic, MlsForce>();
        check_taken<S, D, Apic, WeightGradientForce>();
        check_taken<S, D, Pic, MlsForce>();
        check_taken<S, D, Pic, WeightGradientForce>();
    }
    SECTION("fixed corotated elasticity" + std::to_string(D)) {
        // Lanes of the closed form and of the Jacobi path of left_stretch in one pack; half of them inverted.
        const FixedCorotated<double> model{3, 5};
        const auto stress = [&](const auto* in) {
            using T = std::remove_cvref_t<decltype(*in)>;
            return Numbers<T>{}.add(lift<T>(model).kirchhoff_stress(Reader<T>{in}.template matrix<D>()));
        };
        const auto energy = [&](const auto* in) {
            using T = std::remove_cvref_t<decltype(*in)>;
            return Numbers<T>{}.add(lift<T>(model).energy_density(Reader<T>{in}.template matrix<D>()));
        };
        const auto speed = [&](const auto* in) {
            using T = std::remove_cvref_t<decltype(*in)>;
            return Numbers<T>{}.add(lift<T>(model).wave_speed(T(2), Reader<T>{in}.template matrix<D>()));
        };
        const auto update = [&](const auto* in) {
            using T = std::remove_cvref_t<decltype(*in)>;
            const ElasticState<T, D> state{Reader<T>{in}.template matrix<D>()};
            return Numbers<T>{}.add(updated(lift<T>(model), state, state.F, T(dt)).F);
        };
        // 2μ ‖F‖² + λ (|J| + 1)², |J| ≤ ‖F‖^D
        const auto size = [](const double* F) {
            const double J = std::pow(squared<D>(F), 0.5 * D);
            return 6 * squared<D>(F) + 5 * (J + 1) * (J + 1) + 9;
        };
        same_as_double<S>(stress, deformations<D>(13), size, 2);
        same_as_double<S>(energy, deformations<D>(13), size, 2);
        same_as_double<S>(speed, deformations<D>(13), [&](const double* F) { return std::sqrt(size(F)); }, 4);
        same_as_double<S>(update, deformations<D>(13), [](const double* F) { return 1 + squared<D>(F); }, 2);
    }
    SECTION("walls, and the velocity of a node" + std::to_string(D)) {
        const auto walls = different_walls<S>(std::integral_constant<int, D>{});
        const auto wall = [&](const auto* in) {
            using T = std::remove_cvref_t<decltype(*in)>;
            Reader<T> read{in};
            const Vec<T, D> x = read.template vector<D>(), v = read.template vector<D>();
            return Numbers<T>{}.add(lift<T>(walls).velocity(x, v));
        };
        const auto node = [&](const auto* in) {
            using T = std::remove_cvref_t<decltype(*in)>;
            Reader<T> read{in};
            const T mass = max(read.scalar(), T(0));  // half of the nodes are empty
            const Vec<T, D> x = read.template vector<D>(), momentum = read.template vector<D>() * mass;
            const Vec<T, D> acceleration = read.template vector<D>();
            return Numbers<T>{}.add(node_velocity(momentum, mass, x, acceleration, T(dt), lift<T>(walls)));
        };
        same_as_double<S>(wall, random_cases(14, 2 * D, -1, 1.5), one, 4);
        same_as_double<S>(node, random_cases(15, 1 + 3 * D, -1, 1.5), one, 4);
    }
}

}  // namespace

TEMPLATE_TEST_CASE("every policy gives in every scalar what it gives in double, 2D and 3D", "[stage][scalar]",
                   FIRN_EVERY_SCALAR) {
    using S = TestType;
    static_assert(scalar<S>);
    SECTION("the kernel") {
        const auto kernel = [](const auto* in) {
            using T = std::remove_cvref_t<decltype(*in)>;
            const T x = in[0];
            const T f = x - base_node<QuadraticBSpline>(x);
            return Numbers<T>{}.add(QuadraticBSpline::weights(f)).add(QuadraticBSpline::gradients(f));
        };
        same_as_double<S>(kernel, random_cases(10, 1, -4, 4), [](const double*) { return 4; }, 2);
    }
    check_every_policy<S, 2>();
    check_every_policy<S, 3>();
}
