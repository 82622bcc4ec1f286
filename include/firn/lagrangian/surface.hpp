/// \file Computes the lengths of links and the areas of facets, and from these the masses of points.
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

namespace firn::inline FIRN_BUILD {

/// The largest number of points in a net: links and facets store the index of a point in 32 bits.
inline constexpr std::size_t max_points = std::numeric_limits<std::uint32_t>::max();

/// Returns the area of a facet [m²], or in 2D the length of an edge [m].
template <int D>
double facet_area(const Net<D>& net, const std::type_identity_t<Facet<D>>& facet) {
    std::array<Vec<double, D>, D> corners;
    for (std::size_t k = 0; k < std::size_t(D); ++k) corners[k] = net.positions[facet[k]];
    return norm(area_vector(corners));
}

/// Returns the length at rest of a link of a net [m].
template <int D>
double rest_length(const Net<D>& net, const Link& link) {
    return norm(net.positions[link.a] - net.positions[link.b]);
}

/// Returns the facets of a net as a mesh, for example to draw it or to write it to a file. The vertices are all points
/// of the net, in the same order.
inline TriangleMesh surface_mesh(const Net<3>& net) {
    TriangleMesh mesh{net.positions, {}};
    mesh.triangles.reserve(net.facets.size());
    for (const auto& [a, b, c] : net.facets)
        mesh.triangles.push_back({std::int32_t(a), std::int32_t(b), std::int32_t(c)});
    return mesh;
}

/// Returns two unit vectors u and v that are perpendicular to the unit vector n and to each other, with u × v = n.
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

/// Checks that a net with these numbers of points, links and facets fits into memory.
/// \throws memory_error  if the net does not fit into memory
template <int D>
void require_net_memory(double points, double links, double facets) {
    require_memory(points * sizeof(Vec<double, D>) + links * sizeof(Link) + facets * sizeof(Facet<D>),
                   sentence("A net of ", points, " points and ", links, " links"), "Take fewer cells or segments.");
}

inline void check_positive(double value, const char* what, const char* unit) {
    if (!(value > 0) || !std::isfinite(value))
        throw parameter_error(sentence(what, " is ", value, " ", unit, "; it must be positive and finite."));
}

/// Computes a length or area for each point of a net. The length or area of each piece (facet or link) is shared
/// equally among the points of the piece, and each point gets the sum of its shares.
/// \param net      the net that contains the points
/// \param pieces   for each piece, the indices of the points of the piece
/// \param kind     a word for a piece in messages, such as "facet"
/// \param measure  measure(piece) returns the length [m] or area [m²] of a piece
/// \return for each point, the sum of its shares
/// \throws parameter_error  if a piece names a point that does not exist, or if a point gets no share
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

/// Returns the links without duplicates. Of several links between the same two points, the link whose kind comes first
/// in LinkKind is kept. In the result, each link has a < b, and the links are sorted by a, then by b.
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

/// Returns the mass of every point [kg], in the order of the net's points, for a surface with `density` [kg/m²]. Each
/// triangle gives a third of its mass to each corner; in 2D, each edge gives half of its mass to each end.
/// \throws parameter_error  unless the density is positive and finite, and every point belongs to a facet with an area
template <int D>
std::vector<double> facet_masses(const Net<D>& net, double density) {
    detail::check_positive(density, "The density of the surface", "kg/m^2");
    auto masses = detail::shared_out(net, net.facets, "facet", [&](const Facet<D>& f) { return facet_area(net, f); });
    for (auto& mass : masses) mass *= density;
    return masses;
}

/// Returns the mass of every point [kg], in the order of the net's points, for ropes with `density` [kg/m]. Each
/// stretch link gives half of its mass to each end.
/// \throws parameter_error  unless the density is positive and finite, and every point belongs to a stretch link that
///                          is longer than zero
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

}  // namespace firn::inline FIRN_BUILD
