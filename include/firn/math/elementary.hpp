/// \file exp, log, pow, sin and cos for every scalar.
///
/// The functions of the standard library do not run in SIMD lanes, and standard libraries differ in the last digit of
/// their results. firn's functions consist of + − × ÷, comparisons and exact operations on binary digits, so they run
/// in all lanes at once, and the bits of their results do not depend on the platform. Call them without `firn::`,
/// because a scalar that has such a function built in has its own overload.
#pragma once

#include <firn/math/exp_log.hpp>
#include <firn/math/pow.hpp>
#include <firn/math/trigonometric.hpp>
