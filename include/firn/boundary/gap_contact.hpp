/// \file Walls and colliders that act on matter when it touches them, and not a cell earlier.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/boundary/measured_from.hpp>
#include <firn/core/names.hpp>

#include <concepts>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_gap_contact {
    static constexpr const char* name = "gap_contact";
};
template <class>
inline constexpr bool never = false;
}  // namespace detail

/// A boundary that acts by the gap between matter and its surfaces: `GapContact{walls}`,
/// `GapContact{Together(walls, collider)}`.
///
/// Without GapContact, a wall acts on all matter that shares a node with it: about a cell before the surfaces meet.
/// With GapContact, matter may approach a surface by the gap g between them in a step dt: the contact acts on the
/// velocity v + n g/dt, where n is the normal of the surface. \see velocity_after_contact
///
/// The gap comes from the positions of the particles around the node: g is the distance of the node from the surface,
/// plus the smallest n · x − r + ½ κ m of the particles, as between contact groups. \see Separator
///
/// Surfaces with the contact `slip` or `stick` hold matter that is nearer than boundary_reach cells; other matter
/// approaches them freely. A collider's surface lies `thickness` outside of its shape. Its thickness_in_cells only says
/// which nodes take part. Walls act from half a cell in front of their faces, so that they act where they stand between
/// planes of nodes, too. At mirrored walls (NodesBehind::mirrored), matter meets its own mirror image. All surfaces act
/// on a node at once. \see NodeAtSurfaces
///
/// Within two cells of another solid or wall, a collider's normal and distance are taken at a point outside of that
/// (\see Collider). There, matter meets a round solid of radius R late, by up to 2 h²/R.
///
/// At the edges of a box, the face acts from which the gap is widest, as no plane of another face separates matter and
/// box: what slides past an edge does not catch at it. Nor does it at edges of meshes and other shapes, where another
/// face acts if it keeps solid and matter apart, with an overlap of at most 0.25 cells. At the end of a plate that is
/// thinner than three cells it does catch. A grid of distances rounds its edges off within a spacing.
///
/// A solid may be thin: nodes behind it, which are nearer to its other face, act by the face that matter touches. A
/// plate, capsule, ball or mesh of 0.4 cells or more pulls at matter that leaves it with less than 1 % of the force
/// that it pressed with. But matter on both sides of a solid thinner than 2.5 cells shares nodes, and moves as one
/// there, unless each side has a contact group of its own. A simulation warns of such solids.
///
/// GapContact must be the outermost boundary. It takes Walls, Collider, RigidBody, Together and BoundaryList, and every
/// boundary that has, besides what boundary/concept.hpp asks for,
///
///     Vec velocity_by_gap(x, v, act)   the velocity [m/s] of a node at x [m] after the boundary has acted. For each
///                                      surface that acts on the node, the function replaces v by
///                                      act(v, distance, normal, velocity, contact, friction): the distance of the
///                                      node from the surface [m], negative in the solid; the surface's unit normal,
///                                      which points into free space; the velocity of the solid at x [m/s]; the
///                                      Contact; and Coulomb's friction coefficient. x, v and all others are in
///                                      double. For thin solids, act() takes a function that looks for the face
///                                      that matter touches. \see ActByGap
template <class B>
struct GapContact {
    B boundary;  ///< Walls, colliders or both.

    /// The type of this boundary with scalar type T.
    template <class T>
    using with_scalar = GapContact<with_scalar_t<B, T>>;

    static constexpr const char* name = detail::joined_names<detail::named_gap_contact, B>::text;
    static constexpr auto parameters() { return std::tuple{parameter{"by_gap", "", &GapContact::boundary}}; }

    /// Calls f(boundary).
    template <class F>
    FIRN_INLINE void for_members(const F& f) const {
        f(boundary);
    }

