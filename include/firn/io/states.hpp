/// \file Includes all headers for states in HDF5 files: writing a series, reading a state, and going on from it.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/io/background_series.hpp>
#include <firn/io/compiled.hpp>
#include <firn/io/interruption.hpp>
#include <firn/io/restart.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/state_series.hpp>
#include <firn/io/state_writer.hpp>
