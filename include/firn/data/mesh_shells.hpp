/// \file Finds the shells of a closed triangle mesh, and turns those that face inwards although they bound no hole.
#pragma once

#include <firn/data/mesh.hpp>
#include <firn/data/winding_number.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Triangles that hang together by edges: a closed surface.
struct Shell {
    std::vector<std::int32_t> triangles;  // indices
    Bounds<3> bounds;
    double volume;  // signed [m³]
    bool is_flat;   // its volume is a rounding error
};

inline double cubed_size(const Bounds<3>& box) {
    const auto extent = box.upper - box.lower;
    const double longest = std::max({extent[0], extent[1], extent[2]});
    return longest * longest * longest;
}

/// Returns a part of a mesh. Its triangles share no vertices.
[[gnu::cold]] inline TriangleMesh part_of(const TriangleMesh& mesh, const std::vector<std::int32_t>& triangles) {
    TriangleMesh part;
    for (const auto t : triangles) {
        const auto first = std::int32_t(part.vertices.size());
        for (const auto index : mesh.triangles[std::size_t(t)])
            part.vertices.push_back(mesh.vertices[std::size_t(index)]);
        part.triangles.push_back({first, first + 1, first + 2});
    }
    return part;
}

/// Returns the shells of a mesh in the order of their first triangles.
/// \throws mesh_error  if the mesh does not pass check_closed()
inline std::vector<Shell> shells_of(const TriangleMesh& mesh) {
    const auto edges = closed_edges(mesh);
    std::vector<std::int32_t> parent(mesh.triangles.size());  // of a tree for each shell; its root has the least index
    for (std::size_t t = 0; t < parent.size(); ++t) parent[t] = std::int32_t(t);
    const auto root_of = [&](std::int32_t t) {
        while (parent[std::size_t(t)] != t) t = parent[std::size_t(t)] = parent[std::size_t(parent[std::size_t(t)])];
        return t;
    };
    for (std::size_t e = 0; e + 1 < edges.size(); e += 2) {
        const auto [low, high] = std::minmax({root_of(edges[e].triangle), root_of(edges[e + 1].triangle)});
        parent[std::size_t(high)] = low;
    }
    std::vector<Shell> shells;
    std::vector<std::int32_t> shell_of(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto root = std::size_t(root_of(std::int32_t(t)));
        if (root == t) {
            shell_of[t] = std::int32_t(shells.size());
            const auto& x = mesh.vertices[std::size_t(mesh.triangles[t][0])];
            shells.push_back({{}, {x, x}, 0, false});
        }
        shells[std::size_t(shell_of[root])].triangles.push_back(std::int32_t(t));
    }
    for (auto& shell : shells) {
        const auto apex = mesh.vertices[std::size_t(mesh.triangles[std::size_t(shell.triangles[0])][0])];
        for (const auto t : shell.triangles) {
            Vec<double, 3> x[3];
            for (std::size_t k = 0; k < 3; ++k) {
                const auto& corner = mesh.vertices[std::size_t(mesh.triangles[std::size_t(t)][k])];
                x[k] = corner - apex;
                for (int a = 0; a < 3; ++a) {
                    shell.bounds.lower[a] = std::min(shell.bounds.lower[a], corner[a]);
                    shell.bounds.upper[a] = std::max(shell.bounds.upper[a], corner[a]);
                }
            }
            shell.volume += dot(x[0], cross(x[1], x[2])) / 6;
        }
        // The computed volume of a flat surface is not exactly zero, but a rounding error. A real body as thin as this
        // could contain no particle.
        shell.is_flat = !(std::abs(shell.volume) > 1e-15 * cubed_size(shell.bounds));
    }
    return shells;
}

/// Some 256 points just behind the triangles of a part of a mesh, and the areas for which they stand.
struct PointsBehind {
    std::vector<Vec<double, 3>> points;
    std::vector<double> areas;
    double area = 0;  // of all triangles, estimated [m²]

