/// \file Membranes: triangles that stretch and shear like a thin sheet of any elastic material.
#pragma once

#include <firn/core/tensor.hpp>
#include <firn/material/concept.hpp>

#include <array>

namespace firn::inline FIRN_BUILD {

/// The law of a membrane made of linear triangles in space. A membrane does not resist bending.
///
/// The corners of a triangle are at x₁, x₂, x₃. The columns of the 2 × 2 matrix D_m are the edges x₂ − x₁ and x₃ − x₁
/// at rest, as 2D vectors in the plane of the triangle. The 3 × 2 deformation gradient F = [x₂ − x₁, x₃ − x₁] D_m⁻¹ is
/// factored into Q R, where the 3 × 2 matrix Q has orthonormal columns and the 2 × 2 matrix R is upper triangular. The
/// material, which must be isotropic, computes the Kirchhoff stress τ [Pa] from R as in plane strain. Let P = Q τ R⁻ᵀ
/// be the first Piola-Kirchhoff stress, A₀ the area at rest and h the thickness. Then the columns of −A₀ h P D_m⁻ᵀ are
/// the forces on corners 2 and 3. The force on corner 1 is minus the sum of these two forces (Jiang, Gast, Teran 2017,
/// §4, after Sifakis and Barbic 2012, §4).
/// \tparam Material  an isotropic material whose stress depends on F only
template <class Material>
    requires has_kirchhoff_stress<Material, 2>
struct Membrane {
    using S = material_scalar_t<Material>;  ///< float or double.
    using scalar_type = S;
    static constexpr int corners = 3;  ///< Number of corners of a triangle.
    /// The data of one triangle, computed from its shape at rest.
    struct Element {
        Mat<S, 2> inverse_rest = Mat<S, 2>::identity();  ///< D_m⁻¹: inverse of the matrix of edges at rest [1/m].
        S volume = S(0);                                 ///< Volume at rest A₀ h: area times thickness [m³].
    };
    /// Returns a digest of the data of a triangle.
    static Digest digest(const Element& e)
        requires std::floating_point<S>
    {
        return Digest().add(e.inverse_rest).add(e.volume);
    }

    Material material{};  ///< The material of all triangles.

    /// The factors Q and R of the deformation gradient F = Q R. R(0, 0) and R(1, 1) are at least 1e-12, even if the
    /// triangle has no area.
    struct InPlane {
        Mat<S, 2> R;      ///< The upper triangular factor R [1].
        Vec<S, 3> first,  ///< First column of Q.
            second;       ///< Second column of Q.
    };
    /// Returns the factors Q and R of the deformation gradient F = Q R of a triangle with corners at x [m].
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

    /// Returns the force [N] on each corner of a triangle with corners at x [m]. The last parameter, the velocities of
    /// the corners, is not used.
    FIRN_INLINE std::array<Vec<S, 3>, 3> forces(const Element& element, const std::array<Vec<S, 3>, 3>& x,
                                                const std::array<Vec<S, 3>, 3>&) const {
        const InPlane plane = in_plane(element, x);
        const Mat<S, 2> tau = firn::kirchhoff_stress(material, ElasticState<S, 2>{plane.R});
        // The inverse of Rᵀ is lower triangular, because R is upper triangular.
        const S i00 = S(1) / plane.R(0, 0), i11 = S(1) / plane.R(1, 1);
        const Mat<S, 2> inverse_transposed = Mat<S, 2>::rows(i00, S(0), -plane.R(0, 1) * i00 * i11, i11);
        const Mat<S, 2> H = tau * inverse_transposed * transpose(element.inverse_rest) * (-element.volume);
        const Vec<S, 3> second = plane.first * H(0, 0) + plane.second * H(1, 0);
        const Vec<S, 3> third = plane.first * H(0, 1) + plane.second * H(1, 1);
        return {-(second + third), second, third};
    }

    /// Returns the elastic energy [J] of a triangle with corners at x [m].
    FIRN_INLINE S energy(const Element& element, const std::array<Vec<S, 3>, 3>& x) const
        requires has_energy_density<Material, 2>
    {
        return element.volume * firn::energy_density(material, ElasticState<S, 2>{in_plane(element, x).R});
    }

    /// Returns an upper bound for the eigenvalues of the triangle's stiffness matrix [N/m]: ρ c² V Σᵢ |∇Nᵢ|². Here ρ is
    /// the density and c the wave speed of the material, V = A₀ h the volume, and Nᵢ the shape function of corner i.
    S stiffness(const Element& element, const std::array<Vec<S, 3>, 3>& x) const {
        const S speed = firn::wave_speed(material, S(1), ElasticState<S, 2>{in_plane(element, x).R});
        const Mat<S, 2>& B = element.inverse_rest;
        const Vec<S, 2> sum{{B(0, 0) + B(1, 0), B(0, 1) + B(1, 1)}};
        return element.volume * speed * speed * (squared_norm(B) + dot(sum, sum));
    }
};

}  // namespace firn::inline FIRN_BUILD
