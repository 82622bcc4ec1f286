/// \file Loops of a fixed number of passes, written so that a scalar which records a program can keep them loops.
#pragma once

#include <firn/core/scalar.hpp>

namespace firn {

/// f applied N times: state → f(state) → … On a CPU it is unrolled, so that the state stays in registers.
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

/// f(state) again and again, until the mask that it returns is off in all lanes, N times at most. Where the mask is
/// off, f must leave a lane as it was: how many passes the others need makes no difference to it.
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
