/// \file Stops the compiler with a sentence if HDF5's headers are not found.
#pragma once

#if !__has_include(<hdf5.h>)
#error "firn's states need HDF5: in CMake link firn::hdf5, not firn::firn; without, $(pkg-config --cflags --libs hdf5)."
#include <firn::hdf5 is not linked>
#endif
