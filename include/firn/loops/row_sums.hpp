/// \file Sums of the contributions to rows of nodes. FloatSums, IntegerSums and AtomicSums define the type of the sums
/// and how to add to them; ArenaRows and GridRows define where the sums are stored.
#pragma once

#include <firn/loops/fixed_point.hpp>
#include <firn/loops/places.hpp>
#include <firn/simd/integer_row.hpp>
#include <firn/stage/p2g.hpp>

#include <atomic>

namespace firn::inline FIRN_BUILD {

/// The base class of sums that do not measure the particles whose contributions they add. \see detail::MeasuredSums
struct Unmeasured {
    FIRN_INLINE static constexpr bool fits() { return true; }  ///< Returns true: all contributions may be added.
    FIRN_INLINE static void count(std::size_t, int) {}         ///< Does nothing.

    /// Replaces detail::MeasuredSums::Counts, but counts nothing.
    template <class Kernel, int D>
    struct Counts {
        FIRN_INLINE Counts(const BlockGroup&, const ArenaBox<D>&) {}  ///< Does nothing.
        FIRN_INLINE void add(std::ptrdiff_t, int) const {}            ///< Does nothing.
        /// Does nothing.
        template <class Sums>
        FIRN_INLINE void add_to_grid(const Sums&, const BlocksAround<D>&, const ArenaBox<D>&) const {}
    };
};

/// Sums of contributions in floating point, in memory to which only one thread at a time adds.
template <std::floating_point S>
struct FloatSums : Unmeasured {
    using number = S;  ///< Type of one value of the sums.
    /// Type of the sums of a row of nodes.
    template <class Row>
    using sum = Row;
    /// Whether adding to memory is expensive. If so, the contributions of consecutive particles with the same base node
    /// are summed in registers first.
    static constexpr bool costly = false;

    const FloatSums& of_thread(int) const { return *this; }  ///< Returns the object that a thread uses.
    /// Returns the P2G record of a particle in the unit of the sums: here, the unchanged record.
    template <class Record>
    FIRN_INLINE const Record& operator()(const Record& record) const {
        return record;
    }
    /// Returns the sums of a row of nodes, read from memory.
    template <class Row>
    FIRN_INLINE static Row load(const S* from) {
        return Row::load(from);
    }
    /// Returns the sums of a row plus a particle's contribution: the record times the weights.
    /// \see OpenRecord::added_to
    template <class Row, class Record, class... Weights>
    FIRN_INLINE static Row plus(const Row& sums, const Record& record, const Weights&... weights) {
        return record.added_to(sums, weights...);
    }
    /// Writes the sums of a row of nodes to memory.
    template <class Row>
    FIRN_INLINE static void store(S* to, const Row& sums) {
        sums.store(to);
    }
};

/// Sums of contributions in integers, in memory to which only one thread at a time adds.
template <class Integer, std::floating_point S>
struct IntegerSums : Unmeasured {
    using number = Integer;  ///< Type of one value of the sums.
    /// Type of the sums of a row of nodes.
    template <class Row>
    using sum = typename Row::template of<Integer>;
    static constexpr bool costly = false;  ///< Adding to memory is not expensive.
    FixedPointScale<S> scale;              ///< Integer units (quanta) per kg m/s and per kg.

    /// Makes an object that adds in quanta of this scale.
    explicit IntegerSums(const FixedPointScale<S>& quanta_per_unit) : scale(quanta_per_unit) {}
    const IntegerSums& of_thread(int) const { return *this; }  ///< Returns the object that a thread uses.

    /// Returns the P2G record of a particle in quanta.
    template <class P, int D>
    FIRN_INLINE P2GRecord<P, D> operator()(const P2GRecord<P, D>& record) const {
        return in_quanta(record, FixedPointScale<P>{P(scale.momentum), P(scale.mass)});
    }
    /// Returns the sums of a row of nodes, read from memory.
    template <class Row>
    FIRN_INLINE static sum<Row> load(const Integer* from) {
        return sum<Row>::load(from);
    }
    /// Returns the sums of a row plus a particle's contribution, rounded to the nearest integer.
    /// \see OpenRecord::weighted
    template <class Row, class Record, class... Weights>
    FIRN_INLINE static Row plus(const Row& sums, const Record& record, const Weights&... weights) {
        return sums + nearest<Integer>(record.weighted(weights...));
    }
    /// Writes the sums of a row of nodes to memory.
    template <class Row>
    FIRN_INLINE static void store(Integer* to, const Row& sums) {
        sums.store(to);
    }
};

/// Sums of contributions in integers, in memory to which all threads add at the same time, with atomics.
template <class Integer, std::floating_point S>
struct AtomicSums : IntegerSums<Integer, S> {
    static constexpr bool costly = true;  ///< Adding to memory is expensive.
    using IntegerSums<Integer, S>::IntegerSums;

