/// \file Point masses against boundaries: walls and colliders, moving or not, as nodes of the grid know them.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/error.hpp>
#include <firn/core/parallel.hpp>
#include <firn/lagrangian/impact.hpp>
#include <firn/lagrangian/point_masses.hpp>

namespace firn {

/// What one point does at the surfaces of a boundary. A point touches a surface that is nearer than its radius. Its
/// velocity relative to the surface then follows the surface's contact (where that separates, with restitution), and
/// it is put where it just touches (by contact_slack); that changes no velocity. Surfaces act one after another.
/// \param boundary  in S, lifted
template <class B, std::floating_point S, int D>
FIRN_INLINE void meet_surfaces(const B& boundary, S restitution, S radius, Vec<S, D>& x, Vec<S, D>& v) {
    const Vec<S, D> from = x;
    boundary.surfaces(from, [&](S distance, const Vec<S, D>& normal, const Vec<S, D>& of_surface, Contact contact,
                                S friction) FIRN_LAMBDA {
        if (contact == Contact::none) return;
        const S gap = distance + dot(normal, x - from) - radius;  // where surfaces before it have put the point
        if (!(gap < 0)) return;
        const Vec<S, D> relative = v - of_surface;
        const S into = min(dot(relative, normal), S(0));
        v = of_surface + velocity_after_impact(relative, normal, contact, friction, -restitution * into);
        x -= normal * min(gap + S(contact_slack) * radius, S(0));
    });
}

/// All points that are not pinned against a boundary. A point without radius touches by its position.
/// \param boundary     a boundary policy in S that says where its surfaces are
/// \param restitution  Newton's coefficient e, 0 to 1 [1]
/// \throws parameter_error  for another restitution, and what the boundary throws
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
