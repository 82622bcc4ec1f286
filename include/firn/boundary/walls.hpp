/// \file Walls on the faces of a box.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/core/error.hpp>

#include <concepts>
#include <limits>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// The wall on one face of a box. \tparam P  the scalar type of the friction
template <class P>
struct WallOf {
    Contact contact = Contact::separate;  ///< How matter may move at the face.
    P friction = P(0);                    ///< Coulomb's friction coefficient μ [1]
};
/// The wall on one face of a box.
using Wall = WallOf<double>;

/// How the nodes behind a wall move.
enum class NodesBehind {
    held,     ///< Like the nodes on the wall: their normal velocity is set to zero (for a stick wall, all of it).
    mirrored  ///< Like mirror images of the nodes in front of the wall. The wall must lie on a plane of nodes.
};

/// Walls on the faces of a box, with matter inside: the default boundary of a simulation.
///
/// Each face has its own contact and friction; a face with Contact::none has no wall. `nodes_behind` chooses one of two
/// rules for the nodes beside a wall:
///
/// - `held`: nodes on a face, and the ghost nodes outside of the box, get the velocity that velocity_after_contact()
///   returns. A face between two planes of nodes acts on the nearer one, so it stands up to half a cell from where it
///   was put; a simulation warns of that. The velocity gradient at particles near the wall is then too small. In the
///   two cells next to the wall, stresses have an error of about a fifth, also with finer cells; between slipping
///   walls, convergence is of first order.
/// - `mirrored`: matter moves as if its mirror image stood behind the wall. A wall with contact `slip` and without
///   friction is then a plane of symmetry: half a body at the wall moves as half of the whole body, to rounding. At a
///   wall with contact `stick` the velocity is an odd function of the distance from the wall. Convergence is of second
///   order. \see mirrored
///
/// All held faces act on a node at once, whatever the order of axes. Mirrored faces act one axis after another: in an
/// edge with friction, exchanged axes can change the velocity along it, by about a hundredth.
///
/// Mirrored faces must lie on planes of nodes, and opposite faces at least 3 cells apart. More than a cell and a half
/// behind a face, nodes are held under either rule. Implicit and quasi-static steps take mirrored faces that stick, or
/// slip without friction.
template <scalar S, int D>
struct Walls {
    /// The scalar type of the corners: double if S is float or double, else S. So walls stand where they were put in
    /// domains far from 0, too.
    using P = std::conditional_t<std::floating_point<S>, double, S>;

    Vec<P, D> lower{};                             ///< lower corner of the box [m]
    Vec<P, D> upper{};                             ///< upper corner of the box [m]
    std::array<WallOf<P>, D> at_lower{},           ///< the wall at the lower end of each axis
        at_upper{};                                ///< the wall at the upper end of each axis
    NodesBehind nodes_behind = NodesBehind::held;  ///< How nodes behind all walls move.
    S mirrored_depth = S(0);  ///< How far behind a face nodes are not held [m]. on_grid() computes it.
    S half_cell = S(0);       ///< How far in front of a face nodes are held [m]. on_grid() computes it.

    /// Returns walls on all faces of the box [lower, upper] [m], each with the contact and the friction of `wall`.
    /// \throws parameter_error if check() throws it
    /// @{
    static Walls all(const Vec<P, D>& lower, const Vec<P, D>& upper, Wall wall) {
        Walls walls{lower, upper, {}, {}};
        walls.at_lower.fill(wall);
        walls.at_upper.fill(wall);
        walls.check();
        return walls;
    }
    template <class T>
        requires(!std::same_as<T, P>)
    static Walls all(const Vec<T, D>& lower, const Vec<T, D>& upper, Wall wall) {
        return all(cast<P>(lower), cast<P>(upper), wall);
    }
    /// @}

    /// Checks the corners and the friction of every face.
    /// \throws parameter_error unless lower \< upper along every axis, both corners are finite, and the friction of
    /// every face is finite and not negative
    void check() const
        requires std::floating_point<S>
    {
        for (int a = 0; a < D; ++a) {
            if (!(upper[a] - lower[a] > 0) || !std::isfinite(upper[a] - lower[a]))
                throw parameter_error(sentence("The walls reach from ", lower[a], " m to ", upper[a], " m along axis ",
                                               a, "; upper must be above lower and both finite."));
            for (const WallOf<P>* wall : {&at_lower[std::size_t(a)], &at_upper[std::size_t(a)]})
                if (!(wall->friction >= 0) || !std::isfinite(wall->friction))
                    throw parameter_error(sentence("The friction of a wall across axis ", a, " is ", wall->friction,
                                                   "; Coulomb's coefficient must be finite and not negative."));
        }
    }

