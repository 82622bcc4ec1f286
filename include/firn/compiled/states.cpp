/// \file Compiles the functions that make, write, read and restore states, for the library firn::compiled_hdf5.
#define FIRN_COMPILES FIRN_STATES
#include <firn/io/states.hpp>
