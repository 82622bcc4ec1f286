/// \file The two cubes with transfers that take further passes: step/two_cubes_flip/coloured/threads:N and _fmpm.
#include "step.hpp"

namespace {
const bool flip = scenes::add_two_cubes<float, firn::Flip<float>, 3>("two_cubes_flip");
const bool fmpm = scenes::add_two_cubes<float, firn::Fmpm, 3>("two_cubes_fmpm");
}  // namespace
