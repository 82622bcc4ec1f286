/// \file Numbers that nothing can be made of.
#pragma once

#include <limits>

namespace test_support {

inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

}  // namespace test_support
