/// \file A row of nodes in registers: `K` neighbouring nodes along the last axis, four numbers each.
///
/// P2G writes rows and G2P reads rows; policies never see them.
///
/// If the target has registers for several nodes, a row needs fewer registers. Every form does the same operations on
/// every number in the same order, and gives the same bits. So the code here, not its context, decides which operations
/// a compiler may fuse. If FIRN_PORTABLE_ROWS is defined, only the form with one node per register is used, which every
/// target has.
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

namespace firn {

namespace detail {

/// A product that is rounded before anything is added to it, even if the compiler may fuse operations.
template <class V>
FIRN_INLINE V rounded_product(const V& a, const V& b) {
#ifdef __clang__
#pragma clang fp contract(off)
    return a * b;
#else
    V product = a * b;
#ifdef __FMA__
    asm("" : "+v"(product));  // only this stops g++ from fusing and leaves the vector whole
#elif defined(__aarch64__)
    if constexpr (sizeof(V) <= register_bytes) asm("" : "+w"(product));
#endif
    return product;
#endif
}

/// A register of N numbers, N/4 nodes. Arithmetic uses the compilers' vector extension. x86 intrinsics are used only
/// where g++ 12 moves a shuffle between registers of different widths through memory.
/// \tparam S  a floating-point type, or an integer for sums only
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
    /// The same numbers, kept in a register. Otherwise g++ reads them from memory again for every use. Most rows lie
    /// across two cache lines, and gathering waits for their loads.
    FIRN_INLINE node_register held() const {
        vector r = v;
#ifdef FIRN_WIDE_ROWS
        asm("" : "+v"(r));
#endif
        return {r};
    }

    /// The same number everywhere.
    FIRN_INLINE static node_register fill(const S* from) { return {*from - vector{}}; }

    /// The same four numbers in every node.
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

    /// Node k holds from[k] four times.
    /// \param from  four numbers if N is 16
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

    /// Each quad holds its number k four times.
    /// \param from  one quad per node
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
    /// a + b c, in one operation if the target has it and the compiler may use it (-ffp-contract).
    FIRN_INLINE friend node_register plus_times(node_register a, node_register b, node_register c) {
        return {a.v + b.v * c.v};
    }
    /// b c − a, in one operation likewise.
    FIRN_INLINE friend node_register times_minus(node_register b, node_register c, node_register a) {
        return {b.v * c.v - a.v};
    }
};

/// Numbers per register of a row of K nodes.
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

/// The four numbers of one node: D components of momentum or velocity, and the mass.
template <class S>
using quad = detail::node_register<S, 4>;

/// A row of K nodes in registers of W numbers: 4 (one node), 8 or 16. With W = 8, a single last node has a register
/// of 4. With W = 16, a row of three nodes covers a fourth node, whose weight is zero, and writes it back unchanged.
template <class S, int K, int W>
struct row_of {
    template <class Other>
    using of = row_of<Other, K, W>;                         ///< the same form of a row, of other numbers
    static constexpr int nodes = K;                         ///< number of nodes
    static constexpr int width = W == 8 && K == 1 ? 4 : W;  ///< numbers in the first register
    using Number = detail::node_register<S, width>;         ///< type of a register
    /// Type of the nodes beyond the first register.
    using Rest = row_of<S, (K > width / 4 ? K - width / 4 : 0), width>;
    /// Number of the target's registers that it fills.
    static constexpr int registers = int((width * sizeof(S) - 1) / register_bytes + 1) + Rest::registers;

    Number first;                     ///< the first register
    [[no_unique_address]] Rest rest;  ///< the other registers

    /// Reads the nodes from memory.
    FIRN_INLINE static row_of load(const S* from) { return {Number::load(from), Rest::load(from + width)}; }
    /// Writes the nodes to memory.
    FIRN_INLINE void store(S* to) const {
        first.store(to);
        rest.store(to + width);
    }
    /// The same numbers, kept in registers: the compiler does not read them again from memory.
    FIRN_INLINE row_of held() const { return {first.held(), rest.held()}; }
    /// The same four numbers in every node.
    FIRN_INLINE static row_of repeat(const S* from) { return {Number::repeat(from), Rest::repeat(from)}; }
    /// Node k holds from[k] four times.
    /// \param from  four numbers; those beyond node K − 1 are zero
    FIRN_INLINE static row_of spread(const S* from) { return {Number::spread(from), Rest::spread(from + width / 4)}; }
    /// A row whose node k is f(k). For one node per register only.
    template <int k = 0, class F>
        requires(W == 4)
    FIRN_INLINE static row_of of_nodes(const F& f) {
        return {f(std::integral_constant<int, k>{}), Rest::template of_nodes<k + 1>(f)};
    }

