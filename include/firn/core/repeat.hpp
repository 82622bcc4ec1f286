/// \file Loops with a fixed or a largest number of passes. The scalar that records a program for a GPU records them as
/// loops.
#pragma once

#include <firn/core/scalar.hpp>

namespace firn {

/// Computes state = f(state) N times and returns the last state. On a CPU the loop is unrolled, so that the state stays
/// in registers.
template <int N, class State, class F>
FIRN_INLINE constexpr State repeat(State state, F&& f) {
    if constexpr (N == 0) {
        return state;
    } else if constexpr (requires { record_repeat<N>(state, f); }) {
        return record_repeat<N>(state, f);
    } else {
        unroll<N>([&](auto) FIRN_LAMBDA { state = f(state); });
        return state;
    }
}

/// Calls f(state) until the mask that f returns is off in all lanes, but at most N times. Returns the last state.
///
/// Once the mask is off in a lane, f must not change this lane any more, so that its result does not depend on how many
/// passes other lanes need.
/// \param f  takes the state by reference, changes the state, and returns a mask
template <int N, class State, class F>
FIRN_INLINE constexpr State repeat_while(State state, F&& f) {
    if constexpr (requires { record_repeat<N>(state, f); }) {
        return record_repeat<N>(state, f);
    } else {
        for (int pass = 0; pass < N; ++pass)
            if (!any(f(state))) break;
        return state;
    }
}

}  // namespace firn
