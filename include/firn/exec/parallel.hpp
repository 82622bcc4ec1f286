/// \file Loops over threads.
///
/// The threads are firn's own: as many as a loop asked for, kept for the next loop, asleep in between, ended with the
/// program. One loop has them at a time: a loop inside the body of another, and a loop that another user thread starts
/// meanwhile, runs on its calling thread alone, with the same results. A child of fork() gets threads of its own, if no
/// loop was running.
///
/// A program whose threads OpenMP shall own defines FIRN_OPENMP_THREADS wherever it includes firn: loops then run in an
/// OpenMP parallel region. Results are the same; waiting at the end of the region is OpenMP's.
#pragma once

#include <firn/core/config.hpp>
#include <firn/core/error.hpp>
#include <firn/exec/team.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <thread>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace firn {

/// Threads to use: what was asked for, or, for 0, as many as OpenMP would use here (OMP_NUM_THREADS and
/// OMP_THREAD_LIMIT count, and a parallel region of the caller's has them already), or without OpenMP as many as the
/// machine runs at once.
/// \throws parameter_error  if it is negative, or above 65535
inline int thread_count(int requested) {
    if (requested < 0 || requested > 0xffff)
        throw parameter_error(
            sentence(requested, " threads are asked for; give 1 to 65535, or 0 for as many as the machine has."));
    if (requested > 0) return requested;
#ifdef _OPENMP
    return omp_in_parallel() ? 1 : std::min(omp_get_max_threads(), omp_get_thread_limit());
#else
    static const int offered = std::max(int(std::thread::hardware_concurrency()), 1);
    return offered;
#endif
}

/// Calls body(phase, i, thread) for 0 ≤ i < counts[phase]: the phases one after another, each begun when all of the one
/// before is done, and within a phase in any order, `grain` ≥ 1 consecutive ones at a time. All phases together wake
/// the threads once.
/// 0 ≤ thread < threads, and no two calls at the same time have the same.
/// \throws what a body throws first, when all is quiet; of the calls not begun by then many are left out
template <class Body>
void parallel_phases(std::span<const std::size_t> counts, int threads, const Body& body, std::size_t grain = 1) {
    // One function for every thread, never inlined: else the compiler could fuse other multiplications and additions in
    // a copy for one thread than in a copy for many, and their bits would differ.
    const auto run = [](const void* f, std::size_t phase, std::size_t first, std::size_t last, int thread)
                         FIRN_NEVER_INLINE {
                             for (std::size_t i = first; i < last; ++i)
                                 (*static_cast<const Body*>(f))(phase, i, thread);
                         };
    if (threads > 1 && std::any_of(counts.begin(), counts.end(), [&](std::size_t n) { return n > grain; }) &&
        detail::run_on_team({counts, grain, run, &body}, threads))
        return;
    for (std::size_t phase = 0; phase < counts.size(); ++phase) run(&body, phase, 0, counts[phase], 0);
}

/// Calls body(i, thread) for 0 ≤ i < n: parallel_phases with one phase.
template <class Body>
void parallel_for(std::size_t n, int threads, const Body& body, std::size_t grain = 1) {
    const auto only_phase = [&](std::size_t, std::size_t i, int thread) { body(i, thread); };
    parallel_phases(std::span(&n, 1), threads, only_phase, grain);
}

}  // namespace firn
