/// \file Compiles the common simulation in 3D for the library firn::compiled.
#define FIRN_COMPILES 3
#include <firn/simulation.hpp>
