/// \file exp, log, pow, sin and cos for every scalar.
///
/// The functions of the standard library do not run in SIMD lanes, and standard libraries differ in their last digit.
/// These consist of + − × ÷, comparisons and exact operations on binary digits, so they run in all lanes at once, and
/// their bits do not depend on the platform. In your code write `firn::exp(x)`: an unqualified exp(x) of a float may
/// find C's, and std::exp knows only C++'s own numbers.
#pragma once

#include <firn/math/exp_log.hpp>
#include <firn/math/pow.hpp>
#include <firn/math/trigonometric.hpp>
