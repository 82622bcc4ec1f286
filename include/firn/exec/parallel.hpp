/// \file Loops over threads: the only place that knows OpenMP.
#pragma once

#include <cstddef>
#include <exception>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace firn {

/// Threads to use: what was asked for, or, for 0, as many as OpenMP offers (1 without OpenMP).
inline int thread_count([[maybe_unused]] int requested) {
#ifdef _OPENMP
    return requested > 0 ? requested : omp_get_max_threads();
#else
    return 1;
#endif
}

/// Calls body(i, thread) for 0 ≤ i < n, in any order and on `threads` threads, `grain` consecutive ones at a time.
/// Exceptions reach the caller.
template <class Body>
void parallel_for(std::size_t n, int threads, const Body& body, std::size_t grain = 1) {
    if (threads <= 1 || n <= grain) {
        for (std::size_t i = 0; i < n; ++i) body(i, 0);
        return;
    }
#ifdef _OPENMP
    std::exception_ptr failure;
#pragma omp parallel for num_threads(threads) schedule(dynamic, std::ptrdiff_t(grain))
    for (std::ptrdiff_t i = 0; i < std::ptrdiff_t(n); ++i) {
        try {
            body(std::size_t(i), omp_get_thread_num());
        } catch (...) {
#pragma omp critical(firn_parallel_for)
            failure = std::current_exception();
        }
    }
    if (failure) std::rethrow_exception(failure);
#endif
}

}  // namespace firn
