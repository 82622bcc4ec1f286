/// \file Offsets of particles and nodes from the centre node, in cells. Along each axis, the offset of a node is −1, 0,
/// 1 or 2.
#pragma once

#include <firn/core/tensor.hpp>
#include <firn/kernel/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// Returns a particle's position relative to its centre node [cells].
/// \param fraction  the particle's position relative to its base node [cells]: f = x/h − base
template <class Kernel, class S, int D>
FIRN_INLINE Vec<S, D> from_centre(const Vec<S, D>& fraction) {
    return fraction - Vec<S, D>::filled(S(centre_node<Kernel>));
}

/// Returns true. If the force policy needs a kernel of constant inertia, and the inertia of this kernel is not
/// constant, the compiler stops with a message.
template <class Kernel, class Force>
consteval bool require_inertia() {
    static_assert(
        has_inertia<Kernel> || !Force::needs_inertia,
        "firn: MLS forces need a kernel of constant inertia (inverse_inertia in firn/kernel/concept.hpp), which "
        "Linear and CompactQuartic do not have. Use WeightGradientForce: for linear weights both would be the same.");
    return true;
}

/// Returns the inverse inertia D⁻¹ of APIC and of MLS forces [1/m²]: Kernel::inverse_inertia / h², or 0 if the kernel's
/// inertia is not constant.
/// \see kernel/concept.hpp
/// \param h  cell size [m]
template <class Kernel, class S>
FIRN_INLINE S inverse_inertia(const S& h) {
    if constexpr (has_inertia<Kernel>)
        return named("D_inverse", S(Kernel::inverse_inertia) / (h * h));
    else
        return S(0);
}

/// Returns a + b × o, where o is an offset or a weight.
template <class V, class O>
FIRN_INLINE V plus_times(const V& a, const V& b, const O& o) {
    return a + b * o;
}
/// Returns a + b × o for an offset o that is known at compile time, without a multiplication.
template <class V, int o>
FIRN_INLINE V plus_times(const V& a, const V& b, std::integral_constant<int, o>) {
    if constexpr (o == 0)
        return a;
    else if constexpr (o == 1)
        return a + b;
    else if constexpr (o == -1)
        return a - b;
    else
        return a + (b + b);  // o = 2, which only the cubic kernel has
}

/// Returns b × w − a, where w is a weight.
template <class V, class W>
FIRN_INLINE V times_minus(const V& b, const W& w, const V& a) {
    return b * w - a;
}

}  // namespace firn::inline FIRN_BUILD