    /// \param depth  distance from the triangles [m]; below 0: in front of them
    [[gnu::cold]] PointsBehind(const TriangleMesh& mesh, const std::vector<std::int32_t>& triangles, double depth) {
        constexpr std::size_t most = 256;
        const std::size_t stride = (triangles.size() + most - 1) / most;
        const std::size_t of_each = std::max<std::size_t>(most / std::max<std::size_t>(triangles.size(), 1), 1);
        for (std::size_t at = 0; at < triangles.size(); at += stride) {
            const auto& [i, j, k] = mesh.triangles[std::size_t(triangles[at])];
            const auto& corner = mesh.vertices[std::size_t(i)];
            const auto b = mesh.vertices[std::size_t(j)] - corner, c = mesh.vertices[std::size_t(k)] - corner;
            const auto normal = cross(b, c);
            const double length = norm(normal);
            if (!(length > 0)) continue;
            area += length / 2 * double(stride);
            for (std::size_t n = 0; n < of_each; ++n) {
                // The first point is the centroid; the others are spread evenly (Roberts 2018: powers of the plastic
                // number).
                double u = std::fmod(1.0 / 3 + double(n) * 0.7548776662466927, 1.0);
                double v = std::fmod(1.0 / 3 + double(n) * 0.5698402909980532, 1.0);
                if (u + v > 1) u = 1 - u, v = 1 - v;
                points.push_back(corner + b * u + c * v - normal * (depth / length));
                areas.push_back(length / double(2 * of_each));
            }
        }
    }
    /// Returns the share of the area at whose points `holds(point)` is true.
    template <class Holds>
    double share(const Holds& holds) const {
        double sum = 0, all = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            all += areas[i];
            if (holds(points[i])) sum += areas[i];
        }
        return all > 0 ? sum / all : 0;
    }
};

/// A mesh whose shells all face outwards, but for those that bound holes.
struct OrientedMesh {
    TriangleMesh mesh;
    double volume;                              // [m³]
    std::vector<std::int32_t> facing_outwards;  // the triangles of the shells that bound no hole
};

/// Decides for each shell whether to turn it, from the largest to the smallest.
class ShellTurner {
public:
    [[gnu::cold]] ShellTurner(const TriangleMesh& mesh, const std::vector<Shell>& shells)
        : mesh_(mesh), shells_(shells), turns_(shells.size(), false), winding_(shells.size()) {
        std::vector<std::size_t> order;
        for (std::size_t s = 0; s < shells.size(); ++s)
            if (!shells[s].is_flat) order.push_back(s);
        // If one lies in another, the other is larger. Of two at the same place, the one that faces outwards is first.
        const auto size = [&](std::size_t s) {
            const double volume = shells[s].volume;
            return volume > 0 ? volume * (1 + 1e-9) : -volume;
        };
        std::sort(order.begin(), order.end(),
                  [&](auto a, auto b) { return size(a) != size(b) ? size(a) > size(b) : a < b; });
        for (std::size_t at = 0; at < order.size(); ++at) decide(order[at], std::span(order).first(at));
    }

    bool turns(std::size_t shell) const { return turns_[shell]; }
    bool is_hole(std::size_t shell) const { return (shells_[shell].volume < 0) != turns_[shell]; }

private:
    static constexpr double no_share = 0.01, whole_share = 0.9;

    /// \param larger  the shells that have been decided
    [[gnu::cold]] void decide(std::size_t shell, std::span<const std::size_t> larger) {
        const Shell& self = shells_[shell];
        std::vector<std::size_t> near;  // larger shells whose bounding boxes overlap with this one's
        for (const auto s : larger)
            if (overlap(shells_[s].bounds, self.bounds)) near.push_back(s);
        if (!is_hole(shell) && std::none_of(near.begin(), near.end(), [&](auto s) { return turns_[s]; })) return;
        const auto largest = [](const Bounds<3>& box) {
            double most = 0;
            for (int k = 0; k < 3; ++k) most = std::max({most, std::abs(box.lower[k]), std::abs(box.upper[k])});
            return most;
        };
        // A few of the steps of the lattice on which the winding numbers of the larger shells are computed.
        double depth = 16 * 0x1p-52 * largest(self.bounds);
        for (const auto s : near) depth = std::max(depth, 16 * winding(s).resolution());
        const PointsBehind inside(mesh_, self.triangles, self.volume > 0 ? depth : -depth);

        // What lies in a shell that is turned is turned with it. So is what crosses one and faces inwards as it did.
        for (const auto s : near) {
            const double share = inside.share([&](const auto& x) { return winding(s)(x) != 0; });
            if (share > whole_share)
                turns_[shell] = turns_[s];
            else if (share > no_share && turns_[s] && self.volume < 0)
                turns_[shell] = true;
        }
        if (!is_hole(shell)) return;
        const auto covered = [&](const auto& x, bool of_holes) {
            int times = 0;
            for (const auto s : near)
                if (of_holes || !is_hole(s)) times += winding(s)(x) * (turns_[s] ? -1 : 1);
            return times;
        };
        if (!(inside.share([&](const auto& x) { return covered(x, true) >= 1; }) > no_share)) {
            turns_[shell] = !turns_[shell];  // it lies apart from the others, or as an island in a hole
        } else if (inside.share([&](const auto& x) { return covered(x, false) >= 1; }) < whole_share) {
            throw mesh_error(sentence(
                "A shell of ", self.triangles.size(), " triangles, from ", describe(self.bounds.lower), " to ",
                describe(self.bounds.upper), " m (triangle ", self.triangles[0],
                " from 0 is one of them), faces inwards and lies partly inside and partly outside of the rest of the "
                "mesh. A hole must lie within a body; a body must face outwards. Reverse it, or move it."));
        }
    }

