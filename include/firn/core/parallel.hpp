/// \file Loops over threads.
///
/// Compiled with OpenMP, loops run on OpenMP's threads; without, on the calling thread. A parallel region is opened
/// once for a call: a step, a stage that is called alone, or what parallel_region() is given. A host with threads of
/// its own lends those in their place. \see LentThreads
///
/// A loop inside the body of another, and one inside a parallel region of the user's, runs on its calling thread, with
/// the same results; so does one in a child of fork(), where OpenMP's threads are missing. Calls of two threads of the
/// user's know nothing of each other.
#pragma once

#include <firn/core/config.hpp>
#include <firn/core/error.hpp>
#include <firn/core/lent_threads.hpp>

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>

namespace firn {

/// Workers that a loop started here gets at most, if so many are asked for; for 0, as many as OpenMP would use
/// (OMP_NUM_THREADS), or as a host's machine has processors. OMP_THREAD_LIMIT is a limit; where a loop runs on its
/// calling thread the answer is 1.
/// \throws parameter_error  if it is negative, or above 65535
inline int thread_count(int requested) {
    if (requested < 0 || requested > 0xffff)
        throw parameter_error(
            sentence(requested, " threads are asked for; give 1 to 65535, or 0 for as many as the machine has."));
    const detail::ThreadRole& role = detail::role_of_this_thread;
    const auto at_most = [&](int most) { return requested > 0 ? std::min(requested, most) : most; };
    if (role.at_work) return 1;
    if (role.team) return at_most(role.team->workers());
    if (!detail::may_have_helpers()) return 1;
#ifdef _OPENMP
    if (!detail::lender_of_this_thread)
        return std::min(requested > 0 ? requested : omp_get_max_threads(), omp_get_thread_limit());
#endif
    return requested > 0 ? requested : std::max(int(sysconf(_SC_NPROCESSORS_ONLN)), 1);
}

/// Calls body() on the calling thread. All loops that it starts share one parallel region of up to so many workers, who
/// wait for the next loop in between: in body() OpenMP's own regions have one thread. Inside another call, and where
/// there are no helpers, it only calls body().
/// \param workers  0: as many as thread_count() says
/// \throws what body throws, when the region is closed
template <class Body>
void parallel_region(int workers, const Body& body) {
    if (workers == 0) workers = thread_count(0);
    if (workers <= 1 || !detail::may_open_region()) return body();
    const auto run = [](const void* f) { (*static_cast<const Body*>(f))(); };
    detail::run_call(std::make_shared<detail::Call>(workers, run, &body));
}

namespace detail {

/// body(), whose loops run on the calling thread.
template <class Body>
void on_this_thread(const Body& body) {
    const struct Alone {
        bool before = std::exchange(role_of_this_thread.at_work, true);
        ~Alone() { role_of_this_thread.at_work = before; }
    } alone;
    body();
}

inline void run_loop(const PhasedLoop& loop, int workers) {
    const ThreadRole& role = role_of_this_thread;
    const bool is_long = std::any_of(loop.counts.begin(), loop.counts.end(), [&](auto n) { return n > loop.grain; });
    const bool is_shared = is_long && workers > 1 && !role.at_work;
    if (is_shared && role.team) return role.team->run(loop, workers);
    if (is_shared && may_open_region()) return parallel_region(workers, [&] { run_loop(loop, workers); });
    for (std::size_t phase = 0; phase < loop.counts.size(); ++phase)
        loop.run(loop.body, phase, 0, loop.counts[phase], 0);
}

}  // namespace detail

/// Calls body(phase, i, worker) for 0 ≤ i < counts[phase]: the phases one after another, each begun when all of the one
/// before is done, and within a phase in any order, `grain` ≥ 1 consecutive ones at a time.
/// 0 ≤ worker < workers, and no two calls at the same time have the same.
/// \throws what a body throws first, when all is quiet; of the calls not begun by then many are left out
template <class Body>
void parallel_phases(std::span<const std::size_t> counts, int workers, const Body& body, std::size_t grain = 1) {
    // One function for every thread, never inlined: else the compiler could fuse other multiplications and additions in
    // a copy for one thread than in a copy for many, and their bits would differ.
    const auto run = [](const void* f, std::size_t phase, std::size_t first, std::size_t last, int worker)
                         FIRN_NEVER_INLINE {
                             for (std::size_t i = first; i < last; ++i)
                                 (*static_cast<const Body*>(f))(phase, i, worker);
                         };
    detail::run_loop({counts, grain, run, &body}, workers);
}

/// Calls body(i, worker) for 0 ≤ i < n: parallel_phases with one phase.
template <class Body>
void parallel_for(std::size_t n, int workers, const Body& body, std::size_t grain = 1) {
    const auto only_phase = [&](std::size_t, std::size_t i, int worker) { body(i, worker); };
    parallel_phases(std::span(&n, 1), workers, only_phase, grain);
}

namespace detail {

/// Points, or elements, that a worker takes at once.
inline constexpr std::size_t at_once = 1024;

/// Calls body(first, last) for the share of each worker in [0, n), on that worker: who is the first to write there has
/// the memory beside its processor. Where a worker is late by a millisecond, others do its part.
template <class Body>
void for_shares(std::size_t n, int workers, const Body& body) {
    const std::size_t shares = std::size_t(std::max(workers, 1));
    const auto run = [&](std::size_t k) { body(n * k / shares, n * (k + 1) / shares); };
    using Run = decltype(run);
    const auto run_some = [](const void* f, std::size_t, std::size_t first, std::size_t last, int) {
        for (std::size_t k = first; k < last; ++k) (*static_cast<const Run*>(f))(k);
    };
    run_loop({std::span(&shares, 1), 1, run_some, &run, true}, workers);
}

/// Calls body(first, last) for pieces of [0, n).
template <class Body>
void for_chunks(std::size_t n, int threads, const Body& body) {
    parallel_for((n + at_once - 1) / at_once, thread_count(threads),
                 [&](std::size_t c, int) { body(c * at_once, std::min(n, (c + 1) * at_once)); });
}

/// Gives all numbers that value.
template <class Numbers, class T>
void fill_chunks(Numbers& numbers, const T& value, int threads) {
    for_chunks(numbers.size(), threads, [&](std::size_t first, std::size_t last) {
        std::fill(numbers.data() + first, numbers.data() + last, value);
    });
}

}  // namespace detail

}  // namespace firn
