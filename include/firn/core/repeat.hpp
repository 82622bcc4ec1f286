/// \file Loops whose number of passes is fixed, or has an upper limit, at compile time. If the scalar records a program
/// for a GPU, the recorded program contains a loop, too.
#pragma once

#include <firn/core/scalar.hpp>

namespace firn::inline FIRN_BUILD {

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

/// Calls f(state) until f returns a mask that is off in all lanes, but at most N times. Returns the last state.
///
/// Once the mask is off in a lane, f must not change the state in this lane any more. The result of a lane then does
/// not depend on how many passes other lanes need.
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

}  // namespace firn::inline FIRN_BUILD
