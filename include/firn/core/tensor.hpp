/// \file Small vectors and matrices of any scalar: `Vec<S, D>` and `Mat<S, D>`.
///
/// All operations are unrolled and inlined, so that with S = pack the components stay in registers. The memory layout
/// is that of Eigen's fixed-size types: columns are contiguous. core/eigen.hpp adds conversions from and to Eigen.
#pragma once

#include <firn/core/foreign.hpp>
#include <firn/core/scalar.hpp>

#include <array>

namespace firn::inline FIRN_BUILD {

/// A vector of D components.
/// \tparam S  the scalar: float, double, pack, dual, …
template <class S, int D>
struct Vec {
    S v[D];  ///< the components

    Vec() = default;  ///< Leaves the components uninitialised.

    /// Makes a vector from its components. For D = 3, z may be left out and is then zero: {0, -9.81} works in 2D and
    /// 3D.
    /// @{
    FIRN_INLINE constexpr Vec(const S& x)
        requires(D == 1)
        : v{x} {}
    FIRN_INLINE constexpr Vec(const S& x, const S& y)
        requires(D == 2)
        : v{x, y} {}
    FIRN_INLINE constexpr Vec(const S& x, const S& y)
        requires(D == 3)
        : v{x, y, S(0)} {}
    FIRN_INLINE constexpr Vec(const S& x, const S& y, const S& z)
        requires(D == 3)
        : v{x, y, z} {}
    FIRN_INLINE constexpr Vec(const S& x, const S& y, const S& z, const S& w)
        requires(D == 4)
        : v{x, y, z, w} {}
    FIRN_INLINE constexpr Vec(const S (&numbers)[D]) {
        unroll<D>([&](auto i) FIRN_LAMBDA { v[i] = numbers[i]; });
    }
    /// @}

    /// Converts from a vector or expression of another library, and to a vector of that library. \see foreign.hpp
    /// @{
    template <gives_numbers<S, D, 1> Other>
    FIRN_INLINE Vec(const Other& other) {
        foreign<Other>::template read<S, D, 1>(other, v);
    }
    template <is_made_from<Vec> Other>
    FIRN_INLINE operator Other() const {
        return foreign<Other>::made(v);
    }
    /// @}

    /// Returns a component, given by its index i (0 ≤ i < D) or by its name x, y or z.
    /// @{
    FIRN_INLINE constexpr S& operator[](int i) { return v[i]; }
    FIRN_INLINE constexpr const S& operator[](int i) const { return v[i]; }
    FIRN_INLINE constexpr S& x() { return v[0]; }
    FIRN_INLINE constexpr const S& x() const { return v[0]; }
    FIRN_INLINE constexpr S& y()
        requires(D >= 2)
    {
        return v[1];
    }
    FIRN_INLINE constexpr const S& y() const
        requires(D >= 2)
    {
        return v[1];
    }
    FIRN_INLINE constexpr S& z()
        requires(D >= 3)
    {
        return v[2];
    }
    FIRN_INLINE constexpr const S& z() const
        requires(D >= 3)
    {
        return v[2];
    }
    /// @}

    /// Returns a vector with the same value in all components.
    FIRN_INLINE static constexpr Vec filled(const S& value) {
        Vec r{};
        unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = value; });
        return r;
    }
    /// Returns the zero vector.
    FIRN_INLINE static constexpr Vec zero() { return filled(S(0)); }

    /// Vector arithmetic: sum, difference, negative vector, and product with a scalar.
    /// @{
    FIRN_INLINE friend constexpr Vec operator+(const Vec& a, const Vec& b) {
        Vec r{};
        unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = a.v[i] + b.v[i]; });
        return r;
    }
    FIRN_INLINE friend constexpr Vec operator-(const Vec& a, const Vec& b) {
        Vec r{};
        unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = a.v[i] - b.v[i]; });
        return r;
    }
    FIRN_INLINE friend constexpr Vec operator-(const Vec& a) { return a * S(-1); }
    FIRN_INLINE friend constexpr Vec operator*(const Vec& a, const S& s) {
        Vec r{};
        unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = a.v[i] * s; });
        return r;
    }
    FIRN_INLINE friend constexpr Vec operator*(const S& s, const Vec& a) { return a * s; }
    FIRN_INLINE constexpr Vec& operator+=(const Vec& b) { return *this = *this + b; }
    FIRN_INLINE constexpr Vec& operator-=(const Vec& b) { return *this = *this - b; }
    /// @}

    /// Whether all components are equal, for S = float or double.
    friend constexpr bool operator==(const Vec& a, const Vec& b)
        requires std::floating_point<S>
    {
        bool same = true;
        unroll<D>([&](auto i) { same = same && a.v[i] == b.v[i]; });
        return same;
    }
};

