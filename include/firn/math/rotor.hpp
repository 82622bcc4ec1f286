/// \file Rotations (unit quaternions) and quantities about an axis (angular velocities, torques), such that the same
/// code serves 2D and 3D.
#pragma once

#include <firn/core/angle.hpp>
#include <firn/core/tensor.hpp>
#include <firn/math/trigonometric.hpp>

#include <concepts>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// A rotation by an angle φ about a unit vector n: the unit quaternion (w, x, y, z) = (cos φ/2, n sin φ/2). In 2D n is
/// the z axis, x = y = 0, and a rotor has only the components (w, z).
template <class S, int D>
using Rotor = Vec<S, D == 2 ? 2 : 4>;

/// The type of a quantity about an axis, such as an angular velocity or a torque: in 2D a number (the z component), in
/// 3D a vector.
template <class S, int D>
using Axial = std::conditional_t<D == 2, S, Vec<S, 3>>;

/// Returns the rotation by the angle 0.
template <class S, int D>
FIRN_INLINE constexpr Rotor<S, D> no_rotation() {
    Rotor<S, D> q = Rotor<S, D>::zero();
    q[0] = S(1);
    return q;
}

/// Returns the angular velocity 0.
template <class S, int D>
FIRN_INLINE constexpr Axial<S, D> no_spin() {
    if constexpr (D == 2)
        return S(0);
    else
        return Vec<S, 3>::zero();
}

/// Returns the vector product a × b; in 2D only its z component.
template <class S, int D>
FIRN_INLINE constexpr Axial<S, D> axial_product(const Vec<S, D>& a, const Vec<S, D>& b) {
    if constexpr (D == 2)
        return a.v[0] * b.v[1] - a.v[1] * b.v[0];
    else
        return cross(a, b);
}

/// Returns the matrix of the map r ↦ ω × r in 2D, where ω = w is an angular velocity about the z axis.
template <scalar S>
FIRN_INLINE constexpr Mat<S, 2> skew(const S& w) {
    return Mat<S, 2>::rows(S(0), -w, w, S(0));
}
/// Returns the matrix of the map r ↦ ω × r in 3D, where ω = w.
template <scalar S>
FIRN_INLINE constexpr Mat<S, 3> skew(const Vec<S, 3>& w) {
    return Mat<S, 3>::rows(S(0), -w.v[2], w.v[1], w.v[2], S(0), -w.v[0], -w.v[1], w.v[0], S(0));
}

/// Converts a quantity about an axis, e.g. an angular velocity, to the scalar T.
template <class T, int D, class S>
FIRN_INLINE constexpr Axial<T, D> cast_axial(const S& w) {
    if constexpr (D == 2)
        return T(w);
    else
        return cast<T>(w);
}

/// Returns the components (x, y, z) = n sin φ/2 of a rotor that rotates by φ about the unit vector n; in 2D only z.
template <class S, int N>
FIRN_INLINE constexpr Axial<S, N == 2 ? 2 : 3> axial_part(const Vec<S, N>& q) {
    if constexpr (N == 2)
        return q.v[1];
    else
        return Vec<S, 3>{q.v[1], q.v[2], q.v[3]};
}

/// Returns the matrix R of the rotation q = (w, x, y, z), by Rodrigues' formula: R = I + 2 w K + 2 K², where K is the
/// matrix of the map r ↦ (x, y, z) × r.
template <class S, int N>
FIRN_INLINE constexpr Mat<S, N == 2 ? 2 : 3> matrix_of(const Vec<S, N>& q) {
    using M = Mat<S, N == 2 ? 2 : 3>;
    const M K = skew(axial_part(q));
    return M::identity() + (K * q.v[0] + K * K) * S(2);
}

/// Returns the rotor (w, x, y, z) with w ≥ 0 of a rotation whose matrix is R, the inverse of matrix_of(). Its largest
/// component comes first, from the diagonal of R, and the others by dividing by it, so that no digits cancel (Shepperd,
/// J. Guid. Control 1 (1978)).
/// \param R  a proper rotation: R Rᵀ = I, det R = 1
template <std::floating_point S>
Rotor<S, 3> rotor_of(const Mat<S, 3>& R) {
    const S sum = trace(R);
    const S squares[4] = {S(1) + sum, S(1) + S(2) * R(0, 0) - sum, S(1) + S(2) * R(1, 1) - sum,
                          S(1) + S(2) * R(2, 2) - sum};  // 4 w², 4 x², 4 y², 4 z²
    int most = 0;
    for (int i = 1; i < 4; ++i)
        if (squares[i] > squares[most]) most = i;
    Rotor<S, 3> q;
    q[most] = squares[most];
    if (most == 0) {
        for (int i = 0; i < 3; ++i) q[i + 1] = R((i + 2) % 3, (i + 1) % 3) - R((i + 1) % 3, (i + 2) % 3);
    } else {
        const int i = most - 1, j = (i + 1) % 3, k = (i + 2) % 3;
        q[0] = R(k, j) - R(j, k);
        q[j + 1] = R(i, j) + R(j, i);
        q[k + 1] = R(i, k) + R(k, i);
    }
    return q * ((q[0] < S(0) ? S(-1) : S(1)) / norm(q));
}

/// Returns the rotation q followed by the rotation `turn`, as a rotor of unit length.
/// \param turn  rotation vector [rad]: its length is the angle, its direction is the axis
template <scalar S, int N>
Vec<S, N> turned(const Vec<S, N>& q, const Axial<S, N == 2 ? 2 : 3>& turn) {
    Vec<S, 3> about = Vec<S, 3>::zero(), part = about;  // in 2D both are along z
    if constexpr (N == 2) {
        about[2] = turn;
        part[2] = q[1];
    } else {
        about = turn;
        part = axial_part(q);
    }
    const S angle = norm(about), half = angle / S(2), c = cos(half);
    const auto turns = angle > S(0);
    about = about * select(turns, sin(half) / select(turns, angle, S(1)), S(0.5));
    const S w = c * q[0] - dot(about, part);
    part = part * c + about * q[0] + cross(about, part);
    Vec<S, N> product = Vec<S, N>::zero();
    product[0] = w;
    for (int i = 1; i < N; ++i) product[i] = part[N == 2 ? 2 : i - 1];
    return product * (S(1) / norm(product));
}

/// Returns the counter-clockwise rotation by an angle in 2D, e.g. rotor(degrees(30)).
inline Rotor<double, 2> rotor(Angle angle) { return turned(no_rotation<double, 2>(), angle.in_radians()); }

/// Returns the rotation by an angle about an axis in 3D, by the right-hand rule.
/// \param axis  a vector of any length except 0
inline Rotor<double, 3> rotor(const Vec<double, 3>& axis, Angle angle) {
    return turned(no_rotation<double, 3>(), axis * (angle.in_radians() / norm(axis)));
}

}  // namespace firn::inline FIRN_BUILD
