/// \file Where a particle's numbers lie in memory, and how lanes read and write them.
///
/// A *slot* is a place in the order in which particles are worked through; sixteen slots make a pack. firn's own
/// particles lie in that order (BlockedSpan). Arrays of another program are reached through an index (StridedSpan).
#pragma once

#include <firn/core/pack.hpp>
#include <firn/data/aligned.hpp>

#include <array>
#include <cstdint>

namespace firn {

/// Particles per pack. Loops over lanes work on structures of arrays of this length.
inline constexpr int pack_size = 16;

/// In an index of slots: the slot is padding and holds no particle.
inline constexpr std::uint32_t no_particle = 0xffffffffu;

/// The slots of one register: as many consecutive slots as it has lanes.
struct Slots {
    std::size_t first;           ///< the first slot
    const std::uint32_t* index;  ///< their particles, or no_particle; for particles not in the order of slots
};

/// A field of particles that lie in packs: [pack][component][lane].
template <class S>
struct BlockedSpan {
    S* data;         ///< the first number
    int components;  ///< numbers per particle

    /// Reads one component in the slots.
    template <class P>
    FIRN_INLINE P load(const Slots& slots, int component) const {
        return P::load(at(slots.first, component));
    }
    /// Reads one component in the slots; padding gives zero where a field starts at zero.
    template <class P>
    FIRN_INLINE P load_or_zero(const Slots& slots, int component) const {
        return load<P>(slots, component);
    }
    /// Writes one component in the slots.
    template <class P>
    FIRN_INLINE void store(const Slots& slots, int component, const P& value) const {
        value.store(at(slots.first, component));
    }
    /// Prefetches the pack that begins at `slot`. \tparam Components  equal to `components`
    template <int Components>
    FIRN_INLINE void prefetch(std::size_t slot) const {
        const S* pack = data + slot * std::size_t(Components);
        constexpr int per_line = int(64 / sizeof(S));
        unroll<Components * pack_size / per_line>([&](auto line)
                                                      FIRN_LAMBDA { __builtin_prefetch(pack + per_line * line); });
    }
    /// One component in the first of the slots.
    FIRN_INLINE S& at(const Slots& slots, int component) const { return *at(slots.first, component); }
    /// The address of one component in a slot.
    FIRN_INLINE S* at(std::size_t slot, int component) const {
        return data + (slot / pack_size) * std::size_t(components * pack_size) + std::size_t(component * pack_size) +
               slot % pack_size;
    }
};

/// A field in another program's layout: component k of particle i is data[i * stride + offset[k]]. It describes arrays
/// of structures, structures of arrays, and matrices by rows or by columns.
template <class S>
struct StridedSpan {
    S* data = nullptr;                       ///< what strides and offsets count from
    std::ptrdiff_t stride = 0;               ///< from one particle to the next, in numbers
    std::array<std::ptrdiff_t, 9> offset{};  ///< of each component, matrices by columns

    /// One number per particle.
    static StridedSpan scalars(S* data, std::ptrdiff_t stride = 1) { return {data, stride, {}}; }
    /// Vectors of D consecutive numbers.
    template <int D>
    static StridedSpan vectors(S* data, std::ptrdiff_t stride = D) {
        StridedSpan span{data, stride, {}};
        for (int k = 0; k < D; ++k) span.offset[std::size_t(k)] = k;
        return span;
    }
    /// D × D matrices of consecutive numbers, row after row (C, NumPy) or column after column (Eigen, Fortran).
    template <int D>
    static StridedSpan matrices(S* data, bool by_rows, std::ptrdiff_t stride = D * D) {
        StridedSpan span{data, stride, {}};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) span.offset[std::size_t(i + D * j)] = by_rows ? D * i + j : i + D * j;
        return span;
    }
    /// Each component in its own array. Each array begins `distance` numbers after the one before.
    static StridedSpan arrays(S* data, int components, std::ptrdiff_t distance) {
        StridedSpan span{data, 1, {}};
        for (int k = 0; k < components; ++k) span.offset[std::size_t(k)] = k * distance;
        return span;
    }

    /// Reads one component in the slots. Lanes of padding repeat the first particle of the pack.
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
    /// Reads one component in the slots; padding gives zero.
    template <class P>
    FIRN_INLINE P load_or_zero(const Slots& slots, int component) const {
        P value = load<P>(slots, component);
        for (int l = 0; l < scalar_traits<P>::lanes; ++l)
            if (slots.index[l] == no_particle) value.set(l, value_type_t<P>(0));
        return value;
    }
    /// Writes one component in the slots, except to padding.
    template <class P>
    FIRN_INLINE void store(const Slots& slots, int component, const P& value) const {
        for (int l = 0; l < scalar_traits<P>::lanes; ++l)
            if (slots.index[l] != no_particle) particle(slots.index[l], component) = value[l];
    }
    /// Does nothing: the numbers may lie anywhere.
    template <int>
    FIRN_INLINE void prefetch(std::size_t) const {}
    /// One component in the first of the slots.
    FIRN_INLINE S& at(const Slots& slots, int component) const { return particle(slots.index[0], component); }
    /// One component of particle i.
    FIRN_INLINE S& particle(std::size_t i, int component) const {
        return data[std::ptrdiff_t(i) * stride + offset[std::size_t(component)]];
    }
};

}  // namespace firn
