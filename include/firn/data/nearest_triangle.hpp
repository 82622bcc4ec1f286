/// \file Computes the distance from a point to the nearest triangle of a mesh, with a tree of bounding boxes.
#pragma once

#include <firn/core/lanes.hpp>
#include <firn/data/mesh.hpp>

#include <algorithm>
#include <cmath>

namespace firn::inline FIRN_BUILD {

namespace detail {

using Corners = std::array<Vec<double, 3>, 3>;

template <scalar S>
FIRN_INLINE S squared_distance_to_segment(const Vec<S, 3>& x, const Vec<double, 3>& a, const Vec<double, 3>& b) {
    const auto along = b - a;
    const double length2 = dot(along, along), per_length2 = length2 > 0 ? 1 / length2 : 0;
    const Vec<S, 3> from_a = x - cast<S>(a);
    const S t = min(max(dot(from_a, cast<S>(along)) * S(per_length2), S(0)), S(1));
    const Vec<S, 3> apart = from_a - cast<S>(along) * t;
    return dot(apart, apart);
}

/// Returns the squared distance [m²] from the point x to a triangle: to the triangle's plane if x lies directly above
/// or below the triangle, else to the triangle's nearest edge. A triangle with zero area is treated as its three edges.
template <scalar S>
FIRN_INLINE S squared_distance_to_triangle(const Vec<S, 3>& x, const Corners& corner) {
    const auto [a, b, c] = corner;
    const auto normal = cross(b - a, c - a);
    const double area2 = dot(normal, normal);
    const S to_edges = min(min(squared_distance_to_segment(x, a, b), squared_distance_to_segment(x, b, c)),
                           squared_distance_to_segment(x, c, a));
    if (!(area2 > 0)) return to_edges;
    const auto left_of = [&](const auto& from, const auto& to)
                             FIRN_LAMBDA { return dot(x - cast<S>(from), cast<S>(cross(normal, to - from))); };
    const S height = dot(x - cast<S>(a), cast<S>(normal));
    const auto is_above = min(min(left_of(a, b), left_of(b, c)), left_of(c, a)) >= S(0);
    return select(is_above, height * height * S(1 / area2), to_edges);
}

/// Computes distances from points to the nearest triangle of a mesh.
class NearestTriangle {
public:
    /// Builds the tree of bounding boxes of the triangles of a mesh.
    /// \throws mesh_error  if the mesh does not pass check_mesh()
    explicit NearestTriangle(const TriangleMesh& mesh) {
        check_mesh(mesh);
        for (const auto& [i, j, k] : mesh.triangles)
            triangles_.push_back(
                {mesh.vertices[std::size_t(i)], mesh.vertices[std::size_t(j)], mesh.vertices[std::size_t(k)]});
        build(0, triangles_.size());
    }

    /// Returns the distance [m] from x [m] to the nearest triangle, or `bound` [m] if that distance is larger.
    double distance(const Vec<double, 3>& x, double bound = std::numeric_limits<double>::infinity()) const {
        double nearest = bound * bound;
        search(0, x, nearest);
        return nearest < bound * bound ? std::sqrt(nearest) : bound;
    }
    /// Returns the distances [m] from several points, which lie in the lanes of x [m], to their nearest triangles. If
    /// the points lie near each other, this takes little longer than for one of them.
    template <scalar S>
    S distances(const Vec<S, 3>& x) const {
        S nearest(std::numeric_limits<double>::infinity());
        search(0, x, nearest);
        return sqrt(nearest);
    }

private:
    static constexpr std::size_t most_in_a_leaf = 4;
    /// A bounding box of the triangles with indices first ≤ t < last. In the list `boxes_`, the box that follows this
    /// box bounds the first half of these triangles, and the box with index `second` bounds the second half. If
    /// `second` is 0, this box is a leaf and has no smaller boxes.
    struct Box {
        Bounds<3> bounds;
        std::size_t first, last, second;
    };

    void build(std::size_t first, std::size_t last) {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        Bounds<3> bounds{Vec<double, 3>::filled(infinity), Vec<double, 3>::filled(-infinity)};
        for (std::size_t t = first; t < last; ++t)
            for (const auto& corner : triangles_[t])
                for (int a = 0; a < 3; ++a) {
                    bounds.lower[a] = std::min(bounds.lower[a], corner[a]);
                    bounds.upper[a] = std::max(bounds.upper[a], corner[a]);
                }
        const std::size_t self = boxes_.size();
        boxes_.push_back({bounds, first, last, 0});
        if (last - first <= most_in_a_leaf) return;
        const auto extent = bounds.upper - bounds.lower;
        const int axis = int(std::max_element(extent.v, extent.v + 3) - extent.v);
        const auto along = [&](const detail::Corners& t) { return t[0][axis] + t[1][axis] + t[2][axis]; };
        const std::size_t middle = (first + last) / 2;
        const auto at = [&](std::size_t t) { return triangles_.begin() + std::ptrdiff_t(t); };
        std::nth_element(at(first), at(middle), at(last),
                         [&](const auto& a, const auto& b) { return along(a) < along(b); });
        build(first, middle);
        boxes_[self].second = boxes_.size();
        build(middle, last);
    }

    template <scalar S>
    static S squared_distance_to_box(const Vec<S, 3>& x, const Bounds<3>& box) {
        S sum(0);
        for (int a = 0; a < 3; ++a) {
            const S over = max(max(S(box.lower[a]) - x[a], x[a] - S(box.upper[a])), S(0));
            sum = sum + over * over;
        }
        return sum;
    }

    template <scalar S>
    void search(std::size_t of, const Vec<S, 3>& x, S& nearest) const {
        const Box& box = boxes_[of];
        if (box.second == 0) {
            for (std::size_t t = box.first; t < box.last; ++t)
                nearest = min(nearest, detail::squared_distance_to_triangle(x, triangles_[t]));
            return;
        }
        std::size_t near = of + 1, far = box.second;
        S to_near = squared_distance_to_box(x, boxes_[near].bounds),
          to_far = squared_distance_to_box(x, boxes_[far].bounds);
        if (lane_value(to_far, 0) < lane_value(to_near, 0)) {
            std::swap(near, far);
            std::swap(to_near, to_far);
        }
        if (any(to_near < nearest)) search(near, x, nearest);
        if (any(to_far < nearest)) search(far, x, nearest);
    }

    std::vector<detail::Corners> triangles_;
    std::vector<Box> boxes_;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
