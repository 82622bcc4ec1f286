/// \file What holds for every constitutive model, checked for one model and state at a time: the stress is the
/// derivative of the energy, turns with the body, is isotropic; the wave speed bounds every plane wave; lanes and
/// floats give what plain doubles give.
#pragma once

#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/dual.hpp>
#include <firn/core/pack.hpp>
#include <firn/data/particle_view.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/principal_axes.hpp>

namespace materials {

using namespace firn;
using test_support::Random;

template <class M, int D>
using State = material_state_t<M, D>;

template <class S, int D>
double size_of(const Mat<S, D>& a) {
    double sum = 0;
    for (const S& x : a.m) sum += double(x) * double(x);
    return std::sqrt(sum);
}
template <int D>
Vec<double, D> singular_values(const Mat<double, D>& F) {
    const Eigen::Matrix<double, D, 1> s = Eigen::JacobiSVD<Eigen::Matrix<double, D, D>>(as_eigen(F)).singularValues();
    Vec<double, D> r{};
    for (int i = 0; i < D; ++i) r[i] = s[i];
    if (determinant(F) < 0) r[D - 1] = -r[D - 1];
    return r;
}
/// Q diag(s) Pᵀ for random rotations.
template <int D>
Mat<double, D> with_singular_values(Random& random, const Vec<double, D>& s) {
    Mat<double, D> F = random.rotation<D>();
    for (int j = 0; j < D; ++j)
        for (int i = 0; i < D; ++i) F(i, j) *= s[j];
    return F * random.rotation<D>();
}
/// Stretches along the axes.
template <int D>
Mat<double, D> diagonal_of(std::initializer_list<double> stretches) {
    Mat<double, D> F = Mat<double, D>::identity();
    int i = 0;
    for (const double s : stretches)
        if (i < D) F(i, i) = s, ++i;
    return F;
}
template <int D>
Mat<double, D> simple_shear(double k) {
    Mat<double, D> F = Mat<double, D>::identity();
    F(0, 1) = k;
    return F;
}

/// The numbers of a field of a state, as they are stored.
template <class Member>
auto numbers_in(const Member& member) {
    return firn::detail::Stored<Member>::numbers(member);
}
/// The same state with another scalar.
template <class To, class From>
To converted(const From& from) {
    To to{};
    constexpr auto a = From::fields();
    constexpr auto b = To::fields();
    unroll<int(std::tuple_size_v<decltype(a)>)>([&](auto f) {
        auto& y = to.*(std::get<f>(b).member);
        using Y = firn::detail::Stored<std::remove_cvref_t<decltype(y)>>;
        const auto x = numbers_in(from.*(std::get<f>(a).member));
        std::array<typename Y::Number, x.size()> numbers;
        for (std::size_t k = 0; k < x.size(); ++k) numbers[k] = typename Y::Number(x[k]);
        y = Y::made(numbers);
    });
    return to;
}
/// All numbers of a state, as they are stored.
template <class S>
std::vector<double> numbers_of(const S& state) {
    std::vector<double> all;
    std::apply(
        [&](const auto&... field) {
            const auto add = [&](const auto& member) {
                for (const auto number : numbers_in(member)) all.push_back(double(number));
            };
            (add(state.*field.member), ...);
        },
        S::fields());
    return all;
}
template <class S>
bool same_bits(const S& a, const S& b) {
    return numbers_of(a) == numbers_of(b);
}
/// Where the compiler may fuse multiplication and addition, lanes and plain numbers need not agree to the bit.
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
inline constexpr bool fused = true;
#else
inline constexpr bool fused = false;
#endif

template <template <class> class M, int D>
State<M<dual<double>>, D> changing(const State<M<double>, D>& state, const Mat<double, D>& dF) {
    auto lifted = converted<State<M<dual<double>>, D>>(state);
    for (int k = 0; k < D * D; ++k) lifted.F.m[k].derivative = dF.m[k];
    return lifted;
}

/// τ = ∂ψ/∂F Fᵀ at fixed plastic state. \param scale  a modulus [Pa]
template <template <class> class M, int D>
void check_energy(const M<double>& model, const State<M<double>, D>& state, double scale) {
    static_assert(has_energy_density<M<double>, D>);
    const auto lifted = lift<dual<double>>(model);
    Mat<double, D> P{};
    for (int k = 0; k < D * D; ++k) {
        Mat<double, D> direction = Mat<double, D>::zero();
        direction.m[k] = 1;
        const auto psi = energy_density(lifted, changing<M, D>(state, direction));
        CHECK(psi.value == Approx(energy_density(model, state)).margin(1e-14 * scale));
        P.m[k] = psi.derivative;
    }
    const Mat<double, D> tau = kirchhoff_stress(model, state);
    CHECK(size_of(tau - P * transpose(state.F)) <= 1e-11 * (size_of(tau) + scale * (1 + squared_norm(state.F))));
}

/// τ(QF) = Q τ Qᵀ, τ(FQ) = τ; the energy is the same.
template <template <class> class M, int D>
void check_turned(const M<double>& model, const State<M<double>, D>& state, Random& random, double scale) {
    const Mat<double, D> Q = random.rotation<D>();
    const Mat<double, D> tau = kirchhoff_stress(model, state);
    const double allowed = 1e-12 * (size_of(tau) + scale * (1 + squared_norm(state.F)));
    auto turned = state, turned_before = state;
    turned.F = Q * state.F;
    turned_before.F = state.F * Q;
    CHECK(size_of(kirchhoff_stress(model, turned) - Q * tau * transpose(Q)) <= allowed);
    CHECK(size_of(kirchhoff_stress(model, turned_before) - tau) <= allowed);
    CHECK(energy_density(model, turned) == Approx(energy_density(model, state)).margin(allowed));
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < i; ++j) CHECK(tau(i, j) == tau(j, i));
}

