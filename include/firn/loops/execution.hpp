/// \file The execution policies of P2G: how P2G sums the contributions to a node, and with how many threads.
#pragma once

#include <firn/core/exact_sum.hpp>
#include <firn/core/parallel.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

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
    /// Whether time steps at their bound are chosen in float, as a WGSL program on a GPU chooses them. Set it for a run
    /// that shall have the bits of a GPU. A fixed time step is not affected. Loads push particles in float, then, too.
    bool float_steps = false;
};
/// Execution of P2G with sums in integers, without atomics: threads work on blocks of one colour at a time.
template <class Integer = std::int32_t>
using ColouredFixedPoint = FixedPoint<Integer, Adding::coloured>;

namespace detail {
/// Execution of P2G by one thread, which adds the contributions of one particle after the other to the grid, in their
/// order in memory. It is the reference of tests and benchmarks; programs take Coloured{1}.
struct Serial {
    static constexpr const char* name = "serial";
    static constexpr int threads = 1;
};
}  // namespace detail

/// Satisfied by execution policies of P2G: any type with a member `threads` (the number of threads).
template <class E>
concept execution_policy = requires(const E e) {
    { e.threads } -> std::convertible_to<int>;
};

/// Which of several equal parts of something a process takes: all, unless several processes (ranks) share the work.
struct Share {
    std::size_t part = 0,  ///< Index of the part, from 0.
        parts = 1;         ///< Number of parts.

    /// Returns the first of n elements in this part.
    std::size_t first(std::size_t n) const { return first_of(n, part); }
    /// Returns the number of the last element in this part, plus 1.
    std::size_t last(std::size_t n) const { return first_of(n, part + 1); }

private:
    std::size_t first_of(std::size_t n, std::size_t k) const { return n / parts * k + n % parts * k / parts; }
};

/// Copies of blocks for contact groups that only other processes (ranks) have in their grids, in blocks of the domain
/// of which this rank has a copy, too.
struct CopiesElsewhere {
    std::vector<std::uint64_t> keys{};  ///< Keys of the copies.
    std::size_t first_block = 0;        ///< Index of the first one in the grid; the others follow.
};

/// What the processes (ranks) of a run tell each other, for a run of one process: nothing. firn::mpi::Ranks has the
/// same functions for many.
struct OneRank {
    static Share share() { return {}; }                        ///< Returns which part of new particles this rank takes.
    static bool speaks() { return true; }                      ///< Returns whether this rank gives warnings.
    static std::size_t sum(std::size_t here) { return here; }  ///< Returns the sum of all ranks' numbers.
    static double largest(double here) { return here; }        ///< Returns the largest of all ranks' numbers.
    /// Returns the text of the first rank whose text is not empty.
    static std::string text_of_first(std::string here) { return here; }
    /// Calls describe(), which throws an error, unless `right` is true on all ranks.
    template <class Describe>
    static void require(bool right, const Describe& describe) {
        if (!right) describe();
    }
    /// Before the particles of set `number` are sorted: sends them to the ranks that own their blocks.
    template <class Kernel, class Sets>
    static void bring_home(const Kernel&, Sets&, std::size_t /* number */) {}
    /// After a grid was activated: finds the blocks of nodes that several ranks share.
    template <class Kernel, class Grid, class Partitions>
    static void meet(const Kernel&, Grid&, const Partitions&, int /* threads */) {}
    /// Before P2G: takes note of the mirrored walls, behind which nodes depend on those in front.
    template <class Planes>
    static void use_mirrors(const Planes&) {}
    /// Joins the reports of G2P of all ranks.
    template <class Sets>
    static void join_reports(Sets&) {}
    /// After G2P: joins the reports and the largest accelerations, then calls describe(), which throws an error, unless
    /// `right` is true on all ranks.
    template <class Sets, class Describe>
    static void end_g2p(Sets&, double /* time */, bool right, double& /* acceleration */, const Describe& describe) {
        if (!right) describe();
    }
    /// Adds up the sums of all ranks; each rank then has the sums over all. \see digits_of
    static void merge(std::span<ExactSum>) {}
    /// Returns whether this rank counts what happens in a block of the grid: every block is counted by one rank.
    template <int D>
    static constexpr bool counts(std::size_t /* block */) {
        return true;
    }
    /// Returns whether a particle of set `number` was removed on another rank when the last step ended.
    static bool has_lost(std::size_t /* number */) { return false; }
    /// After meet(): finds the copies of blocks that this rank needs from others. The arguments tell whether there may
    /// be contact between groups, and whether the boundary acts by the gap of particles.
    template <class Grid, class Partitions>
    static CopiesElsewhere copies_elsewhere(Grid&, const Partitions&, bool /* between_groups */, bool /* acts_by_gap */,
                                            int /* threads */) {
        return {};
    }
    /// Before contact: completes the sums in the copies of blocks that this rank shares with others.
    template <class Grid>
    static void bring_copies(Grid&) {}
    /// Sends particles near contact to the ranks that need them. \see NearParticles::find
    template <class Near>
    static void bring_near(Near&) {}
    /// Replaces the pairs of contact groups between which this rank has impulses, sorted, by those of all ranks.
    static void join_pairs(std::vector<std::pair<int, int>>&) {}
};
/// Returns what the ranks of a run tell each other. firn::mpi overloads this function for its executions.
template <class Execution>
OneRank ranks_of(const Execution&) {
    return {};
}
/// Whether an execution policy runs on one rank only.
template <class Execution>
inline constexpr bool has_one_rank =
    std::same_as<std::remove_cvref_t<decltype(ranks_of(std::declval<const Execution&>()))>, OneRank>;

/// Returns the number of threads that an execution policy asks for; 0 if thread_count() is to choose it.
template <class Execution>
int requested_threads(const Execution& execution) {
    return execution.threads;
}

/// Returns whether an execution policy asks for time steps that are chosen in float. \see FixedPoint::float_steps
template <class Execution>
bool requested_float_steps(const Execution& execution) {
    if constexpr (requires { execution.float_steps; })
        return execution.float_steps;
    else
        return false;
}

namespace detail {
/// Returns the number of threads that an execution policy uses.
template <class Execution>
int threads_of(const Execution& execution) {
    return thread_count(requested_threads(execution));
}
}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
