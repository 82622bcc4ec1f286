/// \file What a boundary is: from a node's position [m] and velocity [m/s] to its velocity. A pure function.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>

#include <algorithm>
#include <type_traits>

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

namespace detail {
template <class T, int N>
struct precision_and_dimension {
    using S = T;
    static constexpr int D = N;
};
/// Which S and D a boundary is made for; of one that does not say, nothing.
template <class B>
struct made_for {};
template <template <class, int> class B, class S, int D>
struct made_for<B<S, D>> : precision_and_dimension<S, D> {};
template <class B>
    requires requires {
        typename B::S;
        B::D;
    }
struct made_for<B> : precision_and_dimension<typename B::S, B::D> {};
template <class... B>
struct made_for_first {};  // of the first that says so
template <class First, class... Rest>
struct made_for_first<First, Rest...> : made_for_first<Rest...> {};
template <class First, class... Rest>
    requires requires { made_for<First>::D; }
struct made_for_first<First, Rest...> : made_for<First> {};
template <template <class...> class All, class First, class... Rest>  // a Together, a BoundaryList
    requires(
        requires(All<First, Rest...> all) { all.parts; } || requires(All<First, Rest...> all) { all.all; })
struct made_for<All<First, Rest...>> : made_for_first<First, Rest...> {};

/// Is B made for nodes in S and D? True where it is not known.
template <class B, class S, int D>
struct boundary_fits : std::true_type {};
template <class B, class S, int D>
    requires requires { made_for<B>::D; }
struct boundary_fits<B, S, D> : std::bool_constant<std::same_as<typename made_for<B>::S, S> && made_for<B>::D == D> {};
template <template <class...> class All, class... B, class S, int D>
    requires(
        requires { made_for<All<B...>>::D; } &&
        (requires(All<B...> all) { all.parts; } || requires(All<B...> all) { all.all; }))
struct boundary_fits<All<B...>, S, D> : std::conjunction<boundary_fits<B, S, D>...> {};

/// True, or the compiler says that B is made for others.
template <class B, class S, int D>
consteval bool require_fitting_boundary() {
    static_assert(boundary_fits<B, S, D>::value,
                  "firn: the boundary is of another precision or dimension than the particles and the grid: with "
                  "FixedCorotated<float> in 3D go Walls<float, 3> and Collider<Sphere<float, 3>>.");
    return boundary_fits<B, S, D>::value;
}
}  // namespace detail

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

/// The boundary on the nodes of a grid with cells of side h [m]: what `on_grid(h)` of one that has to know h says;
/// others stay as they are.
template <class B, class H>
FIRN_INLINE B on_grid(const B& boundary, const H& h) {
    if constexpr (requires { boundary.on_grid(h); })
        return boundary.on_grid(h);
    else
        return boundary;
}

// A boundary may be made of parts, which act one after another and whose reactions are told apart. It then offers
// part_count(), template centre_of_part<D>(k), and velocity_among(x, v, others, seen, first), which calls
// seen(first + k, before, after) for each in turn.
//
// A part may look at the surfaces of the solids beside it: others(x, seen) calls seen for each as surfaces(x, seen)
// does, below. A part that wants to know offers velocity_beside(others, x, v).

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

/// Beside a boundary that stands alone.
struct NoOthers {
    template <class X, class Seen>
    FIRN_INLINE void operator()(const X&, const Seen&) const {}
};

/// boundary.velocity(x, v) beside others, and seen(first + k, velocity before, velocity after) for every part k.
template <class B, class S, int D, class Others, class Seen>
FIRN_INLINE Vec<S, D> velocity_among(const B& boundary, const Vec<S, D>& x, const Vec<S, D>& v, const Others& others,
                                     const Seen& seen, int first = 0) {
    if constexpr (requires { boundary.velocity_among(x, v, others, seen, first); }) {
        return boundary.velocity_among(x, v, others, seen, first);
    } else {
        const auto act = [&]() FIRN_LAMBDA {
            if constexpr (requires { boundary.velocity_beside(others, x, v); })
                return boundary.velocity_beside(others, x, v);
            else
                return Vec<S, D>(detail::in_own_terms(boundary.velocity(x, v)));
        };
        const Vec<S, D> after = act();
        seen(first, v, after);
        return after;
    }
}

/// How far [m] a boundary's parts look for others: it may change nodes that far from where it reaches, if others are
/// there.
template <class B>
double looks_around(const B& boundary) {
    if constexpr (requires { boundary.looks_around(); })
        return boundary.looks_around();
    else
        return 0;
}

/// May nodes of the box [lower, upper] be changed by one of several, `count` of them, which look at one another?
/// \param part  part(k, f) calls f(the k-th)
template <int D, class Part>
bool reach_together(int count, const Part& part, const Vec<double, D>& lower, const Vec<double, D>& upper) {
    bool reached = false;
    double around = 0;
    for (int k = 0; k < count && !reached; ++k)
        part(k, [&](const auto& one) {
            reached = one.reaches(lower, upper);
            around = std::max(around, looks_around(one));
        });
    if (reached || around == 0) return reached;
    int near = 0;
    const Vec<double, D> margin = Vec<double, D>::filled(around);
    for (int k = 0; k < count && near < 2; ++k)
        part(k, [&](const auto& one) { near += one.reaches(lower - margin, upper + margin); });
    return near == 2;
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