/// ρ0 c² of the fastest plane wave along n, by dual numbers through the stress: the largest eigenvalue of Q, where
/// Q m = dτ n − (m·n) τ n for the change dF = (m nᵀ) F. (Q m = (∂²ψ/∂F² : dF) Fᵀ n, and τ = P Fᵀ.)
template <template <class> class M, int D>
double stiffest(const M<double>& model, const State<M<double>, D>& state, const Vec<double, D>& n) {
    const auto lifted = lift<dual<double>>(model);
    Mat<double, D> Q{};
    for (int k = 0; k < D; ++k) {
        Vec<double, D> m = Vec<double, D>::zero();
        m[k] = 1;
        const Mat<dual<double>, D> tau = kirchhoff_stress(lifted, changing<M, D>(state, outer(m, n) * state.F));
        Mat<double, D> value{}, change{};
        for (int i = 0; i < D * D; ++i) {
            value.m[i] = tau.m[i].value;
            change.m[i] = tau.m[i].derivative;
        }
        const Vec<double, D> q = change * n - value * n * n[k];
        for (int i = 0; i < D; ++i) Q(i, k) = q[i];
    }
    const double size = size_of(Q);
    CHECK(size_of(Q - transpose(Q)) <= 1e-7 * (1 + size));
    // Singular values are eigenvalues once all of them are positive.
    Q += Mat<double, D>::diagonal(size);
    return singular_values(Q)[0] - size;
}
/// The wave speed bounds plane waves along eight directions; returns how near the fastest came, as a part of 1.
template <template <class> class M, int D>
double check_wave_speed(const M<double>& model, const State<M<double>, D>& state, Random& random) {
    const double bound = wave_speed(model, 1.0, state);
    double closest = 0;
    for (int direction = 0; direction < 8; ++direction) {
        const double speed_squared = stiffest<M, D>(model, state, random.direction<D>());
        CHECK(speed_squared <= bound * bound * (1 + 1e-7));
        closest = std::max(closest, speed_squared / (bound * bound));
    }
    return closest;
}

