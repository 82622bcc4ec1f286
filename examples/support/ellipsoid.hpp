/// \file Particles as ellipsoids: a ball of undeformed matter, deformed by the particle's deformation gradient.
#pragma once

#include <firn/math/svd.hpp>

#include "camera.hpp"

#include <algorithm>
#include <cmath>

namespace example {

using Mat3 = firn::Mat<float, 3>;

/// Returns F without extreme stretches, so that a torn or crushed particle is neither a needle nor a sheet: the volume
/// changes at most by a factor of two and, at equal volume, no axis by more than two. It keeps the axes. The result can
/// be inverted; it is I if F is not finite.
inline Mat3 drawable(const Mat3& F) {
    constexpr float most = 2.0F;
    float square = 0.0F;
    for (const float number : F.m) square += number * number;
    if (!std::isfinite(square)) return Mat3::identity();
    // All stretches of a matrix near a rotation are near 1. Its norm says so if its determinant is not small.
    const float volume = firn::determinant(F);
    if (square < 3.6F && volume > 0.7F) return F;

    const auto parts = firn::svd(F);
    Vec3 s{};
    for (int a = 0; a < 3; ++a) s[a] = std::max(std::abs(parts.values[a]), 1e-3F);
    const float now = s[0] * s[1] * s[2];
    const float root = std::cbrt(now);
    for (int a = 0; a < 3; ++a) s[a] = std::clamp(s[a] / root, 1.0F / most, most);
    const float size = std::cbrt(std::clamp(now, 1.0F / most, most) / (s[0] * s[1] * s[2]));
    Mat3 stretched = parts.U;
    for (int i = 0; i < 3; ++i)
        for (int a = 0; a < 3; ++a) stretched(i, a) *= s[a] * size;
    return stretched * firn::transpose(parts.V);
}

/// The inverse of a matrix with a determinant other than 0.
inline Mat3 inverse(const Mat3& a) {
    const auto column = [&](int k) { return Vec3{{a(0, k), a(1, k), a(2, k)}}; };
    const Vec3 x = column(0), y = column(1), z = column(2);
    const Vec3 rows[3] = {cross(y, z), cross(z, x), cross(x, y)};
    const float scale = 1.0F / firn::dot(x, rows[0]);
    Mat3 result = Mat3::zero();
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) result(i, k) = rows[i][k] * scale;
    return result;
}

}  // namespace example
