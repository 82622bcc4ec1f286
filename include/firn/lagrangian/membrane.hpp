/// \file Membranes: triangles of cloth made of any elastic material.
#pragma once

#include <firn/core/tensor.hpp>
#include <firn/material/concept.hpp>

#include <array>

namespace firn {

/// The law of a membrane: a linear triangle in space that does not resist bending.
///
/// Its deformation gradient F = [x₂ − x₁, x₃ − x₁] D_m⁻¹, 3 × 2, is Q R, where the columns of Q are orthonormal. The
/// isotropic material computes the Kirchhoff stress τ [Pa] from R, 2 × 2, as in plane strain. With P = Q τ R⁻ᵀ, the
/// forces are −A₀ h P D_m⁻ᵀ (Jiang, Gast, Teran 2017, §4, after Sifakis and Barbic 2012, §4).
/// \tparam Material  a model whose stress depends on F only
template <class Material>
    requires has_kirchhoff_stress<Material, 2>
struct Membrane {
    using S = material_scalar_t<Material>;  ///< float or double.
    using scalar_type = S;
    static constexpr int corners = 3;  ///< Points of a triangle.
    /// A triangle at rest.
    struct Element {
        Mat<S, 2> inverse_rest = Mat<S, 2>::identity();  ///< D_m⁻¹ [1/m].
        S volume = S(0);                                 ///< A₀ h, area at rest times thickness [m³].
    };

    Material material{};  ///< The material of all triangles.

    /// The factors of F = Q R. R(0, 0) and R(1, 1) are at least 1e-12, for triangles without area, too.
    struct InPlane {
        Mat<S, 2> R;      ///< Upper triangular [1].
        Vec<S, 3> first,  ///< First column of Q.
            second;       ///< Second column of Q.
    };
    /// The factors of F for a triangle with corners at x [m].
    FIRN_INLINE InPlane in_plane(const Element& element, const std::array<Vec<S, 3>, 3>& x) const {
        const Vec<S, 3> a = x[1] - x[0], b = x[2] - x[0];
        const Mat<S, 2>& inverse = element.inverse_rest;
        const Vec<S, 3> f0 = a * inverse(0, 0) + b * inverse(1, 0), f1 = a * inverse(0, 1) + b * inverse(1, 1);
        const S tiny = S(1e-12);
        const S r00 = max(norm(f0), tiny);
        const Vec<S, 3> first = f0 * (S(1) / r00);
        const S r01 = dot(first, f1);
        const Vec<S, 3> across = f1 - first * r01;
        const S r11 = max(norm(across), tiny);
        return {Mat<S, 2>::rows(r00, r01, S(0), r11), first, across * (S(1) / r11)};
    }

    /// The forces [N] on the corners of a triangle at x [m]. They do not depend on velocities.
    FIRN_INLINE std::array<Vec<S, 3>, 3> forces(const Element& element, const std::array<Vec<S, 3>, 3>& x,
                                                const std::array<Vec<S, 3>, 3>&) const {
        const InPlane plane = in_plane(element, x);
        const Mat<S, 2> tau = firn::kirchhoff_stress(material, ElasticState<S, 2>{plane.R});
        // R⁻ᵀ of an upper triangular R
        const S i00 = S(1) / plane.R(0, 0), i11 = S(1) / plane.R(1, 1);
        const Mat<S, 2> inverse_transposed = Mat<S, 2>::rows(i00, S(0), -plane.R(0, 1) * i00 * i11, i11);
        const Mat<S, 2> H = tau * inverse_transposed * transpose(element.inverse_rest) * (-element.volume);
        const Vec<S, 3> second = plane.first * H(0, 0) + plane.second * H(1, 0);
        const Vec<S, 3> third = plane.first * H(0, 1) + plane.second * H(1, 1);
        return {-(second + third), second, third};
    }

    /// The elastic energy of a triangle with corners at x [m]. \return [J]
    FIRN_INLINE S energy(const Element& element, const std::array<Vec<S, 3>, 3>& x) const
        requires has_energy_density<Material, 2>
    {
        return element.volume * firn::energy_density(material, ElasticState<S, 2>{in_plane(element, x).R});
    }

    /// An upper bound of the largest eigenvalue of a triangle's stiffness matrix [N/m]: ρ c² of the material times the
    /// volume and the squared gradients of the shape functions.
    S stiffness(const Element& element, const std::array<Vec<S, 3>, 3>& x) const {
        const S speed = firn::wave_speed(material, S(1), ElasticState<S, 2>{in_plane(element, x).R});
        const Mat<S, 2>& B = element.inverse_rest;
        const Vec<S, 2> sum{{B(0, 0) + B(1, 0), B(0, 1) + B(1, 1)}};
        return element.volume * speed * speed * (squared_norm(B) + dot(sum, sum));
    }
};

}  // namespace firn
