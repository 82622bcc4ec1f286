/// \file The particles of one contact group around the nodes of a block, and around one of them. Particles around a
/// block are copied into rows once, so that those around a node are a few runs of the rows.
#pragma once

#include <firn/core/pack.hpp>
#include <firn/core/tensor.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/simd/transpose.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

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

/// Reads eight quads. Lane l of r[k] gets the k-th number of quad l.
FIRN_INLINE void load_eight_quads(const float* from, Eight (&r)[4]) {
    using four [[gnu::vector_size(16)]] = float;
    unroll<4>([&](auto k) FIRN_LAMBDA {
        four halves[2];
        std::memcpy(&halves[0], from + 4 * k, sizeof(four));
        std::memcpy(&halves[1], from + 4 * k + 16, sizeof(four));
        r[k] = Eight(__builtin_shufflevector(halves[0], halves[1], 0, 1, 2, 3, 4, 5, 6, 7));
    });
    transpose_groups(r);
}

/// D rows of positions and a row of radii of particles [cells]. Eight numbers may be read from where a particle is.
template <int D>
class ParticleRows {
public:
    static constexpr std::uint32_t spare = 8;  ///< Number of values that may be read behind the last particle.

    std::uint32_t size() const { return size_; }                                        ///< Number of particles.
    std::size_t apart() const { return room_; }                                         ///< Distance between two rows.
    float* row(int a) { return numbers_.data() + std::size_t(a) * room_; }              ///< Row a.
    const float* row(int a) const { return numbers_.data() + std::size_t(a) * room_; }  ///< Row a.

    /// Removes all particles, and makes room for `count`.
    void reserve(std::size_t count) {
        size_ = 0;
        if (count + 2 * spare <= room_) return;
        room_ = count + count / 2 + 2 * spare;
        numbers_.resize(room_ * (D + 1));
    }
    /// Adds particles. `spare` quads may be read behind the last one.
    /// \param quads  for each particle, three numbers for its position (in 2D, the third is not used), and its radius
    /// \param shift  is added to positions
    FIRN_INLINE void add(const float* quads, std::uint32_t count, const std::array<float, D>& shift) {
        for (std::uint32_t i = 0; i < count; i += 8) {
            Eight r[4];
            load_eight_quads(quads + std::size_t(i) * 4, r);
            for (int a = 0; a < D; ++a) (r[a] + Eight(shift[std::size_t(a)])).store(row(a) + size_ + i);
            r[3].store(row(D) + size_ + i);
        }
        size_ += count;
    }
    /// Adds the positions of the particles begin ≤ i < end of other rows, `apart` numbers apart.
    FIRN_INLINE void add(const float* from, std::size_t apart, std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t i = begin; i < end; i += 8)
            for (int a = 0; a < D; ++a)
                Eight::load(from + std::size_t(a) * apart + i).store(row(a) + size_ + (i - begin));
        size_ += end - begin;
    }

private:
    std::uint32_t size_ = 0;
    std::size_t room_ = 0;
    std::vector<float> numbers_;
};

/// The particles of one contact group around the nodes of a block, sorted by their base nodes, then by id.
/// \see NearParticles::gather
template <class Kernel, int D>
class AroundBlock {
public:
    static constexpr int K = Kernel::support;
    static constexpr int across = block_size + K - 1;                ///< Number of base nodes along an axis.
    static constexpr int lines = D == 2 ? across : across * across;  ///< Number of lines of base nodes.

    ParticleRows<D> rows{};  ///< The particles; positions are counted from the corner of the block.
    /// Where the particles of each base node begin, the last axis fastest; where the last of each line end.
    std::uint32_t begin[lines][across + 1];
};

