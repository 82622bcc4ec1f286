/// \file Symmetric matrices, computed so that they are exactly symmetric.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn::inline FIRN_BUILD::detail {

/// Returns the symmetric matrix whose elements in row i and column j, and in row j and column i, are entry(i, j). The
/// function `entry` is called only for i ≤ j.
template <class S, int D, class F>
FIRN_INLINE constexpr Mat<S, D> symmetric(F&& entry) {
    Mat<S, D> r{};
    unroll<D>([&](auto j) FIRN_LAMBDA {
        unroll<int(j) + 1>([&](auto i) FIRN_LAMBDA {
            const S value = entry(i, j);
            r(i, j) = value;
            r(j, i) = value;
        });
    });
    return r;
}

/// Returns the product of two matrices whose product is symmetric. It is exactly symmetric.
template <class S, int D>
FIRN_INLINE Mat<S, D> symmetric_product(const Mat<S, D>& a, const Mat<S, D>& b) {
    return symmetric<S, D>([&](auto i, auto j) FIRN_LAMBDA {
        S sum = a(i, 0) * b(0, j);
        unroll<D - 1>([&](auto k) FIRN_LAMBDA { sum = sum + a(i, k + 1) * b(k + 1, j); });
        return sum;
    });
}

}  // namespace firn::inline FIRN_BUILD::detail
