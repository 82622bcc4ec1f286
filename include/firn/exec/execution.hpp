/// \file The execution policies of P2G: how P2G sums the contributions to a node, and with how many threads.
#pragma once

#include <firn/core/exact_sum.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace firn {

/// Execution of P2G by one thread, which adds the contributions of one particle after the other to the grid.
struct Serial {
    static constexpr const char* name = "serial";
};

/// Execution of P2G by several threads, without atomics. Each block has a colour, such that no two blocks of the same
/// colour contribute to the same node. Threads share the blocks of one colour, and go on to the next colour when all
/// these blocks are done. Sums are in floating point, and have the same bits for any number of threads.
struct Coloured {
    static constexpr const char* name = "coloured";
    int threads = 0;  ///< number of threads; 0: thread_count() chooses it
};

/// How threads add integers to a node. Both ways give the same bits, because integer sums do not depend on the order of
/// the additions.
enum class Adding {
    atomic,   ///< all threads add to the grid at the same time, with atomics, as WebGPU requires on a GPU
    coloured  ///< threads work on blocks of one colour at a time, without atomics. \see Coloured
};

/// Execution of P2G with sums in integers (fixed point). The sums have the same bits for any number of threads and any
/// order of the particles.
///
/// A scale is the number of integer steps (quanta) per unit of momentum or mass. If a scale is not given, P2G takes the
/// largest scale with which no sum can overflow. If a sum could overflow with a given scale, P2G throws an
/// overflow_error.
/// \tparam Integer  std::int32_t, as on a GPU; or std::int64_t: its rounding error is negligible compared with the
///                  rounding error of float
/// \tparam How      how threads add: with atomics, or colour by colour
template <class Integer = std::int32_t, Adding How = Adding::atomic>
    requires std::same_as<Integer, std::int32_t> || std::same_as<Integer, std::int64_t>
struct FixedPoint {
    static constexpr const char* name =
        How == Adding::atomic ? (sizeof(Integer) == 4 ? "fixed_point" : "fixed_point_64")
                              : (sizeof(Integer) == 4 ? "coloured_fixed_point" : "coloured_fixed_point_64");
    int threads = 0;                         ///< number of threads; 0: thread_count() chooses it
    std::optional<double> momentum_scale{},  ///< Quanta per kg m/s, a power of two; if not given, the largest safe one.
        mass_scale{};                        ///< Quanta per kg, a power of two; if not given, the largest safe one.
};
/// Execution of P2G with sums in integers, without atomics: threads work on blocks of one colour at a time.
template <class Integer = std::int32_t>
using ColouredFixedPoint = FixedPoint<Integer, Adding::coloured>;

/// Satisfied by execution policies of P2G: Serial, and any type with a member `threads` (the number of threads).
template <class E>
concept execution_policy = std::same_as<E, Serial> || requires(const E e) {
    { e.threads } -> std::convertible_to<int>;
};

/// Returns 1: Serial uses one thread.
inline int requested_threads(const Serial&) { return 1; }
/// Returns the number of threads that an execution policy asks for; 0 if thread_count() is to choose it.
template <class Execution>
int requested_threads(const Execution& execution) {
    return execution.threads;
}

namespace detail {

// An execution on several ranks (processes that share one simulation) overloads these two functions in its own
// namespace. Callers do not qualify their names.

/// Adds the sums of all ranks, such that every rank then has the sum over all of them. Does nothing: there is one rank.
/// \see ExactSum::digits
template <class Execution>
void merge_sums(const Execution&, std::span<ExactSum>) {}

/// Whether this rank counts the reactions in a block of the grid. If several ranks update the same block, one of them
/// counts it. Returns true: there is one rank.
/// \param block  index of the block in the grid
template <class Execution>
constexpr bool counts_block(const Execution&, [[maybe_unused]] std::size_t block) {
    return true;
}

}  // namespace detail

}  // namespace firn
