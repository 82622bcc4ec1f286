/// \file Compiles the functions that write, read and restore states of Simulation<2> and Simulation<3>, for the library
/// firn::compiled_hdf5.
#define FIRN_COMPILES 0
#include <firn/io/states.hpp>
