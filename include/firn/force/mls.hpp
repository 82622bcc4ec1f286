/// \file Forces by moving least squares (MLS-MPM).
#pragma once

#include <firn/force/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// Forces by moving least squares, the default: the gradient ∇N_i of a weight is replaced by N_i D⁻¹ (x_i − x_p).
///
///     f_i = −V0 τ N_i D⁻¹ (x_i − x_p)       [N]
///
/// V0 is the undeformed volume of the particle, τ its Kirchhoff stress, N_i its weight at node i, and
/// D = Σ N_i (x_i − x_p)(x_i − x_p)ᵀ. The velocity gradient that updates F is Σ N_i v_i (x_i − x_p)ᵀ D⁻¹, with the
/// velocities v_i of the nodes: the work of the forces is the work of the stress. It is C of an affine transfer.
///
/// Use MlsForce with spline kernels: no gradients are computed, and with an affine transfer P2G scatters stress and
/// affine momentum together.
///
/// At a free surface that is neither parallel to an axis nor at 45°, MLS forces of a stress along the surface do not
/// cancel, however many particles there are: along each axis, N_i D⁻¹ (x_i − x_p) is the gradient of another function.
/// The outermost particles then yield. A beam that bends far with 2 × 2 particles per cell sinks 10 % too far, and
/// keeps 8 % of its deflection when it is let go. For solids that bend far, use WeightGradientForce with the kernel
/// CompactQuartic, the function of which N_i D⁻¹ (x_i − x_p) is the slope in one dimension: 0.5 % stays. With
/// WeightGradientForce and QuadraticBSpline 2.4 % stays (benchmarks/verification, cantilever).
///
/// Hu et al. 2018, "A moving least squares material point method with displacement discontinuity and two-way rigid body
/// coupling", eq. (18).
struct MlsForce {
    static constexpr const char* name = "mls";
    static constexpr bool weight_gradients = false;  ///< MlsForce needs no gradients of weights.
    static constexpr bool needs_inertia = true;      ///< MlsForce needs a kernel with `inverse_inertia`: a spline.

    /// Returns the matrix A = (−dt V0 τ) D⁻¹ h [kg m/s]: the impulse on node i is N_i A (x_i − x_p)/h.
    /// \param impulse    −dt V0 τ [J s], with the undeformed volume V0 and the Kirchhoff stress τ
    /// \param D_inverse  D⁻¹ of the kernel [1/m²]
    /// \param h          cell size [m]
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_part(const Mat<S, D>& impulse, const S& D_inverse, const S& h) {
        return impulse * (D_inverse * h);
    }
    /// Returns the matrix G = 0: the impulse has no part G ∇N_i.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> gradient_part(const Mat<S, D>&, const S&) {
        return Mat<S, D>::zero();
    }
};

static_assert(force<MlsForce>);

}  // namespace firn::inline FIRN_BUILD
