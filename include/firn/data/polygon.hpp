/// \file Cuts a polygon in space into triangles, in the polygon's own plane.
///
/// The polygon may be concave. A line sweeps over its corners and leaves behind, in each part of the inside that the
/// line meets, the chain of corners whose triangles are still open; a chain bends to the inside at each of its corners
/// (Hertel & Mehlhorn 1983, "Fast triangulation of simple polygons", FCT). The edges that the line meets are sorted,
/// and neighbours among them are tested for crossings (Shamos & Hoey 1976, "Geometric intersection problems", FOCS). So
/// the time for n corners is proportional to n log n.
///
/// The corners are projected along the polygon's normal and rounded to a lattice of 2⁻⁵⁹ of the polygon's size, which
/// is finer than `double` is. On this lattice all signs are exact. So neither the unit of length nor the place of the
/// polygon matters, and every machine cuts alike.
#pragma once

#include <firn/core/tensor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <set>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// The cross product, with std::fma: its bits do not depend on which operations a compiler fuses.
inline Vec<double, 3> fused_cross(const Vec<double, 3>& a, const Vec<double, 3>& b) {
    return {std::fma(a[1], b[2], -(a[2] * b[1])), std::fma(a[2], b[0], -(a[0] * b[2])),
            std::fma(a[0], b[1], -(a[1] * b[0]))};
}
/// The scalar product, with std::fma as well.
inline double fused_dot(const Vec<double, 3>& a, const Vec<double, 3>& b) {
    return std::fma(a[2], b[2], std::fma(a[1], b[1], a[0] * b[0]));
}

/// Cuts polygons into triangles, one after the other; it keeps its memory.
class PolygonCutter {
public:
    enum class Outcome {
        cut,
        no_area,      ///< the corners lie on a line or on a point, or parts of opposite orientation cancel
        meets_itself  ///< seen along the normal, two edges cross, touch or overlap: see meeting()
    };

    /// Cuts a polygon of n ≥ 3 corners [m] into n − 2 triangles with the orientation of the polygon.
    ///
    /// A triangle is taken as it is. A quadrangle is cut along its shorter diagonal if both lie inside. Neighbouring
    /// corners nearer than 2⁻⁴⁰ (9e-13) of the polygon's size count as one: a triangle without area joins them.
    Outcome cut(std::span<const Vec<double, 3>> corners) {
        triangles_.clear();
        meeting_ = {};
        if (corners.size() == 3) {
            triangles_.push_back({0, 1, 2});
            return Outcome::cut;
        }
        if (!place(corners)) return Outcome::no_area;
        if (corners.size() == 4) return cut_quadrangle();
        if (!project() || !join_neighbours()) return Outcome::no_area;
        if (ring_.size() > 3) return sweep() ? Outcome::cut : Outcome::meets_itself;
        emit(0, 1, 2);
        return Outcome::cut;
    }

    /// The triangles that the last call of cut() has made, as indices of corners, counted from 0.
    const std::vector<std::array<std::uint32_t, 3>>& triangles() const { return triangles_; }

    /// After Outcome::meets_itself, two edges that meet, as the corners, counted from 0, at both ends of one and then
    /// of the other; all are 0 if no pair was found.
    std::array<std::uint32_t, 4> meeting() const { return meeting_; }

private:
    static constexpr int lattice_bits = 59;
    static constexpr double least_area = 0x1p-43;  // twice the area by the squared size: below, it may be rounding
    static constexpr double joined = 0x1p-40;
    static constexpr std::uint32_t none = ~std::uint32_t(0);
    __extension__ typedef __int128 Wide;

    struct Point {
        std::int64_t x, y;
    };
    struct Node {
        std::uint32_t corner, before, after;  // indices into ring_, into nodes_ and into nodes_
    };
    /// The open corners in one part of the inside, from its lower edge to its upper edge, as indices into nodes_.
    struct Chain {
        std::uint32_t front, back, last;  // `last` is the corner that the line has met last
    };
    struct Below {
        PolygonCutter* of;
        bool operator()(std::uint32_t a, std::uint32_t b) const { return of->is_below(a, b); }
    };
    using Edges = std::set<std::uint32_t, Below>;

