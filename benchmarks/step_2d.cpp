/// \file Two squares of as many particles as the two cubes, four a cell: step/two_cubes_2d/coloured/threads:N.
#include "step.hpp"

namespace {
const bool registered = [] {
    for (const int threads : {1, 2})
        scenes::add_step<float, firn::Apic>(
            "two_cubes_2d", +[] { return scenes::two_cubes<2>(); }, firn::Coloured{threads}, threads);
    return true;
}();
}  // namespace
