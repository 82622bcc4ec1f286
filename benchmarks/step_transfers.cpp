/// \file The two cubes with transfers that take further passes: step/two_cubes_flip/coloured/threads:N and _fmpm. With
/// FLIP there are also a million particles, _flip_1m, and with FIRN_BENCHMARK_FULL eight, _flip_8m.
#include "step.hpp"

namespace {
const bool flip = scenes::add_two_cubes<float, firn::Flip<float>, 3>("two_cubes_flip");
const bool flip_1m =
    scenes::add_two_cubes<float, firn::Flip<float>, 3>("two_cubes_flip_1m", scenes::cubes_of<1'000'000>);
const bool flip_8m = scenes::full() && scenes::add_two_cubes<float, firn::Flip<float>, 3>("two_cubes_flip_8m",
                                                                                          scenes::cubes_of<8'000'000>);
const bool fmpm = scenes::add_two_cubes<float, firn::Fmpm, 3>("two_cubes_fmpm");
}  // namespace