    /// Returns a description, as it is written into files: "lower face of axis 0: separate, friction 0; …".
    /// \param exactly  whether numbers have all of their digits, rather than up to nine
    std::string description(bool exactly = false) const {
        std::string text;
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            for (const bool upper_face : {false, true}) {
                const WallOf<P>& wall = (upper_face ? at_upper : at_lower)[a];
                text += sentence(text.empty() ? "" : "; ", upper_face ? "upper" : "lower", " face of axis ", a, ": ",
                                 name_of(wall.contact), ", friction ", detail::number_text(wall.friction, exactly));
            }
        }
        if (nodes_behind == NodesBehind::mirrored) text += "; nodes behind: mirrored";
        return text;
    }

    static constexpr const char* name = "walls";
    static constexpr auto parameters() {
        return std::tuple{parameter{"lower", "m", &Walls::lower}, parameter{"upper", "m", &Walls::upper}};
    }
    /// Returns the walls converted to scalar type T. A simulation calls this function once per step, before any node
    /// changes.
    /// \throws parameter_error if check() throws it
    template <class T>
    Walls<T, D> lifted() const {
        if constexpr (std::floating_point<S>) check();
        using Q = typename Walls<T, D>::P;
        Walls<T, D> walls{cast<Q>(lower), cast<Q>(upper), {}, {}, nodes_behind, T(mirrored_depth), T(half_cell)};
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            walls.at_lower[a] = {at_lower[a].contact, Q(at_lower[a].friction)};
            walls.at_upper[a] = {at_upper[a].contact, Q(at_upper[a].friction)};
        }
        return walls;
    }
    /// Calls f(friction) for the friction of each face. \tparam Self  Walls, or const Walls
    template <class Self, class F>
    static void for_frictions(Self& walls, const F& f) {
        for (auto* faces : {&walls.at_lower, &walls.at_upper})
            for (auto& wall : *faces) f(wall.friction);
    }

    /// Returns the walls for a grid with cells of side h [m].
    template <class H>
    FIRN_INLINE Walls on_grid(const H& h) const {
        constexpr double half = 0.501;  // of two planes as far away, the one in front
        Walls there = *this;
        there.half_cell = S(half) * S(h);
        if (nodes_behind == NodesBehind::mirrored) there.mirrored_depth = S(1.5) * S(h);
        return there;
    }
    /// Returns the walls for positions that are measured from `corner` [m]. \see firn::measured_from
    Walls measured_from(const Vec<double, D>& corner) const
        requires std::floating_point<S>
    {
        Walls there = *this;
        there.lower -= corner;
        there.upper -= corner;
        return there;
    }

    /// Calls seen(axis, position, inward, contact, friction, 0) for each face whose nodes are mirrored. \see
    /// has_mirrors
    template <class Seen>
    void mirrors(const Seen& seen) const {
        if (nodes_behind == NodesBehind::mirrored)
            for (int a = 0; a < D; ++a) {
                const WallOf<P>&low = at_lower[std::size_t(a)], &high = at_upper[std::size_t(a)];
                if (low.contact != Contact::none) seen(a, lower[a], 1, low.contact, low.friction, 0);
                if (high.contact != Contact::none) seen(a, upper[a], -1, high.contact, high.friction, 0);
            }
    }

    /// Returns the velocity [m/s] of a node at x [m] after contact; v [m/s] is the node's velocity before.
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return velocity_among(*this, x, v, NoOthers{}, AnySurface{});
    }

    /// Calls seen(surface) for each face that acts on a node at x [m]. \see has_acting_surfaces
    template <class Others, class Seen>
    FIRN_INLINE void acting_surfaces(const Vec<S, D>& x, const Vec<S, D>&, const Others&, const Seen& seen) const {
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            Vec<S, D> inward = Vec<S, D>::zero();
            inward[axis] = S(1);
            const S near = reach(axis), low = S(lower.v[axis]), high = S(upper.v[axis]);
            const auto face = [&](const WallOf<P>& wall, const mask_t<S>& acts, const S& distance,
                                  const Vec<S, D>& normal) FIRN_LAMBDA {
                if (wall.contact != Contact::none && any(acts))
                    seen(ActingSurface<S, D>{acts, distance, normal, Vec<S, D>::zero(), wall.contact, S(wall.friction),
                                             true});
            };
            face(at_lower[axis], x.v[axis] <= low + near, x.v[axis] - low, inward);
            face(at_upper[axis], x.v[axis] >= high - near, high - x.v[axis], -inward);
        });
    }

    /// Calls `seen` for every face; the normals point into the box. \see has_surfaces
    template <class Seen>
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        const Vec<S, D> at_rest = Vec<S, D>::zero();
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            Vec<S, D> inward = Vec<S, D>::zero();
            inward[axis] = S(1);
            const WallOf<P>&low = at_lower[axis], &high = at_upper[axis];
            seen(x.v[axis] - S(lower.v[axis]), inward, at_rest, low.contact, S(low.friction));
            seen(S(upper.v[axis]) - x.v[axis], -inward, at_rest, high.contact, S(high.friction));
        });
    }

    /// Returns true if nodes in the box [low, high] [m] may lie on a face of the walls or outside of the walls.
    bool reaches(const Vec<double, D>& low, const Vec<double, D>& high) const
        requires std::floating_point<S>
    {
        bool inside = true;
        unroll<D>([&](auto a) {
            const double near = 2 * double(slack(a)) + double(half_cell);  // the corners of the box are rounded, too
            inside = inside && low[a] > lower[a] + near && high[a] < upper[a] - near;
        });
        return !inside;
    }

private:
    /// Returns how far in front of a face nodes are held [m]; negative if only those behind it are.
    FIRN_INLINE S reach(int axis) const {
        return nodes_behind == NodesBehind::mirrored ? -mirrored_depth : slack(axis) + half_cell;
    }
    /// Returns a small distance [m], by which computed positions of nodes differ from where they are. Because of
    /// rounding, the position of a node on the upper face differs from `upper` by at most 3 ε (|lower| + |upper|),
    /// where ε is the machine epsilon of S.
    FIRN_INLINE S slack(int axis) const {
        return S(4 * double(std::numeric_limits<value_type_t<S>>::epsilon())) *
               (abs(S(lower.v[axis])) + abs(S(upper.v[axis])));
    }
};

}  // namespace firn::inline FIRN_BUILD
