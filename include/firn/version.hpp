/// \file The version of firn. CMake reads the version from this header.
#pragma once

#include <firn/core/build.hpp>

#include <string>

/// Major, minor and patch number of firn's version, for the preprocessor.
/// @{
#define FIRN_VERSION_MAJOR 0
#define FIRN_VERSION_MINOR 2
#define FIRN_VERSION_PATCH 0
/// @}

/// The version of firn as one number, 10000 major + 100 minor + patch; version 0.2.0 is 200. The preprocessor can test
/// it: `#if FIRN_VERSION >= 200`.
#define FIRN_VERSION (10000 * FIRN_VERSION_MAJOR + 100 * FIRN_VERSION_MINOR + FIRN_VERSION_PATCH)

namespace firn::inline FIRN_BUILD {

/// Major, minor and patch number of firn's version. As long as the major number is 0, a version with a new minor number
/// may change firn's interface and the bits of results. A version with a new patch number changes neither.
/// @{
inline constexpr int version_major = FIRN_VERSION_MAJOR;
inline constexpr int version_minor = FIRN_VERSION_MINOR;
inline constexpr int version_patch = FIRN_VERSION_PATCH;
/// @}

/// Returns the version of firn as text, e.g. "0.2.0".
inline std::string version() {
    return std::to_string(version_major) + "." + std::to_string(version_minor) + "." + std::to_string(version_patch);
}

}  // namespace firn::inline FIRN_BUILD
