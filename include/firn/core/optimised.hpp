/// \file A program that was compiled without optimisation is told so, once, when it makes its first grid or particle
/// system: it would be some hundred times slower, and nothing else would say why.
///
/// FIRN_ALLOW_UNOPTIMISED, defined for all of the program's files, silences it.
#pragma once

#include <firn/core/requirements.hpp>

#if defined(__OPTIMIZE__) || defined(FIRN_ALLOW_UNOPTIMISED)
#define FIRN_TELLS_UNOPTIMISED false
#else
#define FIRN_TELLS_UNOPTIMISED true
#include <cstdio>
#endif

namespace firn::detail {

/// \tparam tells  false: nothing. (A parameter, so that files compiled in two ways do not share one function.)
template <bool tells>
void tell_unoptimised() {
#if FIRN_TELLS_UNOPTIMISED
    static const bool said = [] {
        std::fputs(
            "firn: this program was compiled without optimisation and is some hundred times slower. Compile with "
            "-O3 -march=native; in CMake configure with -DCMAKE_BUILD_TYPE=Release. Define "
            "FIRN_ALLOW_UNOPTIMISED where that is meant.\n",
            stderr);
        return true;
    }();
    static_cast<void>(said);
#endif
}

}  // namespace firn::detail
