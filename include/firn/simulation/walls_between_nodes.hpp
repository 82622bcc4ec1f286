/// \file Says which walls stand between planes of nodes, and which cell size would fit them.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/core/error.hpp>
#include <firn/data/domain.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A face of walls.
struct WallFace {
    int axis;
    double position,  ///< [m]
        cells;        ///< its distance from the domain's lower corner [cells]
    /// Returns how far the face is from the nearest plane of nodes [cells].
    double from_nodes() const { return std::abs(cells - std::round(cells)); }
};

/// Adds the faces of a boundary's walls that act on the nearest plane of nodes.
template <class Boundary, int D>
void add_wall_faces(const Boundary& boundary, const Domain<D>& domain, std::vector<WallFace>& faces) {
    for_single_parts(boundary, [&](const auto& part, bool by_gap) {
        if constexpr (requires { part.at_lower[D - 1].contact, part.nodes_behind; }) {
            if (by_gap || part.nodes_behind != NodesBehind::held) return;
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                for (const bool upper : {false, true}) {
                    if ((upper ? part.at_upper : part.at_lower)[a].contact == Contact::none) continue;
                    const int axis = int(a);
                    const double position = double((upper ? part.upper : part.lower)[axis]);
                    faces.push_back({axis, position, (position - domain.lower[axis]) / domain.cell_size});
                }
        }
    });
}

/// The distance from a plane of nodes up to which a wall counts as lying on it [cells].
inline constexpr double near_nodes = 0.01;

/// Returns the cell size nearest to `cell_size` that puts all faces on planes of nodes [m]; 0 if there is none between
/// half and twice of it.
[[gnu::cold]] inline double fitting_cell_size(const std::vector<WallFace>& faces, double cell_size) {
    double farthest = 0, best = 0;
    for (const WallFace& face : faces) farthest = std::max(farthest, std::abs(face.cells));
    for (double cells = std::ceil(farthest / 2); cells >= 2 && cells <= 2 * farthest; ++cells) {
        const double scale = cells / farthest;  // how many new cells a cell is
        bool fits = true;
        for (const WallFace& face : faces)
            fits = fits && std::abs(face.cells * scale - std::round(face.cells * scale)) <= 1e-6 * cells;
        const double size = cell_size / scale;
        if (fits && (best == 0 || std::abs(std::log(size / cell_size)) < std::abs(std::log(best / cell_size))))
            best = size;
    }
    return best;
}

}  // namespace detail

/// Returns a sentence about walls that stand between planes of nodes, and the nearest cell size that fits them all; an
/// empty string if all stand on planes of nodes, to a hundredth of a cell.
///
/// Such a wall acts on the nearest plane of nodes, up to half a cell from where it was put. A Simulation gives this
/// warning itself; a program for a GPU does not, so its host may ask for it.
template <class Boundary, int D>
[[gnu::cold]] std::string walls_between_nodes(const Boundary& boundary, const Domain<D>& domain) {
    std::vector<detail::WallFace> faces;
    detail::add_wall_faces(boundary, domain, faces);
    const detail::WallFace* worst = nullptr;
    for (const detail::WallFace& face : faces)
        if (!worst || face.from_nodes() > worst->from_nodes()) worst = &face;
    if (!worst || !(worst->from_nodes() > detail::near_nodes)) return {};
    const double fits = detail::fitting_cell_size(faces, domain.cell_size);
    const double nodes = domain.lower[worst->axis] + std::round(worst->cells) * domain.cell_size;
    return sentence(
        "the wall at ", worst->position, " m along axis ", worst->axis, " stands ", worst->from_nodes(),
        " cells from the nearest plane of nodes, at ", nodes, " m, and acts there. ",
        fits > 0 ? sentence("The nearest cell size that fits all walls is ", fits, " m (now ", domain.cell_size,
                            " m). Or move the wall to the nodes")
                 : sentence("No cell size near ", domain.cell_size, " m fits all walls: move the wall to the nodes"),
        ", or give firn::GapContact{walls}, whose walls act where they stand.");
}

}  // namespace firn::inline FIRN_BUILD
