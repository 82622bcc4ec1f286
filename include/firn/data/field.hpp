/// \file How the fields of particles are stored in memory, and how SIMD lanes read and write them.
///
/// Particles are processed in a fixed order, in packs of sixteen. A *slot* is an index in this order; a slot that holds
/// no particle is padding. firn's own particles are stored in the order of slots (BlockedSpan). Another program stores
/// its particles in any order; then a list gives the index of the particle that belongs to each slot (StridedSpan).
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/pack.hpp>
#include <firn/data/aligned.hpp>

#include <array>
#include <cstdint>
#include <initializer_list>

namespace firn::inline FIRN_BUILD {

/// Number of particles in a pack. A pack stores each component of a field as an array of this length.
inline constexpr int pack_size = 16;

/// Value used instead of a particle's index or id for padding (a slot that holds no particle).
inline constexpr std::uint32_t no_particle = 0xffffffffu;

/// Consecutive slots that are processed together, one in each lane of a SIMD register.
struct Slots {
    std::size_t first;           ///< index of the first slot
    const std::uint32_t* index;  ///< index of the particle in each slot, or no_particle; only for StridedSpan
};

/// A field (one quantity of all particles) that is stored pack by pack, in the order [pack][component][lane].
template <class S>
struct BlockedSpan {
    S* data;         ///< address of the field's first number
    int components;  ///< number of components per particle

    /// Returns one component of the field for the particles in the slots, one particle per lane.
    template <class P>
    FIRN_INLINE P load(const Slots& slots, int component) const {
        return P::load(at(slots.first, component));
    }
    /// Returns one component of the field for the particles in the slots, one particle per lane. Use load_or_zero()
    /// only for fields whose start value is zero. Lanes of padding are then zero.
    template <class P>
    FIRN_INLINE P load_or_zero(const Slots& slots, int component) const {
        return load<P>(slots, component);
    }
    /// Writes one component of the field for the particles in the slots, one particle per lane.
    template <class P>
    FIRN_INLINE void store(const Slots& slots, int component, const P& value) const {
        value.store(at(slots.first, component));
    }
    /// Prefetches the part of the field that belongs to the pack beginning at `slot`.
    ///
    /// A pack in double precision has more cache lines than the first-level cache can wait for at once, and what is
    /// read next would wait for all of them. So they are brought into the second-level cache.
    /// \tparam Components  equal to the member `components`
    template <int Components>
    FIRN_INLINE void prefetch(std::size_t slot) const {
        const S* pack = data + slot * std::size_t(Components);
        constexpr int per_line = int(64 / sizeof(S)), locality = sizeof(S) > 4 ? 2 : 3;
        unroll<Components * pack_size / per_line>(
            [&](auto line) FIRN_LAMBDA { __builtin_prefetch(pack + per_line * line, 0, locality); });
    }
    /// Returns one component of the field for the particle in the first of the slots.
    FIRN_INLINE S& at(const Slots& slots, int component) const { return *at(slots.first, component); }
    /// Returns the address of one component of the field for the particle in a slot.
    FIRN_INLINE S* at(std::size_t slot, int component) const {
        return data + (slot / pack_size) * std::size_t(components * pack_size) + std::size_t(component * pack_size) +
               slot % pack_size;
    }
};

/// A field in the memory of another program, in the program's own layout. Component k of particle i is
/// `data[i * stride + offset[k]]`. This describes arrays of structures, structures of arrays, and matrices stored by
/// rows or by columns.
template <class S>
struct StridedSpan {
    S* data = nullptr;          ///< address from which `stride` and `offset` are counted
    std::ptrdiff_t stride = 0;  ///< distance between two particles, counted in numbers of type S (not bytes)
    /// Offset of each component, counted in numbers of type S (not bytes). The components of a matrix are listed column
    /// by column.
    std::array<std::ptrdiff_t, 9> offset{};
    /// For deformation gradients and volume ratios: false if the arrays hold F and J, true if they hold F − I and J −
    /// 1, as firn's own particles do, so that small strains are not lost.
    bool less_one = false;