    /// Moves the polygon to the origin and scales it to size 1, by powers of two. Returns false if it has no size.
    bool place(std::span<const Vec<double, 3>> corners) {
        const auto largest = [](std::span<const Vec<double, 3>> points) {
            double most = 0;
            for (const auto& x : points)
                for (const double c : x.v) most = std::max(most, std::abs(c));
            return most;
        };
        const auto to_one = [](double size) {
            int exponent = 0;
            std::frexp(size, &exponent);
            return std::ldexp(1.0, -std::clamp(exponent, -1000, 1000));
        };
        const double factor = to_one(largest(corners));
        placed_.resize(corners.size());
        for (std::size_t i = 0; i < corners.size(); ++i) placed_[i] = corners[i] * factor - corners[0] * factor;
        const double size = largest(placed_), to_size = to_one(size);
        for (auto& x : placed_) x = x * to_size;
        return size > 0;
    }

    Outcome cut_quadrangle() {
        const auto& x = placed_;
        const auto normal = fused_cross(x[2] - x[0], x[3] - x[1]);  // its length is twice the area
        const double area = fused_dot(normal, normal);
        if (!(area > least_area * least_area)) return Outcome::no_area;
        const auto part = [&](std::size_t i, std::size_t j, std::size_t k) {
            return fused_dot(normal, fused_cross(x[j] - x[i], x[k] - x[i]));
        };
        const double by_02 = std::min(part(0, 1, 2), part(0, 2, 3)), by_13 = std::min(part(0, 1, 3), part(1, 2, 3));
        bool first = by_02 > by_13;
        if (std::min(by_02, by_13) > joined * area)
            first = fused_dot(x[2] - x[0], x[2] - x[0]) < fused_dot(x[3] - x[1], x[3] - x[1]);
        if (!(std::max(by_02, by_13) >= -joined * area)) {
            if (part(0, 1, 2) * part(0, 1, 3) < 0 && part(2, 3, 0) * part(2, 3, 1) < 0) meeting_ = {0, 1, 2, 3};
            if (part(1, 2, 3) * part(1, 2, 0) < 0 && part(3, 0, 1) * part(3, 0, 2) < 0) meeting_ = {1, 2, 3, 0};
            return Outcome::meets_itself;
        }
        if (first)
            triangles_ = {{0, 1, 2}, {0, 2, 3}};
        else
            triangles_ = {{0, 1, 3}, {1, 2, 3}};
        return Outcome::cut;
    }

    /// Projects the corners along the normal, onto the lattice. Returns false if the polygon has no area.
    bool project() {
        Vec<double, 3> normal{};  // twice the area (Newell)
        for (std::size_t i = 1; i + 1 < placed_.size(); ++i) normal = normal + fused_cross(placed_[i], placed_[i + 1]);
        const double length = std::sqrt(fused_dot(normal, normal));
        if (!(length > least_area)) return false;
        int least = 0;
        for (int k = 0; k < 3; ++k) {
            normal[k] /= length;
            if (std::abs(normal[k]) < std::abs(normal[least])) least = k;
        }
        Vec<double, 3> axis{};
        axis[least] = 1;
        auto u = fused_cross(axis, normal);
        const double u_length = std::sqrt(fused_dot(u, u));
        for (int k = 0; k < 3; ++k) u[k] /= u_length;
        const auto v = fused_cross(normal, u);
        constexpr auto steps = double(std::int64_t(1) << lattice_bits);
        points_.clear();
        for (const auto& x : placed_)
            points_.push_back({std::llround(fused_dot(u, x) * steps), std::llround(fused_dot(v, x) * steps)});
        return true;
    }

    /// Makes the ring of the corners that are left once neighbours at one place are joined. Returns false if it has
    /// fewer than three.
    bool join_neighbours() {
        constexpr auto near = std::int64_t(joined * double(std::int64_t(1) << lattice_bits));
        const auto at_one_place = [&](std::uint32_t a, std::uint32_t b) {
            return std::abs(points_[a].x - points_[b].x) <= near && std::abs(points_[a].y - points_[b].y) <= near;
        };
        const auto count = std::uint32_t(points_.size());
        ring_ = {0};
        for (std::uint32_t i = 1; i < count; ++i) {
            if (at_one_place(ring_.back(), i))
                triangles_.push_back({ring_.back(), i, (i + 1) % count});
            else
                ring_.push_back(i);
        }
        while (ring_.size() > 2 && at_one_place(ring_.back(), 0)) {
            triangles_.push_back({ring_[ring_.size() - 2], ring_.back(), 0});
            ring_.pop_back();
        }
        return ring_.size() > 2;
    }

    // From here on, a corner is an index into ring_, and an edge is the index of its first corner.

    const Point& at(std::uint32_t corner) const { return points_[ring_[corner]]; }
    std::uint32_t next(std::uint32_t corner) const { return corner + 1 == ring_.size() ? 0 : corner + 1; }
    std::uint32_t previous(std::uint32_t corner) const {
        return corner == 0 ? std::uint32_t(ring_.size()) - 1 : corner - 1;
    }

