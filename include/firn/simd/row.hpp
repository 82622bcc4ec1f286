/// \file A row of nodes in SIMD registers: `K` neighbouring nodes along the last axis, with four numbers each.
///
/// P2G and G2P write and read the grid in rows. Policies (materials, kernels, transfers) never use rows.
///
/// On processors whose registers hold several nodes, a row needs fewer registers. The width of the registers does not
/// change a bit of the result, because the same operations are done on every number in the same order. To ensure this,
/// the code in this file, not the code that calls it, decides which operations a compiler may fuse. If
/// FIRN_PORTABLE_ROWS is defined, there is one node per register, which every processor supports.
#pragma once

#include <firn/core/config.hpp>
#include <firn/core/x86.hpp>

#include <array>
#include <concepts>
#include <cstring>
#include <type_traits>

#if defined(__AVX__) && !defined(FIRN_PORTABLE_ROWS)
#define FIRN_WIDE_ROWS
#endif

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the product of `a` and `b`. The product is rounded before anything is added to it, even if the compiler may
/// fuse multiplication and addition.
template <class V>
FIRN_INLINE V rounded_product(const V& a, const V& b) {
#ifdef __clang__
#pragma clang fp contract(off)
    return a * b;
#else
    V product = a * b;
#ifdef __FMA__
    asm("" : "+v"(product));  // without this, g++ fuses the product with an addition, or splits the vector
#elif defined(__aarch64__)
    if constexpr (sizeof(V) <= register_bytes) asm("" : "+w"(product));
#endif
    return product;
#endif
}

/// A register of N numbers: N/4 nodes with four numbers each. Arithmetic uses the compilers' vector extension. x86
/// intrinsics are used only for shuffles between registers of different widths. Without intrinsics, g++ 12 would
/// shuffle by storing and loading the numbers.
/// \tparam S  a floating-point type; or an integer type, which is used for sums only
template <class S, int N>
struct node_register {
    using vector [[gnu::vector_size(N * sizeof(S))]] = S;
    vector v;

    FIRN_INLINE static node_register load(const S* from) {
        node_register r;
        std::memcpy(&r.v, from, sizeof r.v);
        return r;
    }
    FIRN_INLINE void store(S* to) const { std::memcpy(to, &v, sizeof v); }
    /// Returns a copy that the compiler keeps in a register. Without this function, g++ reads the numbers from memory
    /// at every use. G2P would wait for these reads, because most rows lie across two cache lines.
    FIRN_INLINE node_register held() const {
        vector r = v;
#ifdef FIRN_WIDE_ROWS
        asm("" : "+v"(r));
#endif
        return {r};
    }

    /// Returns a register whose numbers all equal *from.
    FIRN_INLINE static node_register fill(const S* from) { return {*from - vector{}}; }

    /// Returns a register whose nodes all have the four numbers from[0] to from[3].
    FIRN_INLINE static node_register repeat(const S* from) {
        if constexpr (N == 4) return load(from);
#ifdef FIRN_WIDE_ROWS
        if constexpr (N == 8 && sizeof(S) == 4) return {x86::repeat(from)};
#ifdef __AVX512F__
        if constexpr (N == 8 && sizeof(S) == 8) return {x86::repeat(node_register<S, 4>::load(from).v)};
        if constexpr (N == 16) return {x86::repeat(node_register<S, 4>::load(from).v)};
#endif
#endif
    }

    /// Returns a register in whose node k all four numbers equal from[k].
    /// \param from  one number per node
    FIRN_INLINE static node_register spread(const S* from) {
        if constexpr (N == 4) return fill(from);
#ifdef FIRN_WIDE_ROWS
        if constexpr (N == 8 && sizeof(S) == 4) return {x86::spread(from)};
#ifdef __AVX512F__
        if constexpr (N == 8 && sizeof(S) == 8) return {x86::with_upper(fill(from).v, from[1])};
        if constexpr (N == 16) {
            const x86::int16 order = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
            return {x86::permuted(repeat(from).v, order)};
        }
#endif
#endif
    }

    /// Returns a register in which all four numbers of node i equal from[4 i + k], for each node i.
    /// \param from  four numbers per node
    template <int k>
    FIRN_INLINE static node_register fill_quads(const S* from) {
        if constexpr (N == 4) {
            return fill(from + k);
        } else {
            const vector all = load(from).v;
            return {__builtin_shufflevector(all, all, k, k, k, k, k + 4, k + 4, k + 4, k + 4, k + 8, k + 8, k + 8,
                                            k + 8, k + 12, k + 12, k + 12, k + 12)};
        }
    }