    static bool overlap(const Bounds<3>& a, const Bounds<3>& b) {
        for (int k = 0; k < 3; ++k)
            if (a.lower[k] > b.upper[k] || b.lower[k] > a.upper[k]) return false;
        return true;
    }
    const WindingNumber& winding(std::size_t shell) {
        if (!winding_[shell]) winding_[shell].emplace(part_of(mesh_, shells_[shell].triangles));
        return *winding_[shell];
    }

    const TriangleMesh& mesh_;
    const std::vector<Shell>& shells_;
    std::vector<bool> turns_;
    std::vector<std::optional<WindingNumber>> winding_;
};

/// Returns the mesh with its shells turned as facing_outwards() does.
inline OrientedMesh oriented(const TriangleMesh& mesh) {
    const auto shells = shells_of(mesh);
    const auto faces_in = [](const Shell& shell) { return !shell.is_flat && shell.volume < 0; };
    double size = 0;
    for (const auto& shell : shells) size += shell.is_flat ? 0 : cubed_size(shell.bounds);
    OrientedMesh result{mesh, 0, {}};
    bool all_turned = false;
    if (std::any_of(shells.begin(), shells.end(), faces_in)) {
        const ShellTurner turner(mesh, shells);
        all_turned = true;
        for (std::size_t s = 0; s < shells.size(); ++s) {
            if (shells[s].is_flat) continue;
            all_turned &= turner.turns(s);
            for (const auto t : shells[s].triangles) {
                auto& corners = result.mesh.triangles[std::size_t(t)];
                if (turner.turns(s)) std::swap(corners[1], corners[2]);
                if (!turner.is_hole(s)) result.facing_outwards.push_back(t);
            }
        }
    } else {
        for (const auto& shell : shells)
            if (!shell.is_flat)
                result.facing_outwards.insert(result.facing_outwards.end(), shell.triangles.begin(),
                                              shell.triangles.end());
    }
    result.volume = all_turned ? -signed_volume(mesh) : signed_volume(result.mesh);
    if (!(result.volume > 1e-15 * size)) {
        const auto box = bounding_box(mesh);
        const auto extent = box.upper - box.lower;
        throw mesh_error(sentence("The mesh is closed but encloses no volume (", result.volume, " m³ in a box of ",
                                  extent[0], " x ", extent[1], " x ", extent[2], " m). Give it thickness."));
    }
    return result;
}

/// Checks that of the shells that face outwards at most a tenth of the area is inside out: that the winding number
/// behind it, without holes, is at least 1.
///
/// Some area is allowed to be: a surface that folds over itself in places has pockets that are inside out.
/// \param winding  of the whole mesh
/// \throws mesh_error  if more is
[[gnu::cold]] inline void check_facing(const OrientedMesh& oriented, const WindingNumber& winding) {
    const double depth = 16 * winding.resolution();
    const PointsBehind inside(oriented.mesh, oriented.facing_outwards, depth);
    if (oriented.volume < 10 * depth * inside.area) return;  // so thin that nothing is known of its inside
    const auto share_of = [&](const WindingNumber& number) {
        return inside.share([&](const auto& x) { return number(x) < 1; });
    };
    constexpr double most = 0.1;
    if (share_of(winding) <= most) return;
    const WindingNumber of_bodies(part_of(oriented.mesh, oriented.facing_outwards));  // at least as high
    const double share = share_of(of_bodies);
    if (share <= most) return;
    const auto wrong =
        std::find_if(inside.points.begin(), inside.points.end(), [&](const auto& x) { return of_bodies(x) < 1; });
    throw mesh_error(sentence("The mesh is closed, but ", rounded_text(100 * share, 2),
                              " % of its surface is inside out, for example at ", describe(*wrong),
                              " m: the surface crosses itself, and parts of it face inwards. Separate these parts, and "
                              "let each face outwards."));
}

}  // namespace detail

/// Returns the mesh with every shell facing outwards that bounds no hole. A shell is a part that hangs together by
/// edges. A shell that faces inwards bounds a hole if it lies within a body. If it lies apart from the others, or as an
/// island within a hole, it is reversed, together with all shells within it.
///
/// Whether a shell lies within others is tested at some 256 points just behind its triangles.
/// \throws mesh_error  if the mesh does not pass check_closed(), if it encloses no volume, or if a shell that faces
///                     inwards lies partly inside and partly outside of the others: more than 1 % and less than 90 % of
///                     its area lies in bodies
[[nodiscard]] inline TriangleMesh facing_outwards(const TriangleMesh& mesh) { return detail::oriented(mesh).mesh; }

}  // namespace firn::inline FIRN_BUILD
