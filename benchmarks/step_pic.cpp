/// \file The two cubes with PIC: step/two_cubes_pic/coloured/threads:N.
#include "step.hpp"

namespace {
const bool registered = [] {
    for (const int threads : {1, 2})
        scenes::add_step<float, firn::Pic>(
            "two_cubes_pic", +[] { return scenes::two_cubes<3>(); }, firn::Coloured{threads}, threads);
    return true;
}();
}  // namespace
