/// \file How much a test does of what it repeats. Sanitized and not optimised, code takes a hundred times as long; and
/// the plain test command has fifteen minutes.
#pragma once

#include <firn/core/config.hpp>

namespace test_support {

#if defined(FIRN_SANITIZED)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif
#if defined(FIRN_TEST_ALL)  // the CMake option FIRN_TEST_PART is `all`, as with `tests/run.sh --full`
inline constexpr bool full = true;
#else
inline constexpr bool full = false;
#endif

/// `few` where the code is sanitized, else `all`.
constexpr auto fewer_if_sanitized(auto all, decltype(all) few) { return sanitized ? few : all; }
/// `few` in the plain test command, `all` in every other build.
constexpr auto fewer_if_plain(auto all, decltype(all) few) { return full ? all : few; }

}  // namespace test_support
