/// \file The arrays of a set of particles, which the stages p2g() and g2p() read and write, and the table that
/// describes the fields in these arrays.
///
/// To add a field, add a member to ParticleView and a line to built_in().
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/field.hpp>
#include <firn/data/field_info.hpp>
#include <firn/material/concept.hpp>

#include <algorithm>
#include <array>

namespace firn::inline FIRN_BUILD {

/// \name Number of components of a type
/// @{

/// Number of components of T: 1 for a scalar, D for a `Vec<S, D>`, D² for a `Mat<S, D>` or a `DeformationGradient<S,
/// D>`.
template <class T>
inline constexpr int component_count = 1;
template <class S, int D>
inline constexpr int component_count<Vec<S, D>> = D;
template <class S, int D>
inline constexpr int component_count<Mat<S, D>> = D * D;
template <class S, int D>
inline constexpr int component_count<DeformationGradient<S, D>> = D * D;
/// @}

/// Number of fields in a material's state.
template <class State>
inline constexpr std::size_t state_field_count = std::tuple_size_v<decltype(State::fields())>;

/// The arrays of a set of particles, either firn's own particles or those of another program.
/// \tparam Field  `BlockedSpan<S>` for firn's own particles, `StridedSpan<S>` for arrays of another program
/// \tparam State  the material's state
template <std::floating_point S, int D, class Field, class State = ElasticState<S, D>>
struct ParticleView {
    using scalar_type = S;
    using state_type = State;  ///< type of the material's state
    static constexpr int dimension = D;

    /// D numbers. In another program's arrays: position x [m]. In firn's particle store: position within the block
    /// [cells].
    Field position;
    Field velocity;  ///< D numbers: velocity v [m/s]
    /// D × D numbers: affine velocity matrix C [1/s]. Affine transfers write it; with other transfers it is zero.
    Field affine;
    Field stress;  ///< symmetric_size<D> numbers: Kirchhoff stress τ [Pa]; written by G2P for the next P2G
    Field mass;    ///< mass m [kg]
    Field volume;  ///< initial volume V0 [m^D]
    /// The material's state: one array for each field, in the order of State::fields().
    std::array<Field, state_field_count<State>> state;

    /// A built-in field: one that every particle has.
    struct BuiltIn {
        FieldInfo info;                ///< the field's entry in the table of fields
        Field ParticleView::* member;  ///< the member of ParticleView that holds the field's array
    };
    /// Returns the built-in fields in the order of the table: one entry for each member above except `state`.
    static constexpr auto built_in() {
        using View = ParticleView;
        using enum FieldShape;
        using enum FieldRole;
        return std::array{
            BuiltIn{{"place", "1", vector, motion, everywhere(block_size / 2)}, &View::position},
            BuiltIn{{"velocity", "m/s", vector, motion}, &View::velocity},
            BuiltIn{{"affine_velocity", "1/s", matrix, FieldRole::affine}, &View::affine},
            BuiltIn{{"kirchhoff_stress", "Pa", symmetric_matrix, FieldRole::stress}, &View::stress},
            BuiltIn{{"mass", "kg", scalar, given, {}, FieldRange::positive}, &View::mass},
            BuiltIn{{"volume", D == 3 ? "m^3" : "m^2", scalar, given, {}, FieldRange::not_negative}, &View::volume},
        };
    }
    /// Returns the table index of the field that is stored in the given member of ParticleView.
    static consteval std::size_t line_of(Field ParticleView::* member) {
        std::size_t line = 0;
        while (built_in()[line].member != member) ++line;
        return line;
    }