    /// Whether the line meets a before b. The line is upright and a little turned, so that it meets the lower of two
    /// corners with the same x first.
    bool is_before(std::uint32_t a, std::uint32_t b) const {
        return at(a).x != at(b).x ? at(a).x < at(b).x : at(a).y < at(b).y;
    }
    /// Whether the edge goes to the right, so that the inside lies above it.
    bool is_lower(std::uint32_t edge) const { return is_before(edge, next(edge)); }
    std::uint32_t left_end(std::uint32_t edge) const { return is_lower(edge) ? edge : next(edge); }
    std::uint32_t right_end(std::uint32_t edge) const { return is_lower(edge) ? next(edge) : edge; }

    /// Returns 1 if c lies to the left of the line from a to b, −1 to the right, 0 on the line.
    int side(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        const Point &p = at(a), &q = at(b), &r = at(c);
        const Wide left = Wide(q.x - p.x) * (r.y - p.y), right = Wide(q.y - p.y) * (r.x - p.x);
        return int(left > right) - int(left < right);
    }

    void note_meeting(std::uint32_t a, std::uint32_t b) {
        if (meets_) return;
        meets_ = true;
        meeting_ = {ring_[a], ring_[next(a)], ring_[b], ring_[next(b)]};
    }

    /// Whether edge a lies below edge b, of two edges that the line meets.
    bool is_below(std::uint32_t a, std::uint32_t b) {
        if (a == b) return false;
        const std::uint32_t at_a = left_end(a), at_b = left_end(b);
        const bool turned = at_a != at_b && is_before(at_b, at_a);  // then a's end is compared with edge b
        const int is =
            turned ? -side(at_b, right_end(b), at_a) : side(at_a, right_end(a), at_a == at_b ? right_end(b) : at_b);
        if (is == 0) note_meeting(a, b);
        return is == 0 ? a < b : is > 0;
    }

    /// Notes a meeting if the edge `lower`, which is now the next below `upper`, does not stay below it.
    void compare(std::uint32_t lower, std::uint32_t upper) {
        if (next(lower) == upper || next(upper) == lower) return;
        const std::uint32_t end = right_end(lower), other = right_end(upper);
        const int is = is_before(end, other) ? -side(left_end(upper), other, end) : side(left_end(lower), end, other);
        if (is <= 0) note_meeting(lower, upper);
    }
    void compare_neighbours(Edges& edges, Edges::iterator edge) {
        if (edge != edges.begin()) compare(*std::prev(edge), *edge);
        if (std::next(edge) != edges.end()) compare(*edge, *std::next(edge));
    }

