/// \file FMPM, PIC with an approximate inverse of the full mass matrix.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

/// FMPM: PIC with an approximate inverse of the full mass matrix, which damps less the higher its order.
///
/// A node's velocity is a series, with p and m the node's momentum and mass and A the operator from nodes to particles
/// (Σ N v_i) and back (Σ m N v_p / m_i):
///
///     v = Σ_{k < order} (1 − A)^k p/m
///     v_1 = p/m,      v_{j+1} = v_1 + v_j − A v_j
///
/// The series tends to the inverse of the mass matrix times p. Particles take Σ N v_i, as in PIC. Order 1 is PIC. With
/// a higher order, less is lost of the motion that the grid can represent, and noise that it cannot represent is still
/// removed. The boundary acts on the sum of the series.
///
/// Take order 2 to 8 for low damping without FLIP's noise. Each order above 1 costs one more P2G of velocities and one
/// more gather.
///
/// The series makes the stiffest motions of the nodes stiffer: with quadratic splines, in matter without gaps,
/// symplectic Euler is stable up to 1.63 h/c for order 1, and up to 1.24, 0.96, 0.77, 0.67 h/c for orders 2, 4, 8, 16.
/// The bound of the time step does not include this: above order 8, take half of it.
///
/// Nairn and Hammerquist 2021, "Material point method simulations using an approximate full mass matrix inverse"; the
/// series is that of XPIC, Hammerquist and Nairn 2017, "A new method for material point method particle updates that
/// reduces noise and enhances stability".
struct Fmpm {
    static constexpr const char* name = "fmpm";
    static constexpr bool affine = false;  ///< Particles carry no C.

    int order = 2;  ///< number of terms of the series, 1 or more [1]

    /// Checks the parameters.
    /// \throws parameter_error if the order is less than 1
    void check() const {
        if (order < 1)
            throw parameter_error(
                sentence("The order of ", name, " is ", order, "; it must be 1 (which is PIC) or more."));
    }
    static constexpr auto parameters() { return std::tuple{parameter{"order", "1", &Fmpm::order}}; }

    /// The affine field that a particle keeps: none, C = 0.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>&) {
        return Mat<S, D>::zero();
    }

    /// The next sum of the series, v_{j+1} = v_1 + v_j − A v_j [m/s].
    /// \param there_and_back  A v_j [m/s]
    template <scalar S, int D>
    FIRN_INLINE static Vec<S, D> next(const Vec<S, D>& v_1, const Vec<S, D>& v_j, const Vec<S, D>& there_and_back) {
        return v_1 + (v_j - there_and_back);
    }
};

static_assert(transfer<Fmpm> && refines_velocities<Fmpm>);

}  // namespace firn
