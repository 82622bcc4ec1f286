/// \file A loop of a fixed number of passes, written so that a scalar which records a program can keep it a loop.
#pragma once

#include <firn/core/config.hpp>

namespace firn {

/// f applied N times: state → f(state) → … On a CPU it is unrolled, so that the state stays in registers.
template <int N, class State, class F>
FIRN_INLINE constexpr State repeat(State state, F&& f) {
    unroll<N>([&](auto) FIRN_LAMBDA { state = f(state); });
    return state;
}

}  // namespace firn
