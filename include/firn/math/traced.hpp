/// \file Traced numbers in the functions of math/ whose derivative is not that of their own operations: elementary
/// functions, and decompositions of matrices.
///
/// An elementary function takes its partial derivatives from the rule for dual numbers, so each rule is written once.
#pragma once

#include <firn/core/traced.hpp>
#include <firn/math/elementary.hpp>
#include <firn/math/isotropic_function.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns a function of one traced number. \param f  the function of a dual number
template <class T, class F>
FIRN_INLINE traced<T> traced_function(const traced<T>& x, const F& f) {
    if (x.node == Tape<T>::no_node) return {f(dual<T>{x.value, T(0)}).value, x.node};
    const dual<T> y = f(dual<T>{x.value, T(1)});
    return {y.value, Tape<T>::mine().general(x.node, y.derivative)};
}
/// Returns a function of two traced numbers. \param f  the function of two dual numbers
template <class T, class F>
FIRN_INLINE traced<T> traced_function(const traced<T>& x, const traced<T>& y, const F& f) {
    if (y.node == Tape<T>::no_node)
        return traced_function(x, [&](const dual<T>& a) FIRN_LAMBDA { return f(a, dual<T>{y.value, T(0)}); });
    const dual<T> by_x = f(dual<T>{x.value, T(1)}, dual<T>{y.value, T(0)}),
                  by_y = f(dual<T>{x.value, T(0)}, dual<T>{y.value, T(1)});
    return {by_x.value, Tape<T>::mine().general(x.node, by_x.derivative, y.node, by_y.derivative)};
}

/// Returns the principal stretches of a matrix of traced numbers.
template <class T, int D>
FIRN_INLINE Principal<traced<T>, D> traced_principal(const Mat<traced<T>, D>& F) {
    Mat<T, D> value;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { value.m[k] = F.m[k].value; });
    const Principal<T, D> own = principal_stretches(value);
    const TurnedStretch<traced<T>, D> turned(F, own);
    Principal<traced<T>, D> result;
    result.directions = constant_matrix<traced<T>>(own.directions);
    unroll<D>([&](auto i) FIRN_LAMBDA { result.stretches.v[i] = turned.stretch(i, i); });
    return result;
}

}  // namespace detail

/// \name Elementary functions, as for other scalars
/// @{

/// Returns eˣ.
template <scalar T>
FIRN_INLINE traced<T> exp(const traced<T>& x) {
    return detail::traced_function(x, [](const dual<T>& a) FIRN_LAMBDA { return exp(a); });
}
/// Returns log x.
template <scalar T>
FIRN_INLINE traced<T> log(const traced<T>& x) {
    return detail::traced_function(x, [](const dual<T>& a) FIRN_LAMBDA { return log(a); });
}
/// Returns log x, where x − 1 is known more exactly than x.
template <scalar T>
FIRN_INLINE traced<T> log(const traced<T>& x, const traced<T>& less_one) {
    return detail::traced_function(
        less_one, [&](const dual<T>& a) FIRN_LAMBDA { return log(dual<T>{x.value, a.derivative}, a); });
}
/// Returns the sine of x [rad].
template <scalar T>
FIRN_INLINE traced<T> sin(const traced<T>& x) {
    return detail::traced_function(x, [](const dual<T>& a) FIRN_LAMBDA { return sin(a); });
}
/// Returns the cosine of x [rad].
template <scalar T>
FIRN_INLINE traced<T> cos(const traced<T>& x) {
    return detail::traced_function(x, [](const dual<T>& a) FIRN_LAMBDA { return cos(a); });
}
/// Returns xʸ.
template <scalar T>
FIRN_INLINE traced<T> pow(const traced<T>& x, const std::type_identity_t<traced<T>>& y) {
    return detail::traced_function(x, y, [](const dual<T>& a, const dual<T>& b) FIRN_LAMBDA { return pow(a, b); });
}
/// Returns xʸ − 1 for x = 1 + less_one.
template <scalar T>
FIRN_INLINE traced<T> pow_less_one(const traced<T>& less_one, const std::type_identity_t<traced<T>>& y) {
    return detail::traced_function(less_one, y,
                                   [](const dual<T>& a, const dual<T>& b) FIRN_LAMBDA { return pow_less_one(a, b); });
}
/// @}

/// \name Decompositions, as for other scalars
/// @{

/// Returns the principal stretches of F. The directions are constants: what needs their derivative is an
/// isotropic_function().
template <scalar T>
FIRN_INLINE Principal<traced<T>, 2> principal_stretches(const Mat<traced<T>, 2>& F) {
    return detail::traced_principal(F);
}
template <scalar T>
FIRN_INLINE Principal<traced<T>, 3> principal_stretches(const Mat<traced<T>, 3>& F) {
    return detail::traced_principal(F);
}
/// Computes the left stretch of F.
template <class T>
void left_stretch_by_jacobi(const Mat<traced<T>, 3>& F, Mat<traced<T>, 3>& V) {
    V = isotropic_function(F, principal_stretches(F), [](const traced<T>& sigma) FIRN_LAMBDA { return sigma; });
}
/// @}

/// Returns what a number has more than 1; both are traced alike. \see DeformationGradient
template <class T>
FIRN_INLINE traced<T> excess_of(const traced<T>& number, const traced<T>& excess) {
    return {detail::excess_of(number.value, excess.value), number.node};
}

}  // namespace firn::inline FIRN_BUILD
