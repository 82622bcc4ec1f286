/// \file The two cubes in double: step/two_cubes_double/coloured/threads:N.
#include "step.hpp"

namespace {
const bool registered = [] {
    for (const int threads : {1, 2})
        scenes::add_step<double, firn::Apic>(
            "two_cubes_double", +[] { return scenes::two_cubes<3>(); }, firn::Coloured{threads}, threads);
    return true;
}();
}  // namespace
