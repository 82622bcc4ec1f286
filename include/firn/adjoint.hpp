/// \file Umbrella header: derivatives of whole runs.
#pragma once

#include <firn/adjoint/adjoint.hpp>
#include <firn/adjoint/load.hpp>
