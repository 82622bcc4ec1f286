/// \file Vec<S, D> and Mat<S, D>: small vectors and matrices of any scalar, for D = 2 and 3 from the same lines.
///
/// Their operations are unrolled and dissolve into the caller, so that with S = pack the numbers stay in registers.
/// They have the memory layout of Eigen's fixed-size types (columns contiguous). With core/eigen.hpp Eigen's
/// expressions are taken wherever a Vec or Mat is, and these become Eigen's.
#pragma once

#include <firn/core/foreign.hpp>
#include <firn/core/scalar.hpp>

#include <array>

namespace firn {

template <class S, int D>
struct Vec {
    S v[D];

    Vec() = default;
    FIRN_INLINE constexpr Vec(const S& x)
        requires(D == 1)
        : v{x} {}
    /// What is not given is zero: {0, -9.81} for both dimensions.
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
    /// Of another library, an expression included. \see foreign.hpp
    template <holds_numbers<D, 1> Other>
    FIRN_INLINE Vec(const Other& other) {
        foreign<Other>::template read<S, D, 1>(other, v);
    }
    template <is_made_from<Vec> Other>
    FIRN_INLINE operator Other() const {
        return foreign<Other>::made(v);
    }

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

    FIRN_INLINE static constexpr Vec filled(const S& value) {
        Vec r{};
        unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = value; });
        return r;
    }
    FIRN_INLINE static constexpr Vec zero() { return filled(S(0)); }

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
    friend constexpr bool operator==(const Vec& a, const Vec& b)
        requires std::floating_point<S>
    {
        bool same = true;
        unroll<D>([&](auto i) { same = same && a.v[i] == b.v[i]; });
        return same;
    }
};

/// A D × D matrix; a(i, j) is row i, column j.
template <class S, int D>
struct Mat {
    S m[D * D];

    Mat() = default;
    /// Column after column; see rows().
    FIRN_INLINE constexpr Mat(const S (&numbers)[D * D]) {
        unroll<D * D>([&](auto k) FIRN_LAMBDA { m[k] = numbers[k]; });
    }
    /// Of another library, an expression included. \see foreign.hpp
    template <holds_numbers<D, D> Other>
    FIRN_INLINE Mat(const Other& other) {
        foreign<Other>::template read<S, D, D>(other, m);
    }
    template <is_made_from<Mat> Other>
    FIRN_INLINE operator Other() const {
        return foreign<Other>::made(m);
    }

    FIRN_INLINE constexpr S& operator()(int i, int j) { return m[i + D * j]; }
    FIRN_INLINE constexpr const S& operator()(int i, int j) const { return m[i + D * j]; }

    FIRN_INLINE static constexpr Mat diagonal(const S& value) {
        Mat r{};
        unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = k % (D + 1) == 0 ? value : S(0); });
        return r;
    }
    FIRN_INLINE static constexpr Mat zero() { return diagonal(S(0)); }
    FIRN_INLINE static constexpr Mat identity() { return diagonal(S(1)); }
    /// From numbers written row by row, as on paper.
    template <class... U>
        requires(sizeof...(U) == D * D)
    FIRN_INLINE static constexpr Mat rows(const U&... values) {
        const S given[] = {S(values)...};
        Mat r{};
        unroll<D * D>([&](auto k) FIRN_LAMBDA { r(k / D, k % D) = given[k]; });
        return r;
    }
    FIRN_INLINE constexpr Vec<S, D> column(int j) const {
        Vec<S, D> r{};
        unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = (*this)(i, j); });
        return r;
    }

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
};

template <class S, int D>
FIRN_INLINE constexpr S dot(const Vec<S, D>& a, const Vec<S, D>& b) {
    S sum = a[0] * b[0];
    unroll<D - 1>([&](auto i) FIRN_LAMBDA { sum = sum + a.v[i + 1] * b.v[i + 1]; });
    return sum;
}

template <class S, int D>
FIRN_INLINE S norm(const Vec<S, D>& a) {
    return sqrt(dot(a, a));
}

/// a × b
template <class S>
FIRN_INLINE constexpr Vec<S, 3> cross(const Vec<S, 3>& a, const Vec<S, 3>& b) {
    return {{a.v[1] * b.v[2] - a.v[2] * b.v[1], a.v[2] * b.v[0] - a.v[0] * b.v[2], a.v[0] * b.v[1] - a.v[1] * b.v[0]}};
}

/// a bᵀ
template <class S, int D>
FIRN_INLINE constexpr Mat<S, D> outer(const Vec<S, D>& a, const Vec<S, D>& b) {
    Mat<S, D> r{};
    unroll<D>([&](auto i) FIRN_LAMBDA { unroll<D>([&](auto j) FIRN_LAMBDA { r(i, j) = a.v[i] * b.v[j]; }); });
    return r;
}

template <class S, int D>
FIRN_INLINE constexpr Mat<S, D> transpose(const Mat<S, D>& a) {
    Mat<S, D> r{};
    unroll<D>([&](auto i) FIRN_LAMBDA { unroll<D>([&](auto j) FIRN_LAMBDA { r(i, j) = a(j, i); }); });
    return r;
}

template <class S, int D>
FIRN_INLINE constexpr S trace(const Mat<S, D>& a) {
    S sum = a(0, 0);
    unroll<D - 1>([&](auto i) FIRN_LAMBDA { sum = sum + a(i + 1, i + 1); });
    return sum;
}

/// Σ aᵢⱼ²
template <class S, int D>
FIRN_INLINE constexpr S squared_norm(const Mat<S, D>& a) {
    S sum = a.m[0] * a.m[0];
    unroll<D * D - 1>([&](auto k) FIRN_LAMBDA { sum = sum + a.m[k + 1] * a.m[k + 1]; });
    return sum;
}

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

/// The same numbers as another scalar: float → pack (all lanes alike), double → float, …
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

}  // namespace firn
