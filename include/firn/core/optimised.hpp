/// \file A warning for programs that are compiled without optimisation. Such programs are some hundred times slower
/// than optimised ones.
///
/// The warning is printed once, when the program makes its first grid or particle system. To silence the warning,
/// define FIRN_ALLOW_UNOPTIMISED in all files of the program.
#pragma once

#include <firn/core/requirements.hpp>

/// \def FIRN_TELLS_UNOPTIMISED
/// True if the source file that includes this header is compiled without optimisation and does not define
/// FIRN_ALLOW_UNOPTIMISED; else false.
#if defined(__OPTIMIZE__) || defined(FIRN_ALLOW_UNOPTIMISED)
#define FIRN_TELLS_UNOPTIMISED false
#else
#define FIRN_TELLS_UNOPTIMISED true
#include <cstdio>
#endif

namespace firn::inline FIRN_BUILD::detail {

/// Warns on stderr, once, that the program was compiled without optimisation.
/// \tparam tells  FIRN_TELLS_UNOPTIMISED of the calling file; if false, the function does nothing. `tells` is a
///                template parameter so that files with and without optimisation call different functions.
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

}  // namespace firn::inline FIRN_BUILD::detail
