/// \file exp, log, pow, sin and cos for every scalar.
///
/// The functions of the standard library do not run in SIMD lanes, and the last digit of their results depends on the
/// library. firn's functions consist of + − × ÷, comparisons and exact operations on binary digits. They run in all
/// lanes at once, and the bits of their results do not depend on the platform. In your code write `firn::exp(x)`: for a
/// float x, an unqualified exp(x) may call the function of the C library, and std::exp accepts only C++'s own types of
/// numbers.
#pragma once

#include <firn/math/exp_log.hpp>
#include <firn/math/pow.hpp>
#include <firn/math/trigonometric.hpp>
