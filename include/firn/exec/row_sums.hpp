/// \file What rows are added up in (FloatSums, IntegerSums, AtomicSums), and where (ArenaRows, GridRows).
#pragma once

#include <firn/exec/fixed_point.hpp>
#include <firn/exec/places.hpp>
#include <firn/simd/integer_row.hpp>
#include <firn/stage/p2g.hpp>

#include <atomic>

namespace firn {

/// For sums that need not know what they are made of. \see MeasuredSums
struct Unmeasured {
    FIRN_INLINE static constexpr bool fits() { return true; }
    FIRN_INLINE static void count(std::size_t, int) {}

    template <class Kernel, int D>
    struct Counts {
        FIRN_INLINE Counts(const BlockGroup&, const ArenaBox<D>&) {}
        FIRN_INLINE void add(std::ptrdiff_t, int) const {}
        template <class Sums>
        FIRN_INLINE void add_to_grid(const Sums&, const BlocksAround<D>&, const ArenaBox<D>&) const {}
    };
};

template <std::floating_point S>
struct FloatSums : Unmeasured {
    using number = S;
    template <class Row>
    using sum = Row;
    static constexpr bool costly = false;  ///< if a sum of one cell's particles shall be made before it is stored

    const FloatSums& of_thread(int) const { return *this; }
    /// A record in the unit of the sums.
    template <class Record>
    FIRN_INLINE const Record& operator()(const Record& record) const {
        return record;
    }
    template <class Row>
    FIRN_INLINE static Row load(const S* from) {
        return Row::load(from);
    }
    /// sums + what the record gives to a row, weighted. \see OpenRecord
    template <class Row, class Record, class... Weights>
    FIRN_INLINE static Row plus(const Row& sums, const Record& record, const Weights&... weights) {
        return record.added_to(sums, weights...);
    }
    template <class Row>
    FIRN_INLINE static void store(S* to, const Row& sums) {
        sums.store(to);
    }
};

/// Integers that one thread at a time adds to.
template <class Integer, std::floating_point S>
struct IntegerSums : Unmeasured {
    using number = Integer;
    template <class Row>
    using sum = typename Row::template of<Integer>;
    static constexpr bool costly = false;
    FixedPointScale<S> scale;

    explicit IntegerSums(const FixedPointScale<S>& quanta_per_unit) : scale(quanta_per_unit) {}
    const IntegerSums& of_thread(int) const { return *this; }

    /// A record in quanta.
    template <class P, int D>
    FIRN_INLINE P2GRecord<P, D> operator()(const P2GRecord<P, D>& record) const {
        return in_quanta(record, FixedPointScale<P>{P(scale.momentum), P(scale.mass)});
    }
    template <class Row>
    FIRN_INLINE static sum<Row> load(const Integer* from) {
        return sum<Row>::load(from);
    }
    template <class Row, class Record, class... Weights>
    FIRN_INLINE static Row plus(const Row& sums, const Record& record, const Weights&... weights) {
        return sums + nearest<Integer>(record.weighted(weights...));
    }
    template <class Row>
    FIRN_INLINE static void store(Integer* to, const Row& sums) {
        sums.store(to);
    }
};

/// Integers that all threads add to.
template <class Integer, std::floating_point S>
struct AtomicSums : IntegerSums<Integer, S> {
    static constexpr bool costly = true;
    using IntegerSums<Integer, S>::IntegerSums;

    template <class Row>
    FIRN_INLINE static auto load(const Integer*) {
        return typename Row::template of<Integer>{};
    }
    template <class Row>
    FIRN_INLINE static void store(Integer* to, const Row& sums) {
        Integer numbers[Row::nodes * node_width];
        sums.store(numbers);
        for (int i = 0; i < Row::nodes * node_width; ++i)
            if (numbers[i] != 0) std::atomic_ref<Integer>(to[i]).fetch_add(numbers[i], std::memory_order_relaxed);
    }
};

/// The rows of one particle, in an arena. In registers that suit the target.
template <class Sums, class Kernel, std::floating_point S, int D, class RowOfArena = row<S, Kernel::support>>
class ArenaRows {
public:
    using Row = RowOfArena;
    using Sum = typename Sums::template sum<Row>;

    /// \param n       nodes a line of the arena
    /// \param corner  number in the arena of the first number of the particle's base node
    FIRN_INLINE ArenaRows(typename Sums::number* arena, std::ptrdiff_t n, std::ptrdiff_t corner)
        : first_(arena + corner), n_(n) {}
    FIRN_INLINE Sum load(int line) const {
        return Sums::template load<Row>(first_ + line_begin<Kernel, D>(line, n_) * node_width);
    }
    template <class... Row>
    FIRN_INLINE static Sum plus(const Sum& sum, const Row&... row) {
        return Sums::plus(sum, row...);
    }
    FIRN_INLINE void store(int line, const Sum& sum) const {
        Sums::store(first_ + line_begin<Kernel, D>(line, n_) * node_width, sum);
    }

private:
    typename Sums::number* first_;
    std::ptrdiff_t n_;
};

/// The rows of one particle, whose nodes lie where they are in the grid. A node a register.
template <class Sums, class Kernel, std::floating_point S, int D>
class GridRows {
    static constexpr int K = Kernel::support, lines = lines_of_particle<Kernel, D>;
    using Node = typename Sums::template sum<portable_row<S, 1>>;

public:
    using Row = portable_row<S, K>;
    using Sum = typename Sums::template sum<Row>;

    FIRN_INLINE GridRows(typename Sums::number* nodes, const std::uint32_t* neighbours, std::ptrdiff_t corner) {
        unroll<lines * K>([&](auto i) FIRN_LAMBDA {
            node_[i] = nodes + ArenaNodes<Kernel, D>::in_grid(neighbours, corner, i / K, i % K) * node_width;
        });
    }
    FIRN_INLINE Sum load(int line) const {
        return Sum::of_nodes([&](auto k) FIRN_LAMBDA {
            return Sums::template load<portable_row<S, 1>>(node_[line * K + k]).template node<0>();
        });
    }
    template <class... Row>
    FIRN_INLINE static Sum plus(const Sum& sum, const Row&... row) {
        return Sums::plus(sum, row...);
    }
    FIRN_INLINE void store(int line, const Sum& sum) const {
        unroll<K>([&](auto k) FIRN_LAMBDA { Sums::store(node_[line * K + k], Node{sum.template node<k>(), {}}); });
    }

private:
    typename Sums::number* node_[lines * K];
};

}  // namespace firn
