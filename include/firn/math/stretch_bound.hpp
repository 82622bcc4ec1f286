/// \file Cheap bounds of the principal stretches, for wave speeds and to skip return mappings.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn {

/// An upper bound of σ_max(F)² [1]: the largest row sum of |FFᵀ| (Gershgorin). It is exact if FFᵀ is diagonal.
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

/// Bounds of the squares of all singular values [1].
template <class S>
struct StretchRange {
    /// No square is smaller.
    S lowest, highest;  ///< No square is larger.
};
/// Bounds of the squares of F's singular values, from Gershgorin's discs of FFᵀ. They are exact if FFᵀ is diagonal.
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
