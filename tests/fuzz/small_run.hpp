/// \file A small simulation whose states the fuzzers damage, and which must answer for what it is restored from.
/// Compiled once for all of them.
#pragma once

#include <firn/io/state.hpp>

namespace small_run {

/// The state after some steps of two bodies: blocks of many particles and blocks of few.
firn::State<float> begun();

/// Restores a simulation from a state and goes one step on. False where a typed error refused either; anything else
/// that is thrown, or worse, is the caller's to see.
bool goes_on_from(const firn::State<float>& state);

}  // namespace small_run
