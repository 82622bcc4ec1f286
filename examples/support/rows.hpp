/// \file The renderer's only loop over threads.
#pragma once

namespace example {

/// Calls body(y) for each row y, on all threads if OpenMP is on. The body must write to its own row only, so that the
/// image is the same for any number of threads.
template <class Body>
void for_rows(int rows, const Body& body) {
#ifdef _OPENMP
#pragma omp parallel for schedule(dynamic, 16)
#endif
    for (int y = 0; y < rows; ++y) body(y);
}

}  // namespace example