    template <int k>
    FIRN_INLINE node_register<S, 4> node() const {
#if defined(FIRN_WIDE_ROWS) && defined(__AVX512F__)
        if constexpr (N == 8 && sizeof(S) == 8 && k == 1) return {x86::upper(v)};
#endif
        node_register<S, 4> r;
        std::memcpy(&r.v, reinterpret_cast<const char*>(&v) + 4 * k * sizeof(S), sizeof r.v);
        return r;
    }

    FIRN_INLINE friend node_register operator+(node_register a, node_register b) {
        if constexpr (std::is_integral_v<S>) {
            using wraps [[gnu::vector_size(N * sizeof(S))]] = std::make_unsigned_t<S>;
            return {vector(wraps(a.v) + wraps(b.v))};
        } else {
            return {a.v + b.v};
        }
    }
    FIRN_INLINE friend node_register operator-(node_register a, node_register b) { return {a.v - b.v}; }
    FIRN_INLINE friend node_register operator*(node_register a, node_register b) { return {rounded_product(a.v, b.v)}; }
    /// Returns a + b c, computed by one fused operation if the target has it and the compiler may use it
    /// (-ffp-contract).
    FIRN_INLINE friend node_register plus_times(node_register a, node_register b, node_register c) {
        return {a.v + b.v * c.v};
    }
    /// Returns b c − a, computed by one fused operation if the target has it and the compiler may use it
    /// (-ffp-contract).
    FIRN_INLINE friend node_register times_minus(node_register b, node_register c, node_register a) {
        return {b.v * c.v - a.v};
    }
};

/// How many numbers each register of a row of K nodes holds.
template <class S, int K>
inline constexpr int row_register =
#ifdef FIRN_WIDE_ROWS
    register_bytes / sizeof(S) == 16 && K > 2 ? 16
    : register_bytes / sizeof(S) >= 8         ? 8
                                              : 4;
#else
    4;
#endif

}  // namespace detail

/// The four numbers of one node in a register: the first D are components of the node's momentum or velocity, the last
/// is the node's mass.
template <class S>
using quad = detail::node_register<S, 4>;

/// A row of K nodes with four numbers each, in registers of W numbers: 4 (one node), 8 or 16. If W is 8 and K is odd,
/// the last node has a register of 4 numbers. If W is 16, a row of three nodes also contains a fourth node, whose
/// weight is zero and which is written back unchanged.
template <class S, int K, int W>
struct row_of {
    template <class Other>
    using of = row_of<Other, K, W>;                         ///< a row of the same shape whose numbers have type Other
    static constexpr int nodes = K;                         ///< number of nodes
    static constexpr int width = W == 8 && K == 1 ? 4 : W;  ///< how many numbers the first register holds
    using Number = detail::node_register<S, width>;         ///< type of the first register
    /// Type of the rest of the row: the nodes that do not fit into the first register.
    using Rest = row_of<S, (K > width / 4 ? K - width / 4 : 0), width>;
    /// How many of the target processor's registers the row fills.
    static constexpr int registers = int((width * sizeof(S) - 1) / register_bytes + 1) + Rest::registers;

    Number first;                     ///< the nodes in the first register
    [[no_unique_address]] Rest rest;  ///< the nodes in the other registers