/// A D × D matrix; a(i, j) is the element in row i and column j.
/// \tparam S  the scalar: float, double, pack, dual, …
template <class S, int D>
struct Mat {
    S m[D * D];  ///< the elements, column by column

    Mat() = default;  ///< Leaves the elements uninitialised.
    /// Makes a matrix from its elements, given column by column. \see rows()
    FIRN_INLINE constexpr Mat(const S (&numbers)[D * D]) {
        unroll<D * D>([&](auto k) FIRN_LAMBDA { m[k] = numbers[k]; });
    }
    /// Converts from a matrix or expression of another library, and to a matrix of that library. \see foreign.hpp
    /// @{
    template <gives_numbers<S, D, D> Other>
    FIRN_INLINE Mat(const Other& other) {
        foreign<Other>::template read<S, D, D>(other, m);
    }
    template <is_made_from<Mat> Other>
    FIRN_INLINE operator Other() const {
        return foreign<Other>::made(m);
    }
    /// @}

    /// Returns the element in row i and column j, both from 0 to D − 1.
    /// @{
    FIRN_INLINE constexpr S& operator()(int i, int j) { return m[i + D * j]; }
    FIRN_INLINE constexpr const S& operator()(int i, int j) const { return m[i + D * j]; }
    /// @}

    /// Returns a matrix with the same value on the diagonal, and zeros elsewhere.
    FIRN_INLINE static constexpr Mat diagonal(const S& value) {
        Mat r{};
        unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = k % (D + 1) == 0 ? value : S(0); });
        return r;
    }
    /// Returns the zero matrix.
    FIRN_INLINE static constexpr Mat zero() { return diagonal(S(0)); }
    /// Returns the identity matrix.
    FIRN_INLINE static constexpr Mat identity() { return diagonal(S(1)); }
    /// Returns a matrix made from its D² elements, given row by row, as on paper.
    template <class... U>
        requires(sizeof...(U) == D * D)
    FIRN_INLINE static constexpr Mat rows(const U&... values) {
        const S given[] = {S(values)...};
        Mat r{};
        unroll<D * D>([&](auto k) FIRN_LAMBDA { r(k / D, k % D) = given[k]; });
        return r;
    }
    /// Returns column j, 0 ≤ j < D.
    FIRN_INLINE constexpr Vec<S, D> column(int j) const {
        Vec<S, D> r{};
        unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = (*this)(i, j); });
        return r;
    }

    /// Matrix arithmetic: sum, difference, product with a scalar, product of two matrices, and product of a matrix and
    /// a vector.
    /// @{
    FIRN_INLINE friend constexpr Mat operator+(const Mat& a, const Mat& b) {
        Mat r{};
        unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = a.m[k] + b.m[k]; });
        return r;
    }
    FIRN_INLINE friend constexpr Mat operator-(const Mat& a, const Mat& b) {
        Mat r{};
        unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = a.m[k] - b.m[k]; });
        return r;
    }
    FIRN_INLINE friend constexpr Mat operator*(const Mat& a, const S& s) {
        Mat r{};
        unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = a.m[k] * s; });
        return r;
    }
    FIRN_INLINE friend constexpr Mat operator*(const S& s, const Mat& a) { return a * s; }
    FIRN_INLINE friend constexpr Mat operator*(const Mat& a, const Mat& b) {
        Mat r{};
        unroll<D>([&](auto i) FIRN_LAMBDA {
            unroll<D>([&](auto j) FIRN_LAMBDA {
                S sum = a(i, 0) * b(0, j);
                unroll<D - 1>([&](auto k) FIRN_LAMBDA { sum = sum + a(i, k + 1) * b(k + 1, j); });
                r(i, j) = sum;
            });
        });
        return r;
    }
    FIRN_INLINE friend constexpr Vec<S, D> operator*(const Mat& a, const Vec<S, D>& x) {
        Vec<S, D> r{};
        unroll<D>([&](auto i) FIRN_LAMBDA {
            S sum = a(i, 0) * x.v[0];
            unroll<D - 1>([&](auto k) FIRN_LAMBDA { sum = sum + a(i, k + 1) * x.v[k + 1]; });
            r.v[i] = sum;
        });
        return r;
    }
    FIRN_INLINE constexpr Mat& operator+=(const Mat& b) { return *this = *this + b; }
    FIRN_INLINE constexpr Mat& operator-=(const Mat& b) { return *this = *this - b; }
    /// @}
};