/// The particles that contribute to a node, or some of them, sorted by their base nodes, then by id: runs of rows that
/// live at least as long.
/// \tparam D  2 or 3
template <class Kernel, int D>
class AroundNode {
public:
    /// \param rows   has the particles
    /// \param shift  the node's position, counted from where the positions in the rows are counted [cells]
    AroundNode(const ParticleRows<D>& rows, const Vec<float, D>& shift)
        : rows_(rows.row(0)), apart_(rows.apart()), shift_(shift) {}
    /// The particles that contribute to a node.
    /// \param node  index of the node in its block
    AroundNode(const AroundBlock<Kernel, D>& around, int node) : AroundNode(around.rows, position_in_block(node)) {
        constexpr int K = Kernel::support, across = AroundBlock<Kernel, D>::across;
        int at[D];
        for (int a = 0; a < D; ++a) at[a] = place_in_block<D>(node, a);
        const int first = D == 2 ? at[0] : at[0] * across + at[1], along = at[D - 1];
        for (int i = 0; i < (D == 2 ? 1 : K); ++i)
            for (int k = 0; k < K; ++k) {
                const auto& line = around.begin[first + i * across + k];
                if (line[along] < line[along + K]) add({line[along], line[along + K], line + along, i * K + k});
            }
    }
    /// Adds the particles begin ≤ i < end of the rows.
    void add(std::uint32_t begin, std::uint32_t end) { add({begin, end, nullptr, 0}); }

    std::uint32_t size() const { return size_; }  ///< Number of particles.
    /// Calls f(x, radius, valid) for every eight particles of a run: their positions, counted from the node [cells],
    /// their radii [cells], and which of them the run has. The numbers of the others are finite.
    template <class F>
    FIRN_INLINE void for_eights(const F& f) const {
        for (int r = 0; r < count_; ++r)
            for (std::uint32_t i = runs_[r].begin; i < runs_[r].end; i += 8) {
                Eight x[D];
                for (int a = 0; a < D; ++a) x[a] = Eight::load(row(a) + i) - Eight(shift_[a]);
                f(x, Eight::load(row(D) + i), first_lanes(runs_[r].end - i));
            }
    }
    /// Calls f(begin, end) for runs of the rows: the particles whose base nodes have cells near a plane. The distance
    /// of the middle of such a cell is at most `within`.
    /// \param n  unit normal of the plane;  \param middle  n · x of the plane, counted from the node [cells]
    template <class F>
    FIRN_INLINE void for_runs_near(const Vec<double, D>& n, double middle, double within, const F& f) const {
        constexpr int K = Kernel::support;
        for (int r = 0; r < count_; ++r) {
            double along = n[D - 1] * (Kernel::base_shift + 0.5 - (K - 1)) - middle;
            for (int a = 0; a < D - 1; ++a) {
                const int at = a == D - 2 ? runs_[r].line % K : runs_[r].line / K;
                along += n[a] * (at - (K - 1) + Kernel::base_shift + 0.5);
            }
            int first = K, last = 0;
            for (int k = 0; k < K; ++k)
                if (std::abs(along + n[D - 1] * k) <= within) {
                    first = std::min(first, k);
                    last = k + 1;
                }
            if (first < last) f(runs_[r].cells[first], runs_[r].cells[last]);
        }
    }

    std::size_t apart() const { return apart_; }                               ///< Distance between two rows.
    const float* row(int a) const { return rows_ + std::size_t(a) * apart_; }  ///< Row a.
    const Vec<float, D>& shift() const { return shift_; }                      ///< The node's position in the rows.

private:
    static Vec<float, D> position_in_block(int node) {
        Vec<float, D> position;
        for (int a = 0; a < D; ++a) position[a] = float(place_in_block<D>(node, a));
        return position;
    }
    struct Run {
        std::uint32_t begin, end;
        const std::uint32_t* cells;  // where the particles of its base nodes begin
        int line;                    // number of its line of base nodes
    };
    FIRN_INLINE void add(const Run& run) {
        runs_[count_++] = run;
        size_ += run.end - run.begin;
    }

    const float* rows_;
    std::size_t apart_;
    Vec<float, D> shift_;
    std::uint32_t size_ = 0;
    int count_ = 0;
    Run runs_[D == 2 ? Kernel::support : Kernel::support * Kernel::support];
};

}  // namespace firn::inline FIRN_BUILD::detail
