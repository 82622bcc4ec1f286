/// \file exp, log, pow, sin and cos for every scalar; why they are not those of <cmath>.
///
/// No compiler of ours vectorises std::exp, and two standard libraries differ in its last digit. These are made of
/// + − × ÷, comparisons and exact steps on binary digits, so lanes cost a lane's share and bits do not depend on the
/// platform. Call them unqualified: a scalar that has such a function as a builtin provides its own overload.
#pragma once

#include <firn/math/exp_log.hpp>
#include <firn/math/pow.hpp>
#include <firn/math/trigonometric.hpp>
