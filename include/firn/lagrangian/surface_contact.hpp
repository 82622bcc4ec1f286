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
#include <type_traits>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Whether lift<T>() accepts the boundary or shape P; for a P that consists of others, without these.
template <class P, class T>
        struct can_itself_be_lifted : std::bool_constant < std::same_as<with_scalar_t<P, T>, P> ||
    has_parameters<P> || requires(const P policy) {
    policy.template lifted<T>();
}>{};
/// Whether lift<T>() accepts the boundary or shape P, and all that it consists of.
template <class P, class T>
struct can_be_lifted : can_itself_be_lifted<P, T> {};
template <template <class...> class All, class... P, class T>
struct can_be_lifted<All<P...>, T> : std::conjunction<can_itself_be_lifted<All<P...>, T>, can_be_lifted<P, T>...> {};
template <class S, class T>
    requires std::is_arithmetic_v<S>
struct can_be_lifted<S, T> : std::true_type {};

/// Whether the surfaces of a boundary B can be seen from a position in double.
template <class B, int D>
inline constexpr bool sees_exactly = [] {
    if constexpr (can_be_lifted<B, double>::value)
        return has_surfaces<with_scalar_t<B, double>, double, D>;
    else
        return false;
}();

/// Calls f(see), where see(x, seen) calls `seen` for each surface of the boundary, as has_surfaces says, with numbers
/// of type S. The position x is in double. Distances are computed in double, too, so that they do not lose digits far
/// from the origin; only a boundary that exists in no other precision than S gets x rounded to S.
template <std::floating_point S, int D, class B, class F>
void with_surfaces(const B& boundary, const F& f) {
    if constexpr (sees_exactly<B, D>) {
        const auto exact = lift<double>(boundary);
        f([&](const Vec<double, D>& x, const auto& seen) FIRN_LAMBDA {
            exact.surfaces(x, [&](double distance, const Vec<double, D>& normal, const Vec<double, D>& velocity,
                                  Contact contact, double friction) FIRN_LAMBDA {
                seen(S(distance), cast<S>(normal), cast<S>(velocity), contact, S(friction));
            });
        });
    } else {
        const auto lifted = lift<S>(boundary);
        f([&](const Vec<double, D>& x, const auto& seen) FIRN_LAMBDA { lifted.surfaces(cast<S>(x), seen); });
    }
}

/// Applies the contact of one point with the surfaces of a boundary, one surface after another. \see meet_surfaces
/// \param see           see with_surfaces()
/// \param restitution   Newton's coefficient of restitution between point and surface, from 0 to 1 [1]
/// \param radius        radius of the point [m]
/// \param acceleration  acceleration of the point in the step [m/s²]
/// \param lag, step     see Approach [s]
/// \param x             position of the point [m], changed in place
/// \param v             velocity of the point [m/s], changed in place
template <class See, std::floating_point S, int D>
FIRN_INLINE void meet_surfaces(const See& see, S restitution, S radius, const Vec<S, D>& acceleration, S lag, S step,
                               Vec<double, D>& x, Vec<S, D>& v) {
    Vec<S, D> moved = Vec<S, D>::zero();  // by the surfaces so far
    see(x, [&](S distance, const Vec<S, D>& normal, const Vec<S, D>& of_surface, Contact contact,
               S friction) FIRN_LAMBDA {
        if (contact == Contact::none) return;
        S gap = distance + dot(normal, moved) - radius;
        if (!(gap < 0)) return;
        const Vec<S, D> relative = v - of_surface;
        const S rate = dot(relative, normal);
        Rebound<S> after{0, 0};
        if (contact == Contact::separate && restitution > 0 && rate < 0)
            after = rebound(-gap, rate, dot(acceleration, normal), lag, step, restitution);
        const Vec<S, D> back = of_surface + velocity_after_impact(relative, normal, contact, friction, after.leaving);
        if (after.since > 0) {
            const Vec<S, D> way = (back - v) * after.since;
            moved += way;
            gap += dot(normal, way);
        }
        v = back;
        moved -= normal * min(gap + S(contact_slack) * radius, S(0));
    });
    x += cast<double>(moved);
}

}  // namespace detail

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
///
/// A point touches a surface if its distance from the surface is below its radius. The surface's Contact then changes
/// the point's velocity relative to the surface; Contact::separate acts with restitution, see rebound(). A point that
/// rebounds is moved to where it would be if its velocity had changed when it met the surface. If a point overlaps the
/// surface by more than contact_slack times its radius, it is also moved outwards until the overlap is only
/// contact_slack times the radius. These shifts do not change velocities.
/// \param points       the points; their positions and velocities are changed in place
/// \param boundary     a boundary with a member function surfaces(), see has_surfaces. Its distances are computed in
///                     double if it can be lifted to double; else in S.
/// \param restitution  Newton's coefficient of restitution between points and surfaces, from 0 to 1 [1]
/// \param threads      number of threads; 0: the number that thread_count() returns
/// \param approach     how the points have come to their positions; by default not known: a point that rebounds is then
///                     not moved for it
/// \throws parameter_error  if the restitution is not from 0 to 1, or if check_boundary() or check_distances() throws
///                          it
template <std::floating_point S, int D, class B, class Acceleration = NoAcceleration<S, D>>
void meet_surfaces(PointMasses<S, D>& points, const B& boundary, double restitution = 0, int threads = 0,
                   const Approach<Acceleration>& approach = {}) {
    static_assert(has_surfaces<with_scalar_t<B, S>, S, D>,
                  "firn: the boundary must offer surfaces(x, seen) in the points' scalar and dimension; see "
                  "firn/boundary/concept.hpp.");
    check_restitution(restitution);
    check_boundary(boundary);
    check_distances(points, boundary);
    detail::with_surfaces<S, D>(boundary, [&](const auto& see) {
        parallel_for(
            points.size(), thread_count(threads),
            [&](std::size_t i, int) {
                if (points.inverse_mass[i] == 0) return;
                const Vec<S, D> acceleration = restitution > 0 ? approach.acceleration(i) : Vec<S, D>::zero();
                detail::meet_surfaces(see, S(restitution), points.radius[i], acceleration, S(approach.lag),
                                      S(approach.step), points.position[i], points.velocity[i]);
            },
            1024);
    });
}

}  // namespace firn::inline FIRN_BUILD
