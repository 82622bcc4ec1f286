/// \file The particles of one contact group around a node: copied into one row, so that loops over them are short.
#pragma once

#include <firn/core/pack.hpp>
#include <firn/core/tensor.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace firn::detail {

/// Eight numbers that are processed together; where registers are shorter, in several of them.
using Eight = pack<float, 8>;

/// Returns the sum of all lanes, added up as a balanced tree.
FIRN_INLINE float sum_of_lanes(const Eight& all) {
    using four [[gnu::vector_size(16)]] = float;
    four halves[2];
    std::memcpy(halves, &all.lanes, sizeof halves);
    const four half = halves[0] + halves[1];
    return (half[0] + half[2]) + (half[1] + half[3]);
}
/// Returns a mask of the first `count` lanes.
FIRN_INLINE Eight::mask first_lanes(std::uint32_t count) {
    alignas(32) static constexpr std::int32_t numbers[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    Eight::mask_vector lanes;
    std::memcpy(&lanes, numbers, sizeof lanes);
    return {lanes < std::int32_t(std::min<std::uint32_t>(count, 8))};
}

/// The particles that contribute to a node, or some of them, sorted by their base nodes, then by id. Positions are
/// counted from the node [cells]. Behind the last particle there are up to 7 particles that are far away.
/// \tparam D  2 or 3
template <int D>
class AroundNode {
public:
    static constexpr std::uint32_t spare = 8;  ///< Number of values that may be read behind the last particle.

    std::uint32_t size() const { return size_; }              ///< Number of particles.
    const float* place(int axis) const { return row(axis); }  ///< Positions [cells].
    const float* radius() const { return row(D); }            ///< Half of the extents of the particles [cells].

    /// Removes all particles, and makes room for `count`.
    void clear(std::size_t count) {
        size_ = 0;
        if (count + 2 * spare <= room_) return;
        room_ = std::uint32_t(2 * count + 2 * spare);
        numbers_.resize(std::size_t(room_) * (D + 1));
    }
    /// Adds the particles begin ≤ i < end from rows of numbers that may be read `spare` values behind the last
    /// particle.
    /// \param from   D rows of positions and a row of radii, `apart` numbers apart
    /// \param shift  is subtracted from positions
    FIRN_INLINE void add(const float* from, std::size_t apart, std::uint32_t begin, std::uint32_t end,
                         const float (&shift)[D]) {
        for (std::uint32_t i = begin; i < end; i += 8) {
            const std::uint32_t at = size_ + i - begin;
            for (int a = 0; a < D; ++a)
                (Eight::load(from + std::size_t(a) * apart + i) - Eight(shift[a])).store(row(a) + at);
            Eight::load(from + D * apart + i).store(row(D) + at);
        }
        size_ += end - begin;
    }
    /// Call it after all particles were added.
    void close() {
        for (int a = 0; a < D; ++a) Eight(0.f).store(row(a) + size_);
        Eight(-far_away).store(row(D) + size_);
    }

private:
    static constexpr float far_away = 1e15f;  // [cells]; its square is finite

    float* row(int a) { return numbers_.data() + std::size_t(a) * room_; }
    const float* row(int a) const { return numbers_.data() + std::size_t(a) * room_; }

    std::uint32_t size_ = 0, room_ = 0;
    std::vector<float> numbers_;  // D rows of positions and a row of radii
};

}  // namespace firn::detail
