/// \file The way to a state of a run by Checkpoints, as an Adjoint goes it, for states that only know their step.
#pragma once

#include "support/catch.hpp"
#include <firn/adjoint/checkpoints.hpp>

namespace test_support {

/// Brings the run to the state before step `wanted`; all states that are brought are the right ones.
/// \param now      the state of the run
/// \param step_of  step_of(state): the step of a kept state
/// \param store    store(state) keeps the state of the run
/// \param again    again(k) is told that step k is taken again
template <class State>
void bring_state(firn::Checkpoints<State>& kept, std::size_t& now, std::size_t wanted, const auto& step_of,
                 const auto& store, const auto& again) {
    if (kept.last() == wanted && wanted > 0) {
        kept.take_last([&](const State& state) { now = step_of(state); });
    } else {
        now = step_of(kept.state());
        REQUIRE(now == kept.last());
        while (now < wanted) {
            const std::size_t to = kept.way_to(wanted);
            REQUIRE(to > now);
            for (; now < to; ++now) again(now);
            if (now < wanted) kept.keep_again(now, store);
        }
    }
    REQUIRE(now == wanted);
}

}  // namespace test_support
