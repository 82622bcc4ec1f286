/// \file How the loops run: the executions of P2G. They differ only in how sums are made.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>

namespace firn {

/// One thread, particle after particle, straight to the grid.
struct Serial {
    static constexpr const char* name = "serial";
};

/// Blocks of one colour share no node; colours follow one another. Floating point, no atomics, the same bits for any
/// number of threads.
struct Coloured {
    static constexpr const char* name = "coloured";
    int threads = 0;  ///< 0: as many as thread_count() says
};

/// How fixed-point sums are added up. Integer sums know no order: both give the same bits.
enum class Adding {
    atomic,   ///< every thread adds to the grid with atomics: what WebGPU forces on a GPU
    coloured  ///< blocks of one colour share no node, as in Coloured: no atomics
};

/// Sums in integers: the same bits for any number of threads and any order of the particles.
/// \tparam Integer  std::int32_t, as on a GPU, or std::int64_t, whose error vanishes beside that of float
template <class Integer = std::int32_t, Adding How = Adding::atomic>
    requires std::same_as<Integer, std::int32_t> || std::same_as<Integer, std::int64_t>
struct FixedPoint {
    static constexpr const char* name =
        How == Adding::atomic ? (sizeof(Integer) == 4 ? "fixed_point" : "fixed_point_64")
                              : (sizeof(Integer) == 4 ? "coloured_fixed_point" : "coloured_fixed_point_64");
    int threads = 0;  ///< 0: as many as thread_count() says
    /// Quanta per kg m/s and per kg, powers of two. Not given: the largest for which no sum can overflow.
    /// A given scale that could overflow is refused with overflow_error.
    std::optional<double> momentum_scale{}, mass_scale{};
};
template <class Integer = std::int32_t>
using ColouredFixedPoint = FixedPoint<Integer, Adding::coloured>;

/// What can run the loops.
template <class E>
concept execution_policy = std::same_as<E, Serial> || requires(const E e) {
    { e.threads } -> std::convertible_to<int>;
};

inline int requested_threads(const Serial&) { return 1; }
template <class Execution>
int requested_threads(const Execution& execution) {
    return execution.threads;
}

}  // namespace firn
