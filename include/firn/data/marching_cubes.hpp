/// \file The cases of marching cubes (Lorensen, Cline 1987): which triangles separate the corners of a cell that are
/// inside a surface from those that are outside.
///
/// The table is computed by the compiler, from the geometry of a cube. On each face of the cell, lines run around every
/// run of corners that are inside; so two corners at the ends of a diagonal are separated. This depends on the face
/// alone, and the two cells of a face draw the same lines on it, in opposite directions. The lines of all faces of a
/// cell form closed loops, which are filled with triangles. So the surface of all cells is closed and consistently
/// oriented.
///
/// No edge of the surface belongs to more than two triangles. An edge on a face belongs to one loop of each of the
/// face's cells. Every other edge joins two points on edges of the cell that are on no face together, which no other
/// cell has: the compiler finds such triangles for every loop.
#pragma once

#include <firn/core/build.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace firn::inline FIRN_BUILD::detail {

/// The triangles of a cell.
///
/// Corner n of the cell lies at (n & 1, n >> 1 & 1, n >> 2). Edge 4 a + m is along axis a, from the corner with bits m
/// in the other two axes, a + 1 and a + 2 (modulo 3).
struct CellCase {
    int triangles = 0;                      ///< number of triangles
    std::array<std::int8_t, 15> corners{};  ///< the three edges on which the corners of each triangle lie
};

/// Returns the corner of a cell from which an edge begins.
constexpr int first_corner(int edge) {
    const int axis = edge / 4, b = (axis + 1) % 3, c = (axis + 2) % 3;
    return (edge & 1) << b | (edge >> 1 & 1) << c;
}

/// Returns the edge that joins two corners of a cell.
constexpr int edge_between(int corner, int other) {
    const int low = corner < other ? corner : other, bit = corner ^ other;
    const int axis = bit == 1 ? 0 : bit == 2 ? 1 : 2;
    return 4 * axis + (low >> (axis + 1) % 3 & 1) + 2 * (low >> (axis + 2) % 3 & 1);
}

/// Returns whether two edges of a cell lie on a face together.
constexpr bool share_face(int edge, int other) {
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            const auto on_face = [&](int e) { return e / 4 != axis && (first_corner(e) >> axis & 1) == side; };
            if (on_face(edge) && on_face(other)) return true;
        }
    return false;
}

/// Fills a loop with triangles that all have the loop's edge number `apex`, if no new edge of them lies on a face.
constexpr bool fill_as_fan(CellCase& cell, const std::int8_t* loop, int length, int apex) {
    for (int k = 2; k + 1 < length; ++k)
        if (share_face(loop[apex], loop[(apex + k) % length])) return false;
    for (int k = 1; k + 1 < length; ++k) {
        const std::size_t at = 3 * std::size_t(cell.triangles++);
        cell.corners[at] = loop[apex];
        cell.corners[at + 1] = loop[(apex + k) % length];
        cell.corners[at + 2] = loop[(apex + k + 1) % length];
    }
    return true;
}

/// Returns the triangles of a cell.
/// \param inside  bit n says whether corner n is inside
constexpr CellCase cell_case(int inside) {
    std::array<std::int8_t, 12> next{};  // the edge to which a loop goes on, or −1
    next.fill(-1);
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            // The corners of the face, counter-clockwise seen from outside of the cell.
            const int b = 1 << (axis + (side ? 1 : 2)) % 3, c = 1 << (axis + (side ? 2 : 1)) % 3, at = side << axis;
            const std::array<int, 4> corner{at, at | b, at | b | c, at | c};
            const auto is_in = [&](int k) { return (inside >> corner[std::size_t(k) % 4] & 1) != 0; };
            const auto edge = [&](int k) {
                return edge_between(corner[std::size_t(k) % 4], corner[std::size_t(k + 1) % 4]);
            };
            for (int k = 0; k < 4; ++k) {
                if (is_in(k) || !is_in(k + 1)) continue;  // edge k leads into a run of corners that are inside
                int last = k + 1;
                while (is_in(last + 1)) ++last;
                next[std::size_t(edge(k))] = std::int8_t(edge(last));
            }
        }
    CellCase cell;
    for (int start = 0; start < 12; ++start) {
        std::array<std::int8_t, 12> loop{};
        int length = 0;
        for (int e = start; next[std::size_t(e)] >= 0; ++length) {
            loop[std::size_t(length)] = std::int8_t(e);
            e = std::exchange(next[std::size_t(e)], std::int8_t(-1));
        }
        bool filled = length == 0;
        for (int apex = 0; apex < length && !filled; ++apex) filled = fill_as_fan(cell, loop.data(), length, apex);
        if (!filled) throw "a loop has no triangles";  // then the table below does not compile
    }
    return cell;
}

/// The triangles of all 256 cases, by the bits of the corners that are inside.
inline constexpr std::array<CellCase, 256> cell_cases = [] {
    std::array<CellCase, 256> all{};
    for (int inside = 0; inside < 256; ++inside) all[std::size_t(inside)] = cell_case(inside);
    return all;
}();

}  // namespace firn::inline FIRN_BUILD::detail
