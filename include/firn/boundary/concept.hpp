/// \file What a boundary is: from a node's position [m] and velocity [m/s] to its velocity. A pure function.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>

namespace firn {

template <class B, class S, int D>
concept changes_velocity = requires(const B b, const Vec<S, D> v) {
    { detail::in_own_terms(b.velocity(v, v)) } -> std::same_as<Vec<S, D>>;  ///< velocity(position, velocity)
};
/// May nodes of the box [lower, upper] be changed? Whole blocks of nodes are skipped by it.
template <class B, int D>
concept says_where = requires(const B b, const Vec<double, D> x) {
    { b.reaches(x, x) } -> std::same_as<bool>;
};

/// B is given with the scalar S.
template <class B, class S, int D>
concept boundary = changes_velocity<B, S, D> && says_where<B, D>;

/// \throws what the boundary's own check throws, if it has one
template <class B>
void check_boundary(const B& boundary) {
    if constexpr (requires { boundary.check(); }) boundary.check();
}

/// The boundary dt [s] later: what `advanced(dt)` of a boundary that moves says; others stay as they are.
template <class B>
B advanced(const B& boundary, double dt) {
    if constexpr (requires { boundary.advanced(dt); })
        return boundary.advanced(dt);
    else
        return boundary;
}

/// The largest speed [m/s] that the boundary can give to nodes of the box [lower, upper], beyond what they have: for
/// the bound of the time step. Zero for what does not move.
template <class B, int D>
double largest_speed(const B& boundary, const Vec<double, D>& lower, const Vec<double, D>& upper) {
    if constexpr (requires { boundary.largest_speed(lower, upper); })
        return boundary.largest_speed(lower, upper);
    else
        return 0;
}

// A boundary may be made of parts, which act one after another and whose reactions are told apart. It then offers
// part_count(), template centre_of_part<D>(k), and velocity(x, v, seen, first), which calls seen(first + k, before,
// after) for each in turn.

template <class B>
int part_count(const B& boundary) {
    if constexpr (requires { boundary.part_count(); })
        return boundary.part_count();
    else
        return 1;
}

/// The point that the torque on part k is about: the position of what has one [m], else the origin.
template <int D, class B>
Vec<double, D> part_centre(const B& boundary, int k) {
    if constexpr (requires { boundary.template centre_of_part<D>(k); })
        return boundary.template centre_of_part<D>(k);
    else if constexpr (requires { boundary.position; })
        return cast<double>(boundary.position);
    else
        return Vec<double, D>::zero();
}

/// boundary.velocity(x, v), and seen(first + k, velocity before, velocity after) for every part k.
template <class B, class S, int D, class Seen>
FIRN_INLINE Vec<S, D> velocity_by_parts(const B& boundary, const Vec<S, D>& x, const Vec<S, D>& v, const Seen& seen,
                                        int first = 0) {
    if constexpr (requires { boundary.velocity(x, v, seen, first); }) {
        return detail::in_own_terms(boundary.velocity(x, v, seen, first));
    } else {
        const Vec<S, D> after = detail::in_own_terms(boundary.velocity(x, v));
        seen(first, v, after);
        return after;
    }
}

// For points that are not nodes, a boundary says where its surfaces are: surfaces(x, seen) calls
//
//     seen(distance, normal, velocity, contact, friction)
//
// for each: the distance of x from it [m], negative in the solid; its unit normal into free space; the velocity of the
// solid at x [m/s]; a Contact; and Coulomb's coefficient [1].

/// What is called for a surface, as the concepts try it.
struct AnySurface {
    template <class... Of>
    constexpr void operator()(const Of&...) const {}
};

template <class B, class S, int D>
concept has_surfaces = requires(const B b, const Vec<S, D> x) { b.surfaces(x, AnySurface{}); };

}  // namespace firn
