/// \file Compiles the common simulation in 2D for the library firn::compiled.
#define FIRN_COMPILES 2
#include <firn/simulation.hpp>
