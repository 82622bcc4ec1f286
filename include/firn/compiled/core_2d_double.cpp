/// \file Compiles for the library firn::compiled what names no policy, in 2D and double.
#define FIRN_COMPILES FIRN_CORE_2D
#include <firn/simulation.hpp>
