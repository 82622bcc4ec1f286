/// \file Compiles for the library firn::compiled what names no policy, in 2D and float.
#define FIRN_COMPILES FIRN_CORE_2F
#include <firn/simulation.hpp>
