/// \file The arrays of a set of particles, whoever owns them: what the stages p2g() and g2p() work on.
#pragma once

#include <firn/data/field.hpp>
#include <firn/material/concept.hpp>

namespace firn {

/// Numbers in a symmetric D × D matrix, stored as the upper triangle by rows: 00 01 02 11 12 22.
template <int D>
inline constexpr int symmetric_size = D * (D + 1) / 2;

/// Place of element (i, j) in it.
template <int D>
FIRN_INLINE constexpr int symmetric_index(int i, int j) {
    const int low = i < j ? i : j, high = i < j ? j : i;
    return low * (2 * D - low - 1) / 2 + high;
}

/// Numbers in a field of a material's state: a scalar, a Vec or a Mat.
template <class T>
inline constexpr int component_count = 1;
template <class S, int D>
inline constexpr int component_count<Vec<S, D>> = D;
template <class S, int D>
inline constexpr int component_count<Mat<S, D>> = D * D;

template <class State>
inline constexpr std::size_t state_field_count = std::tuple_size_v<decltype(State::fields())>;

/// \tparam Field  BlockedSpan<S> or StridedSpan<S>
template <std::floating_point S, int D, class Field, class State = ElasticState<S, D>>
struct ParticleView {
    using scalar_type = S;
    using state_type = State;
    static constexpr int dimension = D;

    Field position;  ///< x [m], D
    Field velocity;  ///< v [m/s], D
    Field affine;    ///< C [1/s], D × D; written by affine transfers, zero otherwise
    Field stress;    ///< τ [Pa], symmetric (symmetric_size<D> numbers); G2P writes it for the next P2G
    Field mass;      ///< m [kg]
    Field volume;    ///< V0 [m^D]
    std::array<Field, state_field_count<State>> state;  ///< the material's state, in the order of State::fields()

    /// Calls the pack that begins at `slot` into the cache, all but the material's state.
    template <bool Affine>
    FIRN_INLINE void prefetch(std::size_t slot) const {
        position.template prefetch<D>(slot);
        velocity.template prefetch<D>(slot);
        stress.template prefetch<symmetric_size<D>>(slot);
        mass.template prefetch<1>(slot);
        volume.template prefetch<1>(slot);
        if constexpr (Affine) affine.template prefetch<D * D>(slot);
    }
    /// The same for the material's state.
    FIRN_INLINE void prefetch_state(std::size_t slot) const {
        constexpr auto members = State::fields();
        unroll<int(state_field_count<State>)>([&](auto f) FIRN_LAMBDA {
            using Number = std::remove_cvref_t<decltype(std::declval<State>().*(std::get<f>(members).member))>;
            state[f].template prefetch<component_count<Number>>(slot);
        });
    }
};

/// A foreign program's arrays, float or double, 2D or 3D.
template <std::floating_point S, int D, class State = ElasticState<S, D>>
using ForeignParticles = ParticleView<S, D, StridedSpan<S>, State>;

/// The upper triangles of full matrices, for ParticleView::stress. Only these numbers are read and written.
template <int D, std::floating_point S>
StridedSpan<S> symmetric_matrices(S* data, std::ptrdiff_t stride = D * D) {
    StridedSpan<S> span{data, stride, {}};
    for (int i = 0; i < D; ++i)
        for (int j = i; j < D; ++j) span.offset[std::size_t(symmetric_index<D>(i, j))] = i * D + j;
    return span;
}

template <class P, int D, class Field>
FIRN_INLINE Vec<P, D> load_vector(const Field& field, const Slots& slots) {
    Vec<P, D> r;
    unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = field.template load<P>(slots, i); });
    return r;
}
template <class P, int D, class Field>
FIRN_INLINE Mat<P, D> load_symmetric(const Field& field, const Slots& slots) {
    P stored[symmetric_size<D>];
    unroll<symmetric_size<D>>([&](auto k) FIRN_LAMBDA { stored[k] = field.template load<P>(slots, k); });
    Mat<P, D> r;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = stored[symmetric_index<D>(k % D, k / D)]; });
    return r;
}
template <class P, int D, class Field>
FIRN_INLINE void store_symmetric(const Field& field, const Slots& slots, const Mat<P, D>& a) {
    unroll<D>([&](auto i) FIRN_LAMBDA {
        unroll<D - i>([&](auto j) FIRN_LAMBDA { field.store(slots, symmetric_index<D>(i, i + j), a(i, i + j)); });
    });
}

namespace detail {
template <class P>
FIRN_INLINE P* components(P& a) {
    return &a;
}
template <class P, int D>
FIRN_INLINE P* components(Vec<P, D>& a) {
    return a.v;
}
template <class P, int D>
FIRN_INLINE P* components(Mat<P, D>& a) {
    return a.m;
}
}  // namespace detail

/// Reads a material's state, lifted to lanes.
template <class State, class Field, std::size_t N>
FIRN_INLINE State load_state(const std::array<Field, N>& fields, const Slots& slots) {
    State state;
    constexpr auto members = State::fields();
    unroll<int(N)>([&](auto f) FIRN_LAMBDA {
        auto& member = state.*(std::get<f>(members).member);
        auto* to = detail::components(member);
        unroll<component_count<std::remove_cvref_t<decltype(member)>>>(
            [&](auto k) FIRN_LAMBDA { to[k] = fields[f].template load<std::remove_cvref_t<decltype(*to)>>(slots, k); });
    });
    return state;
}
template <class State, class Field, std::size_t N>
FIRN_INLINE void store_state(const std::array<Field, N>& fields, const Slots& slots, State& state) {
    constexpr auto members = State::fields();
    unroll<int(N)>([&](auto f) FIRN_LAMBDA {
        auto& member = state.*(std::get<f>(members).member);
        const auto* from = detail::components(member);
        unroll<component_count<std::remove_cvref_t<decltype(member)>>>(
            [&](auto k) FIRN_LAMBDA { fields[f].store(slots, k, from[k]); });
    });
}

}  // namespace firn
