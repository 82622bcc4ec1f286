/// \file Of the library firn::compiled: the common simulation in 2D.
#define FIRN_COMPILES 2
#include <firn/simulation.hpp>
