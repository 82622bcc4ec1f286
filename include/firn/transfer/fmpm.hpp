/// \file FMPM, PIC with an approximate inverse of the full mass matrix. Nairn and Hammerquist 2021; the series is that
/// of XPIC, Hammerquist and Nairn 2017.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

/// With A the way from nodes to particles (Σ N v_i) and back (Σ m N v_p / m_i), a node's velocity is the series
///     v = Σ_{k < order} (1 − A)^k p/m,     v_1 = p/m,   v_{j+1} = v_1 + v_j − A v_j,
/// which tends to the inverse of the mass matrix times p. Particles take Σ N v_i, as in PIC: order 1 is PIC, and the
/// higher the order, the less is lost of what the grid can represent, while noise that it cannot represent still goes.
/// Each order above 1 costs a P2G and a gather of velocities more. The boundary acts on the sum.
///
/// The series makes the stiffest motions of the nodes stiffer: with quadratic splines, in matter without gaps,
/// symplectic Euler is stable up to 1.63 h/c for order 1, but to 1.24, 0.96, 0.77, 0.67 h/c for orders 2, 4, 8, 16. The
/// bound of the time step does not know of that: above order 8 take half of it.
struct Fmpm {
    static constexpr const char* name = "fmpm";
    static constexpr bool affine = false;

    int order = 2;  ///< 1 or more

    /// \throws parameter_error if the order is less than 1
    void check() const {
        if (order < 1)
            throw parameter_error(
                sentence("The order of ", name, " is ", order, "; it must be 1 (which is PIC) or more."));
    }
    static constexpr auto parameters() { return std::tuple{parameter{"order", "1", &Fmpm::order}}; }

    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>&) {
        return Mat<S, D>::zero();
    }

    /// v_{j+1}. \param there_and_back  A v_j
    template <scalar S, int D>
    FIRN_INLINE static Vec<S, D> next(const Vec<S, D>& v_1, const Vec<S, D>& v_j, const Vec<S, D>& there_and_back) {
        return v_1 + (v_j - there_and_back);
    }
};

static_assert(transfer<Fmpm> && refines_velocities<Fmpm>);

}  // namespace firn
