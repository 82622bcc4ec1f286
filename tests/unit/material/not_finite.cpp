/// \file What is not finite in a particle's state shows in the sum of its stress that G2P looks at, or in its wave
/// speed.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/soil.hpp>

namespace not_finite_tests {

using namespace firn;

namespace {

template <class State>
bool is_finite(const State& state) {
    bool finite = true;
    constexpr auto members = State::fields();
    unroll<int(std::tuple_size_v<decltype(members)>)>([&](auto f) {
        const auto& member = state.*(std::get<f>(members).member);
        for (const auto& number : detail::Stored<std::remove_cvref_t<decltype(member)>>::numbers(member))
            finite = finite && std::isfinite(double(number[0]));
    });
    return finite;
}

/// A flow of which one number is NaN, infinite or so large that its square is; from two states.
template <int D, class Material>
void check() {
    using P = native_pack<material_scalar_t<Material>>;
    using T = value_type_t<P>;
    using Lifted = with_scalar_t<Material, P>;
    const Lifted material = lift<P>(Material{});
    int seen = 0;
    for (const double strain : {1.0, 0.97})
        for (const T planted : {std::numeric_limits<T>::quiet_NaN(), std::numeric_limits<T>::infinity(),
                                -std::numeric_limits<T>::infinity(), std::numeric_limits<T>::max()})
            for (int k = 0; k < D * D; ++k) {
                material_state_t<Lifted, D> state = initial_state<D>(material);
                if constexpr (requires { state.F; }) state.F = state.F * P(T(strain));
                Mat<P, D> gradient = Mat<P, D>::zero();
                gradient.m[k] = P(planted);
                state = updated(material, state, gradient, P(T(1)));
                const Mat<P, D> stress = stress_of(material, state, gradient);
                bool finite = is_finite(state);
                for (const P& number : stress.m) finite = finite && std::isfinite(number[0]);
                const P speed = signal_speed(material, Vec<P, D>::zero(), P(T(1)), P(T(1)), state, P(T(1)));
                const P sum = detail::sum_of_stress<Lifted>(stress) + speed;
                CAPTURE(Material::name, D, strain, planted, k);
                CHECK((finite || !std::isfinite(sum[0])));
                seen += !finite;
            }
    CHECK(seen > 0);
}

}  // namespace

TEMPLATE_TEST_CASE("a state that is not finite shows in what G2P sums up", "[material]", FixedCorotated<float>,
                   NeoHookean<double>, Hencky<float>, VonMises<float>, Sand<float>, Snow<float>, Nacc<float>,
                   MohrCoulomb<float>, ModifiedCamClay<float>, Fluid<float>) {
    check<2, TestType>();
    check<3, TestType>();
}

}  // namespace not_finite_tests