    /// Node k.
    template <int k>
    FIRN_INLINE quad<S> node() const {
        if constexpr (k < width / 4)
            return first.template node<k>();
        else
            return rest.template node<k - width / 4>();
    }

    /// \name Arithmetic, number by number
    /// @{

    /// Number by number, each result rounded.
    FIRN_INLINE friend row_of operator+(const row_of& a, const row_of& b) {
        return {a.first + b.first, a.rest + b.rest};
    }
    FIRN_INLINE friend row_of operator-(const row_of& a, const row_of& b) {
        return {a.first - b.first, a.rest - b.rest};
    }
    FIRN_INLINE friend row_of operator*(const row_of& a, const row_of& b) {
        return {a.first * b.first, a.rest * b.rest};
    }
    /// a + b c, in one operation if the target has it and the compiler may use it (-ffp-contract).
    FIRN_INLINE friend row_of plus_times(const row_of& a, const row_of& b, const row_of& c) {
        return {plus_times(a.first, b.first, c.first), plus_times(a.rest, b.rest, c.rest)};
    }
    FIRN_INLINE friend row_of operator*(const row_of& a, const Number& s) {
        return {a.first * s, a.rest * Rest::narrowed(s)};
    }
    /// a + b s, in one operation if the target has it and the compiler may use it (-ffp-contract).
    FIRN_INLINE friend row_of plus_times(const row_of& a, const row_of& b, const Number& s) {
        return {plus_times(a.first, b.first, s), plus_times(a.rest, b.rest, Rest::narrowed(s))};
    }
    /// b s − a, in one operation likewise.
    FIRN_INLINE friend row_of times_minus(const row_of& b, const Number& s, const row_of& a) {
        return {times_minus(b.first, s, a.first), times_minus(b.rest, Rest::narrowed(s), a.rest)};
    }
    /// @}

    /// A register as narrow as this row's: the first numbers of a wider one.
    template <int N>
    FIRN_INLINE static Number narrowed(const detail::node_register<S, N>& s) {
        if constexpr (N == width)
            return s;
        else
            return s.template node<0>();
    }
};

/// A row without nodes ends the recursion of row_of: its functions do nothing.
template <class S, int W>
struct row_of<S, 0, W> {
    /// \name As of rows with nodes
    /// @{

    /// As in row_of, for no nodes.
    static constexpr int width = W, registers = 0;
    FIRN_INLINE static row_of load(const S*) { return {}; }
    FIRN_INLINE void store(S*) const {}
    FIRN_INLINE row_of held() const { return {}; }
    FIRN_INLINE static row_of repeat(const S*) { return {}; }
    FIRN_INLINE static row_of spread(const S*) { return {}; }
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

/// A row with one node per register.
template <std::floating_point S, int K>
using portable_row = row_of<S, K, 4>;

/// A row in the registers that suit the target best.
template <std::floating_point S, int K>
using row = row_of<S, K, detail::row_register<S, K>>;

/// The same, but it never covers nodes beyond its own.
template <std::floating_point S, int K>
using exact_row = row_of<S, K, (detail::row_register<S, 4> > 4 ? 8 : 4)>;

/// How many rows are worked on side by side: four if a row is one register of four nodes, else one.
template <class Row>
inline constexpr int rows_abreast = Row::width == 16 && Row::nodes <= 4 ? 4 : 1;

/// The nodes of one row, one per element.
template <class Row>
FIRN_INLINE auto nodes_of_rows(const std::array<Row, 1>& rows) {
    std::array<std::remove_cvref_t<decltype(rows[0].template node<0>())>, std::size_t(Row::nodes)> nodes;
    unroll<Row::nodes>([&](auto k) FIRN_LAMBDA { nodes[k] = rows[0].template node<k>(); });
    return nodes;
}

namespace detail {
/// Four of the quads of a (0 to 3) and b (4 to 7).
template <int i, int j, int k, int l, class Number>
FIRN_INLINE Number quads_of(const Number& a, const Number& b) {
    return {__builtin_shufflevector(a.v, b.v, 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3, 4 * j, 4 * j + 1, 4 * j + 2,
                                    4 * j + 3, 4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3, 4 * l, 4 * l + 1, 4 * l + 2,
                                    4 * l + 3)};
}
}  // namespace detail

/// The nodes of four rows: element k holds node k of each row.
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

/// True if `count` rows fit in registers and leave enough registers to work in.
template <class Row, int count>
inline constexpr bool rows_fit = 16 * count * Row::registers <= 9 * vector_registers;

}  // namespace firn
