/// \file The deformation gradient F of a particle and its volume ratio J, kept so that small strains are not lost.
///
/// A float near 1 has steps of 6e-8 or 1.2e-7. Steel under 10 kPa is strained by 5e-8, and a step of a slow test
/// strains by less, so F itself would lose both. The differences to 1 have no such limit: firn keeps H = F − I and J −
/// 1, and computes strains from them. F and J remain what a program reads and sets.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/dual.hpp>
#include <firn/math/symmetric.hpp>

#include <concepts>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns `excess`, the difference of `number` to 1, if number = 1 + excess; else `number` − 1, because a program has
/// set `number` to another value since. If `number` was computed as 1 + excess, the compiler sees that nothing is to
/// do.
template <class S>
FIRN_INLINE constexpr S excess_of(const S& number, const S& excess) {
    const S whole = S(1) + excess;
    if constexpr (requires { same_bits(number, whole); })
        return select(same_bits(number, whole), excess, number - S(1));
    else  // a scalar of the program's own
        return select((number <= whole) & (whole <= number), excess, number - S(1));
}
template <class T>
FIRN_INLINE constexpr dual<T> excess_of(const dual<T>& number, const dual<T>& excess) {
    return {excess_of(number.value, excess.value), number.derivative};
}

template <class S, int D>
std::type_identity<S> scalar_of(const Mat<S, D>&);
template <class S, int D>
std::integral_constant<int, D> dimension_of(const Mat<S, D>&);

}  // namespace detail

/// The deformation gradient F [1] of a particle. It is a matrix that a program reads and sets as any other. Beside F it
/// has the differences of the diagonal to 1, which do not fit into the diagonal's numbers.
///
/// Use it in the state of a material of your own in place of `Mat<S, D>`, so that small strains are not lost, and
/// compute stresses from displacement_gradient(), left_cauchy_green_change(), volume_change() or logarithmic_strain().
template <class S, int D>
struct DeformationGradient : Mat<S, D> {
    /// Fᵢᵢ − 1 [1]; without meaning where the program has set Fᵢᵢ since. \see displacement_gradient
    Vec<S, D> excess = Vec<S, D>::zero();

    /// Makes the deformation gradient of undeformed matter, F = I.
    FIRN_INLINE constexpr DeformationGradient() : Mat<S, D>(Mat<S, D>::identity()) {}
    /// Makes a deformation gradient from a matrix F.
    FIRN_INLINE constexpr DeformationGradient(const Mat<S, D>& F) : Mat<S, D>(F) {
        unroll<D>([&](auto i) FIRN_LAMBDA { excess.v[i] = F(i, i) - S(1); });
    }
    /// Makes a deformation gradient from a matrix or expression of another library. \see foreign.hpp
    template <gives_numbers<S, D, D> Other>
    FIRN_INLINE DeformationGradient(const Other& other) : DeformationGradient(Mat<S, D>(other)) {}

    /// Returns the deformation gradient F = I + H. \param H  the displacement gradient [1]
    FIRN_INLINE static constexpr DeformationGradient from_displacement(const Mat<S, D>& H) {
        DeformationGradient F;
        unroll<D * D>([&](auto k) FIRN_LAMBDA { F.m[k] = k % (D + 1) == 0 ? S(1) + H.m[k] : H.m[k]; });
        unroll<D>([&](auto i) FIRN_LAMBDA { F.excess.v[i] = H(i, i); });
        return F;
    }
};

/// The ratio J [1] of a particle's volume to its volume at rest: a number that a program reads and sets as any other.
/// It keeps the difference to 1.
template <class S>
struct VolumeRatio {
    S excess = S(0);  ///< J − 1 [1]

    /// Makes the ratio of undeformed matter, J = 1.
    constexpr VolumeRatio() = default;
    /// Makes the ratio from a number J.
    FIRN_INLINE constexpr VolumeRatio(const S& J) : excess(J - S(1)) {}
    /// Returns the ratio 1 + `excess`.
    FIRN_INLINE static constexpr VolumeRatio from_excess(const S& excess) {
        VolumeRatio J;
        J.excess = excess;
        return J;
    }
    /// Returns J.
    FIRN_INLINE constexpr operator S() const { return S(1) + excess; }

    /// Changes J as the operators of a number do.
    /// @{
    FIRN_INLINE constexpr VolumeRatio& operator+=(const S& change) {
        excess = excess + change;
        return *this;
    }
    FIRN_INLINE constexpr VolumeRatio& operator-=(const S& change) {
        excess = excess - change;
        return *this;
    }
    FIRN_INLINE constexpr VolumeRatio& operator*=(const S& factor) { return *this = S(*this) * factor; }
    /// @}
};

