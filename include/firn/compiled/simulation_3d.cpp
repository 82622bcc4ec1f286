/// \file Compiles Simulation<3>, with its default policies, for the library firn::compiled.
#define FIRN_COMPILES FIRN_SIMULATION_3
#include <firn/simulation.hpp>