    /// Returns a row of zeros and does not read memory, because store() adds to the sums in memory.
    template <class Row>
    FIRN_INLINE static auto load(const Integer*) {
        return typename Row::template of<Integer>{};
    }
    /// Adds a row to the sums in memory, with atomics.
    template <class Row>
    FIRN_INLINE static void store(Integer* to, const Row& sums) {
        Integer numbers[Row::nodes * node_width];
        sums.store(numbers);
        for (int i = 0; i < Row::nodes * node_width; ++i)
            if (numbers[i] != 0) std::atomic_ref<Integer>(to[i]).fetch_add(numbers[i], std::memory_order_relaxed);
    }
};

/// Reads and writes the sums of the rows of nodes around one particle, in an arena.
/// \tparam RowOfArena  type of a row of node values, in SIMD registers of the processor for which the code is compiled
template <class Sums, class Kernel, std::floating_point S, int D, class RowOfArena = row<S, Kernel::support>>
class ArenaRows {
public:
    using Row = RowOfArena;                        ///< Type of a row of contributions to nodes.
    using Sum = typename Sums::template sum<Row>;  ///< Type of the sums of a row.

    /// Gives access to the rows of nodes around the particle whose base node is at `corner`.
    /// \param n       number of nodes along each axis of the arena
    /// \param corner  index, among all values of the arena, of the first value of the particle's base node
    FIRN_INLINE ArenaRows(typename Sums::number* arena, std::ptrdiff_t n, std::ptrdiff_t corner)
        : first_(arena + corner), n_(n) {}
    /// Returns the sums of row `line`, read from memory.
    FIRN_INLINE Sum load(int line) const {
        return Sums::template load<Row>(first_ + line_begin<Kernel, D>(line, n_) * node_width);
    }
    /// Returns the sums of a row plus a particle's contribution. \see FloatSums::plus
    template <class... Row>
    FIRN_INLINE static Sum plus(const Sum& sum, const Row&... row) {
        return Sums::plus(sum, row...);
    }
    /// Writes the sums of row `line` to memory.
    FIRN_INLINE void store(int line, const Sum& sum) const {
        Sums::store(first_ + line_begin<Kernel, D>(line, n_) * node_width, sum);
    }

private:
    typename Sums::number* first_;
    std::ptrdiff_t n_;
};

/// Reads and writes the sums of the rows of nodes around one particle, in the grid. Each node is read and written
/// separately.
template <class Sums, class Kernel, std::floating_point S, int D>
class GridRows {
    static constexpr int K = Kernel::support, lines = lines_of_particle<Kernel, D>;
    using Node = typename Sums::template sum<portable_row<S, 1>>;

public:
    using Row = portable_row<S, K>;                ///< Type of a row of contributions to nodes.
    using Sum = typename Sums::template sum<Row>;  ///< Type of the sums of a row.

    /// Gives access to the rows of nodes around the particle whose base node is at `corner`.
    /// \param nodes       the sums of all nodes of the grid
    /// \param neighbours  grid indices of the particle's block and of the blocks around it. \see SparseGrid::neighbours
    /// \param corner      index of the first value of the particle's base node, counted as if the blocks around the
    ///                    particle were stored as one arena
    FIRN_INLINE GridRows(typename Sums::number* nodes, const std::uint32_t* neighbours, std::ptrdiff_t corner) {
        RowsInGrid<Kernel, D> rows;
        rows.find(neighbours, corner, [&](auto row) FIRN_LAMBDA {
            unroll<K>([&](auto k) FIRN_LAMBDA { node_[row * K + k] = nodes + rows.number(row, k); });
        });
    }
    /// Returns the sums of row `line`, read from memory.
    FIRN_INLINE Sum load(int line) const {
        return Sum::of_nodes([&](auto k) FIRN_LAMBDA {
            return Sums::template load<portable_row<S, 1>>(node_[line * K + k]).template node<0>();
        });
    }
    /// Returns the sums of a row plus a particle's contribution. \see FloatSums::plus
    template <class... Row>
    FIRN_INLINE static Sum plus(const Sum& sum, const Row&... row) {
        return Sums::plus(sum, row...);
    }
    /// Writes the sums of row `line` to memory.
    FIRN_INLINE void store(int line, const Sum& sum) const {
        unroll<K>([&](auto k) FIRN_LAMBDA { Sums::store(node_[line * K + k], Node{sum.template node<k>(), {}}); });
    }

private:
    typename Sums::number* node_[lines * K];
};

}  // namespace firn::inline FIRN_BUILD
