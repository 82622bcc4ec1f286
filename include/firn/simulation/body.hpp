/// \file A body: the particles that were added together.
#pragma once

#include <cstdint>
#include <limits>

namespace firn {

/// The particles that one call of Simulation::add has added: ids [first, first + count) of their material.
struct Body {
    std::uint32_t first = 0,  ///< Id of the first particle.
        count = 0;            ///< Number of ids; some of their particles may have been taken out.
    double end = std::numeric_limits<double>::infinity();  ///< When its particles are taken out [s].

    /// Whether the id is one of the body's.
    bool holds(std::uint32_t id) const { return id - first < count; }  // an id below `first` wraps round
};

}  // namespace firn
