/// \file The concept of a boundary: a pure function that returns a node's new velocity [m/s], from the node's position
/// [m] and velocity [m/s].
///
/// A boundary must have
///
///     Vec velocity(x, v)                 the velocity [m/s] of a node at x [m] after the boundary has acted; v [m/s]
///                                        is the node's velocity before
///     bool reaches(lower, upper)         true if the boundary may change nodes in the box [lower, upper] [m]; if the
///                                        result is false, firn may skip all nodes in the box
///
/// and may have
///
///     Vec velocity(x, v, mass, dt)       in place of velocity(x, v), for boundaries that act with a force: the mass of
///                                        the node [kg] and the time step [s] turn a force into a change of velocity
///     void check()                       throws parameter_error if a parameter is out of range
///     advanced(dt)                       returns the boundary at a time dt [s] later; for boundaries that move
///     on_grid(h)                         returns the boundary for cells of side h [m]; for boundaries that depend on h
///     measured_from(corner)              returns the boundary for positions that are measured from `corner` [m], in
///                                        double; for boundaries that are to work in domains far from 0
///     double largest_speed(lower, upper) the largest speed [m/s] that the boundary gives to nodes in a box
///     void surfaces(x, seen)             calls seen(distance, normal, velocity, contact, friction) for each surface
///     double exact_up_to()               the distance [m] from which on the distances of surfaces() are not exact
///     void acting_surfaces(x, v, others, seen)  calls seen(surface) for each surface that acts on a node; see
///                                        has_acting_surfaces
///     void mirrors(seen)                 calls seen for each plane of symmetry; see has_mirrors
///     Vec velocity_by_gap(x, v, act)     as velocity(), by the gap of particles; see GapContact
///     std::string description()          a text that is written into files
///     std::uint64_t digest()             tells a restart whether data that are no parameters are the same; see
///                                        core/digest.hpp
#pragma once

#include <firn/boundary/at_once.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>

#include <algorithm>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// Whether B has a function `velocity(position, velocity)`. The function returns a node's velocity [m/s] after the
/// boundary has acted.
template <class B, class S, int D>
concept changes_velocity = requires(const B b, const Vec<S, D> v) {
    { detail::in_own_terms(b.velocity(v, v)) } -> std::same_as<Vec<S, D>>;  ///< velocity(position, velocity)
};
/// Whether B has a function `velocity(position, velocity, mass, dt)`, for boundaries that act with a force. firn then
/// calls this function, with the mass of the node [kg], which is positive, and the time step [s], and not
/// velocity(position, velocity). Each contact group at a node has a mass and a velocity of its own.
template <class B, class S, int D>
concept acts_by_force = requires(const B b, const Vec<S, D> v, const S s) {
    { detail::in_own_terms(b.velocity(v, v, s, s)) } -> std::same_as<Vec<S, D>>;  ///< velocity(position, velocity, …)
};
/// Whether B has a function `reaches(lower, upper)`. The function returns true if the boundary may change nodes in the
/// box [lower, upper] [m]. If the result is false, firn may skip all nodes in the box.
template <class B, int D>
concept says_where = requires(const B b, const Vec<double, D> x) {
    { b.reaches(x, x) } -> std::same_as<bool>;
};

/// Whether B is a boundary in D dimensions with scalar type S.
template <class B, class S, int D>
concept boundary = (changes_velocity<B, S, D> || acts_by_force<B, S, D>) && says_where<B, D>;

/// The mass of a node [kg] and the time step [s], for boundaries that act with a force. \see acts_by_force
template <class S>
struct NodeInertia {
    S mass;  ///< mass of the node [kg]
    S dt;    ///< time step [s]
};
/// In place of a NodeInertia where the mass and the time step are not known.
struct NoInertia {};

/// Returns the velocity [m/s] of a node at x [m] after a boundary has acted; v [m/s] is the node's velocity before.
/// \param inertia  the mass of the node and the time step
template <class B, class S, int D, class Inertia>
FIRN_INLINE Vec<S, D> velocity_after(const B& boundary, const Vec<S, D>& x, const Vec<S, D>& v,
                                     const Inertia& inertia) {
    if constexpr (!acts_by_force<B, S, D>) {
        return Vec<S, D>(detail::in_own_terms(boundary.velocity(x, v)));
    } else {
        constexpr bool known = std::same_as<Inertia, NodeInertia<S>>;
        static_assert(known,
                      "firn: this boundary has velocity(x, v, mass, dt), so it acts in grid_update() and in a "
                      "Simulation, which know the mass of the node and the time step. Here they are not known.");
        if constexpr (known)
            return Vec<S, D>(detail::in_own_terms(boundary.velocity(x, v, inertia.mass, inertia.dt)));
        else
            return v;
    }
}

