/// \file Cheap bounds of the stretches, for wave speeds and for what is surely elastic.
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

/// Between these lie the squares of all singular values. [1]
template <class S>
struct StretchRange {
    S lowest, highest;
};
/// Gershgorin's discs of FFᵀ; nothing but their ends for a diagonal FFᵀ.
template <scalar S, int D>
FIRN_INLINE StretchRange<S> squared_stretch_range(const Mat<S, D>& F) {
    const Mat<S, D> b = F * transpose(F);
    StretchRange<S> range;
    unroll<D>([&](auto i) FIRN_LAMBDA {
        S radius = S(0);
        unroll<D>([&](auto j) FIRN_LAMBDA {
            if constexpr (int(i) != int(j)) radius = radius + abs(b(i, j));
        });
        range.lowest = int(i) == 0 ? b(i, i) - radius : min(range.lowest, b(i, i) - radius);
        range.highest = int(i) == 0 ? b(i, i) + radius : max(range.highest, b(i, i) + radius);
    });
    return range;
}

}  // namespace firn
