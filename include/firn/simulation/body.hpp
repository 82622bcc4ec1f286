/// \file Which particles were added together.
#pragma once

#include <cstdint>
#include <limits>

namespace firn {

/// The ids [first, first + count) that one call of Simulation::add gave out among the particles of its material.
struct Body {
    std::uint32_t first = 0, count = 0;
    double end = std::numeric_limits<double>::infinity();  ///< when its particles are taken out [s]

    bool holds(std::uint32_t id) const { return id - first < count; }  // what lies below wraps round
};

}  // namespace firn