    /// Checks the boundary.
    /// \throws parameter_error if check() of the boundary throws it
    void check() const { check_boundary(boundary); }
    /// Returns this boundary converted to scalar type T.
    /// \throws parameter_error if check() of the boundary throws it
    template <class T>
    with_scalar<T> lifted() const {
        return {lift<T>(boundary)};
    }
    /// Returns this boundary at a time dt [s] later.
    GapContact advanced(double dt) const { return {firn::advanced(boundary, dt)}; }
    /// Returns this boundary adapted to a grid with cells of side h [m].
    template <class H>
    GapContact on_grid(const H& h) const {
        return {firn::on_grid(boundary, h)};
    }

    /// Returns this boundary for positions that are measured from `corner` [m].
    template <int D>
    auto measured_from(const Vec<double, D>& corner) const {
        return firn::GapContact<decltype(firn::measured_from(boundary, corner))>{firn::measured_from(boundary, corner)};
    }

    /// Does not compile: the velocity of a node depends on the particles around it, which only act_by_gap() knows.
    template <class S, int D>
    Vec<S, D> velocity(const Vec<S, D>&, const Vec<S, D>& v) const {
        static_assert(detail::never<S>,
                      "firn: a GapContact acts by the gap between particles and surfaces, which a node alone does not "
                      "know. It must be the outermost boundary of a Simulation, GapContact{Together(walls, collider)}; "
                      "programs that call the stages use act_by_gap() after grid_update(..., NoBoundary{}).");
        return v;
    }
    /// Returns true if the boundary may change nodes in the box [lower, upper] [m].
    template <int D>
        requires says_where<B, D>
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        return boundary.reaches(lower, upper);
    }
    /// Calls `seen` for the surfaces of the boundary. \see has_surfaces
    template <class S, int D, class Seen>
        requires has_surfaces<B, S, D>
    void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        boundary.surfaces(x, seen);
    }
    /// Calls `seen` for the mirrored walls of the boundary. \see has_mirrors
    template <class Seen>
        requires has_mirrors<B>
    void mirrors(const Seen& seen) const {
        boundary.mirrors(seen);
    }
    /// Returns the description of the boundary, as it is written into files: "by the gap of particles: …".
    std::string description() const {
        std::string text = "by the gap of particles";
        if constexpr (requires { boundary.description(); }) text += ": " + std::string(boundary.description());
        return text;
    }
};

/// Deduces the type of the boundary: `GapContact{walls}`.
template <class B>
GapContact(const B&) -> GapContact<B>;

/// True: a GapContact acts by the gap between matter and surfaces.
template <class B>
inline constexpr bool acts_by_gap<GapContact<B>> = true;

/// The gap up to which surfaces of boundaries with the contact `slip` or `stick` hold matter [cells]. \see GapContact
inline constexpr double boundary_reach = 0.25;

/// How surfaces act on a node by the gap of particles.
/// \tparam Nearest  a function: nearest(n) returns how far matter lies from the node along n [m]. Without matter it
///                  returns at least `none`, or no number.
template <int D, class Nearest>
struct ActByGap {
    static constexpr double none = 1e30;  ///< Above any distance [m].

    double cell_size;        ///< h [m]
    double dt;               ///< time step [s]
    const Nearest& nearest;  ///< how far matter lies from the node along a normal [m]

    /// Returns the velocity of the node [m/s] after contact with a surface; v is that before. If the surface does not
    /// push, this is v to the bit.
    /// \param distance  of the node from the surface [m];  \param normal  of the surface, into free space
    /// \param velocity  of the surface [m/s]
    /// \param look      optional, a function: where matter overlaps, look(nearest, gap, normal) may replace the
    ///                  gap [m] and the normal by those of another face
    template <class... Look>
    Vec<double, D> operator()(const Vec<double, D>& v, double distance, Vec<double, D> normal,
                              const Vec<double, D>& velocity, Contact contact, double friction,
                              const Look&... look) const {
        static_assert(sizeof...(Look) <= 1);
        if (contact == Contact::none) return v;
        const double gap = gap_to(distance, normal, look...);
        return alone(v, gap, normal, velocity, contact, friction);
    }

