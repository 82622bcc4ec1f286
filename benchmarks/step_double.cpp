/// \file The two cubes in double: step/two_cubes_double/coloured/threads:N.
#include "step.hpp"

namespace {
const bool registered = scenes::add_two_cubes<double, firn::Apic, 3>("two_cubes_double");
}  // namespace
