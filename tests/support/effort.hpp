/// \file How much a test does of what it repeats. Not optimised, code takes ten times as long, sanitized a hundred
/// times; and the plain test command has five minutes.
#pragma once

#include <firn/core/config.hpp>

namespace test_support {

#if defined(FIRN_SANITIZED) || !defined(__OPTIMIZE__)
inline constexpr bool slow = true;
#else
inline constexpr bool slow = false;
#endif
#if defined(FIRN_TEST_ALL)  // the CMake option FIRN_TEST_PART is `all`, as with `tests/run.sh --full`
inline constexpr bool full = true;
#else
inline constexpr bool full = false;
#endif

/// `few` where the code is sanitized or not optimised, else `all`.
constexpr auto fewer_if_slow(auto all, decltype(all) few) { return slow ? few : all; }
/// `few` in the plain test command and with --ci, `all` in every other build.
constexpr auto fewer_if_plain(auto all, decltype(all) few) { return full ? all : few; }

}  // namespace test_support