    /// Prefetches all fields, except the material's state, of the particles in the pack that begins at `slot`.
    /// \tparam Affine  true if the field `affine` is prefetched, too
    template <bool Affine>
    FIRN_INLINE void prefetch(std::size_t slot) const {
        position.template prefetch<D>(slot);
        velocity.template prefetch<D>(slot);
        stress.template prefetch<symmetric_size<D>>(slot);
        mass.template prefetch<1>(slot);
        volume.template prefetch<1>(slot);
        if constexpr (Affine) affine.template prefetch<D * D>(slot);
    }
    /// Prefetches the material's state of the particles in the pack that begins at `slot`.
    FIRN_INLINE void prefetch_state(std::size_t slot) const {
        constexpr auto members = State::fields();
        unroll<int(state_field_count<State>)>([&](auto f) FIRN_LAMBDA {
            using Number = std::remove_cvref_t<decltype(std::declval<State>().*(std::get<f>(members).member))>;
            state[f].template prefetch<component_count<Number>>(slot);
        });
    }
};

/// The state of a material that has none.
struct NoState {
    static constexpr auto fields() { return std::tuple{}; }
};
/// What P2G and contact see of particles: all arrays except those of the material's state. So these stages are compiled
/// once, for all materials.
template <std::floating_point S, int D, class Field>
using MotionView = ParticleView<S, D, Field, NoState>;

/// Returns a view of the same particles without the material's state.
template <std::floating_point S, int D, class Field, class State>
MotionView<S, D, Field> motion_of(const ParticleView<S, D, Field, State>& view) {
    return {view.position, view.velocity, view.affine, view.stress, view.mass, view.volume, {}};
}

/// Particles in arrays of another program. S is float or double; D is 2 or 3.
template <std::floating_point S, int D, class State = ElasticState<S, D>>
using ForeignParticles = ParticleView<S, D, StridedSpan<S>, State>;

/// Returns a span that reads and writes the upper triangles of symmetric D × D matrices. In memory, each matrix has all
/// D² elements, row by row. Use the span for ParticleView::stress.
/// \param stride  distance between two matrices, counted in numbers of type S
template <int D, std::floating_point S>
StridedSpan<S> symmetric_matrices(S* data, std::ptrdiff_t stride = D * D) {
    StridedSpan<S> span{data, stride, {}};
    for (int i = 0; i < D; ++i)
        for (int j = i; j < D; ++j) span.offset[std::size_t(symmetric_index<D>(i, j))] = i * D + j;
    return span;
}

/// Returns the vectors of a field for the particles in some slots. \tparam P  a number (one slot), or a pack with one
/// lane per slot
template <class P, int D, class Field>
FIRN_INLINE Vec<P, D> load_vector(const Field& field, const Slots& slots) {
    Vec<P, D> r;
    unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = field.template load<P>(slots, i); });
    return r;
}
/// Returns the symmetric matrices of a field for the particles in some slots. \tparam P  a number (one slot), or a pack
/// with one lane per slot
template <class P, int D, class Field>
FIRN_INLINE Mat<P, D> load_symmetric(const Field& field, const Slots& slots) {
    P stored[symmetric_size<D>];
    unroll<symmetric_size<D>>([&](auto k) FIRN_LAMBDA { stored[k] = field.template load<P>(slots, k); });
    Mat<P, D> r;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = stored[symmetric_index<D>(k % D, k / D)]; });
    return r;
}
/// Writes the symmetric matrices of a field for the particles in some slots. Of the matrices `a`, only the upper
/// triangles are read.
template <class P, int D, class Field>
FIRN_INLINE void store_symmetric(const Field& field, const Slots& slots, const Mat<P, D>& a) {
    unroll<D>([&](auto i) FIRN_LAMBDA {
        unroll<D - i>([&](auto j) FIRN_LAMBDA { field.store(slots, symmetric_index<D>(i, i + j), a(i, i + j)); });
    });
}

