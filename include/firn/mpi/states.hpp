/// \file Includes all headers that are needed to write the states of a simulation on many ranks to HDF5 files, to read
/// them, and to continue a run from a state.
#pragma once

#include <firn/io/states.hpp>
#include <firn/mpi/restart.hpp>
#include <firn/mpi/state_reader.hpp>
#include <firn/mpi/state_series.hpp>
#include <firn/mpi/state_writer.hpp>
