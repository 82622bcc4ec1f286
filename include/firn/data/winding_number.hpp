/// \file Computes how often a closed triangle mesh winds around a point, in exact integer arithmetic.
///
/// The winding number is a sum over all triangles that a ray from the point along +z crosses: +1 for a triangle that
/// faces up, −1 for one that faces down. Tests of this kind often fail where the ray hits an edge or a vertex, because
/// they count that crossing twice or not at all. The test in this file does not fail there:
///
/// - Positions are rounded once to a lattice. The lattice step is 2⁻⁴⁰ (about 1e-12) of the mesh's size. Every quantity
///   whose sign is needed is then an integer of at most 124 bits, so the sign is exact and the same on every machine.
/// - A point that lies on a face, edge or vertex is treated as if it were moved by (ε, ε², 0) and then by a much
///   larger, yet infinitesimal, step along +z (simulation of simplicity: Edelsbrunner & Mücke 1990, "Simulation of
///   simplicity", ACM TOG 9). So a point on a face that two bodies share lies in exactly one of the bodies. If the face
///   is perpendicular to an axis, the point lies in the body with the larger coordinates along this axis.
#pragma once

#include <firn/data/mesh.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// The winding number of a closed mesh around points.
class WindingNumber {
public:
    /// \param mesh  must pass check_closed()
    /// \throws mesh_error  if the mesh is so small and so far from the origin that its shape is lost to rounding
    explicit WindingNumber(const TriangleMesh& mesh) {
        bounds_ = bounding_box(mesh);
        const auto extent = bounds_.upper - bounds_.lower;
        set_lattice(std::max({extent[0], extent[1], extent[2]}));
        triangles_.reserve(mesh.triangles.size());
        for (const auto& [i, j, k] : mesh.triangles) {
            triangles_.push_back({on_lattice(mesh.vertices[std::size_t(i)]), on_lattice(mesh.vertices[std::size_t(j)]),
                                  on_lattice(mesh.vertices[std::size_t(k)])});
        }
        set_bins();
    }

    /// Returns how often the surface winds around the point x [m]: 0 outside, 1 inside a simple body, n where n bodies
    /// overlap.
    /// \throws parameter_error  if x is not finite
    int operator()(const Vec<double, 3>& x) const {
        for (int k = 0; k < 3; ++k) {
            if (x[k] >= bounds_.lower[k] && x[k] <= bounds_.upper[k]) continue;
            if (!detail::is_finite(x)) {
                throw parameter_error(sentence("A point at ", detail::describe(x),
                                               " is neither inside nor outside; give finite coordinates."));
            }
            return 0;
        }
        const Point q = on_lattice(x);
        const std::int64_t bin = q.x / bin_width_ + bins_ * (q.y / bin_width_);
        int winding = 0;
        for (auto at = bin_begin_[std::size_t(bin)]; at < bin_begin_[std::size_t(bin) + 1]; ++at) {
            winding += crossing(triangles_[binned_[at]], q);
        }
        return winding;
    }

    /// Returns the bounding box of the mesh [m].
    const Bounds<3>& bounds() const { return bounds_; }

    /// Returns the smallest distance [m] that the lattice and the precision of the coordinates tell from 0.
    double resolution() const {
        double reach = 0;
        for (int k = 0; k < 3; ++k) reach = std::max({reach, std::abs(bounds_.lower[k]), std::abs(bounds_.upper[k])});
        return std::max(1 / per_step_, reach * 0x1p-52);
    }

private:
    static constexpr int lattice_bits = 40;
    __extension__ typedef __int128 Wide;

    struct Point {
        std::int64_t x, y, z;
    };
    struct Triangle {
        Point a, b, c;
    };

    /// Returns twice the signed area of the triangle (a, b, q) seen from +z: positive if its corners are
    /// counter-clockwise.
    static Wide area(const Point& a, const Point& b, const Point& q) {
        return Wide(a.x - q.x) * (b.y - q.y) - Wide(a.y - q.y) * (b.x - q.x);
    }

    /// Returns what the edge from a to b adds to the winding number around q in the xy plane: +1 or −1 if the edge
    /// crosses the ray from q along +x, else 0. The reversed edge adds exactly the opposite, so the results for the two
    /// triangles at an edge always agree.
    /// \param twice_area  area(a, b, q)
    static int edge_crossing(const Point& a, const Point& b, const Point& q, Wide twice_area) {
        const bool a_above = a.y > q.y, b_above = b.y > q.y;
        if (a_above == b_above) return 0;
        if (b_above) return twice_area > 0 ? 1 : 0;
        return twice_area < 0 ? -1 : 0;
    }

