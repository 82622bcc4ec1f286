/// \file How much a test does of what it repeats. Not optimised, code takes ten times as long, sanitized a hundred
/// times; and the plain test command has five minutes.
#pragma once

#include <firn/core/config.hpp>

#include <vector>

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

#if defined(FIRN_TEST_QUICK)  // FIRN_TEST_PART is `quick`, as with `tests/run.sh`
inline constexpr bool quick = true;
#else
inline constexpr bool quick = false;
#endif

/// `few` where the code is sanitized or not optimised, else `all`.
constexpr auto fewer_if_slow(auto all, decltype(all) few) { return slow ? few : all; }
/// `few` in the plain test command and with --ci, `all` in every other build.
constexpr auto fewer_if_plain(auto all, decltype(all) few) { return full ? all : few; }
/// `few` in the plain test command, `all` with --ci and in every other build.
constexpr auto fewer_if_quick(auto all, decltype(all) few) { return quick ? few : all; }

/// The precisions of a test that compiles whole simulations: one of them in the plain test command.
#if defined(FIRN_TEST_QUICK)
#define FIRN_TEST_PRECISIONS float
#else
#define FIRN_TEST_PRECISIONS float, double
#endif

/// The first one, two or three types of a test case in the plain test command, all with --ci:
/// `TEMPLATE_TEST_CASE("…", "", FIRN_TEST_FIRST_1(A, B, C))`.
#if defined(FIRN_TEST_QUICK)
#define FIRN_TEST_FIRST_1(a, ...) a
#define FIRN_TEST_FIRST_2(a, b, ...) a, b
#define FIRN_TEST_FIRST_3(a, b, c, ...) a, b, c
#else
#define FIRN_TEST_FIRST_1(...) __VA_ARGS__
#define FIRN_TEST_FIRST_2(...) __VA_ARGS__
#define FIRN_TEST_FIRST_3(...) __VA_ARGS__
#endif

/// Numbers of threads to compare with one thread.
inline const std::vector<int> other_threads = quick ? std::vector{3} : std::vector{2, 3, 4, 7};

}  // namespace test_support