    /// Describes a field of one number per particle. \param stride  distance between two particles, in numbers
    static StridedSpan scalars(S* data, std::ptrdiff_t stride = 1) { return {data, stride, {}}; }
    /// Describes a field of vectors of D consecutive numbers. \param stride  distance between two particles, in numbers
    template <int D>
    static StridedSpan vectors(S* data, std::ptrdiff_t stride = D) {
        StridedSpan span{data, stride, {}};
        for (int k = 0; k < D; ++k) span.offset[std::size_t(k)] = k;
        return span;
    }
    /// Describes a field of D × D matrices of consecutive numbers.
    /// \param by_rows  true: stored row after row (C, NumPy); false: column after column (Eigen, Fortran)
    /// \param stride   distance between two particles, counted in numbers of type S
    template <int D>
    static StridedSpan matrices(S* data, bool by_rows, std::ptrdiff_t stride = D * D) {
        StridedSpan span{data, stride, {}};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) span.offset[std::size_t(i + D * j)] = by_rows ? D * i + j : i + D * j;
        return span;
    }
    /// Describes a field that has one array per component. Each array begins `distance` numbers after the previous one.
    static StridedSpan arrays(S* data, int components, std::ptrdiff_t distance) {
        StridedSpan span{data, 1, {}};
        for (int k = 0; k < components; ++k) span.offset[std::size_t(k)] = k * distance;
        return span;
    }

    /// Describes a field that has one array per component. The arrays may lie anywhere in memory: `arrays({x, y, z})`.
    /// \throws parameter_error  if there is no array, if there are more than nine arrays, or if the distance between
    ///                          two arrays is no multiple of the size of a number
    static StridedSpan arrays(std::initializer_list<S*> components) {
        if (components.size() == 0 || components.size() > 9)
            throw parameter_error(sentence("A field has ", components.size(), " arrays; it must have 1 to 9."));
        StridedSpan span{*components.begin(), 1, {}};
        const auto begin = std::intptr_t(span.data);
        std::size_t k = 0;
        for (S* const component : components) {
            const std::intptr_t distance = std::intptr_t(component) - begin;
            if (distance % std::intptr_t(sizeof(S)) != 0)
                throw parameter_error(sentence("The arrays of components 0 and ", k, " lie ", distance,
                                               " bytes apart; that must be a multiple of ", sizeof(S), "."));
            span.offset[k++] = std::ptrdiff_t(distance / std::intptr_t(sizeof(S)));
        }
        return span;
    }

    /// Returns one component of the field for the particles in the slots, one particle per lane. Lanes of padding get
    /// the value of the pack's first particle.
    template <class P>
    FIRN_INLINE P load(const Slots& slots, int component) const {
        P value;
        for (int l = 0; l < scalar_traits<P>::lanes; ++l) {
            const bool used = slots.index[l] != no_particle;
            value.set(
                l, particle(used ? slots.index[l] : slots.index[-std::ptrdiff_t(slots.first % pack_size)], component));
        }
        return value;
    }
    /// Returns one component of the field for the particles in the slots, one particle per lane. Lanes of padding are
    /// zero.
    template <class P>
    FIRN_INLINE P load_or_zero(const Slots& slots, int component) const {
        P value = load<P>(slots, component);
        for (int l = 0; l < scalar_traits<P>::lanes; ++l)
            if (slots.index[l] == no_particle) value.set(l, value_type_t<P>(0));
        return value;
    }
    /// Writes one component of the field for the particles in the slots, one particle per lane. Nothing is written for
    /// padding.
    template <class P>
    FIRN_INLINE void store(const Slots& slots, int component, const P& value) const {
        for (int l = 0; l < scalar_traits<P>::lanes; ++l)
            if (slots.index[l] != no_particle) particle(slots.index[l], component) = value[l];
    }
    /// Does nothing, because the particles of a pack may lie anywhere in another program's memory.
    template <int>
    FIRN_INLINE void prefetch(std::size_t) const {}
    /// Returns one component of the field for the particle in the first of the slots.
    FIRN_INLINE S& at(const Slots& slots, int component) const { return particle(slots.index[0], component); }
    /// Returns one component of the field for particle i.
    FIRN_INLINE S& particle(std::size_t i, int component) const {
        return data[std::ptrdiff_t(i) * stride + offset[std::size_t(component)]];
    }
};

}  // namespace firn::inline FIRN_BUILD
