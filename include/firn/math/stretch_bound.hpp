/// \file Bounds of the principal stretches of a deformation gradient, computed with few operations. Materials use these
/// bounds to bound wave speeds, and to skip the return mapping of particles that certainly do not yield.
#pragma once

#include <firn/math/deformation.hpp>

namespace firn::inline FIRN_BUILD {

/// Returns an upper bound of the square of F's largest singular value [1]. The bound is the largest row sum Σⱼ
/// |(FFᵀ)ᵢⱼ| of FFᵀ (Gershgorin). The bound is exact if FFᵀ is diagonal.
template <deformation_gradient G>
FIRN_INLINE scalar_of_t<G> squared_stretch_bound(const G& F) {
    using S = scalar_of_t<G>;
    constexpr int D = dimension_of<G>;
    const Mat<S, D> E = left_cauchy_green_change(F);
    S largest = S(-1);
    unroll<D>([&](auto i) FIRN_LAMBDA {
        S row = E(i, i);  // the diagonal of FFᵀ is not negative
        unroll<D>([&](auto j) FIRN_LAMBDA {
            if constexpr (int(i) != int(j)) row = row + abs(E(i, j));
        });
        largest = int(i) == 0 ? row : max(largest, row);
    });
    return S(1) + largest;
}

/// Bounds of the squares of all singular values of a matrix [1].
template <class S>
struct StretchRange {
    S lowest,     ///< a lower bound of all squares; may be negative
        highest;  ///< an upper bound of all squares
};
/// Returns bounds of the squares of F's singular values, from Gershgorin's discs of FFᵀ. The bounds are exact if FFᵀ is
/// diagonal.
template <deformation_gradient G>
FIRN_INLINE auto squared_stretch_range(const G& F) {
    using S = scalar_of_t<G>;
    constexpr int D = dimension_of<G>;
    const Mat<S, D> b = left_cauchy_green(F);
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

}  // namespace firn::inline FIRN_BUILD
