/// \file FMPM, PIC with an approximate inverse of the full mass matrix.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// FMPM: PIC with an approximate inverse of the full mass matrix. The higher the order, the less FMPM damps motion.
///
/// The nodes' velocities v are the sum of a series. p and m are the nodes' momenta and masses. A is an operator that
/// interpolates the nodes' velocities v_i to the particles (v_p = Σ N v_i) and back to the nodes (Σ m_p N v_p / m_i). N
/// is the weight, m_p a particle's mass, m_i a node's mass. v_j is the sum of the first j terms:
///
///     v = Σ_{k < order} (1 − A)^k p/m
///     v_1 = p/m,      v_{j+1} = v_1 + v_j − A v_j
///
/// With growing order, v tends to the inverse of the full mass matrix times p. The particles' velocities become Σ N
/// v_i, as in PIC; order 1 is PIC. A higher order damps less of the motion that the grid can represent, and still
/// removes noise that the grid cannot represent. The boundary acts on the sum of the series.
///
/// Use order 2 to 8 for low damping without the noise of FLIP. Raising the order by one costs one more transfer of
/// velocities in each step, from the nodes to the particles and back.
///
/// The series raises the highest frequencies of the nodes. With quadratic splines, in matter without gaps, symplectic
/// Euler is stable for time steps up to 1.63 h/c for order 1, and up to 1.24, 0.96, 0.77, 0.67 h/c for orders 2, 4, 8,
/// 16, where h is the cell size and c the wave speed. The bound that firn computes for the time step does not include
/// this effect: above order 8, use half of the bound.
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

    /// Returns zero: a particle keeps no affine field C.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>&) {
        return Mat<S, D>::zero();
    }

    /// Returns the next partial sum of the series at a node, v_{j+1} = v_1 + v_j − A v_j [m/s].
    /// \param v_1             p/m: a node's momentum divided by its mass [m/s]
    /// \param v_j             the sum of the first j terms of the series [m/s]
    /// \param there_and_back  A v_j: the velocities v_j, interpolated to the particles and back to the node [m/s]
    template <scalar S, int D>
    FIRN_INLINE static Vec<S, D> next(const Vec<S, D>& v_1, const Vec<S, D>& v_j, const Vec<S, D>& there_and_back) {
        return v_1 + (v_j - there_and_back);
    }
};

static_assert(transfer<Fmpm> && refines_velocities<Fmpm>);

}  // namespace firn::inline FIRN_BUILD
