/// \file Models that return a state and give its stress at once: the stress is that of the state, and G2P uses it.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/material/dissipating.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/nacc.hpp>
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
    if constexpr (requires { state.plastic_strain; }) state.plastic_strain = S(random.uniform(0, 0.5));
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
    simulation.add(sample_box<3>({0.4, 0.1, 0.4}, {0.6, 0.4, 0.6}, {.spacing = 1. / 32}), 1000);
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
        if constexpr (requires { state.log_volume; })
            flowed += state.log_volume != 0;
        else
            flowed += state.plastic_strain > 0;
    }
    CHECK(flowed > particles.size() / 4);
}

/// Wrapped, a model returns the same states with the same stresses, to the bit; where its mu is the particle's own, as
/// a model of that mu does.
template <int D, class M>
void check_wrapped(const M& model) {
    using S = material_scalar_t<M>;
    M softer = model;
    softer.mu /= 2;
    PerParticle<M, "mu"> varied;
    Dissipating<M> counted;
    static_cast<M&>(varied) = static_cast<M&>(counted) = model;
    Random random(8);
    S dissipated = 0;
    for (int i = 0; i < 300; ++i) {
        const State<M, D> state = trial<M, D>(random, i);
        State<PerParticle<M, "mu">, D> of_varied{state, {softer.mu}};
        State<Dissipating<M>, D> of_counted{state, S(3)};
        const auto after = varied.returned_with_stress(of_varied);
        of<"mu">(of_varied) = model.mu;
        const auto own = varied.returned_with_stress(of_varied);
        const auto expected = softer.returned_with_stress(state);
        const auto and_lost = counted.returned_with_stress(of_counted);
        const auto of_model = model.returned_with_stress(state);
        CAPTURE(i);
        for (int k = 0; k < D * D; ++k) {
            CHECK(after.state.F.m[k] == expected.state.F.m[k]);
            CHECK(after.stress.m[k] == expected.stress.m[k]);
            CHECK(own.stress.m[k] == of_model.stress.m[k]);
            CHECK(and_lost.state.F.m[k] == of_model.state.F.m[k]);
            CHECK(and_lost.stress.m[k] == of_model.stress.m[k]);
        }
        CHECK(after.state.plastic_strain == expected.state.plastic_strain);
        CHECK(of<"mu">(after.state) == softer.mu);
        CHECK(and_lost.state.dissipated == S(3) + (model.energy_density(state) - model.energy_density(of_model.state)));
        CHECK(and_lost.state.dissipated == counted.returned(of_counted).dissipated);
        dissipated += and_lost.state.dissipated - 3;
    }
    CHECK(dissipated > 0);
}

/// Its stress is not that of dry sand.
template <scalar S>
struct Wet : Sand<S> {
    template <int D>
    Mat<S, D> kirchhoff_stress(const typename Sand<S>::template state<D>& sand) const {
        return Sand<S>::kirchhoff_stress(sand) + Mat<S, D>::identity();
    }
};

}  // namespace

TEMPLATE_TEST_CASE("The stress that comes with a return is that of the state", "", FIRN_TEST_PRECISIONS) {
    using S = TestType;
    const Sand<S> sand =
        Sand<S>::from_properties({.hardening = degrees(9), .hardening_decay = 0.2, .initial_loss = degrees(10)});
    const VonMises<S> clay = VonMises<S>::from_properties({.hardening = 1e5});
    check_stress<2>(sand);
    check_stress<3>(sand);
    check_stress<2>(clay);
    check_stress<3>(clay);
    const MohrCoulomb<S> soil = MohrCoulomb<S>::from_properties(
        {.young = 1e6, .dilatancy_angle = degrees(10), .tension = 5e3, .softening_strain = 0.3});
    check_stress<2>(soil);
    check_stress<3>(soil);
    check_stress<2>(Nacc<S>{});
    check_stress<3>(Nacc<S>{});
}

TEST_CASE("G2P stores the stress of the states it stores, where both come at once") {
    check_g2p(MohrCoulomb<float>::from_properties({.young = 1e6, .cohesion = 1e3, .tension = 1e3}));
    check_g2p(PerParticle<Sand<float>, "mu">{});
#ifndef FIRN_TEST_QUICK
    check_g2p(Sand<float>{});
    check_g2p(VonMises<float>::from_properties({.yield_stress = 2e3}));
    check_g2p(Dissipating<Sand<float>>{});
    check_g2p(Nacc<float>{});
#endif
}

TEMPLATE_TEST_CASE("A wrapped model, too, gives state and stress at once", "", FIRN_TEST_PRECISIONS) {
    using S = TestType;
    check_wrapped<3>(Sand<S>{});
    check_wrapped<2>(Sand<S>{});
    check_wrapped<3>(VonMises<S>::from_properties({.yield_stress = 2e3}));
    check_wrapped<3>(MohrCoulomb<S>::from_properties({.young = 1e6, .cohesion = 2e3, .softening_strain = 0.3}));
}

TEST_CASE("Only the model that defines state and stress at once is asked for them, not one that inherits from it") {
    STATIC_REQUIRE(has_returned_with_stress<Sand<float>, 3>);
    STATIC_REQUIRE(!has_returned_with_stress<Wet<float>, 3>);
    STATIC_REQUIRE(!has_returned_with_stress<Snow<float>, 3>);
    STATIC_REQUIRE(has_returned_with_stress<Dissipating<Sand<float>>, 3>);
    STATIC_REQUIRE(has_returned_with_stress<PerParticle<Sand<float>, "mu">, 3>);
    STATIC_REQUIRE(has_returned_with_stress<Dissipating<PerParticle<Sand<float>, "mu">>, 3>);
    STATIC_REQUIRE(!has_returned_with_stress<Dissipating<Wet<float>>, 3>);
    STATIC_REQUIRE(!has_returned_with_stress<PerParticle<Snow<float>, "mu">, 3>);
}
