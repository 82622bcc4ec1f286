/// \file Lengths and areas of nets, and the masses of points that follow from them.
#pragma once

#include <firn/data/memory.hpp>
#include <firn/data/mesh.hpp>
#include <firn/lagrangian/net.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn {

/// The largest number of points in a net: links and facets name points by 32 bits.
inline constexpr std::size_t max_points = std::numeric_limits<std::uint32_t>::max();

/// The area of a facet [m²], or the length of an edge [m] in 2D.
template <int D>
double facet_area(const Net<D>& net, const std::type_identity_t<Facet<D>>& facet) {
    std::array<Vec<double, D>, D> corners;
    for (std::size_t k = 0; k < std::size_t(D); ++k) corners[k] = net.positions[facet[k]];
    return norm(area_vector(corners));
}

/// The length of a link at rest [m].
template <int D>
double rest_length(const Net<D>& net, const Link& link) {
    return norm(net.positions[link.a] - net.positions[link.b]);
}

/// The facets of a net as a mesh whose vertices are all points of the net, to check, draw or write it.
inline TriangleMesh surface_mesh(const Net<3>& net) {
    TriangleMesh mesh{net.positions, {}};
    mesh.triangles.reserve(net.facets.size());
    for (const auto& [a, b, c] : net.facets)
        mesh.triangles.push_back({std::int32_t(a), std::int32_t(b), std::int32_t(c)});
    return mesh;
}

/// Two unit vectors u, v perpendicular to the unit vector n and to each other; n, u, v are right-handed.
inline std::array<Vec<double, 3>, 2> perpendicular(const Vec<double, 3>& n) {
    int flattest = 0;
    for (int a = 1; a < 3; ++a)
        if (std::abs(n[a]) < std::abs(n[flattest])) flattest = a;
    Vec<double, 3> axis{};
    axis[flattest] = 1;
    const auto u = cross(n, axis) * (1 / norm(cross(n, axis)));
    return {u, cross(n, u)};
}

namespace detail {

/// \throws memory_error  if a net with these numbers of points, links and facets does not fit into memory
template <int D>
void require_net_memory(double points, double links, double facets) {
    require_memory(points * sizeof(Vec<double, D>) + links * sizeof(Link) + facets * sizeof(Facet<D>),
                   sentence("A net of ", points, " points and ", links, " links"), "Take fewer cells or segments.");
}

inline void check_positive(double value, const char* what, const char* unit) {
    if (!(value > 0) || !std::isfinite(value))
        throw parameter_error(sentence(what, " is ", value, " ", unit, "; it must be positive and finite."));
}

/// Shares the measure of each piece equally among its points. \return each point's sum
template <int D, class Pieces, class Measure>
std::vector<double> shared_out(const Net<D>& net, const Pieces& pieces, const char* kind, const Measure& measure) {
    std::vector<double> parts(net.positions.size());
    for (const auto& piece : pieces) {
        for (const auto point : piece)
            if (point >= parts.size())
                throw parameter_error(sentence("A ", kind, " names point ", point, ", but the net has ", parts.size(),
                                               " points, counted from 0."));
        for (const auto point : piece) parts[point] += measure(piece) / double(piece.size());
    }
    const auto bare = std::find_if(parts.begin(), parts.end(), [](double part) { return !(part > 0); });
    if (bare != parts.end())
        throw parameter_error(sentence("Point ", bare - parts.begin(), " (from 0) belongs to no ", kind,
                                       " of the net, so it would have no mass. Take it out, or give masses yourself."));
    return parts;
}

/// Sorts links by their points, the lower point first, and keeps one link per pair of points: the one whose kind comes
/// first in LinkKind.
inline std::vector<Link> unique_links(std::vector<Link> links) {
    for (auto& link : links)
        if (link.b < link.a) std::swap(link.a, link.b);
    const auto ends = [](const Link& link) { return std::pair(link.a, link.b); };
    std::sort(links.begin(), links.end(), [&](const Link& left, const Link& right) {
        return ends(left) != ends(right) ? ends(left) < ends(right) : left.kind < right.kind;
    });
    links.erase(std::unique(links.begin(), links.end(),
                            [&](const Link& left, const Link& right) { return ends(left) == ends(right); }),
                links.end());
    return links;
}

}  // namespace detail

/// The mass of every point [kg] of a surface of `density` [kg/m²; kg/m in 2D]. Each triangle gives a third of its mass
/// to each corner; in 2D, each edge gives half of its mass to each end.
/// \throws parameter_error  unless the density is positive and every point belongs to a facet with an area
template <int D>
std::vector<double> facet_masses(const Net<D>& net, double density) {
    detail::check_positive(density, "The density of the surface", D == 3 ? "kg/m^2" : "kg/m");
    auto masses = detail::shared_out(net, net.facets, "facet", [&](const Facet<D>& f) { return facet_area(net, f); });
    for (auto& mass : masses) mass *= density;
    return masses;
}

/// The mass of every point [kg] of ropes of `density` [kg/m]. Each stretch link gives half of its mass to each end.
/// \throws parameter_error  unless the density is positive and every point belongs to a stretch link with a length
template <int D>
std::vector<double> link_masses(const Net<D>& net, double density) {
    detail::check_positive(density, "The density of the rope", "kg/m");
    std::vector<std::array<std::uint32_t, 2>> pieces;
    for (const auto& link : net.links)
        if (link.kind == LinkKind::stretch) pieces.push_back({link.a, link.b});
    auto masses = detail::shared_out(net, pieces, "stretch link", [&](const auto& piece) {
        return norm(net.positions[piece[0]] - net.positions[piece[1]]);
    });
    for (auto& mass : masses) mass *= density;
    return masses;
}

}  // namespace firn