    /// Adds a surface to those that act on a node at once.
    /// \param part  index of the part of the boundary that the surface belongs to
    /// \param v     velocity of the node before any surface acts [m/s]
    /// \param look  as above
    template <class... Look>
    void add(NodeAtSurfaces<double, D>& node, int part, const Vec<double, D>& v, ActingSurface<double, D> surface,
             const Look&... look) const {
        if (surface.contact == Contact::none || !surface.acts) return;
        const double gap = gap_to(surface.distance, surface.normal, look...);
        add_at(node, part, v, surface, gap);
    }
    /// As add(), with the gap between matter and the surface [m].
    void add_at(NodeAtSurfaces<double, D>& node, int part, const Vec<double, D>& v, ActingSurface<double, D> surface,
                double gap) const {
        if (!(gap < none)) return;
        const Vec<double, D> after = alone(v, gap, surface.normal, surface.velocity, surface.contact, surface.friction);
        const bool held = holds(surface.contact, gap, boundary_reach * cell_size);
        if (!held) surface.contact = Contact::separate;
        node.add(part, surface, after, held ? 0 : closing_speed(gap, dt));
    }
    /// Returns the gap between a surface and matter [m]; `look` may choose another face.
    template <class... Look>
    double gap_to(double distance, Vec<double, D>& normal, const Look&... look) const {
        double gap = distance + nearest(normal);
        if (gap < 0) (look(nearest, gap, normal), ...);
        return gap;
    }

private:
    /// Returns the velocity of the node [m/s] after contact with a surface that acts alone.
    Vec<double, D> alone(const Vec<double, D>& v, double gap, const Vec<double, D>& normal,
                         const Vec<double, D>& velocity, Contact contact, double friction) const {
        if (!(gap < none)) return v;
        const Vec<double, D> before = v - velocity;
        const Vec<double, D> after =
            velocity_after_contact(before, normal, contact, friction, gap, boundary_reach * cell_size, dt);
        return dot(after - before, after - before) > 0 ? velocity + after : v;
    }
};

/// Notes whether a surface may act on a node, and lets none act: a function like ActByGap.
template <int D>
struct NoteSurface {
    double cell_size;  ///< h [m]
    bool& is_there;    ///< becomes true where a surface may act

    /// Returns v.
    template <class... Look>
    Vec<double, D> operator()(const Vec<double, D>& v, double, const Vec<double, D>&, const Vec<double, D>&,
                              Contact contact, double, const Look&...) const {
        is_there = is_there || contact != Contact::none;
        return v;
    }
    /// Adds nothing.
    template <class... Look>
    void add(NodeAtSurfaces<double, D>&, int, const Vec<double, D>&, const ActingSurface<double, D>& surface,
             const Look&...) const {
        is_there = is_there || (surface.contact != Contact::none && surface.acts);
    }
};

namespace detail {
/// Adds the surfaces of a part that act on a node, by the gap of particles.
template <int D, class Act>
struct AddByGap {
    static constexpr bool needs_normals = true, looks_at_matter = true;
    const Act& act;
    NodeAtSurfaces<double, D>& node;
    int part;
    const Vec<double, D>& v;
    template <class... Look>
    void operator()(const ActingSurface<double, D>& surface, const Look&... look) const {
        act.add(node, part, v, surface, look...);
    }
};
}  // namespace detail

/// Whether the boundary B has a function velocity_by_gap(x, v, act), as GapContact asks for.
template <class B, int D, class Act>
concept has_velocity_by_gap = requires(const B b, const Vec<double, D> x, const Act act) {
    { b.velocity_by_gap(x, x, act) } -> std::same_as<Vec<double, D>>;
};

