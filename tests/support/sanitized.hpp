/// \file Sanitized and not optimised, code takes a hundred times as long: a test that goes through the same code in
/// every step or trial does fewer of them there.
#pragma once

#include <firn/core/config.hpp>

namespace test_support {

#if defined(FIRN_SANITIZED)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// \param all  in a plain build
constexpr auto fewer_if_sanitized(auto all, decltype(all) few) { return sanitized ? few : all; }

}  // namespace test_support
