/// \file The two cubes with the rows of nodes that every target has, compiled for this one:
/// step/two_cubes_portable/coloured/threads:N. All of firn has another name here, so that one program can hold both.
#define FIRN_PORTABLE_ROWS
#define firn firn_with_portable_rows
#define scenes scenes_with_portable_rows
#include "step.hpp"

namespace {

const bool registered = [] {
    for (const int threads : {1, 2})
        scenes::add_step<float, firn::Apic>("two_cubes_portable", scenes::all_of_two_cubes, firn::Coloured{threads},
                                            threads);
    return true;
}();

}  // namespace