    /// Returns the row whose numbers are stored in memory from `from` on, node after node.
    FIRN_INLINE static row_of load(const S* from) { return {Number::load(from), Rest::load(from + width)}; }
    /// Writes the numbers of the row to memory from `to` on, node after node.
    FIRN_INLINE void store(S* to) const {
        first.store(to);
        rest.store(to + width);
    }
    /// Returns a copy of the row that the compiler keeps in registers: the numbers of the copy are not read from memory
    /// again.
    FIRN_INLINE row_of held() const { return {first.held(), rest.held()}; }
    /// Returns a row whose nodes all have the four numbers from[0] to from[3].
    FIRN_INLINE static row_of repeat(const S* from) { return {Number::repeat(from), Rest::repeat(from)}; }
    /// Returns a row in whose node k all four numbers equal from[k].
    /// \param from  four numbers, one per node; if K < 4, from[K] and the numbers after it must be zero
    FIRN_INLINE static row_of spread(const S* from) { return {Number::spread(from), Rest::spread(from + width / 4)}; }
    /// Returns the row whose node k has its four numbers at first[4 k] if k < split, else at second[4 k]. No other
    /// memory is read. Only for rows with one node per register, and for rows in one register of 16 floats.
    template <int k = 0>
    FIRN_INLINE static row_of of_runs(const S* first, const S* second, int split) {
#if defined(FIRN_WIDE_ROWS) && defined(__AVX512F__)
        if constexpr (W == 16) {
            constexpr unsigned all = (1u << 4 * K) - 1;
            const unsigned lanes = ((1u << 4 * split) - 1) & all;
            return {{detail::x86::with_loaded(detail::x86::with_loaded(detail::x86::float16{}, lanes, first),
                                              all & ~lanes, second)},
                    {}};
        }
#endif
        if constexpr (W == 4)
            return {Number::load((k < split ? first : second) + 4 * k),
                    Rest::template of_runs<k + 1>(first, second, split)};
    }
    /// Returns a row whose node k is f(k), where f gets k as a std::integral_constant. Only for rows with one node per
    /// register.
    template <int k = 0, class F>
        requires(W == 4)
    FIRN_INLINE static row_of of_nodes(const F& f) {
        return {f(std::integral_constant<int, k>{}), Rest::template of_nodes<k + 1>(f)};
    }

    /// Returns node k.
    template <int k>
    FIRN_INLINE quad<S> node() const {
        if constexpr (k < width / 4)
            return first.template node<k>();
        else
            return rest.template node<k - width / 4>();
    }

    /// \name Arithmetic with rows, number by number
    /// @{

    /// Apply the operation to each number of the row, and round each result. If the second operand is a single
    /// register, each register of the row is combined with this register.
    FIRN_INLINE friend row_of operator+(const row_of& a, const row_of& b) {
        return {a.first + b.first, a.rest + b.rest};
    }
    FIRN_INLINE friend row_of operator-(const row_of& a, const row_of& b) {
        return {a.first - b.first, a.rest - b.rest};
    }
    FIRN_INLINE friend row_of operator*(const row_of& a, const row_of& b) {
        return {a.first * b.first, a.rest * b.rest};
    }
    /// Returns a + b c, computed by one fused operation if the target has it and the compiler may use it
    /// (-ffp-contract).
    FIRN_INLINE friend row_of plus_times(const row_of& a, const row_of& b, const row_of& c) {
        return {plus_times(a.first, b.first, c.first), plus_times(a.rest, b.rest, c.rest)};
    }
    FIRN_INLINE friend row_of operator*(const row_of& a, const Number& s) {
        return {a.first * s, a.rest * Rest::narrowed(s)};
    }
    /// Returns a + b s, computed by one fused operation if the target has it and the compiler may use it
    /// (-ffp-contract). Each register of b is multiplied by the register s.
    FIRN_INLINE friend row_of plus_times(const row_of& a, const row_of& b, const Number& s) {
        return {plus_times(a.first, b.first, s), plus_times(a.rest, b.rest, Rest::narrowed(s))};
    }
    /// Returns b s − a, computed by one fused operation if the target has it and the compiler may use it
    /// (-ffp-contract). Each register of b is multiplied by the register s.
    FIRN_INLINE friend row_of times_minus(const row_of& b, const Number& s, const row_of& a) {
        return {times_minus(b.first, s, a.first), times_minus(b.rest, Rest::narrowed(s), a.rest)};
    }
    /// @}

    /// Returns the first numbers of `s`, as many as fit into the first register of this row.
    template <int N>
    FIRN_INLINE static Number narrowed(const detail::node_register<S, N>& s) {
        if constexpr (N == width)
            return s;
        else
            return s.template node<0>();
    }
};

/// A row without nodes, which ends the recursion of row_of. The functions of this row do nothing.
template <class S, int W>
struct row_of<S, 0, W> {
    /// \name Members of row_of
    /// @{