namespace detail {

/// The surfaces of a boundary near a node. They are found once for all parts, as each part looks at those of the
/// others: else many solids take a time that grows with the square of their number.
template <class B, int D>
class SurfacesAtNode {
public:
    SurfacesAtNode(const B& boundary, const Vec<double, D>& x) : boundary_(boundary), x_(x) {}

    /// Returns a function like those that for_parts() gives part k, which leaves out surfaces at the distance `within`
    /// [m] or farther. Call it for this node only, with the same distance for all parts.
    auto others_of(int k, double within) {
        return [this, k, within](const Vec<double, D>&, const auto& see) {
            if (!std::exchange(are_found_, true)) find(within);
            for (const One& one : all_)
                if (one.part != k) see(one.distance, one.normal, one.velocity, one.contact, one.friction);
        };
    }

private:
    struct One {
        int part;
        double distance;
        Vec<double, D> normal, velocity;
        Contact contact;
        double friction;
    };
    struct Note {
        std::vector<One>& all;
        int part;
        double within;
        void operator()(double distance, const Vec<double, D>& normal, const Vec<double, D>& velocity, Contact contact,
                        double friction) const {
            if (distance < within) all.push_back({part, distance, normal, velocity, contact, friction});
        }
    };
    void find(double within) {
        for_parts(boundary_, NoOthers{}, [&]<class Part>(const Part& part, const auto&, int k) {
            if constexpr (has_surfaces<Part, double, D>) part.surfaces(x_, Note{all_, k, within});
        });
    }

    const B& boundary_;
    const Vec<double, D>& x_;
    std::vector<One> all_{};
    bool are_found_ = false;
};

}  // namespace detail

/// Returns the velocity [m/s] of a node at x [m] after all parts of a boundary have acted by the gap of particles:
/// first all surfaces at once, then parts of which firn does not know the surfaces, one after another.
/// \param act   how surfaces act. \see ActByGap
/// \param seen  a function, called as seen(k, before, after) for what part k does. \see velocity_among
template <class B, int D, class Act, class Seen>
Vec<double, D> velocity_by_gap(const B& boundary, const Vec<double, D>& x, const Vec<double, D>& v, const Act& act,
                               const Seen& seen) {
    NodeAtSurfaces<double, D> node(v);
    detail::SurfacesAtNode<B, D> near(boundary, x);
    for_parts(boundary, NoOthers{}, [&]<class Part, class Beside>(const Part& part, const Beside& beside, int k) {
        if constexpr (has_acting_surfaces<Part, double, D>) {
            const detail::AddByGap<D, Act> add{act, node, k, v};
            if constexpr (requires { part.sees_others_within(); } && !std::same_as<Beside, NoOthers>)
                part.acting_surfaces(x, v, near.others_of(k, part.sees_others_within()), add);
            else
                part.acting_surfaces(x, v, beside, add);
        }
    });
    Vec<double, D> after = node.velocity(seen);
    for_parts(boundary, NoOthers{}, [&]<class Part>(const Part& part, const auto&, int k) {
        if constexpr (!has_acting_surfaces<Part, double, D>) {
            constexpr bool fits = has_velocity_by_gap<Part, D, Act>;
            static_assert(fits || !acts_by_force<Part, double, D>,
                          "firn: velocity(x, v, mass, dt) is not called inside of a GapContact, where surfaces act by "
                          "the gap of particles. Leave GapContact out, or give this boundary velocity_by_gap(x, v, "
                          "act), see firn/boundary/gap_contact.hpp.");
            static_assert(fits || acts_by_force<Part, double, D>,
                          "firn: this boundary cannot act by the gap of particles. A boundary in a GapContact must "
                          "have velocity_by_gap(x, v, act), see firn/boundary/gap_contact.hpp.");
            if constexpr (fits) {
                const Vec<double, D> before = after;
                after = part.velocity_by_gap(x, before, act);
                seen(k, before, after);
            }
        }
    });
    return after;
}

}  // namespace firn::inline FIRN_BUILD