namespace detail {

/// The numbers that memory holds of a value of type T. Of a DeformationGradient these are the components of F − I, of a
/// VolumeRatio J − 1.
template <class T>
struct Stored {
    using Number = T;
    template <class Q>
    using With = Q;                          ///< the type of the value with the scalar Q
    static constexpr bool less_one = false;  ///< whether the number, or the diagonal of the matrix, is stored less 1
    FIRN_INLINE static std::array<T, 1> numbers(const T& value) { return {value}; }
    FIRN_INLINE static T made(const std::array<T, 1>& numbers) { return numbers[0]; }
};
template <class P, int D>
struct Stored<Vec<P, D>> {
    using Number = P;
    template <class Q>
    using With = Vec<Q, D>;
    static constexpr bool less_one = false;
    FIRN_INLINE static std::array<P, D> numbers(const Vec<P, D>& value) { return std::to_array(value.v); }
    FIRN_INLINE static Vec<P, D> made(const std::array<P, D>& numbers) {
        Vec<P, D> value;
        unroll<D>([&](auto k) FIRN_LAMBDA { value.v[k] = numbers[k]; });
        return value;
    }
};
template <class P, int D>
struct Stored<Mat<P, D>> {
    using Number = P;
    template <class Q>
    using With = Mat<Q, D>;
    static constexpr bool less_one = false;
    FIRN_INLINE static std::array<P, D * D> numbers(const Mat<P, D>& value) { return std::to_array(value.m); }
    FIRN_INLINE static Mat<P, D> made(const std::array<P, D * D>& numbers) {
        Mat<P, D> value;
        unroll<D * D>([&](auto k) FIRN_LAMBDA { value.m[k] = numbers[k]; });
        return value;
    }
};
template <class P, int D>
struct Stored<DeformationGradient<P, D>> {
    using Number = P;
    template <class Q>
    using With = DeformationGradient<Q, D>;
    static constexpr bool less_one = true;
    FIRN_INLINE static std::array<P, D * D> numbers(const DeformationGradient<P, D>& value) {
        return Stored<Mat<P, D>>::numbers(displacement_gradient(value));
    }
    FIRN_INLINE static DeformationGradient<P, D> made(const std::array<P, D * D>& numbers) {
        return DeformationGradient<P, D>::from_displacement(Stored<Mat<P, D>>::made(numbers));
    }
};
template <class P>
struct Stored<VolumeRatio<P>> {
    using Number = P;
    template <class Q>
    using With = VolumeRatio<Q>;
    static constexpr bool less_one = true;
    FIRN_INLINE static std::array<P, 1> numbers(const VolumeRatio<P>& value) { return {value.excess}; }
    FIRN_INLINE static VolumeRatio<P> made(const std::array<P, 1>& numbers) {
        return VolumeRatio<P>::from_excess(numbers[0]);
    }
};

/// The shape of a field whose values are of type T, in D dimensions.
template <int D, class T>
struct ShapeOf {
    static_assert(
        component_count<T> == 1,
        "firn: a field of a material's state is a number, or a vector or matrix of D or of three dimensions.");
    static constexpr FieldShape shape = FieldShape::scalar;
};
template <int D, class P, int N>
struct ShapeOf<D, Vec<P, N>> {
    static_assert(N == D || N == 3,
                  "firn: a vector in a material's state has the dimension of space, or three dimensions.");
    static constexpr FieldShape shape = N == D ? FieldShape::vector : FieldShape::vector_3d;
};
template <int D, class P, int N>
struct ShapeOf<D, Mat<P, N>> {
    static_assert(N == D || N == 3,
                  "firn: a matrix in a material's state has the dimension of space, or three dimensions.");
    static constexpr FieldShape shape = N == D ? FieldShape::matrix : FieldShape::matrix_3d;
};
template <int D, class P, int N>
struct ShapeOf<D, DeformationGradient<P, N>> : ShapeOf<D, Mat<P, N>> {};

/// Calls f(k) for each component k of a T that is stored less 1. D: dimension of space
template <class T, class F>
FIRN_INLINE void for_less_one(const F& f) {
    constexpr int N = component_count<T>, step = N == 9 ? 4 : N == 4 ? 3 : 1;
    unroll<(N + step - 1) / step>([&](auto i) FIRN_LAMBDA { f(std::integral_constant<int, int(i) * step>{}); });
}
/// Whether the arrays of this field may hold F and J, not F − I and J − 1. \see StridedSpan::less_one
template <class Field>
inline constexpr bool may_hold_whole = requires(const Field field) { field.less_one; };

/// Makes a value of type T from the numbers get(k) of a field's components k.
template <class T, class Field, class Get>
FIRN_INLINE T value_of(const Field& field, const Get& get) {
    using Number = typename Stored<T>::Number;
    std::array<Number, std::size_t(component_count<T>)> numbers;
    unroll<component_count<T>>([&](auto k) FIRN_LAMBDA { numbers[k] = get(k); });
    if constexpr (Stored<T>::less_one && may_hold_whole<Field>)
        if (!field.less_one) for_less_one<T>([&](auto k) FIRN_LAMBDA { numbers[k] = numbers[k] - Number(1); });
    return Stored<T>::made(numbers);
}
/// Returns the values of a field for the particles in some slots. \tparam T  the type of a value, with a number or a
/// pack as its scalar
template <class T, class Field>
FIRN_INLINE T load_value(const Field& field, const Slots& slots) {
    return value_of<T>(field,
                       [&](auto k) FIRN_LAMBDA { return field.template load<typename Stored<T>::Number>(slots, k); });
}
/// Writes the values of a field for the particles in some slots.
template <class T, class Field>
FIRN_INLINE void store_value(const Field& field, const Slots& slots, const T& value) {
    auto numbers = Stored<T>::numbers(value);
    if constexpr (Stored<T>::less_one && may_hold_whole<Field>)
        if (!field.less_one)
            for_less_one<T>([&](auto k) FIRN_LAMBDA { numbers[k] = numbers[k] + typename Stored<T>::Number(1); });
    unroll<component_count<T>>([&](auto k) FIRN_LAMBDA { field.store(slots, k, numbers[k]); });
}

}  // namespace detail

