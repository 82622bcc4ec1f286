/// \file The slope of the benchmarks and tests of implicit steps.
#pragma once

#include <firn/core/angle.hpp>

#include <algorithm>
#include <cmath>

/// Returns the height of a slope of 35° at x, in a box that is 1 long.
inline double surface(double x) {
    return std::max(0.106, std::min(0.427, 0.427 - (x - 0.317) * std::tan(firn::degrees(35).in_radians())));
}
