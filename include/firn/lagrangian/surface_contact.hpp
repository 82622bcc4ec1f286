/// \file Contact of point masses with boundaries. The boundaries are the same fixed or moving walls and colliders that
/// act on the nodes of a grid.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/error.hpp>
#include <firn/core/parallel.hpp>
#include <firn/lagrangian/impact.hpp>
#include <firn/lagrangian/point_masses.hpp>

#include <algorithm>
#include <limits>

namespace firn {

/// Applies the contact of one point with the surfaces of a boundary, one surface after another.
///
/// The point touches a surface if its distance from the surface is below its radius. The surface's Contact then changes
/// the point's velocity relative to the surface; Contact::separate acts with restitution. If the point overlaps the
/// surface by more than contact_slack times its radius, the point is also moved outwards until the overlap is only
/// contact_slack times the radius. This shift does not change the velocity.
/// \param boundary     a boundary with scalar type S, as lift<S>() returns it
/// \param restitution  Newton's coefficient of restitution between point and surface, from 0 to 1 [1]
/// \param radius       radius of the point [m]
/// \param x            position of the point [m], changed in place
/// \param v            velocity of the point [m/s], changed in place
template <class B, std::floating_point S, int D>
FIRN_INLINE void meet_surfaces(const B& boundary, S restitution, S radius, Vec<S, D>& x, Vec<S, D>& v) {
    const Vec<S, D> from = x;
    boundary.surfaces(from, [&](S distance, const Vec<S, D>& normal, const Vec<S, D>& of_surface, Contact contact,
                                S friction) FIRN_LAMBDA {
        if (contact == Contact::none) return;
        const S gap = distance + dot(normal, x - from) - radius;  // x: the position after shifts by earlier surfaces
        if (!(gap < 0)) return;
        const Vec<S, D> relative = v - of_surface;
        const S into = min(dot(relative, normal), S(0));
        v = of_surface + velocity_after_impact(relative, normal, contact, friction, -restitution * into);
        x -= normal * min(gap + S(contact_slack) * radius, S(0));
    });
}

/// Checks that a boundary knows distances from its surfaces up to the radius of every point.
/// \throws parameter_error  if it does not. \see exact_up_to
template <std::floating_point S, int D, class B>
void check_distances(const PointMasses<S, D>& points, const B& boundary) {
    const double known = exact_up_to(boundary);
    if (known == std::numeric_limits<double>::infinity() || points.size() == 0) return;
    const double largest = *std::max_element(points.radius.begin(), points.radius.end());
    if (!(largest <= known))
        throw parameter_error(sentence("A point has a radius of ", largest,
                                       " m, and a shape of the boundary knows distances up to ", known,
                                       " m only: the point would touch surfaces that are far away. Store distances up "
                                       "to ",
                                       largest, " m (a wider band)."));
}

/// Applies the contact of all points with the surfaces of a boundary; pinned points do not change. A point of radius 0
/// touches a surface when it is inside the solid.
/// \param points       the points; their positions and velocities are changed in place
/// \param boundary     a boundary with scalar type S and a member function surfaces(), see has_surfaces
/// \param restitution  Newton's coefficient of restitution between points and surfaces, from 0 to 1 [1]
/// \param threads      number of threads; 0: the number that thread_count() returns
/// \throws parameter_error  if the restitution is not from 0 to 1, or if check_boundary() or check_distances() throws
/// it
template <std::floating_point S, int D, class B>
void meet_surfaces(PointMasses<S, D>& points, const B& boundary, double restitution = 0, int threads = 0) {
    static_assert(has_surfaces<with_scalar_t<B, S>, S, D>,
                  "firn: the boundary must offer surfaces(x, seen) in the points' scalar and dimension; see "
                  "firn/boundary/concept.hpp.");
    check_restitution(restitution);
    check_boundary(boundary);
    check_distances(points, boundary);
    const auto lifted = lift<S>(boundary);
    parallel_for(
        points.size(), thread_count(threads),
        [&](std::size_t i, int) {
            if (points.inverse_mass[i] == 0) return;
            meet_surfaces(lifted, S(restitution), points.radius[i], points.position[i], points.velocity[i]);
        },
        1024);
}

}  // namespace firn