namespace detail {
template <class T, int N>
struct precision_and_dimension {
    using S = T;
    static constexpr int D = N;
};
/// A struct with the scalar type S and the dimension D for which the boundary type B is made. The struct is empty if S
/// and D cannot be read from the type B.
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
struct made_for_first {};  // S and D of the first type in the list that tells S and D
template <class First, class... Rest>
struct made_for_first<First, Rest...> : made_for_first<Rest...> {};
template <class First, class... Rest>
    requires requires { made_for<First>::D; }
struct made_for_first<First, Rest...> : made_for<First> {};
/// Whether the boundary type B consists of other boundaries: Together, BoundaryList, GapContact. It then has a function
/// for_members(f), which calls f with each of them.
template <class B>
concept has_boundaries = requires(const B all) { all.for_members(AnySurface{}); };
template <template <class...> class All, class First, class... Rest>
    requires has_boundaries<All<First, Rest...>>
struct made_for<All<First, Rest...>> : made_for_first<First, Rest...> {};

/// Whether B is made for nodes with scalar type S in D dimensions. The value is also true if S and D cannot be read
/// from the type B.
template <class B, class S, int D>
struct boundary_fits : std::true_type {};
template <class B, class S, int D>
    requires requires { made_for<B>::D; }
struct boundary_fits<B, S, D> : std::bool_constant<std::same_as<typename made_for<B>::S, S> && made_for<B>::D == D> {};
template <template <class...> class All, class... B, class S, int D>
    requires(requires { made_for<All<B...>>::D; } && has_boundaries<All<B...>>)
struct boundary_fits<All<B...>, S, D> : std::conjunction<boundary_fits<B, S, D>...> {};

/// Whether B, converted to the scalar type P, changes the velocities of nodes.
template <class P, class B, int D>
concept acts_in = changes_velocity<with_scalar_t<B, P>, P, D> || acts_by_force<with_scalar_t<B, P>, P, D>;

/// Returns true if a boundary, or each of the boundaries of which it consists, offers what a boundary must. If one does
/// not, the compilation stops with a message.
/// \tparam P  the scalar type in which nodes are computed
/// @{
template <class P, int D, class B>
consteval bool require_offers(std::type_identity<B>) {
    static_assert(says_where<B, D>,
                  "firn: a boundary offers `bool reaches(lower, upper) const`, with two firn::Vec<double, D>: whether "
                  "it may change nodes in this box [m]; see firn/boundary/concept.hpp.");
    static_assert(can_be_lifted<B>,
                  "firn: a boundary that is a template over its scalar lists its parameters in a static function "
                  "parameters(); see firn/core/parameters.hpp.");
    constexpr bool acts = !can_be_lifted<B> || acts_in<P, B, D>;
    static_assert(
        acts,
        "firn: a boundary offers `template <class S> firn::Vec<S, D> velocity(const firn::Vec<S, D>& x, const "
        "firn::Vec<S, D>& v) const` for every scalar S, because firn calls it with many nodes at once; or "
        "the same with `const S& mass, const S& dt` in addition. It is no function of float or double alone; "
        "see firn/boundary/concept.hpp.");
    return says_where<B, D> && can_be_lifted<B> && acts;
}
template <class P, int D, template <class...> class All, class... B>
    requires has_boundaries<All<B...>>
consteval bool require_offers(std::type_identity<All<B...>>) {
    return (require_offers<P, D>(std::type_identity<B>{}) && ...);
}
/// @}

/// Returns true if B is a boundary for nodes with scalar type S in D dimensions. If B is not, the compilation stops
/// with a message.
template <class B, class S, int D>
consteval bool require_boundary() {
    static_assert(boundary_fits<B, S, D>::value,
                  "firn: the boundary is of another precision or dimension than the particles and the grid. With "
                  "FixedCorotated<float> in 3D, use Walls<float, 3> and Collider<Sphere<float, 3>>.");
    if constexpr (boundary_fits<B, S, D>::value)
        return require_offers<native_pack<S>, D>(std::type_identity<B>{});
    else
        return false;
}
}  // namespace detail

