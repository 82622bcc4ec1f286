/// \file The two cubes with PIC: step/two_cubes_pic/coloured/threads:N.
#include "step.hpp"

namespace {
const bool registered = scenes::add_two_cubes<float, firn::Pic, 3>("two_cubes_pic");
}  // namespace
