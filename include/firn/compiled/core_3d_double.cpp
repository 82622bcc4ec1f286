/// \file Compiles for the library firn::compiled what names no policy, in 3D and double.
#define FIRN_COMPILES FIRN_CORE_3D
#include <firn/simulation.hpp>
