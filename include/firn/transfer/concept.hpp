/// \file What a transfer scheme is: which velocity field a particle carries to the grid, and what it takes back.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn {

// A particle's velocity field around itself is v + C (x − x_p). P2G gives m N (v + C (x_i − x_p)) to node i, G2P
// interpolates v = Σ N v_i and the affine field C = B D⁻¹ from the first moment B = Σ N v_i (x_i − x_p)ᵀ.

template <class T>
concept has_affine_flag = requires {
    { T::affine } -> std::convertible_to<bool>;  ///< does the scheme carry C ?
};
template <class T, class S, int D>
concept has_affine_field = requires(const Mat<S, D> C) {
    { T::affine_field(C) } -> std::same_as<Mat<S, D>>;  ///< what a particle keeps of it
};

template <class T>
concept transfer = has_affine_flag<T> && has_affine_field<T, float, 3> && has_affine_field<T, double, 2>;

}  // namespace firn
