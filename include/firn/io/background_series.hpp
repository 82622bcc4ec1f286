/// \file Writes a series of states on a second thread while the simulation runs.
#pragma once

#include <firn/io/background.hpp>
#include <firn/io/state_series.hpp>
