/// \file A row of nodes in registers: `K` neighbouring nodes along the last axis, four numbers each.
/// The unit in which P2G writes and G2P reads; policies never see it.
///
/// Where the target has registers of several nodes, a row has fewer of them. Every form does the same operations on
/// every number in the same order, and gives the same bits: what a compiler may fuse into one operation is said here,
/// too, and not left to what it sees around. FIRN_PORTABLE_ROWS, if defined, leaves only the form that every target
/// has, of a node a register.
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

/// A product that is rounded before anything is added to it, whatever the compiler may fuse.
template <class V>
FIRN_INLINE V rounded_product(const V& a, const V& b) {
#ifdef __clang__
#pragma clang fp contract(off)
    return a * b;
#else
    V product = a * b;
#ifdef __FMA__
    asm("" : "+v"(product));  // nothing else tells g++ that leaves the vector whole
#elif defined(__aarch64__)
    if constexpr (sizeof(V) <= register_bytes) asm("" : "+w"(product));
#endif
    return product;
#endif
}

/// A register of N numbers, N/4 nodes. Arithmetic is the compilers' vector extension's. Instructions of x86 are
/// named only where g++ 12 takes a shuffle between registers of different widths through memory.
/// \tparam S  of floating point, or an integer, of which only sums are made
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
    /// The same, in a register: g++ would read it from memory once more for every use. Most rows lie across two cache
    /// lines, and reading them is what a gather waits for.
    FIRN_INLINE node_register held() const {
        vector r = v;
#ifdef FIRN_WIDE_ROWS
        asm("" : "+v"(r));
#endif
        return {r};
    }

    /// One number everywhere.
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

    /// Node k holds from[k] four times. \param from  four numbers, if N is 16
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

    /// Each quad holds its number k four times. \param from  a quad a node
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
    /// a + b c, in one operation where the target has it and the compiler is allowed to use it (-ffp-contract).
    FIRN_INLINE friend node_register plus_times(node_register a, node_register b, node_register c) {
        return {a.v + b.v * c.v};
    }
    /// b c − a, likewise.
    FIRN_INLINE friend node_register times_minus(node_register b, node_register c, node_register a) {
        return {b.v * c.v - a.v};
    }
};

/// Numbers in the registers of a row of K nodes.
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

/// A row in registers of W numbers: 4 (a node), 8 or 16. What does not fill 8 has a register of 4; 16 numbers are taken
/// for three nodes, too: the row then reaches over a fourth, whose weight is zero, and writes it back as it was.
template <class S, int K, int W>
struct row_of {
    template <class Other>
    using of = row_of<Other, K, W>;  ///< the same form of a row, of other numbers
    static constexpr int nodes = K;
    static constexpr int width = W == 8 && K == 1 ? 4 : W;
    using Number = detail::node_register<S, width>;
    using Rest = row_of<S, (K > width / 4 ? K - width / 4 : 0), width>;
    /// Of the target, that it fills.
    static constexpr int registers = int((width * sizeof(S) - 1) / register_bytes + 1) + Rest::registers;

    Number first;
    [[no_unique_address]] Rest rest;

    FIRN_INLINE static row_of load(const S* from) { return {Number::load(from), Rest::load(from + width)}; }
    FIRN_INLINE void store(S* to) const {
        first.store(to);
        rest.store(to + width);
    }
    FIRN_INLINE row_of held() const { return {first.held(), rest.held()}; }
    /// The same four numbers in every node.
    FIRN_INLINE static row_of repeat(const S* from) { return {Number::repeat(from), Rest::repeat(from)}; }
    /// Node k holds from[k] four times. \param from  four numbers; those beyond node K − 1 are zero
    FIRN_INLINE static row_of spread(const S* from) { return {Number::spread(from), Rest::spread(from + width / 4)}; }
    /// Of a node a register: node k is f(k).
    template <int k = 0, class F>
        requires(W == 4)
    FIRN_INLINE static row_of of_nodes(const F& f) {
        return {f(std::integral_constant<int, k>{}), Rest::template of_nodes<k + 1>(f)};
    }

    template <int k>
    FIRN_INLINE quad<S> node() const {
        if constexpr (k < width / 4)
            return first.template node<k>();
        else
            return rest.template node<k - width / 4>();
    }

    FIRN_INLINE friend row_of operator+(const row_of& a, const row_of& b) {
        return {a.first + b.first, a.rest + b.rest};
    }
    FIRN_INLINE friend row_of operator-(const row_of& a, const row_of& b) {
        return {a.first - b.first, a.rest - b.rest};
    }
    FIRN_INLINE friend row_of operator*(const row_of& a, const row_of& b) {
        return {a.first * b.first, a.rest * b.rest};
    }
    FIRN_INLINE friend row_of plus_times(const row_of& a, const row_of& b, const row_of& c) {
        return {plus_times(a.first, b.first, c.first), plus_times(a.rest, b.rest, c.rest)};
    }
    // With one number for the whole row.
    FIRN_INLINE friend row_of operator*(const row_of& a, const Number& s) {
        return {a.first * s, a.rest * Rest::narrowed(s)};
    }
    FIRN_INLINE friend row_of plus_times(const row_of& a, const row_of& b, const Number& s) {
        return {plus_times(a.first, b.first, s), plus_times(a.rest, b.rest, Rest::narrowed(s))};
    }
    FIRN_INLINE friend row_of times_minus(const row_of& b, const Number& s, const row_of& a) {
        return {times_minus(b.first, s, a.first), times_minus(b.rest, Rest::narrowed(s), a.rest)};
    }
    template <int N>
    FIRN_INLINE static Number narrowed(const detail::node_register<S, N>& s) {
        if constexpr (N == width)
            return s;
        else
            return s.template node<0>();
    }
};

/// No nodes are left.
template <class S, int W>
struct row_of<S, 0, W> {
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
};

/// A node a register.
template <std::floating_point S, int K>
using portable_row = row_of<S, K, 4>;

/// In the registers that suit the target best.
template <std::floating_point S, int K>
using row = row_of<S, K, detail::row_register<S, K>>;

/// The same, but no form of it reaches over other nodes.
template <std::floating_point S, int K>
using exact_row = row_of<S, K, (detail::row_register<S, 4> > 4 ? 8 : 4)>;

/// How many rows' nodes are worked on side by side: four where a row is one register of four nodes.
template <class Row>
inline constexpr int rows_abreast = Row::width == 16 && Row::nodes <= 4 ? 4 : 1;

/// The nodes of one row, one after the other.
template <class Row>
FIRN_INLINE auto nodes_of_rows(const std::array<Row, 1>& rows) {
    std::array<std::remove_cvref_t<decltype(rows[0].template node<0>())>, std::size_t(Row::nodes)> nodes;
    unroll<Row::nodes>([&](auto k) FIRN_LAMBDA { nodes[k] = rows[0].template node<k>(); });
    return nodes;
}

namespace detail {
/// Four quads of those of a (0 to 3) and b (4 to 7).
template <int i, int j, int k, int l, class Number>
FIRN_INLINE Number quads_of(const Number& a, const Number& b) {
    return {__builtin_shufflevector(a.v, b.v, 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3, 4 * j, 4 * j + 1, 4 * j + 2,
                                    4 * j + 3, 4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3, 4 * l, 4 * l + 1, 4 * l + 2,
                                    4 * l + 3)};
}
}  // namespace detail

/// The nodes of four rows: register k holds node k of each.
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

/// Whether as many rows stay in registers, with others beside them to work in.
template <class Row, int count>
inline constexpr bool rows_fit = 16 * count * Row::registers <= 9 * vector_registers;

}  // namespace firn
