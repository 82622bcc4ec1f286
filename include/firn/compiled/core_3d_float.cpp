/// \file Compiles for the library firn::compiled what names no policy, in 3D and float.
#define FIRN_COMPILES FIRN_CORE_3F
#include <firn/simulation.hpp>
