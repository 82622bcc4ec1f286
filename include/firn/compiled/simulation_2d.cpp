/// \file Compiles Simulation<2>, with its default policies, for the library firn::compiled.
#define FIRN_COMPILES FIRN_SIMULATION_2
#include <firn/simulation.hpp>
