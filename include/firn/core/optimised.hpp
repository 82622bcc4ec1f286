/// \file A warning for programs that are compiled without optimisation, which makes them some hundred times slower.
///
/// It is printed once, when the program makes its first grid or particle system. Define FIRN_ALLOW_UNOPTIMISED in all
/// files of the program to silence it.
#pragma once

#include <firn/core/requirements.hpp>

/// \def FIRN_TELLS_UNOPTIMISED
/// Whether this file is compiled without optimisation and shall warn of it.
#if defined(__OPTIMIZE__) || defined(FIRN_ALLOW_UNOPTIMISED)
#define FIRN_TELLS_UNOPTIMISED false
#else
#define FIRN_TELLS_UNOPTIMISED true
#include <cstdio>
#endif

namespace firn::detail {

/// Prints the warning to stderr, once.
/// \tparam tells  FIRN_TELLS_UNOPTIMISED; false: it does nothing. As a parameter it keeps the functions of differently
///                compiled files apart.
template <bool tells>
void tell_unoptimised() {
#if FIRN_TELLS_UNOPTIMISED
    static const bool said = [] {
        std::fputs(
            "firn: this program was compiled without optimisation and is some hundred times slower. Compile with "
            "-O3 -march=native; in CMake configure with -DCMAKE_BUILD_TYPE=Release. Define "
            "FIRN_ALLOW_UNOPTIMISED if this is intended.\n",
            stderr);
        return true;
    }();
    static_cast<void>(said);
#endif
}

}  // namespace firn::detail
