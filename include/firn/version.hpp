/// \file The version of firn. The build reads it from this header.
#pragma once

#include <string>

namespace firn {

/// Major, minor and patch number of the version.
/// @{
inline constexpr int version_major = 0;
inline constexpr int version_minor = 2;
inline constexpr int version_patch = 0;
/// @}

/// Returns the version as text, e.g. "0.2.0".
inline std::string version() {
    return std::to_string(version_major) + "." + std::to_string(version_minor) + "." + std::to_string(version_patch);
}

}  // namespace firn