/// Appends the fields of a material's state to a table. The start values of these fields are those of a
/// default-constructed State.
template <int D, class State>
void append_state_fields(FieldTable& table) {
    State start{};
    std::apply(
        [&](const auto&... each) {
            [[maybe_unused]] const auto append = [&](const auto& field) {
                auto& member = start.*(field.member);
                using Value = std::remove_cvref_t<decltype(member)>;
                FieldInfo info{field.name, field.unit, detail::ShapeOf<D, Value>::shape, FieldRole::state};
                std::ranges::copy(detail::Stored<Value>::numbers(member), info.start.begin());
                info.less_one = detail::Stored<Value>::less_one;
                table.push_back(info);
            };
            (append(each), ...);
        },
        State::fields());
}
/// Returns the table of all fields of a particle: first the built-in fields, then the fields of the material's state.
template <std::floating_point S, int D, class State>
FieldTable field_table() {
    FieldTable table;
    for (const auto& line : ParticleView<S, D, BlockedSpan<S>, State>::built_in()) table.push_back(line.info);
    append_state_fields<D, State>(table);
    return table;
}

namespace detail {
/// Returns the index of a member among the fields of a material's state.
template <class State, class Member>
consteval std::size_t field_of(Member State::* member) {
    std::size_t index = 0;
    std::apply(
        [&](const auto&... field) {
            std::size_t i = 0;
            const auto look = [&](const auto& of) {
                if constexpr (std::same_as<std::remove_cvref_t<decltype(of.member)>, Member State::*>)
                    if (of.member == member) index = i;
                ++i;
            };
            (look(field), ...);
        },
        State::fields());
    return index;
}
}  // namespace detail

/// Returns the material's state of the particles in some slots. \tparam State  the state type whose numbers are packs
/// with one lane per slot
template <class State, class Field, std::size_t N>
FIRN_INLINE State load_state(const std::array<Field, N>& fields, const Slots& slots) {
    State state;
    constexpr auto members = State::fields();
    unroll<int(N)>([&](auto f) FIRN_LAMBDA {
        auto& member = state.*(std::get<f>(members).member);
        member = detail::load_value<std::remove_cvref_t<decltype(member)>>(fields[f], slots);
    });
    return state;
}
/// Writes the material's state of the particles in some slots.
template <class State, class Field, std::size_t N>
FIRN_INLINE void store_state(const std::array<Field, N>& fields, const Slots& slots, const State& state) {
    constexpr auto members = State::fields();
    unroll<int(N)>([&](auto f)
                       FIRN_LAMBDA { detail::store_value(fields[f], slots, state.*(std::get<f>(members).member)); });
}

}  // namespace firn::inline FIRN_BUILD
