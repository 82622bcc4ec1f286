/// \file Left singular vectors and signed singular values of a 3 × 3 matrix by one-sided Jacobi rotations.
///
/// The method works for every finite matrix, at some thirty times the cost of the closed form in left_stretch.hpp.
///
/// Pairs of columns of the matrix F are rotated until all columns are orthogonal (Hestenes, J. SIAM 6 (1958)). Each
/// column is then a left singular vector times its singular value. The method works on F, not on FFᵀ or FᵀF, so the
/// sign of det F is correct even if singular values are as small as a few ε ‖F‖ (ε: machine epsilon). The longer column
/// of a pair is put first (de Rijk, SIAM J. Sci. Stat. Comput. 10 (1989)), which sorts the singular values and speeds
/// up convergence.
#pragma once

#include <firn/core/repeat.hpp>
#include <firn/core/tensor.hpp>

#include <limits>

namespace firn::inline FIRN_BUILD {

/// U and σ of the decomposition F = scale · U diag(σ) Qᵀ, where U and Q are rotations. (Q is not computed.)
///
/// The singular values are sorted, σ₀ ≥ σ₁ ≥ |σ₂|, and the last one has the sign of det F. If two or three singular
/// values are zero, the columns of U that belong to these singular values are zero.
template <scalar S, int D = 3>
struct LeftSingular {
    Mat<S, D> vectors;  ///< U; its columns are the left singular vectors
    Vec<S, D> values;   ///< σ: the singular values of F divided by `scale`
    S scale;            ///< the largest |Fᵢⱼ|, or 1 for F = 0
};

namespace detail {

/// Rotates the columns w[p] and w[q] in their common plane so that they become orthogonal, and puts the longer one
/// first. For columns a and b, the longer one first, the angle θ of the rotation has tan 2θ = 2 a·b / (|a|² − |b|²). If
/// w has more than three columns, columns w[p + 3] and w[q + 3] get the same rotation. Lanes where w[p] and w[q] are
/// already orthogonal and sorted keep their bits. Returns a mask that is on in the lanes where the columns changed.
template <int p, int q, class S, std::size_t N>
FIRN_INLINE mask_t<S> orthogonalise(std::array<Vec<S, 3>, N>& w) {
    constexpr auto epsilon = std::numeric_limits<value_type_t<S>>::epsilon();
    const S pp = dot(w[p], w[p]);
    const S qq = dot(w[q], w[q]);
    const mask_t<S> swap = pp < qq;
    const Vec<S, 3> longer = select(swap, w[q], w[p]);
    const Vec<S, 3> shorter = select(swap, -w[p], w[q]);  // the minus keeps the sign of the determinant
    const S difference = abs(pp - qq);
    const S twice = S(2) * dot(longer, shorter);
    const mask_t<S> turn = S(epsilon * epsilon) * pp * qq < twice * twice;
    const S denominator = select(turn, difference + sqrt(difference * difference + twice * twice), S(1));
    const S tangent = select(turn, twice / denominator, S(0));
    const S cosine = S(1) / sqrt(S(1) + tangent * tangent);
    const S sine = cosine * tangent;
    w[p] = select(turn, longer * cosine + shorter * sine, longer);
    w[q] = select(turn, shorter * cosine - longer * sine, shorter);
    if constexpr (N > 3) {
        const Vec<S, 3> of_longer = select(swap, w[q + 3], w[p + 3]);
        const Vec<S, 3> of_shorter = select(swap, -w[p + 3], w[q + 3]);
        w[p + 3] = select(turn, of_longer * cosine + of_shorter * sine, of_longer);
        w[q + 3] = select(turn, of_shorter * cosine - of_longer * sine, of_shorter);
    }
    return turn | swap;
}

/// Returns the columns w after all rotations. The first three columns are then the left singular vectors times their
/// singular values, sorted by length, the longest first. Columns 3 to 5, if there are any, get the same rotations.
template <class S, std::size_t N>
FIRN_INLINE std::array<Vec<S, 3>, N> orthogonal_columns(const std::array<Vec<S, 3>, N>& w) {
    constexpr int most_sweeps = sizeof(value_type_t<S>) == 4 ? 6 : 7;
    return repeat_while<most_sweeps>(w, [](std::array<Vec<S, 3>, N>& columns) FIRN_LAMBDA {
        const mask_t<S> first = orthogonalise<0, 1>(columns);
        const mask_t<S> second = orthogonalise<0, 2>(columns);
        const mask_t<S> third = orthogonalise<1, 2>(columns);
        return first | second | third;
    });
}

/// Returns the largest |Fᵢⱼ|, or 1 for F = 0.
template <class S, int D>
FIRN_INLINE S largest_or_one(const Mat<S, D>& F) {
    S largest = abs(F.m[0]);
    unroll<D * D - 1>([&](auto k) FIRN_LAMBDA { largest = max(largest, abs(F.m[k + 1])); });
    return select(S(0) < largest, largest, S(1));
}

template <class S>
FIRN_INLINE Vec<S, 3> normalised_or_zero(const Vec<S, 3>& a, const S& length) {
    const auto positive = S(0) < length;
    const S divisor = select(positive, length, S(1));
    return select(positive, Vec<S, 3>{{a.v[0] / divisor, a.v[1] / divisor, a.v[2] / divisor}}, Vec<S, 3>::zero());
}

}  // namespace detail

/// Returns the left singular vectors and the singular values of a 3 × 3 matrix F, by Jacobi rotations. F may be any
/// finite matrix.
template <scalar S>
FIRN_INLINE LeftSingular<S> left_singular(const Mat<S, 3>& F) {
    const S largest = detail::largest_or_one(F);
    std::array<Vec<S, 3>, 3> w;
    unroll<9>([&](auto k) FIRN_LAMBDA { w[k / 3].v[k % 3] = F.m[k] / largest; });
    w = detail::orthogonal_columns(w);

    LeftSingular<S> result{};
    const S first = sqrt(dot(w[0], w[0]));
    const S second = sqrt(dot(w[1], w[1]));
    const Vec<S, 3> u0 = detail::normalised_or_zero(w[0], first);
    const Vec<S, 3> u1 = detail::normalised_or_zero(w[1], second);
    const Vec<S, 3> u2 = cross(u0, u1);
    unroll<3>([&](auto i) FIRN_LAMBDA {
        result.vectors(i, 0) = u0.v[i];
        result.vectors(i, 1) = u1.v[i];
        result.vectors(i, 2) = u2.v[i];
    });
    result.values = {{first, second, dot(u2, w[2])}};
    result.scale = largest;
    return result;
}

}  // namespace firn::inline FIRN_BUILD
