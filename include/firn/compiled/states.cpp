/// \file Of the library firn::compiled_hdf5: states of the common simulations.
#define FIRN_COMPILES 0
#include <firn/io/states.hpp>
