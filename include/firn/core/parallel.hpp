/// \file Loops that run on several threads.
///
/// If firn is compiled with OpenMP, loops run on OpenMP's threads; otherwise they run on the calling thread. The
/// calling program (the host) can lend its own threads instead. \see LentThreads
///
/// Each call of firn opens one parallel region. A call is a step, a stage that is called alone, or a parallel_region().
///
/// In these cases a loop runs on its calling thread alone, with the same results:
/// - in the body of another loop,
/// - in a parallel region that the user has opened with OpenMP,
/// - in a child process after fork(), where OpenMP's threads do not exist.
///
/// Several threads of the user may call firn at the same time. Their calls are independent of each other.
#pragma once

#include <firn/core/config.hpp>
#include <firn/core/error.hpp>
#include <firn/core/lent_threads.hpp>

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <span>

namespace firn::inline FIRN_BUILD {

/// Returns how many workers (threads) a loop gets at most if the calling thread starts the loop and asks for
/// `requested` workers. If OpenMP's threads are used, the result is at most OMP_THREAD_LIMIT. Where a loop would run on
/// its calling thread alone, the result is 1.
/// \param requested  1 to 65535. 0: the OpenMP default (OMP_NUM_THREADS); if the calling program lends the threads, the
///                   number of processors
/// \throws parameter_error  if `requested` is negative or above 65535
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

/// Calls body() on the calling thread. All loops that body() starts share one parallel region: the region's workers are
/// started once and wait between two loops. A parallel region of OpenMP that is opened in body() has one thread.
///
/// Inside another parallel region, or if no helpers (other threads) are available, parallel_region() only calls body().
/// \param workers  largest number of workers; 0: thread_count(0)
/// \throws anything  that body() throws, after the region has ended
template <class Body>
void parallel_region(int workers, const Body& body) {
    if (workers == 0) workers = thread_count(0);
    if (workers <= 1 || !detail::may_open_region()) return body();
    const auto run = [](const void* f) { (*static_cast<const Body*>(f))(); };
    detail::run_call(detail::CallHolder(new detail::Call(workers, run, &body)));
}

namespace detail {

/// Calls body(). All loops that body() starts run on the calling thread alone.
template <class Body>
void on_this_thread(const Body& body) {
    const struct Alone {
        bool before = std::exchange(role_of_this_thread.at_work, true);
        ~Alone() { role_of_this_thread.at_work = before; }
    } alone;
    body();
}

void run_loop(const PhasedLoop& loop, int workers);

}  // namespace detail

/// Calls body(phase, i, worker) for every phase and 0 ≤ i < counts[phase]. Each phase starts when the previous phase
/// has ended. Within a phase the order of the calls is arbitrary, but a worker takes `grain` consecutive indices at a
/// time.
/// \param counts   the number of indices of each phase
/// \param workers  largest number of workers. In the calls of body, 0 ≤ worker < workers; two calls of body at the same
///                 time never have the same worker.
/// \param body     called on several threads at the same time
/// \param grain    number of indices that a worker takes at a time, at least 1
/// \throws anything  that body throws: the first exception, after all workers have stopped. Many of the remaining calls
///                   of body are then left out.
template <class Body>
void parallel_phases(std::span<const std::size_t> counts, int workers, const Body& body, std::size_t grain = 1) {
    // All threads run the same copy of this function, which is never inlined. If there were two copies, the compiler
    // could fuse multiplications and additions differently in the two, and results would then depend on the number of
    // threads.
    const auto run = [](const void* f, std::size_t phase, std::size_t first, std::size_t last, int worker)
                         FIRN_NEVER_INLINE {
                             for (std::size_t i = first; i < last; ++i)
                                 (*static_cast<const Body*>(f))(phase, i, worker);
                         };
    detail::run_loop({counts, grain, run, &body}, workers);
}

/// Calls body(i, worker) for 0 ≤ i < n, in any order and on several threads at the same time.
/// \param workers  largest number of workers. In the calls of body, 0 ≤ worker < workers; two calls of body at the same
///                 time never have the same worker.
/// \param grain    number of consecutive indices that a worker takes at a time, at least 1
/// \throws anything  that body throws: the first exception, after all workers have stopped. Many of the remaining calls
///                   of body are then left out.
template <class Body>
void parallel_for(std::size_t n, int workers, const Body& body, std::size_t grain = 1) {
    const auto only_phase = [&](std::size_t, std::size_t i, int worker) { body(i, worker); };
    parallel_phases(std::span(&n, 1), workers, only_phase, grain);
}

namespace detail {

/// Number of consecutive indices in a chunk of for_chunks().
inline constexpr std::size_t at_once = 1024;

/// Cuts the indices [0, n) into one share per worker. Each worker calls body(first, last) once, for the indices first ≤
/// i < last of its own share. Use for_shares() to initialise memory: the operating system puts a page of memory near
/// the processor of the worker that first writes to the page. If a worker is more than a millisecond late, other
/// workers take over its share.
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

/// Cuts the indices [0, n) into chunks, and calls body(first, last) once for each chunk. The chunk consists of the
/// indices first ≤ i < last. The calls run on several threads.
template <class Body>
void for_chunks(std::size_t n, int threads, const Body& body) {
    parallel_for((n + at_once - 1) / at_once, thread_count(threads),
                 [&](std::size_t c, int) { body(c * at_once, std::min(n, (c + 1) * at_once)); });
}

/// Sets all elements of an array to `value`, on several threads.
template <class Numbers, class T>
void fill_chunks(Numbers& numbers, const T& value, int threads) {
    for_chunks(numbers.size(), threads, [&](std::size_t first, std::size_t last) {
        std::fill(numbers.data() + first, numbers.data() + last, value);
    });
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/core/parallel-inl.hpp>
#endif
