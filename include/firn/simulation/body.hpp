/// \file A body: the particles that were added in one call.
#pragma once

#include <firn/core/build.hpp>

#include <cstdint>
#include <limits>

namespace firn::inline FIRN_BUILD {

/// A body: the particles that one call of Simulation::add has added. The ids of these particles are first, first + 1,
/// …, first + count − 1. Ids are counted from 0 for each material.
struct Body {
    std::uint32_t first = 0,  ///< Id of the first particle.
        count = 0;            ///< Number of ids. Some of the particles with these ids may have been removed.
    double end = std::numeric_limits<double>::infinity();  ///< Time at which the body's particles are removed [s].
    int contact_group = 0;  ///< The contact group of the body's particles. \see SetAccess::set_contact_group

    /// Returns whether `id` is the id of a particle of this body.
    bool holds(std::uint32_t id) const { return id - first < count; }  // if id < first, the difference is very large
};

}  // namespace firn::inline FIRN_BUILD