/// A type of deformation gradients: Mat<S, D> or DeformationGradient<S, D>.
template <class F>
concept deformation_gradient = requires(const F& of) {
    detail::scalar_of(of);
    detail::dimension_of(of);
};
/// The type of the elements of a deformation gradient.
template <deformation_gradient F>
using scalar_of_t = typename decltype(detail::scalar_of(std::declval<const F&>()))::type;
/// The number of dimensions of a deformation gradient.
template <deformation_gradient F>
inline constexpr int dimension_of = decltype(detail::dimension_of(std::declval<const F&>()))::value;
/// The type Mat<S, D> of the elements of a deformation gradient.
template <deformation_gradient F>
using matrix_of_t = Mat<scalar_of_t<F>, dimension_of<F>>;
/// A type of deformation gradients with elements of type S.
template <class F, class S>
concept deformation_gradient_of = deformation_gradient<F> && std::same_as<scalar_of_t<F>, S>;

/// \name Differences to the undeformed body
/// Their errors are relative to ‖F − I‖, and so to the strain of a body that has not turned. They are those of F itself
/// for a body that has turned by a right angle.
/// @{

/// Returns the displacement gradient H = F − I [1].
template <class S, int D>
FIRN_INLINE constexpr Mat<S, D> displacement_gradient(const Mat<S, D>& F) {
    Mat<S, D> H = F;
    unroll<D>([&](auto i) FIRN_LAMBDA { H(i, i) = F(i, i) - S(1); });
    return H;
}
template <class S, int D>
FIRN_INLINE constexpr Mat<S, D> displacement_gradient(const DeformationGradient<S, D>& F) {
    Mat<S, D> H = F;
    using detail::excess_of;  // or a scalar's own
    unroll<D>([&](auto i) FIRN_LAMBDA { H(i, i) = excess_of(F(i, i), F.excess.v[i]); });
    return H;
}

/// Returns b − I [1], with the left Cauchy–Green tensor b = FFᵀ: H + F Hᵀ. It is exactly symmetric.
template <deformation_gradient G>
FIRN_INLINE constexpr matrix_of_t<G> left_cauchy_green_change(const G& F) {
    using S = scalar_of_t<G>;
    constexpr int D = dimension_of<G>;
    const Mat<S, D> H = displacement_gradient(F);
    return detail::symmetric<S, D>([&](auto i, auto j) FIRN_LAMBDA {
        S sum = H(i, j);
        unroll<D>([&](auto k) FIRN_LAMBDA { sum = sum + F(i, k) * H(j, k); });
        return sum;
    });
}
/// Returns the left Cauchy–Green tensor b = FFᵀ [1], computed from b − I. It is exactly symmetric.
template <deformation_gradient G>
FIRN_INLINE constexpr matrix_of_t<G> left_cauchy_green(const G& F) {
    matrix_of_t<G> b = left_cauchy_green_change(F);
    unroll<dimension_of<G>>([&](auto i) FIRN_LAMBDA { b(i, i) = scalar_of_t<G>(1) + b(i, i); });
    return b;
}
/// Returns J − 1 [1], the relative change of the volume; J = det F.
///
/// In three dimensions this is tr H + ½ ((tr H)² − tr H²) + det H, in two tr H + det H.
template <deformation_gradient G>
FIRN_INLINE constexpr scalar_of_t<G> volume_change(const G& F) {
    using S = scalar_of_t<G>;
    const auto H = displacement_gradient(F);
    if constexpr (dimension_of<G> == 2) {
        return H(0, 0) + F(0, 0) * H(1, 1) - H(0, 1) * H(1, 0);
    } else {
        const S across = H(1, 1) + F(1, 1) * H(2, 2) - H(1, 2) * H(2, 1);  // of the area across axis 0
        return H(0, 0) + F(0, 0) * across + H(0, 1) * (H(1, 2) * H(2, 0) - H(1, 0) * F(2, 2)) +
               H(0, 2) * (H(1, 0) * H(2, 1) - F(1, 1) * H(2, 0));
    }
}
/// @}

/// Returns F + `change`. Of a DeformationGradient, a small change of the diagonal is kept.
/// @{
template <class S, int D>
FIRN_INLINE constexpr Mat<S, D> increased(const Mat<S, D>& F, const Mat<S, D>& change) {
    return F + change;
}
template <class S, int D>
FIRN_INLINE constexpr DeformationGradient<S, D> increased(const DeformationGradient<S, D>& F, const Mat<S, D>& change) {
    return DeformationGradient<S, D>::from_displacement(displacement_gradient(F) + change);
}
/// @}

/// Returns `a` in the lanes where the mask is on, and `b` in the other lanes.
/// @{
template <class M, class S, int D>
FIRN_INLINE constexpr DeformationGradient<S, D> select(const M& mask, const DeformationGradient<S, D>& a,
                                                       const DeformationGradient<S, D>& b) {
    return DeformationGradient<S, D>::from_displacement(
        select(mask, displacement_gradient(a), displacement_gradient(b)));
}
template <class M, class S>
FIRN_INLINE constexpr VolumeRatio<S> select(const M& mask, const VolumeRatio<S>& a, const VolumeRatio<S>& b) {
    return VolumeRatio<S>::from_excess(select(mask, a.excess, b.excess));
}
/// @}

}  // namespace firn::inline FIRN_BUILD
