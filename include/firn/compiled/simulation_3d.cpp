/// \file Compiles Simulation<3>, with its default policies, for the library firn::compiled.
#define FIRN_COMPILES 3
#include <firn/simulation.hpp>
