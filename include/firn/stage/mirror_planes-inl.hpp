/// \file Bodies of mirror_planes.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/stage/mirror_planes.hpp>

namespace firn::inline FIRN_BUILD::detail {

[[gnu::cold]] FIRN_BODY void add_mirror(std::vector<MirrorPlane>& planes, const MirrorPlane& plane, double on_grid,
                                        double tolerance, double position, double cell_size) {
    if (!(std::abs(on_grid - plane.node) <= tolerance))
        throw parameter_error(sentence(
            "The wall at ", position, " m along axis ", plane.axis, " lies ", on_grid,
            " cells above the lower end of the domain, on no plane of nodes. A mirrored wall must lie on one: move it, "
            "choose cells that divide the domain (now ",
            cell_size, " m), or set nodes_behind to NodesBehind::held."));
    for (const MirrorPlane& other : planes)
        if (other.part == plane.part && other.axis == plane.axis && std::abs(other.node - plane.node) < 3)
            throw parameter_error(sentence("Two mirrored walls across axis ", plane.axis, " are ",
                                           std::abs(other.node - plane.node),
                                           " cells apart; at least 3 are needed. Take smaller cells, or set "
                                           "nodes_behind to NodesBehind::held."));
    planes.push_back(plane);
}

}  // namespace firn::inline FIRN_BUILD::detail
