/// \file A material in Eigen's terms (examples/eigen_material.hpp) against the same one in firn's, NeoHookean.
#include <firn/firn.hpp>
// What is asked of another material before Eigen's header is included says nothing of this one.
static_assert(firn::require_material<firn::NeoHookean<float>, 2>() && firn::require_material<firn::Snow<float>, 3>());

#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/dual.hpp>
#include <firn/core/lanes.hpp>
#include <firn/core/strict.hpp>

#include "../examples/eigen_material.hpp"

using namespace firn;

namespace {

constexpr double mu = 4e4, lambda = 6e4;  // [Pa]

template <class S>
double number(const S& x) {
    return double(lane_value(x, 0));
}

/// The largest ‖τ − τ′‖ / (ε (μ + λ) ‖F‖²) of both materials, over deformations up to a stretch of 2.
template <class S, int D>
double difference() {
    const double epsilon = std::numeric_limits<value_type_t<S>>::epsilon();
    const auto of_eigen = lift<S>(EigenNeoHookean<double>{.mu = mu, .lambda = lambda});
    const auto own = lift<S>(NeoHookean<double>{.mu = mu, .lambda = lambda});
    test_support::Random random(3);
    double largest = 0;
    for (int trial = 0; trial < 500; ++trial) {
        const Mat<double, D> exact = random.gaussian<D>() * 0.3 + Mat<double, D>::identity();
        if (determinant(exact) < 0.2) continue;
        ElasticState<S, D> state;
        for (int k = 0; k < D * D; ++k) state.F.m[k] = S(value_type_t<S>(exact.m[k]));
        const Mat<S, D> between = kirchhoff_stress(of_eigen, state) - kirchhoff_stress(own, state);
        double square = 0;
        for (const S& x : between.m) square += number(x) * number(x);
        largest = std::max(largest, std::sqrt(square) / (epsilon * (mu + lambda) * squared_norm(exact)));

        // The acoustic tensor's largest eigenvalue is no more than μ σ_max² + max(μ + λ (1 − ln J), 0).
        const double stretch = Eigen::Matrix<double, D, D>(as_eigen(exact)).operatorNorm();
        const double along = mu + lambda * (1 - std::log(determinant(exact)));
        const double least = std::sqrt((mu * stretch * stretch + std::max(along, 0.0)) / 1000);
        const double speed = number(wave_speed(of_eigen, S(1000), state));
        CHECK((speed >= least * (1 - 1e-6) && speed < 2 * least));
    }
    return largest;
}

}  // namespace

static_assert(require_material<EigenNeoHookean<float>, 2>() && require_material<EigenNeoHookean<double>, 3>());

TEMPLATE_TEST_CASE("A material in Eigen's terms has the stress of the same in firn's to rounding", "[material][eigen]",
                   FIRN_TEST_FIRST_2(float, native_pack<float>, double, native_pack<double>, dual<double>,
                                     dual<native_pack<float>>, strict<float>)) {
    const double in_plane = difference<TestType, 2>(), in_space = difference<TestType, 3>();
    CAPTURE(in_plane, in_space);
    CHECK((in_plane <= 16 && in_space <= 16));
    CHECK(in_space > 0);  // the two add up in another order
}

TEST_CASE("Dual numbers give the derivative of a stress in Eigen's terms", "[material][eigen]") {
    using S = dual<double>;
    const auto of_eigen = lift<S>(EigenNeoHookean<double>{.mu = mu, .lambda = lambda});
    const auto own = lift<S>(NeoHookean<double>{.mu = mu, .lambda = lambda});
    test_support::Random random(4);
    for (int trial = 0; trial < 100; ++trial) {
        const Mat<double, 3> F = random.upright_deformation<3>(), along = random.gaussian<3>();
        if (determinant(F) < 0.2) continue;
        ElasticState<S, 3> state;
        for (int k = 0; k < 9; ++k) state.F.m[k] = {F.m[k], along.m[k]};
        const auto tau = kirchhoff_stress(of_eigen, state), expected = kirchhoff_stress(own, state);
        for (int k = 0; k < 9; ++k)
            CHECK(tau.m[k].derivative == Approx(expected.m[k].derivative).epsilon(1e-12).margin(1e-12 * (mu + lambda)));
    }
}

TEST_CASE("A simulation of a material in Eigen's terms has the same bits on any number of threads",
          "[material][eigen]") {
    const auto run = [](const auto& material, int threads) {
        Simulation<3, std::remove_cvref_t<decltype(material)>> simulation({.cell_size = 1.0 / 16}, material, {threads});
        simulation.add(sample_box<3>({0.3, 0.02, 0.3}, {0.7, 0.3, 0.7}, {.spacing = 1.0 / 32}), 1000, {0, -1, 0});
        for (int i = 0; i < 20; ++i) simulation.step();
        return simulation.totals();
    };
    const EigenNeoHookean<float> of_eigen{.mu = float(mu), .lambda = float(lambda)};
    const Totals<3> one = run(of_eigen, 1), two = run(of_eigen, 2);
    CHECK((one.momentum == two.momentum && one.first_moment == two.first_moment));
    CHECK(one.kinetic_energy == two.kinetic_energy);
}