/// Whether the boundary type B acts by the gap between matter and surfaces, which the particles tell. \see GapContact
template <class B>
inline constexpr bool acts_by_gap = false;

/// Whether a boundary of type B, or a part of it, is a body that matter pushes. \see RigidBody
template <class B>
inline constexpr bool has_rigid_bodies = requires { B::is_rigid_body; };
/// The same for boundaries that consist of others.
template <template <class...> class All, class... B>
    requires detail::has_boundaries<All<B...>>
inline constexpr bool has_rigid_bodies<All<B...>> =
    requires { All<B...>::is_rigid_body; } || (has_rigid_bodies<B> || ...);

namespace detail {
/// Calls f(part, by_gap) for each part of a boundary that has no parts itself. `by_gap` is true if the part acts by the
/// gap between matter and its surface, so that matter touches the surface. \see GapContact
template <class B, class F>
FIRN_INLINE void for_single_parts(const B& boundary, const F& f, bool by_gap = false) {
    if constexpr (has_boundaries<B>)
        boundary.for_members([&](const auto& one) FIRN_LAMBDA { for_single_parts(one, f, by_gap || acts_by_gap<B>); });
    else
        f(boundary, by_gap);
}
}  // namespace detail

/// Calls the boundary's check(), if it has one.
/// \throws parameter_error if boundary.check() throws it
template <class B>
void check_boundary(const B& boundary) {
    if constexpr (requires { boundary.check(); }) boundary.check();
}

/// Returns the boundary at a time dt [s] later: boundary.advanced(dt) if the boundary has this function, else the
/// boundary unchanged.
template <class B>
[[nodiscard]] B advanced(const B& boundary, double dt) {
    if constexpr (requires { boundary.advanced(dt); })
        return boundary.advanced(dt);
    else
        return boundary;
}

/// Returns the largest speed [m/s] that a moving boundary can give to nodes in the box [lower, upper] [m]; this speed
/// limits the time step. Returns zero for a boundary without largest_speed().
template <class B, int D>
double largest_speed(const B& boundary, const Vec<double, D>& lower, const Vec<double, D>& upper) {
    double largest = 0;
    if constexpr (requires { boundary.largest_speed(lower, upper); })
        largest = boundary.largest_speed(lower, upper);
    else if constexpr (detail::has_boundaries<B>)
        boundary.for_members(
            [&](const auto& one) { largest = std::max(largest, firn::largest_speed(one, lower, upper)); });
    return largest;
}

/// Returns the boundary for a grid with cells of side h [m]: boundary.on_grid(h) if the boundary has this function,
/// else the boundary unchanged.
template <class B, class H>
[[nodiscard]] FIRN_INLINE B on_grid(const B& boundary, const H& h) {
    if constexpr (requires { boundary.on_grid(h); })
        return boundary.on_grid(h);
    else
        return boundary;
}

// A boundary may have parts, whose reactions are recorded separately. Such a boundary has for_parts(others, f, first),
// and for_members(f), or part_count() and template centre_of_part<D>(k). The surfaces of all parts act at once, see
// at_once.hpp; a part without acting_surfaces() acts after them, in the order of the parts.
//
// The effect of a part may depend on the surfaces of other solids. For such a part, `others` is a function: others(x,
// seen) calls `seen` for each surface of the other solids. The arguments of `seen` are explained at has_surfaces.

/// Returns the number of a boundary's parts: of a Together, BoundaryList or GapContact, of those of all its boundaries;
/// of a boundary without part_count(), 1.
template <class B>
int part_count(const B& boundary) {
    int count = 0;
    if constexpr (requires { boundary.part_count(); })
        count = boundary.part_count();
    else if constexpr (detail::has_boundaries<B>)
        boundary.for_members([&](const auto& one) { count += firn::part_count(one); });
    else
        count = 1;
    return count;
}

