/// \file Of the library firn::compiled: the common simulation in 3D.
#define FIRN_COMPILES 3
#include <firn/simulation.hpp>
