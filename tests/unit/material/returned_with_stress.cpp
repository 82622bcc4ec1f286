/// \file Models that return a state and give its stress at once: the stress is that of the state, and G2P uses it.
#include "support/catch.hpp"
#include "support/materials.hpp"
#include <firn/material/dissipating.hpp>
#include <firn/material/per_particle.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>
#include <firn/simulation.hpp>

using namespace firn;
using test_support::Random;

namespace {

template <class M, int D>
using State = material_state_t<M, D>;

/// Most of them beyond the yield surface; for sand at every third some volume has opened.
template <class M, int D>
State<M, D> trial(Random& random, int i) {
    using S = material_scalar_t<M>;
    State<M, D> state{};
    if constexpr (requires { state.volume_gain; })
        if (i % 3 == 0) state.volume_gain = S(random.uniform(0, 0.05));
    state.plastic_strain = S(random.uniform(0, 0.5));
    for (auto& number : state.F.m) number += S(random.uniform(-0.2, 0.2));
    return state;
}

/// τ of the returned state from its F: the logarithms lose ε of a stretch, times the moduli.
template <int D, class M>
void check_stress(const M& model) {
    static_assert(has_returned_with_stress<M, D>);
    using S = material_scalar_t<M>;
    Random random(7);
    const double allowed = 60 * double(std::numeric_limits<S>::epsilon()) * double(2 * model.mu + D * model.lambda);
    int returned = 0;
    for (int i = 0; i < 1000; ++i) {
        State<M, D> state = trial<M, D>(random, i);
        if (i % 2 == 0)  // hardly strained
            state.F = Mat<S, D>::identity() + (state.F - Mat<S, D>::identity()) * S(1e-3);
        const auto after = model.returned_with_stress(state);
        const Mat<S, D> expected = kirchhoff_stress(model, after.state);
        CAPTURE(i);
        CHECK(materials::size_of(cast<double>(after.stress) - cast<double>(expected)) <= allowed);
        const bool same = materials::size_of(cast<double>(after.state.F) - cast<double>(state.F)) == 0;
        returned += same ? 0 : 1;
        if (same)
            for (int k = 0; k < D * D; ++k) CHECK(after.stress.m[k] == expected.m[k]);
    }
    CHECK(returned > 300);
    CHECK(returned < 1000);
}

/// What G2P has stored is the stress of the states that it has stored.
template <class M>
void check_g2p(const M& model) {
    Simulation<3, M> simulation({{0, 0, 0}, {1, 1, 1}, 1. / 16}, model);
    simulation.add(sample_box<3>({0.3, 0.1, 0.3}, {0.7, 0.4, 0.7}, {.spacing = 1. / 32}), 1000);
    simulation.gravity[1] = -200;
    for (int i = 0; i < 100; ++i) simulation.step();
    const auto& particles = simulation.particles();
    const double allowed = 100 * 0x1p-23 * double(2 * model.mu + 3 * model.lambda);
    std::size_t flowed = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto state = particles.state(slot);
        const auto difference = particles.stress(slot) - kirchhoff_stress(model, state);
        CHECK(materials::size_of(cast<double>(difference)) <= allowed);
        flowed += state.plastic_strain > 0;
    }
    CHECK(flowed > particles.size() / 4);
}

/// Its stress is not that of dry sand.
struct Wet : Sand<float> {
    template <int D>
    Mat<float, D> kirchhoff_stress(const state<D>& sand) const {
        return Sand::kirchhoff_stress(sand) + Mat<float, D>::identity();
    }
};

}  // namespace

TEMPLATE_TEST_CASE("The stress that comes with a return is that of the state", "", float, double) {
    using S = TestType;
    const Sand<S> sand = Sand<S>::from_properties({.hardening = 9, .hardening_decay = 0.2, .initial_loss = 10});
    const VonMises<S> clay = VonMises<S>::from_properties({.hardening = 1e5});
    check_stress<2>(sand);
    check_stress<3>(sand);
    check_stress<2>(clay);
    check_stress<3>(clay);
}

TEST_CASE("G2P stores the stress of the states it stores, where both come at once") {
    check_g2p(Sand<float>{});
    check_g2p(VonMises<float>::from_properties({.yield_stress = 2e3}));
}

TEST_CASE("Only the model that defines state and stress at once is asked for them, not one that inherits from it") {
    STATIC_REQUIRE(has_returned_with_stress<Sand<float>, 3>);
    STATIC_REQUIRE(!has_returned_with_stress<Wet, 3>);
    STATIC_REQUIRE(!has_returned_with_stress<Dissipating<Sand<float>>, 3>);
    STATIC_REQUIRE(!has_returned_with_stress<PerParticle<Sand<float>, "mu">, 3>);
    STATIC_REQUIRE(!has_returned_with_stress<Snow<float>, 3>);
}
