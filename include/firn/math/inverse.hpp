/// \file Inverses of small matrices, for any scalar.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn::inline FIRN_BUILD {

/// Returns (A⁻¹)ᵀ: the matrix of cofactors, divided by the determinant, for D = 2 or 3. It has no meaning where the
/// determinant is zero.
template <class S, int D>
    requires(D == 2 || D == 3)
FIRN_INLINE Mat<S, D> inverse_transposed(const Mat<S, D>& A) {
    const S per_determinant = S(1) / determinant(A);
    Mat<S, D> r;
    unroll<D>([&](auto i) FIRN_LAMBDA {
        unroll<D>([&](auto j) FIRN_LAMBDA {
            if constexpr (D == 2) {
                r(i, j) = A(1 - i, 1 - j) * (int(i) == int(j) ? per_determinant : -per_determinant);
            } else {
                constexpr int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                r(i, j) = (A(i1, j1) * A(i2, j2) - A(i1, j2) * A(i2, j1)) * per_determinant;
            }
        });
    });
    return r;
}

}  // namespace firn::inline FIRN_BUILD
