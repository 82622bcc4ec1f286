/// \file Makes forces from a net: springs along the links, and membranes and the drag of air on the facets.
#pragma once

#include <firn/lagrangian/drag.hpp>
#include <firn/lagrangian/element_forces.hpp>
#include <firn/lagrangian/membrane.hpp>
#include <firn/lagrangian/spring.hpp>
#include <firn/lagrangian/surface.hpp>
#include <firn/material/check.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

/// Springs and dampers between pairs of points.
template <class S, int D>
using Springs = ElementForces<SpringDamper<S>, D>;
/// Springs and dampers that pull single points to fixed positions.
template <class S, int D>
using Anchors = ElementForces<Anchor<S, D>, D>;
/// Drag of air on facets.
template <class S, int D>
using AerodynamicSurface = ElementForces<AerodynamicDrag<S, D>, D>;
/// Triangular membranes of an elastic material.
template <class Material>
using Membranes = ElementForces<Membrane<Material>, 3>;

namespace detail {

template <int D>
const Vec<double, D>& point_of(const Net<D>& net, std::uint32_t point) {
    if (point >= net.positions.size())
        throw parameter_error(
            sentence("The net joins point ", point, "; it has ", net.positions.size(), " points, counted from 0."));
    return net.positions[point];
}

/// Returns the length at rest of a link [m].
/// \throws parameter_error  unless both end points exist and have different, finite positions
template <int D>
double checked_rest_length(const Net<D>& net, const Link& link) {
    for (const std::uint32_t end : {link.a, link.b}) point_of(net, end);
    const double length = rest_length(net, link);
    if (!(length > 0) || !std::isfinite(length))
        throw parameter_error(sentence("The link between points ", link.a, " and ", link.b, " has length ", length,
                                       " m at rest; it must be positive. Take out one of the points, or the link."));
    return length;
}

inline std::uint32_t moved_place(std::uint32_t point, std::size_t first) { return std::uint32_t(point + first); }

}  // namespace detail

/// The stiffness and damping of the springs that are made from the links of one kind.
struct SpringOptions {
    double stiffness = 0;  ///< Stiffness k_s [N/m]. If stiffness and damping are both 0, no springs are made.
    double damping = 0;    ///< Damping k_d [N s/m].
    /// A spring tears at the end of a step if it is longer than this factor times its length at rest. The factor must
    /// be above 1; infinite: these springs never tear. Empty: SpringDamper::tear_factor, which is infinite by default.
    std::optional<double> tear_factor = {};

    /// Checks stiffness, damping and tear factor.
    /// \throws parameter_error  unless stiffness and damping are finite and not negative, and the tear factor above 1
    void check() const {
        detail::check_spring(stiffness, damping);
        if (tear_factor) detail::check_tear_factor(*tear_factor);
    }
};
/// The options for each kind of link, in the order of LinkKind.
using SpringsOfKinds = std::array<SpringOptions, link_kinds>;

/// Makes springs along the links of a net. The length at rest of each spring is the length of its link in the net.
/// \param net      the net
/// \param options  the options for each kind of link
/// \param first    the index of the net's first point in the system, as ParticleSystem::add returned it
/// \throws parameter_error  if a link has length zero or names a point that does not exist, or if SpringOptions::check
///                          throws it
template <class S, int D>
Springs<S, D> springs_of(const Net<D>& net, const SpringsOfKinds& options, std::size_t first = 0) {
    for (const SpringOptions& each : options) each.check();
    Springs<S, D> springs;
    for (const Link& link : net.links) {
        const SpringOptions& of = options[std::size_t(link.kind)];
        if (of.stiffness == 0 && of.damping == 0) continue;
        springs.add({detail::moved_place(link.a, first), detail::moved_place(link.b, first)},
                    {S(detail::checked_rest_length(net, link)), S(of.stiffness), S(of.damping)}, link.kind,
                    of.tear_factor);
    }
    return springs;
}
/// Makes springs along the links of a net, with the same options for all kinds of links. The length at rest of each
/// spring is the length of its link in the net.
/// \param net     the net
/// \param of_all  the options for all links
/// \param first   the index of the net's first point in the system, as ParticleSystem::add returned it
/// \throws parameter_error  if a link has length zero or names a point that does not exist, or if SpringOptions::check
///                          throws it
template <class S, int D>
Springs<S, D> springs_of(const Net<D>& net, const SpringOptions& of_all, std::size_t first = 0) {
    SpringsOfKinds options;
    options.fill(of_all);
    return springs_of<S>(net, options, first);
}

/// Makes the drag of air on the facets of a net.
/// \param net    the net
/// \param law    the law of the drag, for all facets
/// \param first  the index of the net's first point in the system, as ParticleSystem::add returned it
/// \throws parameter_error  if a facet names a point that does not exist
template <class S, int D>
AerodynamicSurface<S, D> aerodynamic_surface_of(const Net<D>& net, const AerodynamicDrag<S, D>& law,
                                                std::size_t first = 0) {
    AerodynamicSurface<S, D> surface(law);
    for (Facet<D> facet : net.facets) {
        for (std::uint32_t& corner : facet) {
            detail::point_of(net, corner);
            corner = detail::moved_place(corner, first);
        }
        surface.add(facet);
    }
    return surface;
}

/// Makes one membrane from each facet of a net. The shape of a facet in the net is the membrane's shape at rest.
/// \param net        the net
/// \param material   the material of all membranes
/// \param thickness  the thickness of all membranes [m]
/// \param first      the index of the net's first point in the system, as ParticleSystem::add returned it
/// \throws parameter_error  if the thickness is not positive and finite, if a facet names a point that does not exist,
///                          or if check_material() throws it
/// \throws mesh_error       if a triangle has no area
template <class Material>
Membranes<Material> membranes_of(const Net<3>& net, const Material& material, double thickness, std::size_t first = 0) {
    using S = material_scalar_t<Material>;
    check_material<2>(material);
    if (!(thickness > 0) || !std::isfinite(thickness))
        throw parameter_error(sentence("A membrane is ", thickness, " m thick; it must be positive."));
    Membranes<Material> membranes(Membrane<Material>{material});
    for (std::size_t t = 0; t < net.facets.size(); ++t) {
        const Facet<3>& corners = net.facets[t];
        const Vec<double, 3> origin = detail::point_of(net, corners[0]);
        const Vec<double, 3> a = detail::point_of(net, corners[1]) - origin;
        const Vec<double, 3> b = detail::point_of(net, corners[2]) - origin;
        const double base = norm(a), area = norm(cross(a, b)) / 2;
        // Below this limit, the rounding errors of the corner positions are as large as the height of the triangle.
        if (!(area > 1e-12 * (dot(a, a) + dot(b, b))) || !std::isfinite(area))
            throw mesh_error(sentence("Triangle ", t, " (from 0) of the net has area ", area, " m²: its corners ",
                                      corners[0], ", ", corners[1], " and ", corners[2],
                                      " lie on a line. Take it out, or move a corner."));
        // If the first edge lies along the x axis, the matrix of the edges at rest is D_m = [[base, along], [0, high]].
        const double along = dot(a, b) / base, high = 2 * area / base;
        membranes.add({detail::moved_place(corners[0], first), detail::moved_place(corners[1], first),
                       detail::moved_place(corners[2], first)},
                      {Mat<S, 2>::rows(1 / base, -along / (base * high), 0, 1 / high), S(area * thickness)});
    }
    return membranes;
}

}  // namespace firn::inline FIRN_BUILD
