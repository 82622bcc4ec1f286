/// \file A cheap bound of the largest stretch, for wave speeds.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn {

/// σ_max(F)² or a little more: the largest row sum of |FFᵀ| (Gershgorin), exact for a diagonal FFᵀ. [1]
template <scalar S, int D>
FIRN_INLINE S squared_stretch_bound(const Mat<S, D>& F) {
    const Mat<S, D> b = F * transpose(F);
    S largest = S(0);
    unroll<D>([&](auto i) FIRN_LAMBDA {
        S row = abs(b(i, 0));
        unroll<D - 1>([&](auto j) FIRN_LAMBDA { row = row + abs(b(i, j + 1)); });
        largest = max(largest, row);
    });
    return largest;
}

}  // namespace firn