/// Stress, energy, wave speed and the state after a return, of all lanes: the bits that a plain number gives.
/// \param state_of  state_of(i): a state of M<double>
template <class S, int D, template <class> class M, class StateOf>
void check_lanes(const M<S>& model, const StateOf& state_of, int count) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    const auto lifted = lift<P>(model);
    const auto near = [&](double a, double b, double size) {
        return fused ? std::abs(a - b) <= 1e4 * double(std::numeric_limits<S>::epsilon()) * (size + std::abs(b))
                     : a == b || (std::isnan(a) && std::isnan(b));
    };
    for (int first = 0; first < count; first += lanes) {
        State<M<P>, D> packed{};
        std::vector<State<M<S>, D>> plain;
        for (int lane = 0; lane < lanes; ++lane) {
            plain.push_back(converted<State<M<S>, D>>(state_of(first + lane)));
            std::apply(
                [&](const auto&... field) {
                    const auto set = [&](auto& to, const auto& from) {
                        auto numbers = numbers_in(to);
                        for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k].set(lane, numbers_in(from)[k]);
                        to = firn::detail::Stored<std::remove_cvref_t<decltype(to)>>::made(numbers);
                    };
                    constexpr auto of_plain = State<M<S>, D>::fields();
                    std::apply(
                        [&](const auto&... other) { (set(packed.*field.member, plain.back().*other.member), ...); },
                        of_plain);
                },
                State<M<P>, D>::fields());
        }
        const auto tau = kirchhoff_stress(lifted, packed);
        const P psi = energy_density(lifted, packed), c = wave_speed(lifted, P(2), packed);
        for (int lane = 0; lane < lanes; ++lane) {
            const auto& state = plain[std::size_t(lane)];
            const Mat<S, D> expected = kirchhoff_stress(model, state);
            const double scale = double(wave_speed(model, S(1), state)) * double(wave_speed(model, S(1), state));
            CAPTURE(first, lane);
            for (int k = 0; k < D * D; ++k) CHECK(near(double(tau.m[k][lane]), double(expected.m[k]), scale));
            CHECK(near(double(psi[lane]), double(energy_density(model, state)), scale));
            CHECK(near(double(c[lane]), double(wave_speed(model, S(2), state)), 0));
        }
        if constexpr (requires { model.returned(plain[0]); }) {
            auto after = lifted.returned(packed);
            for (int lane = 0; lane < lanes; ++lane) {
                auto expected = model.returned(plain[std::size_t(lane)]);
                std::vector<double> got;
                std::apply(
                    [&](const auto&... field) {
                        const auto add = [&](const auto& member) {
                            for (const auto& number : numbers_in(member)) got.push_back(double(number[lane]));
                        };
                        (add(after.*field.member), ...);
                    },
                    State<M<P>, D>::fields());
                const std::vector<double> wanted = numbers_of(expected);
                CAPTURE(first, lane);
                for (std::size_t k = 0; k < wanted.size(); ++k) CHECK(near(got[k], wanted[k], 1));
            }
        }
    }
}

/// A NaN anywhere in F is in the stress, before and after a return.
template <int D, class M>
void check_nan(const M& model) {
    for (int k = 0; k < D * D; ++k) {
        State<M, D> state{};
        state.F.m[k] = std::numeric_limits<material_scalar_t<M>>::quiet_NaN();
        CAPTURE(k);
        CHECK(std::isnan(trace(kirchhoff_stress(model, state))));
        CHECK(std::isnan(trace(kirchhoff_stress(
            model, updated(model, state, Mat<material_scalar_t<M>, D>::zero(), material_scalar_t<M>(0))))));
    }
}

/// Checks that F is upright, with principal stretches between `low` and `high`.
template <class T, int D>
void check_upright(const Mat<T, D>& F, double low, double high) {
    CHECK(determinant(F) > 0);
    const Vec<T, D> stretches = principal_stretches(F).stretches;
    for (int i = 0; i < D; ++i) {
        CHECK(stretches[i] > low);
        CHECK(stretches[i] < high);
    }
}

/// float against double, from the same (float) state; errors in ε of float times a modulus.
template <int D, template <class> class M>
void check_float(const M<float>& model, const State<M<double>, D>& of_double, double epsilons) {
    const M<double> exact = lift<double>(model);
    const auto state = converted<State<M<float>, D>>(of_double);
    const auto same = converted<State<M<double>, D>>(state);
    const double c = wave_speed(exact, 1.0, same);
    const double allowed = epsilons * 0x1p-23 * c * c;
    const Mat<double, D> error = cast<double>(kirchhoff_stress(model, state)) - kirchhoff_stress(exact, same);
    CHECK(size_of(error) <= allowed);
    CHECK(std::abs(double(energy_density(model, state)) - energy_density(exact, same)) <= allowed);
    CHECK(double(wave_speed(model, 1.0F, state)) == Approx(c).epsilon(1e-5));
    if constexpr (requires { model.returned(state); }) {
        const auto got = numbers_of(model.returned(state)), wanted = numbers_of(exact.returned(same));
        for (std::size_t k = 0; k < wanted.size(); ++k)
            CHECK(std::abs(got[k] - wanted[k]) <= epsilons * 0x1p-23 * (1 + std::abs(wanted[k])));
    }
}

}  // namespace materials
