/// \file Access to the single numbers in the lanes of a scalar, e.g. to look up values in a table. For programs on a
/// CPU only.
#pragma once

#include <firn/core/dual.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/strict.hpp>

namespace firn::inline FIRN_BUILD {

/// Returns the number that the scalar `a` holds in the given lane, 0 ≤ lane < `scalar_traits<S>::lanes`. For a dual
/// number this is the value, not the derivative.
/// @{
template <std::floating_point T>
FIRN_INLINE T lane_value(T a, int) {
    return a;
}
template <std::floating_point T>
FIRN_INLINE T lane_value(strict<T> a, int) {
    return a.value;
}
template <class T, int N>
FIRN_INLINE T lane_value(pack<T, N> a, int lane) {
    return a[lane];
}
template <class T>
FIRN_INLINE auto lane_value(const dual<T>& a, int lane) -> decltype(lane_value(a.value, lane)) {
    return lane_value(a.value, lane);
}
/// @}

/// A scalar whose numbers can be read at run time: every scalar except the one that records a program for a GPU.
template <class S>
concept has_lanes = requires(const S a) {
    { lane_value(a, 0) } -> std::floating_point;
};

/// Returns a scalar of type S that holds the number f(lane) in each lane. If S is a dual number, its derivative is
/// zero.
template <has_lanes S, class F>
FIRN_INLINE S from_lanes(const F& f) {
    using T = value_type_t<S>;
    constexpr int lanes = scalar_traits<S>::lanes;
    if constexpr (lanes == 1) {
        return S(T(f(0)));
    } else if constexpr (requires(S a) { a.derivative; }) {
        return S(from_lanes<decltype(S::value)>(f));
    } else {
        T numbers[lanes];
        for (int lane = 0; lane < lanes; ++lane) numbers[lane] = T(f(lane));
        return S::load(numbers);
    }
}

}  // namespace firn::inline FIRN_BUILD