    /// These members have the same names as those of a row with nodes. The functions do nothing.
    static constexpr int width = W, registers = 0;
    FIRN_INLINE static row_of load(const S*) { return {}; }
    FIRN_INLINE void store(S*) const {}
    FIRN_INLINE row_of held() const { return {}; }
    FIRN_INLINE static row_of repeat(const S*) { return {}; }
    FIRN_INLINE static row_of spread(const S*) { return {}; }
    template <int>
    FIRN_INLINE static row_of of_runs(const S*, const S*, int) {
        return {};
    }
    template <int, class F>
    FIRN_INLINE static row_of of_nodes(const F&) {
        return {};
    }
    FIRN_INLINE friend row_of operator+(row_of, row_of) { return {}; }
    FIRN_INLINE friend row_of operator-(row_of, row_of) { return {}; }
    FIRN_INLINE friend row_of operator*(row_of, row_of) { return {}; }
    FIRN_INLINE friend row_of plus_times(row_of, row_of, row_of) { return {}; }
    FIRN_INLINE friend row_of operator*(row_of, const detail::node_register<S, W>&) { return {}; }
    FIRN_INLINE friend row_of plus_times(row_of, row_of, const detail::node_register<S, W>&) { return {}; }
    FIRN_INLINE friend row_of times_minus(row_of, const detail::node_register<S, W>&, row_of) { return {}; }
    FIRN_INLINE static const detail::node_register<S, W>& narrowed(const detail::node_register<S, W>& s) { return s; }
    /// @}
};

/// A row of K nodes with one node per register, on every target processor.
template <std::floating_point S, int K>
using portable_row = row_of<S, K, 4>;

/// A row of K nodes in registers of the width that suits the target processor best. The row may contain one node more
/// than K.
template <std::floating_point S, int K>
using row = row_of<S, K, detail::row_register<S, K>>;

/// A row of exactly K nodes, in the widest registers of the target processor for which no further node is needed.
template <std::floating_point S, int K>
using exact_row = row_of<S, K, (detail::row_register<S, 4> > 4 ? 8 : 4)>;

/// A row of K nodes that row_of::of_runs() can read from two places, in the widest registers for which it can.
template <std::floating_point S, int K>
using row_of_runs = std::conditional_t<row<S, K>::width == 16 && K <= 4, row<S, K>, portable_row<S, K>>;

/// Number of rows that are processed side by side: four if one register holds a row, else one.
template <class Row>
inline constexpr int rows_abreast = Row::width == 16 && Row::nodes <= 4 ? 4 : 1;

/// Returns an array of the nodes of one row: element k is node k.
template <class Row>
FIRN_INLINE auto nodes_of_rows(const std::array<Row, 1>& rows) {
    std::array<std::remove_cvref_t<decltype(rows[0].template node<0>())>, std::size_t(Row::nodes)> nodes;
    unroll<Row::nodes>([&](auto k) FIRN_LAMBDA { nodes[k] = rows[0].template node<k>(); });
    return nodes;
}

namespace detail {
/// Returns a register of four quads (four numbers each): those with the indices `i`, `j`, `k` and `l`. Quads 0 to 3 are
/// the quads of `a`, quads 4 to 7 are the quads of `b`.
template <int i, int j, int k, int l, class Number>
FIRN_INLINE Number quads_of(const Number& a, const Number& b) {
    return {__builtin_shufflevector(a.v, b.v, 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3, 4 * j, 4 * j + 1, 4 * j + 2,
                                    4 * j + 3, 4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3, 4 * l, 4 * l + 1, 4 * l + 2,
                                    4 * l + 3)};
}
}  // namespace detail

/// Returns an array of the nodes of four rows: element k holds node k of each row, in the order of the rows.
template <class Row>
FIRN_INLINE auto nodes_of_rows(const std::array<Row, 4>& rows) {
    using Number = typename Row::Number;
    const Number &a = rows[0].first, &b = rows[1].first, &c = rows[2].first, &d = rows[3].first;
    std::array<Number, std::size_t(Row::nodes)> nodes;
    const Number low = detail::quads_of<0, 1, 4, 5>(a, b), low_too = detail::quads_of<0, 1, 4, 5>(c, d);
    nodes[0] = detail::quads_of<0, 2, 4, 6>(low, low_too);
    nodes[1] = detail::quads_of<1, 3, 5, 7>(low, low_too);
    if constexpr (Row::nodes > 2) {
        const Number high = detail::quads_of<2, 3, 6, 7>(a, b), high_too = detail::quads_of<2, 3, 6, 7>(c, d);
        nodes[2] = detail::quads_of<0, 2, 4, 6>(high, high_too);
        if constexpr (Row::nodes > 3) nodes[3] = detail::quads_of<1, 3, 5, 7>(high, high_too);
    }
    return nodes;
}

/// True if `count` rows fit into 9/16 of the target's vector registers, so that the other registers are free for
/// computing.
template <class Row, int count>
inline constexpr bool rows_fit = 16 * count * Row::registers <= 9 * vector_registers;

}  // namespace firn::inline FIRN_BUILD
