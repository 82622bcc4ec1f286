/// \file Loops with a fixed number of passes. A scalar that records a program records them as loops.
#pragma once

#include <firn/core/scalar.hpp>

namespace firn {

/// Applies f N times, state → f(state) → …, and returns the last state. On a CPU the loop is unrolled, so that the
/// state stays in registers.
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

/// Calls f(state), at most N times, until the mask that f returns is off in all lanes. Returns the state.
///
/// f must not change lanes whose mask is off, so that a lane does not depend on how many passes other lanes need.
/// \param f  takes the state by reference and changes it
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
