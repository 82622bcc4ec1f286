/// \file Contact of point masses with boundaries: the same walls and colliders, moving or not, that grid nodes meet.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/error.hpp>
#include <firn/core/parallel.hpp>
#include <firn/lagrangian/impact.hpp>
#include <firn/lagrangian/point_masses.hpp>

namespace firn {

/// Applies the contact of one point with the surfaces of a boundary, one surface after another.
///
/// A point touches a surface if it is nearer than its radius. Its velocity relative to the surface then obeys the
/// surface's contact, with restitution if the contact separates. Its position is moved to where it just touches the
/// surface (overlap of contact_slack), which changes no velocity.
/// \param boundary  in S, lifted
/// \param restitution  Newton's e [1]
/// \param radius  of the point [m]
/// \param x  its position [m], changed in-place
/// \param v  its velocity [m/s], changed in-place
template <class B, std::floating_point S, int D>
FIRN_INLINE void meet_surfaces(const B& boundary, S restitution, S radius, Vec<S, D>& x, Vec<S, D>& v) {
    const Vec<S, D> from = x;
    boundary.surfaces(from, [&](S distance, const Vec<S, D>& normal, const Vec<S, D>& of_surface, Contact contact,
                                S friction) FIRN_LAMBDA {
        if (contact == Contact::none) return;
        const S gap = distance + dot(normal, x - from) - radius;  // after earlier surfaces have moved the point
        if (!(gap < 0)) return;
        const Vec<S, D> relative = v - of_surface;
        const S into = min(dot(relative, normal), S(0));
        v = of_surface + velocity_after_impact(relative, normal, contact, friction, -restitution * into);
        x -= normal * min(gap + S(contact_slack) * radius, S(0));
    });
}

/// Applies the contact of all points that are not pinned with a boundary. A point of radius 0 touches a surface when it
/// has passed it.
/// \param boundary     a boundary policy in S that has surfaces(), see has_surfaces
/// \param restitution  Newton's e, from 0 to 1 [1]
/// \param threads      0: as many as thread_count() says
/// \throws parameter_error  if the restitution is not from 0 to 1, and as check_boundary()
template <std::floating_point S, int D, class B>
void meet_surfaces(PointMasses<S, D>& points, const B& boundary, double restitution = 0, int threads = 0) {
    static_assert(has_surfaces<with_scalar_t<B, S>, S, D>,
                  "firn: the boundary must offer surfaces(x, seen) in the points' scalar and dimension; see "
                  "firn/boundary/concept.hpp.");
    check_restitution(restitution);
    check_boundary(boundary);
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
