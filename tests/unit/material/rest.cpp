/// \file What a state gathers (a plastic strain, a volume ratio, a dissipated energy) stands while the matter is at
/// rest, for every material of firn and after every kind of loading.
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/material/dissipating.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/per_particle.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>

using namespace materials;

namespace {

/// The numbers of a state that are not F: what it gathers.
template <class State>
std::vector<double> gathered(State state) {
    std::vector<double> all;
    std::apply(
        [&](const auto&... field) {
            const auto add = [&](const auto& number) {
                if constexpr (std::floating_point<std::remove_cvref_t<decltype(number)>>) all.push_back(double(number));
            };
            (add(field.of(state)), ...);
        },
        State::fields());
    return all;
}

/// The state after a step of one second, as G2P computes it.
template <int D, class M>
State<M, D> after_step(const M& model, const State<M, D>& state,
                       const Mat<material_scalar_t<M>, D>& velocity_gradient) {
    using S = material_scalar_t<M>;
    if constexpr (has_returned_with_stress<M, D>)
        return updated_with_stress(model, state, velocity_gradient, S(1)).state;
    else
        return updated(model, state, velocity_gradient, S(1));
}

enum class Loading { compression, shear, opening, tip, turning };
constexpr Loading loadings[] = {Loading::compression, Loading::shear, Loading::opening, Loading::tip, Loading::turning};

/// The velocity gradient [1/s] of one of 40 steps of loading.
template <class S, int D>
Mat<S, D> rate(Loading loading, int step, Random& random) {
    Mat<S, D> rate = Mat<S, D>::zero();
    switch (loading) {
        case Loading::compression:
            rate(0, 0) = S(-0.01), rate(1, 1) = S(-0.004);
            break;
        case Loading::shear:
            rate = Mat<S, D>::diagonal(S(-0.001)), rate(0, 1) = S(0.013);
            break;
        case Loading::opening:
            rate(0, 0) = S(0.01), rate(1, 1) = S(0.002);
            break;
        case Loading::tip:
            rate = Mat<S, D>::diagonal(S(step < 20 ? -0.003 : 0.011));
            break;
        case Loading::turning:  // strained while it turns: F is not near a diagonal
            for (S& number : rate.m) number = S(random.uniform(-0.008, 0.012));
            rate(0, 1) += S(0.03);
            rate(1, 0) -= S(0.03);
            break;
    }
    return rate;
}

template <class M, int D>
void check_at_rest(const M& model, double largest_change, double per_strain = 4) {
    using S = material_scalar_t<M>;
    const double eps = double(std::numeric_limits<S>::epsilon());
    const auto rest = Mat<S, D>::zero();
    for (const Loading loading : loadings)
        for (std::uint64_t seed = 0; seed < (loading == Loading::turning ? test_support::fewer_if_quick(20u, 5u)
                                                                         : test_support::fewer_if_quick(9u, 1u));
             seed += 4) {
            CAPTURE(M::name, D, sizeof(S), int(loading), seed);
            Random random(seed);
            State<M, D> state = initial_state<D>(model);
            const S part = S(0.5 + 0.05 * double(seed));
            for (int i = 0; i < 40; ++i) state = after_step<D>(model, state, rate<S, D>(loading, i, random) * part);

            const std::vector<double> loaded = gathered(state);
            State<M, D> resting = state, disturbed = state;
            for (int i = 0; i < 1000; ++i) resting = after_step<D>(model, resting, rest);
            const std::vector<double> settled = gathered(resting);
            for (int i = 0; i < 300; ++i) resting = after_step<D>(model, resting, rest);
            CHECK(gathered(resting) == settled);  // to the bit: nothing that rounding adds goes on for ever

            double noise = 0;  // the sum of ‖∇v‖ dt: no strain is longer
            for (int i = 0; i < 300; ++i) {
                Mat<S, D> small{};
                for (S& number : small.m) number = S(eps * random.uniform(-1, 1));
                disturbed = after_step<D>(model, disturbed, small);
                noise += materials::size_of(small);
            }
            const std::vector<double> moved = gathered(disturbed);
            // A strain moves by the strains that are imposed; an energy by them times the stress, and by the rounding
            // of ψ in every step.
            for (std::size_t k = 0; k < loaded.size(); ++k) {
                CAPTURE(k, loaded[k], noise);
                double size = std::max(1.0, std::abs(loaded[k]));
                if constexpr (has_energy_density<M, D>) size = std::max(size, double(energy_density(model, state)));
                CHECK(std::abs(settled[k] - loaded[k]) <= (largest_change + 32 * eps) * size);  // until F has settled
                CHECK(std::abs(moved[k] - loaded[k]) <= (largest_change + per_strain * noise) * size);
            }
        }
}

template <class S, template <class> class M>
void check_everywhere(const M<S>& model, double largest_change = 0) {
    check_at_rest<M<S>, 2>(model, largest_change);
    check_at_rest<M<S>, 3>(model, largest_change);
    Dissipating<M<S>> counted;
    PerParticle<M<S>, "mu"> varied;
    static_cast<M<S>&>(counted) = static_cast<M<S>&>(varied) = model;
    check_at_rest<Dissipating<M<S>>, 2>(counted, largest_change);
    check_at_rest<Dissipating<M<S>>, 3>(counted, largest_change);
    check_at_rest<PerParticle<M<S>, "mu">, 3>(varied, largest_change);
}

}  // namespace

TEMPLATE_TEST_CASE("what a state gathers stands at rest, after every loading", "[material]", FIRN_TEST_PRECISIONS) {
    using S = TestType;
    check_everywhere<S>(Sand<S>::from_properties({}));
    check_everywhere<S>(Sand<S>::from_properties(
        {.friction_angle = degrees(35), .hardening = degrees(9), .hardening_decay = 0.2, .initial_loss = degrees(10)}));
    check_everywhere<S>(Snow<S>{});
    check_everywhere<S>(VonMises<S>::from_properties({.yield_stress = 2e3}));
    check_everywhere<S>(VonMises<S>::from_properties({.yield_stress = 2e3, .hardening = 1e5}));
    check_everywhere<S>(MohrCoulomb<S>::from_properties(
        {.young = 1e6, .cohesion = 2e3, .dilatancy_angle = degrees(10), .tension = 1e3}));
    check_everywhere<S>(MohrCoulomb<S>::from_properties({.young = 1e6, .cohesion = 2e3, .softening_strain = 0.3}));
    // Clay that softens goes on to soften until its stress lies in its new ellipse: by less than the strain that its
    // largest tension has (β p₀ / κ = 0.012 here).
    check_everywhere<S>(Nacc<S>{}, 0.02);
    // Torn clay dilates by up to 16 times its shear strain.
    for (const auto& clay : {ModifiedCamClay<S>{}, ModifiedCamClay<S>::from_properties({.shear_modulus = 1e6})}) {
        check_at_rest<ModifiedCamClay<S>, 2>(clay, 0, 16);
        check_at_rest<ModifiedCamClay<S>, 3>(clay, 0, 16);
        check_at_rest<Dissipating<ModifiedCamClay<S>>, 3>(Dissipating<ModifiedCamClay<S>>{clay}, 0, 16);
    }
    check_at_rest<Fluid<S>, 2>(Fluid<S>{}, 0);
    check_at_rest<Fluid<S>, 3>(Fluid<S>{}, 0);
}
