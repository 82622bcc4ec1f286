/// \file Two squares of as many particles as the two cubes, four a cell: step/two_cubes_2d/coloured/threads:N.
#include "step.hpp"

namespace {
const bool registered = scenes::add_two_cubes<float, firn::Apic, 2>("two_cubes_2d");
}  // namespace