/// Returns the scalar product a · b.
template <class S, int D>
FIRN_INLINE constexpr S dot(const Vec<S, D>& a, const Vec<S, D>& b) {
    S sum = a[0] * b[0];
    unroll<D - 1>([&](auto i) FIRN_LAMBDA { sum = sum + a.v[i + 1] * b.v[i + 1]; });
    return sum;
}

/// Returns |a|, the length of the vector `a`.
template <class S, int D>
FIRN_INLINE S norm(const Vec<S, D>& a) {
    return sqrt(dot(a, a));
}

/// Returns the vector product a × b.
template <class S>
FIRN_INLINE constexpr Vec<S, 3> cross(const Vec<S, 3>& a, const Vec<S, 3>& b) {
    return {{a.v[1] * b.v[2] - a.v[2] * b.v[1], a.v[2] * b.v[0] - a.v[0] * b.v[2], a.v[0] * b.v[1] - a.v[1] * b.v[0]}};
}

/// Returns the outer product a bᵀ, with the elements aᵢ bⱼ.
template <class S, int D>
FIRN_INLINE constexpr Mat<S, D> outer(const Vec<S, D>& a, const Vec<S, D>& b) {
    Mat<S, D> r{};
    unroll<D>([&](auto i) FIRN_LAMBDA { unroll<D>([&](auto j) FIRN_LAMBDA { r(i, j) = a.v[i] * b.v[j]; }); });
    return r;
}

/// Returns the transpose aᵀ.
template <class S, int D>
FIRN_INLINE constexpr Mat<S, D> transpose(const Mat<S, D>& a) {
    Mat<S, D> r{};
    unroll<D>([&](auto i) FIRN_LAMBDA { unroll<D>([&](auto j) FIRN_LAMBDA { r(i, j) = a(j, i); }); });
    return r;
}

/// Returns the sum of the diagonal elements of `a`, Σ aᵢᵢ.
template <class S, int D>
FIRN_INLINE constexpr S trace(const Mat<S, D>& a) {
    S sum = a(0, 0);
    unroll<D - 1>([&](auto i) FIRN_LAMBDA { sum = sum + a(i + 1, i + 1); });
    return sum;
}

/// Returns the square of the Frobenius norm of `a`, Σ aᵢⱼ².
template <class S, int D>
FIRN_INLINE constexpr S squared_norm(const Mat<S, D>& a) {
    S sum = a.m[0] * a.m[0];
    unroll<D * D - 1>([&](auto k) FIRN_LAMBDA { sum = sum + a.m[k + 1] * a.m[k + 1]; });
    return sum;
}

/// Returns the determinant of `a`, for D ≤ 3.
template <class S, int D>
FIRN_INLINE constexpr S determinant(const Mat<S, D>& a) {
    if constexpr (D == 1) {
        return a(0, 0);
    } else if constexpr (D == 2) {
        return a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0);
    } else {
        return a(0, 0) * (a(1, 1) * a(2, 2) - a(1, 2) * a(2, 1)) + a(0, 1) * (a(1, 2) * a(2, 0) - a(1, 0) * a(2, 2)) +
               a(0, 2) * (a(1, 0) * a(2, 1) - a(1, 1) * a(2, 0));
    }
}

/// Returns `a` in the lanes where the mask is on, and `b` in the other lanes.
/// @{
template <class M, class S, int D>
FIRN_INLINE constexpr Vec<S, D> select(const M& mask, const Vec<S, D>& a, const Vec<S, D>& b) {
    Vec<S, D> r{};
    unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = select(mask, a.v[i], b.v[i]); });
    return r;
}
template <class M, class S, int D>
FIRN_INLINE constexpr Mat<S, D> select(const M& mask, const Mat<S, D>& a, const Mat<S, D>& b) {
    Mat<S, D> r{};
    unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = select(mask, a.m[k], b.m[k]); });
    return r;
}
/// @}

/// Converts every component of a vector, or every element of a matrix, to the scalar T, e.g. double to float, or float
/// to a pack of equal numbers.
/// @{
template <class T, class S, int D>
FIRN_INLINE constexpr Vec<T, D> cast(const Vec<S, D>& a) {
    Vec<T, D> r{};
    unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = T(a.v[i]); });
    return r;
}
template <class T, class S, int D>
FIRN_INLINE constexpr Mat<T, D> cast(const Mat<S, D>& a) {
    Mat<T, D> r{};
    unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = T(a.m[k]); });
    return r;
}
/// @}

}  // namespace firn::inline FIRN_BUILD