/// Returns the point [m] about which the torque on part k is computed: the part's position if it has one, else the
/// origin, also if there is no part k.
/// \param k  index of a part, from 0 to part_count() − 1
template <int D, class B>
Vec<double, D> part_centre(const B& boundary, int k) {
    Vec<double, D> centre = Vec<double, D>::zero();
    if constexpr (requires { boundary.template centre_of_part<D>(k); })
        centre = boundary.template centre_of_part<D>(k);
    else if constexpr (detail::has_boundaries<B>)
        boundary.for_members([&](const auto& one) {
            const int count = firn::part_count(one);
            if (k >= 0 && k < count) centre = firn::part_centre<D>(one, k);
            k -= count;
        });
    else if constexpr (requires { boundary.position; })
        centre = cast<double>(boundary.position);
    return centre;
}

/// A function object to pass as `others` where there are no other solids.
struct NoOthers {
    /// Does nothing: there is no surface for which to call `seen`.
    template <class X, class Seen>
    FIRN_INLINE void operator()(const X&, const Seen&) const {}
};

/// Calls f(part, others, k) for each part of a boundary; a boundary without for_parts() is its only part.
/// \param others  a function: others(x, seen) calls `seen` for each surface of other solids. The function `others` that
///                f gets calls it for the surfaces of the boundary's other parts, too
/// \param first   the index k of the first part
template <class B, class Others, class F>
FIRN_INLINE void for_parts(const B& boundary, const Others& others, const F& f, int first = 0) {
    if constexpr (requires { boundary.for_parts(others, f, first); })
        boundary.for_parts(others, f, first);
    else
        f(boundary, others, first);
}

/// Whether B has a function `acting_surfaces(x, v, others, seen)`. For each surface that acts on a node at x [m] with
/// the velocity v [m/s], the function calls seen(surface) with an ActingSurface. \see NodeAtSurfaces
template <class B, class S, int D>
concept has_acting_surfaces =
    requires(const B b, const Vec<S, D> x) { b.acting_surfaces(x, x, NoOthers{}, AnySurface{}); };

/// Whether `seen` needs the normal of a surface that sticks, too; without gaps the velocity is that of the solid.
template <class Seen>
inline constexpr bool needs_normals = requires { Seen::needs_normals; };

/// Whether `seen` takes, after a surface, a function that looks for the face that matter touches. \see ActByGap
template <class Seen>
inline constexpr bool looks_at_matter = requires { Seen::looks_at_matter; };

/// Returns the velocity [m/s] of a node at x [m] after all parts of a boundary have acted: first all surfaces at once,
/// then parts of which firn does not know the surfaces, one after another.
/// \param x       the node's position [m]
/// \param v       the node's velocity before the boundary acts [m/s]
/// \param others  a function: others(x, seen) calls `seen` for each surface of the other solids
/// \param seen    a function, called as seen(first + k, before, after) for what part k does, with velocities [m/s] of
///                the node. Each difference is the share of this part; their sum is the whole change
/// \param inertia  the mass of the node and the time step, for parts that act with a force
/// \param first   the index that `seen` gets for part 0 of the boundary
template <class B, class S, int D, class Others, class Seen, class Inertia = NoInertia>
FIRN_INLINE Vec<S, D> velocity_among(const B& boundary, const Vec<S, D>& x, const Vec<S, D>& v, const Others& others,
                                     const Seen& seen, const Inertia& inertia = {}, int first = 0) {
    NodeAtSurfaces<S, D> node(v);
    for_parts(
        boundary, others,
        [&]<class Part>(const Part& part, const auto& beside, int k) FIRN_LAMBDA {
            if constexpr (has_acting_surfaces<Part, S, D>)
                part.acting_surfaces(x, v, beside,
                                     [&](const ActingSurface<S, D>& surface) FIRN_LAMBDA { node.add(k, surface); });
        },
        first);
    Vec<S, D> after = node.velocity(seen);
    for_parts(
        boundary, others,
        [&]<class Part>(const Part& part, const auto&, int k) FIRN_LAMBDA {
            if constexpr (!has_acting_surfaces<Part, S, D>) {
                const Vec<S, D> before = after;
                after = velocity_after(part, x, before, inertia);
                seen(k, before, after);
            }
        },
        first);
    return after;
}

