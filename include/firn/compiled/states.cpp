/// \file Of the library firn::compiled_hdf5: states of the common simulations.
#define FIRN_COMPILES_STATES
#include <firn/io/states.hpp>
