/// \file Offsets from the centre node, a particle's, and the nodes', which are −1, 0, 1 or 2; and their inertia.
#pragma once

#include <firn/core/tensor.hpp>
#include <firn/kernel/concept.hpp>

namespace firn {

/// The position from the base node becomes the position from the centre node. \param fraction  f = x/h − base, in cells
template <class Kernel, class S, int D>
FIRN_INLINE Vec<S, D> from_centre(const Vec<S, D>& fraction) {
    return fraction - Vec<S, D>::filled(S(centre_node<Kernel>));
}

/// True, or the compiler says why these forces cannot be had with this kernel.
template <class Kernel, class Force>
consteval bool require_inertia() {
    static_assert(
        has_inertia<Kernel> || !Force::needs_inertia,
        "firn: MLS forces need a kernel of constant inertia (inverse_inertia in firn/kernel/concept.hpp), which "
        "the linear kernel does not have. Use WeightGradientForce: for linear weights both would be the same.");
    return true;
}

/// D⁻¹ [1/m²]; nobody asks for it where the kernel has none.
template <class Kernel, class S>
FIRN_INLINE S inverse_inertia(const S& h) {
    if constexpr (has_inertia<Kernel>)
        return named("D_inverse", S(Kernel::inverse_inertia) / (h * h));
    else
        return S(0);
}

/// a + b o, without a multiplication where o is −1, 0 or 1.
template <class V, class O>
FIRN_INLINE V plus_times(const V& a, const V& b, const O& o) {
    return a + b * o;
}
template <class V, int o>
FIRN_INLINE V plus_times(const V& a, const V& b, std::integral_constant<int, o>) {
    if constexpr (o == 0)
        return a;
    else if constexpr (o == 1)
        return a + b;
    else if constexpr (o == -1)
        return a - b;
    else
        return a + (b + b);  // o = 2, of the cubic kernel
}

/// b w − a
template <class V, class W>
FIRN_INLINE V times_minus(const V& b, const W& w, const V& a) {
    return b * w - a;
}

}  // namespace firn