/// Returns a distance [m]: only other solids within this distance of a node can change how a boundary acts on the node.
/// Near another solid, the boundary may also change nodes up to this distance outside of the boxes for which reaches()
/// is true. Returns zero for a boundary without looks_around().
template <class B>
double looks_around(const B& boundary) {
    double farthest = 0;
    if constexpr (requires { boundary.looks_around(); })
        farthest = boundary.looks_around();
    else if constexpr (detail::has_boundaries<B>)
        boundary.for_members([&](const auto& one) { farthest = std::max(farthest, firn::looks_around(one)); });
    return farthest;
}

namespace detail {

/// Whether a boundary is a list in which there is nothing. A simulation that is chosen at run time has several.
template <class B>
FIRN_INLINE bool is_empty_list(const B& boundary) {
    if constexpr (requires { boundary.all.empty(); })
        return boundary.all.empty();
    else
        return false;
}

/// Returns true if at least one of a boundary's boundaries may change nodes in the box [lower, upper] [m], either alone
/// or because another of them is near. \see looks_around
template <has_boundaries All, int D>
bool reach_together(const All& all, const Vec<double, D>& lower, const Vec<double, D>& upper) {
    bool reached = false;
    double around = 0;
    all.for_members([&](const auto& one) {
        if (reached || is_empty_list(one)) return;
        reached = one.reaches(lower, upper);
        around = std::max(around, looks_around(one));
    });
    if (reached || around == 0) return reached;
    int near = 0;
    const Vec<double, D> margin = Vec<double, D>::filled(around);
    all.for_members([&](const auto& one) {
        near += near < 2 && !is_empty_list(one) && one.reaches(lower - margin, upper + margin);
    });
    return near == 2;
}

/// Calls `seen` for the mirrored walls of all of a boundary's boundaries. \see has_mirrors
template <has_boundaries All, class Seen>
void mirrors_together(const All& all, const Seen& seen) {
    int first = 0;
    all.for_members([&]<class B>(const B& one) {
        if constexpr (requires { one.mirrors(seen); })
            one.mirrors([&](auto axis, auto position, auto inward, auto contact, auto friction, int k) {
                seen(axis, position, inward, contact, friction, first + k);
            });
        first += part_count(one);
    });
}

/// Returns the descriptions of all of a boundary's boundaries, separated by "; ".
template <has_boundaries All>
std::string descriptions(const All& all) {
    std::string text;
    all.for_members([&](const auto& one) {
        if constexpr (requires { one.description(); }) {
            if (!text.empty()) text += "; ";
            text += one.description();
        }
    });
    return text;
}

}  // namespace detail

/// Returns the distance [m] from which on the distances that a boundary's surfaces() tells are not exact; infinite for
/// a boundary without exact_up_to().
template <class B>
double exact_up_to(const B& boundary) {
    double least = std::numeric_limits<double>::infinity();
    if constexpr (requires { boundary.exact_up_to(); })
        least = boundary.exact_up_to();
    else if constexpr (detail::has_boundaries<B>)
        boundary.for_members([&](const auto& one) { least = std::min(least, firn::exact_up_to(one)); });
    return least;
}

/// Whether B has a function `surfaces(x, seen)`. The function reports where the surfaces of the boundary are, seen from
/// a point x [m], which need not be a node. For each surface, the function calls
///
///     seen(distance, normal, velocity, contact, friction)
///
/// with the distance of x from the surface [m], negative in the solid; the surface's unit normal, which points into
/// free space; the velocity of the solid at x [m/s]; the Contact; and Coulomb's friction coefficient [1].
template <class B, class S, int D>
concept has_surfaces = requires(const B b, const Vec<S, D> x) { b.surfaces(x, AnySurface{}); };

/// Whether B has a function `mirrors(seen)`. The function reports the walls behind which nodes move like mirror images.
/// For each such wall, which lies across an axis, it calls
///
///     seen(axis, position, inward, contact, friction, part)
///
/// with the position of the wall along the axis [m]; inward = 1 if matter lies above the wall along the axis, −1 if it
/// lies below; the Contact; Coulomb's friction coefficient [1]; and the index of the boundary's part that the wall
/// belongs to. velocity() of such a boundary does not change the nodes that mirrored() changes. \see NodesBehind
template <class B>
concept has_mirrors = requires(const B b) { b.mirrors(AnySurface{}); };

}  // namespace firn::inline FIRN_BUILD
