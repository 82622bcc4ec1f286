/// \file What a model may offer besides a stress and a wave speed: a stranger's models, outside of firn's namespace.
#include "support/catch.hpp"
#include <firn/material/fixed_corotated.hpp>
#include <firn/material/no_stress.hpp>
#include <firn/stage/time_step.hpp>

namespace stranger {

/// Needs F alone; offers nothing else.
template <firn::scalar S = float>
struct Plain {
    S k = S(2);
    static constexpr auto parameters() { return std::tuple{firn::parameter{"k", "Pa", &Plain::k}}; }
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const firn::Mat<S, D>& F) const {
        return F * k;
    }
    template <int D>
    S wave_speed(const S&, const firn::Mat<S, D>&) const {
        return k;
    }
};

/// Has a state, a return mapping, a rate-dependent stress, an energy and a diffusivity, all as members.
template <firn::scalar S = float>
struct Rich {
    S k = S(2);
    static constexpr auto parameters() { return std::tuple{firn::parameter{"k", "Pa", &Rich::k}}; }
    template <int D>
    struct state {
        firn::Mat<S, D> F = firn::Mat<S, D>::identity();
        S returns = S(0);
        static constexpr auto fields() {
            return std::tuple{firn::parameter{"F", "1", &state::F}, firn::parameter{"returns", "1", &state::returns}};
        }
    };
    template <int D>
    state<D> returned(const state<D>& trial) const {
        return {trial.F, trial.returns + S(1)};
    }
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const state<D>& s) const {
        return s.F * k;
    }
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const state<D>& s, const firn::Mat<S, D>& rate) const {
        return s.F * k + rate;
    }
    template <int D>
    S energy_density(const state<D>& s) const {
        return k * s.returns;
    }
    template <int D>
    S wave_speed(const S&, const state<D>&) const {
        return k;
    }
    template <int D>
    S diffusivity(const S& density, const state<D>&) const {
        return S(8) / density;
    }
};

/// Moves its state by a function of its own, found beside it.
template <firn::scalar S = float>
struct Own {
    S k = S(2);
    static constexpr auto parameters() { return std::tuple{firn::parameter{"k", "Pa", &Own::k}}; }
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const firn::Mat<S, D>& F) const {
        return F * k;
    }
    template <int D>
    S wave_speed(const S&, const firn::Mat<S, D>&) const {
        return k;
    }
};
template <class S, int D>
firn::ElasticState<S, D> updated(const Own<S>&, const firn::ElasticState<S, D>&, const firn::Mat<S, D>&, const S&) {
    return {firn::Mat<S, D>::diagonal(S(7))};
}

}  // namespace stranger

using namespace firn;
using stranger::Own, stranger::Plain, stranger::Rich;

static_assert(require_material<Plain<>, 2>() && require_material<Rich<>, 3>() && require_material<Own<>, 3>());
static_assert(!has_rate_dependent_stress<Plain<>, 3> && has_rate_dependent_stress<Rich<>, 3>);
static_assert(!has_energy_density<Plain<>, 2> && has_energy_density<Rich<>, 2> &&
              has_energy_density<FixedCorotated<>, 2>);
static_assert(!has_diffusivity<Plain<>, 3> && has_diffusivity<Rich<>, 3> && !has_diffusivity<FixedCorotated<>, 3>);

TEST_CASE("F follows the flow; then a model's own return mapping, if it has one", "[material]") {
    const Mat<double, 2> L = Mat<double, 2>::rows(0, 3, 0, 0);
    const auto plain = updated(Plain<double>{}, ElasticState<double, 2>{}, L, 0.1);
    CHECK(plain.F(0, 1) == 3 * 0.1);
    const auto rich = updated(Rich<double>{}, Rich<double>::state<2>{}, L, 0.1);
    CHECK(rich.F(0, 1) == plain.F(0, 1));
    CHECK(rich.returns == 1);
    CHECK(updated(Own<double>{}, ElasticState<double, 2>{}, L, 0.1).F(0, 0) == 7);
}

TEST_CASE("a stress may depend on the velocity gradient; one that does not ignores it", "[material]") {
    const Mat<double, 2> L = Mat<double, 2>::rows(0, 3, 0, 0);
    CHECK(stress_of(Plain<double>{}, ElasticState<double, 2>{}, L)(0, 1) == 0);
    CHECK(stress_of(Rich<double>{}, Rich<double>::state<2>{}, L)(0, 1) == 3);
    CHECK(kirchhoff_stress(Rich<double>{}, Rich<double>::state<2>{})(0, 1) == 0);
    CHECK(energy_density(Rich<double>{}, Rich<double>::state<2>{Mat<double, 2>::identity(), 3}) == 6);
    CHECK(energy_density(FixedCorotated<double>{}, ElasticState<double, 3>{}) == 0);
}

TEST_CASE("the signal speed is |v| + c, and 2 d/h where momentum diffuses", "[material]") {
    const Vec<double, 2> v{{3, 4}};
    CHECK(signal_speed(Plain<double>{}, v, 2.0, 0.5, ElasticState<double, 2>{}, 0.1) == 7);
    // ρ = 4: d = 8/4, h = 0.1.
    CHECK(signal_speed(Rich<double>{}, v, 2.0, 0.5, Rich<double>::state<2>{}, 0.1) == Approx(7 + 2 * 2 / 0.1));
    CHECK(signal_speed(Rich<double>{}, v, 0.0, 0.5, Rich<double>::state<2>{}, 0.1) == 0);
}

TEMPLATE_TEST_CASE_SIG("what has no stress has none, and no waves", "[material]", ((int D), D), 2, 3) {
    const NoStress<double> none;
    CHECK(squared_norm(kirchhoff_stress(none, initial_state<D>(none))) == 0);
    CHECK(wave_speed(none, 1000.0, initial_state<D>(none)) == 0);
}