    void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        triangles_.push_back({ring_[a], ring_[b], ring_[c]});
    }

    std::uint32_t new_node(std::uint32_t corner, std::uint32_t before, std::uint32_t after) {
        nodes_.push_back({corner, before, after});
        return std::uint32_t(nodes_.size()) - 1;
    }
    /// Adds a corner at the lower end of a chain, and cuts the triangles that it can see from there.
    void push_front(Chain& chain, std::uint32_t corner) {
        std::uint32_t front = chain.front;
        for (std::uint32_t up; (up = nodes_[front].after) != none; front = up) {
            if (side(nodes_[front].corner, corner, nodes_[up].corner) <= 0) break;
            emit(nodes_[front].corner, corner, nodes_[up].corner);
        }
        const std::uint32_t added = new_node(corner, none, front);
        chain.front = chain.last = nodes_[front].before = added;
    }
    /// The same at the upper end.
    void push_back(Chain& chain, std::uint32_t corner) {
        std::uint32_t back = chain.back;
        for (std::uint32_t down; (down = nodes_[back].before) != none; back = down) {
            if (side(nodes_[down].corner, corner, nodes_[back].corner) <= 0) break;
            emit(nodes_[down].corner, corner, nodes_[back].corner);
        }
        const std::uint32_t added = new_node(corner, back, none);
        chain.back = chain.last = nodes_[back].after = added;
    }

    /// Returns the chain above the next edge below `edge`; null if the inside does not lie there, as it must.
    Chain* chain_below(const Edges& edges, Edges::iterator edge) {
        if (edge == edges.begin() || !is_lower(*std::prev(edge))) return nullptr;
        Chain& chain = chains_[*std::prev(edge)];
        return chain.front == none ? nullptr : &chain;
    }

    /// Cuts the ring. Returns false if two of its edges meet.
    bool sweep() {
        const auto count = std::uint32_t(ring_.size());
        const std::size_t triangles = triangles_.size() + count - 2;
        meets_ = false;
        order_.resize(count);
        for (std::uint32_t i = 0; i < count; ++i) order_[i] = i;
        std::sort(order_.begin(), order_.end(), [&](auto a, auto b) { return is_before(a, b); });
        for (std::uint32_t i = 0; i + 1 < count; ++i)
            if (!is_before(order_[i], order_[i + 1])) note_meeting(order_[i], order_[i + 1]);
        if (meets_) return false;

        Edges edges(Below{this});
        places_.assign(count, edges.end());
        chains_.assign(count, {none, none, none});
        nodes_.clear();
        bool sound = true;  // false once a corner lies where it cannot in a ring that does not meet itself
        for (const std::uint32_t corner : order_) {
            const std::uint32_t in = previous(corner), out = corner;
            const bool from_left = is_before(in, corner), to_left = is_before(next(corner), corner);
            const int turn = side(in, corner, next(corner));
            if (from_left == to_left && turn == 0) note_meeting(in, out);
            if (meets_) return false;
            const auto insert = [&](std::uint32_t edge) { places_[edge] = edges.insert(edge).first; };
            if (from_left != to_left) {
                const std::uint32_t old = from_left ? in : out, now = from_left ? out : in;
                const auto above = edges.erase(places_[old]);
                places_[now] = edges.insert(above, now);
                compare_neighbours(edges, places_[now]);
                if (from_left) {
                    chains_[now] = chains_[old];
                    if (sound) push_front(chains_[now], corner);
                } else if (Chain* chain = sound ? chain_below(edges, places_[now]) : nullptr) {
                    push_back(*chain, corner);
                } else {
                    sound = false;
                }
            } else if (!from_left) {
                insert(in), insert(out);
                if (meets_) return false;
                compare_neighbours(edges, places_[in]);
                compare_neighbours(edges, places_[out]);
                if (turn > 0) {  // a part of the inside begins
                    const std::uint32_t node = new_node(corner, none, none);
                    chains_[out] = {node, node, node};
                } else if (Chain* chain = sound ? chain_below(edges, places_[in]) : nullptr) {
                    // A part is split in two, from the corner that the line met last in it.
                    const std::uint32_t last = chain->last, up = nodes_[last].after;
                    const std::uint32_t copy = new_node(nodes_[last].corner, none, up);
                    if (up != none) nodes_[up].before = copy;
                    nodes_[last].after = none;
                    chains_[out] = {copy, up == none ? copy : chain->back, copy};
                    chain->back = last;
                    push_back(*chain, corner);
                    push_front(chains_[out], corner);
                } else {
                    sound = false;
                }
            } else {
                if (turn > 0) {  // a part ends
                    if (sound && chains_[in].front != none) {
                        std::uint32_t node = chains_[in].front;
                        for (std::uint32_t up; (up = nodes_[node].after) != none; node = up)
                            emit(nodes_[node].corner, corner, nodes_[up].corner);
                    } else {
                        sound = false;
                    }
                } else if (Chain* chain = sound ? chain_below(edges, places_[out]) : nullptr;
                           chain && chain != &chains_[in] && chains_[in].front != none) {  // two parts become one
                    Chain& upper = chains_[in];
                    push_back(*chain, corner);
                    push_front(upper, corner);
                    const std::uint32_t up = nodes_[upper.front].after;  // the corner itself is in both chains
                    nodes_[chain->back].after = up;
                    nodes_[up].before = chain->back;
                    chain->back = upper.back;
                } else {
                    sound = false;
                }
                edges.erase(places_[out]);
                const auto above = edges.erase(places_[in]);
                if (above != edges.end() && above != edges.begin()) compare(*std::prev(above), *above);
            }
        }
        return sound && !meets_ && triangles_.size() == triangles;
    }

    std::vector<std::array<std::uint32_t, 3>> triangles_;
    std::array<std::uint32_t, 4> meeting_{};
    bool meets_ = false;
    std::vector<Vec<double, 3>> placed_;
    std::vector<Point> points_;
    std::vector<std::uint32_t> ring_;      // the corners that are cut, as indices of the polygon's corners
    std::vector<std::uint32_t> order_;     // the ring's corners from left to right
    std::vector<Edges::iterator> places_;  // for each edge that the line meets, its place among them
    std::vector<Chain> chains_;            // for each lower edge, the chain above it
    std::vector<Node> nodes_;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
