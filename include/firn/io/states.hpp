/// \file Includes all headers that are needed to write states to HDF5 files, to read states from these files, and to
/// continue a run from a state.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/io/background_series.hpp>
#include <firn/io/compiled.hpp>
#include <firn/io/interruption.hpp>
#include <firn/io/needs_hdf5.hpp>
#include <firn/io/restart.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/state_series.hpp>
#include <firn/io/state_writer.hpp>
#include <firn/io/stress_invariants.hpp>
