/// \file The version of firn. It stands here once; the build reads it from these lines.
#pragma once

#include <string>

namespace firn {

inline constexpr int version_major = 0;
inline constexpr int version_minor = 2;
inline constexpr int version_patch = 0;

/// "0.2.0"
inline std::string version() {
    return std::to_string(version_major) + "." + std::to_string(version_minor) + "." + std::to_string(version_patch);
}

}  // namespace firn
