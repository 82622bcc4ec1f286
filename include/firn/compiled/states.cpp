/// \file Compiles the states of the common simulations for the library firn::compiled_hdf5.
#define FIRN_COMPILES 0
#include <firn/io/states.hpp>