    /// Returns what the triangle adds to the winding number of q: +1 if the triangle lies above q and faces up, −1 if
    /// the triangle lies above q and faces down, else 0.
    static int crossing(const Triangle& t, const Point& q) {
        const auto [a, b, c] = t;
        if (a.z <= q.z && b.z <= q.z && c.z <= q.z) return 0;
        const Wide area_c = area(a, b, q), area_a = area(b, c, q), area_b = area(c, a, q);
        const int around =
            edge_crossing(a, b, q, area_c) + edge_crossing(b, c, q, area_a) + edge_crossing(c, a, q, area_b);
        if (around == 0) return 0;
        // The height of the triangle above q, multiplied by twice the triangle's signed area, from barycentric
        // coordinates.
        const Wide height = area_a * (a.z - q.z) + area_b * (b.z - q.z) + area_c * (c.z - q.z);
        return (around > 0 ? height > 0 : height < 0) ? around : 0;
    }

    void set_lattice(double longest) {
        int size_exponent = 0, reach_exponent = 0;
        std::frexp(longest, &size_exponent);
        double reach = 0;
        for (int k = 0; k < 3; ++k) reach = std::max({reach, std::abs(bounds_.lower[k]), std::abs(bounds_.upper[k])});
        std::frexp(reach, &reach_exponent);
        const int step_exponent = size_exponent - lattice_bits;
        if (reach_exponent - step_exponent > 62 || std::abs(step_exponent) > 900) {
            throw mesh_error(sentence("The mesh is ", longest, " m large and reaches to ", reach,
                                      " m from the origin; its shape is lost to rounding. Give it near the origin and "
                                      "in metres, and move the points instead."));
        }
        per_step_ = std::ldexp(1.0, -step_exponent);
        origin_ = {0, 0, 0};
        origin_ = on_lattice(bounds_.lower);
    }

    Point on_lattice(const Vec<double, 3>& x) const {
        return {std::llround(x[0] * per_step_) - origin_.x, std::llround(x[1] * per_step_) - origin_.y,
                std::llround(x[2] * per_step_) - origin_.z};
    }

    struct BinRange {
        std::int64_t i0, i1, j0, j1;
        std::size_t count() const { return std::size_t((i1 - i0 + 1) * (j1 - j0 + 1)); }
    };
    /// Returns the bins that the triangle's bounding rectangle in the xy plane overlaps.
    BinRange bins_of(const Triangle& t) const {
        const auto [x0, x1] = std::minmax({t.a.x, t.b.x, t.c.x});
        const auto [y0, y1] = std::minmax({t.a.y, t.b.y, t.c.y});
        return {x0 / bin_width_, x1 / bin_width_, y0 / bin_width_, y1 / bin_width_};
    }
    template <class F>
    void for_bins_of(const Triangle& t, const F& f) const {
        const auto [i0, i1, j0, j1] = bins_of(t);
        for (std::int64_t j = j0; j <= j1; ++j) {
            for (std::int64_t i = i0; i <= i1; ++i) f(std::size_t(i + bins_ * j));
        }
    }

    /// Sorts the triangles into square bins of the xy plane. There are about as many bins as triangles.
    void set_bins() {
        const Point upper = on_lattice(bounds_.upper);
        const std::int64_t widest = std::max(upper.x, upper.y);
        bins_ = std::clamp<std::int64_t>(std::llround(std::sqrt(double(triangles_.size()))), 1, 2048);
        // A long, thin triangle lies in many bins. If there are many such triangles, bins are made larger, so that
        // memory stays proportional to the number of triangles.
        for (;; bins_ = (bins_ + 1) / 2) {
            bin_width_ = widest / bins_ + 1;
            std::size_t entries = 0;
            for (const auto& t : triangles_) entries += bins_of(t).count();
            if (bins_ == 1 || entries <= 16 * triangles_.size()) break;
        }
        bin_begin_.assign(std::size_t(bins_ * bins_) + 1, 0);
        for (const auto& t : triangles_) for_bins_of(t, [&](std::size_t bin) { ++bin_begin_[bin + 1]; });
        for (std::size_t i = 1; i < bin_begin_.size(); ++i) bin_begin_[i] += bin_begin_[i - 1];
        binned_.resize(bin_begin_.back());
        auto next = bin_begin_;
        for (std::size_t t = 0; t < triangles_.size(); ++t) {
            for_bins_of(triangles_[t], [&](std::size_t bin) { binned_[next[bin]++] = std::uint32_t(t); });
        }
    }

    Bounds<3> bounds_{};
    double per_step_ = 1;  // lattice steps per metre; a power of two, so that products are exact
    Point origin_{};
    std::int64_t bins_ = 1, bin_width_ = 1;
    std::vector<Triangle> triangles_;
    std::vector<std::size_t> bin_begin_;  // for each bin, the index in binned_ of its first triangle
    std::vector<std::uint32_t> binned_;   // indices into triangles_, bin after bin
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
