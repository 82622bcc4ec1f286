/// \file A rigid solid with a given motion: a shape with a position, a rotation, a linear and an angular velocity.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/boundary/shape.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/math/rotor.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_collider {
    static constexpr const char* name = "collider";
};
}  // namespace detail

/// A rigid solid with a given motion: a floor, a ball, a wheel, a shovel, a container.
///
/// A node in the solid, or in a layer around the solid, gets a new velocity from velocity_after_contact(). In this
/// function, velocities are relative to the velocity of the solid at the node's position x,
///
///     V + ω × (x − c)       [m/s]
///
/// V is the linear velocity, ω the angular velocity, c the position of the solid. Matter does not push the solid: the
/// solid always moves as given. In every step, a simulation calls advanced(), which returns the collider at the end of
/// the step. Simulation::reactions returns the forces of the matter on the solid. To move matter at a chosen velocity,
/// use a collider with contact `stick`.
///
/// The layer keeps matter out of the solid. A particle on the surface takes its velocity from nodes up to 1.5 cells
/// away, the radius of the quadratic spline. If the contact acts on all these nodes, the particle does not enter the
/// solid, wherever the surface lies between the nodes. Without a layer, matter enters the solid by up to 1.5 cells.
/// With the default layer, matter comes to rest about one cell before the surface, between half a cell and one and a
/// half, depending on where the nodes lie; by the gap of particles it comes right up to it. \see GapContact
///
/// Other solids (in the same `Together` or `BoundaryList`) can cover a face of this solid, as a floor covers the lower
/// face of a box that stands on the floor. If contact near the covered face used the normal of this face, the box would
/// push matter up and down and let matter through sideways. Therefore, for a node inside another solid or within two
/// cells of that solid, contact uses the normal at a different point: the node's position, moved to two cells outside
/// of the other solid.
///
/// A solid should be at least 3 cells thick. In a thinner one, nodes near one face pull at matter that leaves the
/// other: a turned plate of 1.6, 2.4 and 3 cells that the edge of a body touches, with up to 18, 4 and 1 % of the force
/// that it pressed with. Matter on both sides shares nodes, and moves as one there. A simulation warns of such solids.
/// In a GapContact, they do not pull.
///
/// A shape may cap its distances, and say so by exact_up_to(). A collider on a grid needs distances up to its layer and
/// two cells; if it has less, it is refused.
///
/// Position, rotation and velocities are stored in double, so that the small motions of single steps are not lost by
/// rounding. The contact is that of Stomakhin et al. 2013, §8; see velocity_after_contact().
/// \tparam Shape  a shape as described in boundary/shape.hpp, for example `Sphere<float, 3>`
template <class Shape>
struct Collider {
    using S = typename shape_facts<Shape>::scalar_type;      ///< The scalar type of the shape.
    static constexpr int D = shape_facts<Shape>::dimension;  ///< The number of dimensions of space: 2 or 3.
    /// The scalar type of position, rotation and velocities: double if S is float or double, else S.
    using P = std::conditional_t<std::floating_point<S>, double, S>;
    /// The type of this collider with scalar type T.
    template <class T>
    using with_scalar = Collider<with_scalar_t<Shape, T>>;
    /// Whether the shape tells up to which distance it is exact.
    static constexpr bool caps = requires(const Shape of) { of.exact_up_to(); };

    Shape shape{};                                  ///< The shape, in the shape's coordinates.
    Contact contact = Contact::separate;            ///< How matter may move at the surface.
    P friction = P(0);                              ///< Coulomb's friction coefficient μ [1]
    P thickness = P(0);                             ///< thickness of the layer [m], in addition to thickness_in_cells
    P thickness_in_cells = P(1.5);                  ///< thickness of the layer in cells [1], in addition to `thickness`
    Vec<P, D> position = Vec<P, D>::zero();         ///< c: position of the shape's origin [m]
    Rotor<P, D> rotation = no_rotation<P, D>();     ///< turns the shape's axes to the axes of space; see rotor()
    Vec<P, D> linear_velocity = Vec<P, D>::zero();  ///< V: velocity of the shape's origin [m/s]
    Axial<P, D> angular_velocity = no_spin<P, D>();  ///< ω: about the shape's origin [rad/s]; in 2D counter-clockwise
    P cell_size = P(0);                              ///< cell size of the grid [m], set by on_grid()
    P known = P(0);  ///< if the shape caps distances: those below this are exact [m]; set by on_grid() and lifted()

    static constexpr const char* name = detail::joined_names<detail::named_collider, Shape>::text;
    static constexpr auto parameters() {
        return std::tuple{parameter{"shape", "", &Collider::shape},
                          parameter{"friction", "1", &Collider::friction},
                          parameter{"thickness", "m", &Collider::thickness},
                          parameter{"thickness_in_cells", "1", &Collider::thickness_in_cells},
                          parameter{"position", "m", &Collider::position},
                          parameter{"rotation", "1", &Collider::rotation},
                          parameter{"linear_velocity", "m/s", &Collider::linear_velocity},
                          parameter{"angular_velocity", "rad/s", &Collider::angular_velocity}};
    }

    /// Checks the parameters of the collider and of its shape.
    /// \throws parameter_error if the position or a velocity is not finite, if the length of `rotation` differs from 1
    /// by 1e-6 or more, if the friction or a thickness is negative or not finite, or if the shape does not know
    /// distances up to the layer and two cells. If check() of the shape throws an exception, this function passes the
    /// exception on.
    void check() const
        requires std::floating_point<S>
    {
        if constexpr (requires { shape.check(); }) shape.check();
        const auto refuse = [](const char* what, const auto& given, const char* allowed) {
            throw parameter_error(sentence("The ", what, " of a ", name, " is ", given, "; it must be ", allowed, "."));
        };
        if (!(friction >= 0) || !std::isfinite(friction)) refuse("friction", friction, "finite and not negative");
        if (!(thickness >= 0) || !std::isfinite(thickness)) refuse("thickness", thickness, "finite and not negative");
        if (!(thickness_in_cells >= 0) || !std::isfinite(thickness_in_cells))
            refuse("thickness in cells", thickness_in_cells, "finite and not negative");
        for (int a = 0; a < D; ++a) {
            if (!std::isfinite(position[a])) refuse("position", position[a], "finite along every axis");
            if (!std::isfinite(linear_velocity[a]))
                refuse("linear velocity", linear_velocity[a], "finite along every axis");
        }
        const Mat<P, D> spin = skew(angular_velocity);
        if (!std::isfinite(squared_norm(spin))) refuse("angular velocity", squared_norm(spin), "finite");
        const double length = norm(rotation);
        if (!(std::abs(length - 1) < 1e-6))
            refuse("rotation", sentence("a quaternion of length ", length), "of length 1: make it with rotor()");
        check_distances();
    }

    /// Returns the collider converted to scalar type T. A simulation calls this function once per step, before any node
    /// changes.
    /// \throws parameter_error if check() throws it
    template <class T>
    with_scalar<T> lifted() const {
        if constexpr (std::floating_point<S>) check();
        using Q = typename with_scalar<T>::P;
        return {lift<T>(shape),
                contact,
                Q(friction),
                Q(thickness),
                Q(thickness_in_cells),
                cast<Q>(position),
                cast<Q>(rotation),
                cast<Q>(linear_velocity),
                cast_axial<Q, D>(angular_velocity),
                Q(cell_size),
                Q(known_distance())};
    }

    /// Returns the collider for a grid with cells of side h [m].
    /// \throws parameter_error if the shape does not know distances up to the layer and two cells
    FIRN_INLINE Collider on_grid(const P& h) const {
        Collider there = *this;
        there.cell_size = h;
        if constexpr (std::floating_point<S>) there.check_distances();
        there.known = known_distance();
        return there;
    }
    /// Returns the collider for positions that are measured from `corner` [m]. \see firn::measured_from
    Collider measured_from(const Vec<double, D>& corner) const
        requires std::floating_point<S>
    {
        Collider there = *this;
        if constexpr (requires { shape.from_its_place(); }) {
            // Far from its origin, a shape would be known to a few digits only.
            const auto [moved, origin] = shape.from_its_place();
            const Vec<double, D> arm = matrix_of(rotation) * origin;
            there.shape = moved;
            there.position += arm;
            there.linear_velocity += skew(angular_velocity) * arm;
        }
        there.position -= corner;
        return there;
    }
    /// The thickness of the layer around the solid [m].
    FIRN_INLINE P layer() const { return thickness + thickness_in_cells * cell_size; }

    /// Returns the collider at a time dt [s] later, moved and turned by its velocities. For constant velocities the
    /// result is exact, except for rounding in double.
    Collider advanced(double dt) const {
        Collider later = *this;
        later.position += linear_velocity * P(dt);
        later.rotation = turned(rotation, angular_velocity * P(dt));
        return later;
    }

    /// Returns an upper bound of the solid's speed [m/s] in the box [lower, upper] [m]; zero if the collider changes no
    /// nodes in this box. \see firn::largest_speed
    double largest_speed(const Vec<double, D>& lower, const Vec<double, D>& upper) const
        requires std::floating_point<S>
    {
        if (!reaches(lower, upper)) return 0;
        Vec<double, D> arm{};  // from the collider's position to the farthest corner of the box
        for (int a = 0; a < D; ++a)
            arm[a] = std::max(std::abs(lower[a] - position[a]), std::abs(upper[a] - position[a]));
        double radius = norm(arm);
        if constexpr (requires { shape.extent(); }) radius = std::min(radius, shape.extent() + layer());
        return norm(linear_velocity) + std::sqrt(squared_norm(skew(angular_velocity)) / 2) * radius;
    }

    /// The velocity of the solid at x [m]: V + ω × (x − c) [m/s], with the linear velocity V, the angular velocity ω
    /// and the position c of the solid.
    FIRN_INLINE Vec<S, D> surface_velocity(const Vec<S, D>& x) const {
        return cast<S>(linear_velocity) + skew(cast_axial<S, D>(angular_velocity)) * (x - cast<S>(position));
    }

    /// Returns the velocity [m/s] of a node at x [m] after contact; v [m/s] is the node's velocity before.
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return velocity_among(*this, x, v, NoOthers{}, AnySurface{});
    }

    /// Calls seen(surface) for each face of the solid that acts on a node at x [m] with the velocity v [m/s]. The
    /// distance is that from the surface that lies `thickness` outside of the shape. \see has_acting_surfaces
    /// \param others  a function: others(x, seen) calls `seen` for each surface of the other solids, which may cover
    /// faces of this solid, with the arguments that has_surfaces explains
    template <class Others, class Seen>
    FIRN_INLINE void acting_surfaces(const Vec<S, D>& x, const Vec<S, D>& v, const Others& others,
                                     const Seen& seen) const {
        constexpr bool moves = !is_flat<Shape> && !has_faces<Shape> && !std::same_as<Others, NoOthers>;
        Vec<S, D> way = Vec<S, D>::zero();  // of the node, out of other solids
        if constexpr (looks_first) {
            if constexpr (moves) {
                if (is_beyond(x, layer() + sight() * cell_size)) return;
                way = way_out_of(others, x);
            }
            if (is_beyond(x, layer()) && is_beyond(x + way, layer())) return;
        }
        const Mat<S, D> R = matrix_of(cast<S>(rotation));
        const S thick = S(layer());
        Vec<S, D> local = transpose(R) * (x - cast<S>(position));
        S distance = named("distance", shape.signed_distance(local));
        S nearest = distance, told = distance;
        if constexpr (moves) {
            if (!any(distance <= thick + S(sight()) * S(cell_size))) return;
            if constexpr (!looks_first) way = way_out_of(others, x);
            const Vec<S, D> beside = local + transpose(R) * way;
            told = shape.signed_distance(beside);
            nearest = min(distance, told);
            if constexpr (caps) {  // what is capped has no normal
                const auto exact = told < S(known);
                if constexpr (looks_at_matter<Seen>)
                    if (!exact && distance < told) return;  // the gap is not known, but wide
                local = select(exact, beside, local);
                distance = select(exact, told, distance);
            } else {
                local = beside;
                distance = told;
            }
        }
        const auto touched = nearest <= thick;
        if (!any(touched)) return;
        const Vec<S, D> surface = surface_velocity(x);
        const auto tell = [&](const mask_t<S>& acts, const S& from, const Vec<S, D>& normal,
                              const auto&... look) FIRN_LAMBDA {
            seen(ActingSurface<S, D>{acts, from - S(thickness), R * normal, surface, contact, S(friction)}, look...);
        };
        if constexpr (has_faces<Shape>) {
            shape.faces(local, [&](const S& from, const Vec<S, D>& normal) FIRN_LAMBDA {
                if (any(from <= thick)) tell(from <= thick, from, normal);
            });
        } else if (contact == Contact::stick && !needs_normals<Seen>) {
            tell(touched, told, Vec<S, D>::zero());
        } else {
            const Vec<S, D> normal = normal_of(shape, local);
            if constexpr (looks_at_matter<Seen> && !is_flat<Shape>)
                tell(touched, told, normal, [&](const auto& matter, S& gap, Vec<S, D>& face) {
                    look_at_matter(local, distance, R, matter, gap, face);
                });
            else
                tell(touched, told, normal);
            if constexpr (may_have_corners<Shape>)
                find_corner(touched, thick, local, distance, normal, transpose(R) * (v - surface), tell);
        }
    }

    /// Returns the distance [m] from which on the distance that surfaces() tells is not exact. \see firn::exact_up_to
    double exact_up_to() const
        requires(std::floating_point<S> && caps)
    {
        return shape.exact_up_to() - layer();
    }

    /// Returns a distance [m]: solids whose surfaces() are farther from a node do not change how this collider acts on
    /// it.
    FIRN_INLINE P sees_others_within() const { return P(off_others) * cell_size; }

    /// Calls `seen` for the outer surface of the layer; for each of its faces if the shape names its faces. If `seen`
    /// has a number `within` [m], surfaces at that distance or farther may be left out. \see has_surfaces
    template <class Seen>
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        if constexpr (looks_first && requires { seen.within; })
            if (is_beyond(x, layer() + seen.within)) return;
        const Mat<S, D> R = matrix_of(cast<S>(rotation));
        const Vec<S, D> local = transpose(R) * (x - cast<S>(position));
        const auto tell = [&](const S& distance, const Vec<S, D>& normal) FIRN_LAMBDA {
            seen(distance - S(layer()), R * normal, surface_velocity(x), contact, S(friction));
        };
        if constexpr (has_faces<Shape>)
            shape.faces(local, tell);
        else
            tell(shape.signed_distance(local), normal_of(shape, local));
    }

    /// Returns true if the solid or its layer may change nodes in the box [lower, upper] [m].
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const
        requires std::floating_point<S>
    {
        const auto exact = lift<double>(shape);
        const Mat<double, D> R = matrix_of(rotation);
        const Vec<double, D> middle = (lower + upper) * 0.5, half = (upper - lower) * 0.5;
        const Vec<double, D> local = transpose(R) * (middle - position);
        const double distance = exact.signed_distance(local);
        double farthest = norm(half);  // upper bound of |signed distance at a point of the box − `distance`|
        if constexpr (is_flat<Shape>) {
            const Vec<double, D> normal = R * normal_of(exact, local);
            farthest = 0;
            for (int a = 0; a < D; ++a) farthest += std::abs(normal[a]) * half[a];
        }
        double least = distance - farthest;
        if constexpr (requires { exact.distances_within(local, farthest); })
            least = exact.distances_within(local, farthest)[0];
        else if constexpr (requires { exact.uncertainty(); })
            least -= exact.uncertainty();
        // velocity() gets positions rounded to S, so a node may be nearer to the solid by this distance [m].
        const double rounding = 32 * double(std::numeric_limits<S>::epsilon()) *
                                (norm(middle) + norm(half) + norm(position) + std::abs(distance));
        return least <= layer() + rounding;
    }

    /// Returns a distance [m]: only other solids within this distance of a node can change the normal that contact uses
    /// for this node. \see firn::looks_around
    double looks_around() const
        requires std::floating_point<S>
    {
        return is_flat<Shape> || has_faces<Shape> ? 0 : sight() * cell_size * (1 + 1e-6);
    }

    /// Returns a description, as it is written into files: "collider_sphere: separate, friction 0.3".
    std::string description() const { return sentence(name, ": ", firn::name_of(contact), ", friction ", friction); }

private:
    static constexpr double off_others = 2,  ///< distance from other solids to which way_out_of() moves a node [cells]
        farthest_off = 4;                    ///< largest displacement along each axis in way_out_of() [cells]
    /// Returns the largest length [cells] of the displacement that way_out_of() returns.
    static double sight() { return farthest_off * std::sqrt(double(D)); }

    /// Whether is_beyond() is asked before the shape: in double, in which surfaces act by the gap of particles.
    static constexpr bool looks_first = std::same_as<S, double> && requires(const Shape of) { of.extent(); };
    /// Returns true if x is certainly farther than `far` [m] from the shape, by a ball around it.
    bool is_beyond(const Vec<double, D>& x, double far) const {
        const Vec<double, D> arm = x - position;
        const double most = (shape.extent() + far) * (1 + 1e-6);  // more than rounding
        return dot(arm, arm) > most * most;
    }

    /// Calls tell(acts, distance, normal) for further faces of a concave corner that a node is near, with the distances
    /// of the node from their planes.
    ///
    /// The shape has one normal at a point, that of the nearest face. A node beside the corner moves on along this
    /// face, into the other one. So its neighbourhood is looked at again: at a point on the outside of the layer, one
    /// cell along the velocity that the faces before have left. A convex solid has nothing there, and a smooth hollow
    /// has almost the same normal.
    /// \param thick     thickness of the layer [m]
    /// \param local     position of the node, in the shape's coordinates [m]
    /// \param distance  signed distance of the node from the shape [m];  \param normal  the shape's normal there
    /// \param v         velocity of the node relative to the solid, in the shape's coordinates [m/s]
    template <class Tell>
    FIRN_INLINE void find_corner(mask_t<S> found, const S& thick, const Vec<S, D>& local, const S& distance,
                                 const Vec<S, D>& normal, const Vec<S, D>& v, const Tell& tell) const {
        constexpr double corner = 0.8;  // cosine of the angle between normals from which faces meet in a corner
        const S cell = S(cell_size);
        const auto along = [&](const Vec<S, D>& left) FIRN_LAMBDA {
            const S square = dot(left, left);
            const auto moves = S(detail::least_square) < square;
            return left * select(moves, cell / sqrt(select(moves, square, S(1))), S(0));
        };
        Vec<S, D> out = normal * (thick - distance), left = v - normal * dot(v, normal), first = normal;
        Vec<S, D> second = Vec<S, D>::zero();
        unroll<D - 1>([&](auto look) FIRN_LAMBDA {
            if (!any(found)) return;
            const Vec<S, D> way = out + along(left), there = local + way;
            const S from = shape.signed_distance(there);
            found = found & (from < thick - cell * S(0.3));
            if (!any(found)) return;
            const Vec<S, D> other = normal_of(shape, there);
            const S to_plane = from - dot(other, way);
            const auto from_first = dot(other, first) < S(corner), from_second = dot(other, second) < S(corner);
            found = found & from_first & from_second & (to_plane <= thick);
            if (!any(found)) return;
            tell(found, to_plane, other);
            if constexpr (D == 3) {
                if (look > 0) return;
                // On to where both faces end, along the edge between them.
                const Vec<S, 3> edge = cross(first, other);
                const S square = dot(edge, edge);
                const auto meet = S(1e-8) < square;
                const S per_square = select(meet, S(1) / select(meet, square, S(1)), S(0));
                out = (cross(other, edge) * (thick - distance) + cross(edge, first) * (thick - to_plane)) * per_square;
                left = edge * (dot(v, edge) * per_square);
                found = found & meet;
                second = other;
            }
        });
    }

    /// Returns the distance [m] below which those of the shape are exact.
    FIRN_INLINE P known_distance() const {
        if constexpr (caps && std::floating_point<S>)
            return P(std::min(double(shape.exact_up_to()), 1e30));  // infinity is no number of a program for a GPU
        else
            return known;
    }
    /// \throws parameter_error if the shape caps distances that contact compares on this grid
    void check_distances() const {
        if constexpr (caps) {
            const double exact = shape.exact_up_to(), needed = layer() + off_others * cell_size;
            if (!(exact >= needed))
                throw parameter_error(sentence("The shape of a ", name, " knows distances up to ", exact,
                                               " m only, and the collider needs them up to ", needed,
                                               " m, its layer of ", layer(), " m and two cells of ", cell_size,
                                               " m: it would take nodes far away for near ones. Store distances up to ",
                                               needed, " m (a wider band), or take a thinner layer."));
        }
    }

    /// Replaces the face next to a node by the one that matter around the node touches, if that is another one.
    ///
    /// In a thin solid, and behind it, nodes are nearer to the other face than to the one that matter touches. For this
    /// face, such matter is deep in the solid, and must not move out of it through the first one: the solid would pull
    /// at matter that leaves. So the face is looked for at the middle of the matter. It is taken if it looks the other
    /// way, if the node lies behind it, and if the gap is wider.
    ///
    /// A convex solid with plane faces touches matter at the face from which the gap is widest: the planes of all
    /// others cut through the matter.
    /// \param local    the node in the shape's coordinates [m];  \param distance  the shape's distance there [m]
    /// \param R        turns the shape's axes to those of space
    /// \param nearest  nearest(n) returns how far matter lies from the node along n [m]
    /// \param gap      between face and matter [m];  \param normal  of the face, into free space
    template <class Nearest>
    [[gnu::cold, gnu::noinline]] void look_at_matter(const Vec<S, D>& local, const S& distance, const Mat<S, D>& R,
                                                     const Nearest& nearest, S& gap, Vec<S, D>& normal) const {
        const auto widest = [&](const S& from, const Vec<S, D>& outward) {
            const Vec<S, D> face = R * outward;
            const S there = from - S(thickness) + nearest(face);
            if (!(there > gap)) return;
            gap = there;
            normal = face;
        };
        if constexpr (is_convex<Shape> && requires { shape.planes(local, widest); }) {
            shape.planes(local, widest);
            return;
        }
        if constexpr (!is_smooth<Shape>) look_past_edge(local, distance, R, nearest, gap, normal);
        constexpr double clear_overlap = 0.1;  // [cells]; matter that rests on a surface overlaps by less
        if (!(gap < S(-clear_overlap) * S(cell_size))) return;
        const S middle = S(0.5) * (nearest(normal) - nearest(-normal));
        const Vec<S, D> of_matter = local + transpose(R) * normal * middle, face = R * normal_of(shape, of_matter);
        const S cosine = dot(face, normal), of_node = shape.signed_distance(of_matter) - middle * cosine - S(thickness);
        if (!(cosine < S(0) && of_node < S(0))) return;
        const S there = of_node + nearest(face);
        if (!(there > gap)) return;
        gap = there;
        normal = face;
    }

    /// Replaces the face next to a node by another one that meets it in an edge, if that one keeps solid and matter
    /// apart. The arguments are those of look_at_matter().
    ///
    /// Beside an edge, a node may be nearer to another face than to the one that matter touches, or to the edge. But a
    /// plane that has the solid behind it and matter in front shows a gap that is at most the true one, so the right
    /// one is that from which the gap is widest. The shape tells such planes next to its other faces: at points 0.6
    /// cells below the face next to the node and two cells to each side. If the solid ends there, it has an edge.
    ///
    /// Where the node is farther from such a plane than from the solid, the solid reaches beyond the plane, as in a
    /// concave corner; the plane is left out. Where matter wraps around the edge, no plane keeps them apart, and the
    /// face next to the node stays.
    template <class Nearest>
    void look_past_edge(const Vec<S, D>& local, const S& distance, const Mat<S, D>& R, const Nearest& nearest, S& gap,
                        Vec<S, D>& normal) const {
        constexpr double below = 0.6, beside = 2, rise = 0.3, tolerance = 0.1, most_overlap = 0.25;  // [cells]
        constexpr double flat = 0.01;  // [cells]; points below one plane face differ in their distance by less
        constexpr int count = 2 * (D - 1);
        const S cell = S(cell_size);
        const Vec<S, D> face = transpose(R) * normal, middle = face * (-distance - below * cell);
        Vec<S, D> ways[count];
        S heights[count], highest = -below * cell;
        int found = 0;
        for_tangents(face, [&](const Vec<S, D>& t) {
            for (const double side : {-beside, beside}) {
                ways[found] = middle + t * (side * cell);
                heights[found] = shape.signed_distance(local + ways[found]);
                highest = std::max(highest, heights[found++]);
            }
        });
        if (!(highest > (rise - below) * cell)) return;
        for (int k = 0; k < count; ++k) {
            if (std::abs(heights[k] + below * cell) < flat * cell) continue;
            const Vec<S, D> other = normal_of(shape, local + ways[k]);
            const S of_node = heights[k] - dot(other, ways[k]);
            if (of_node > distance + tolerance * cell) continue;
            const Vec<S, D> outward = R * other;
            const S there = of_node - thickness + nearest(outward);
            if (!(there > gap && there > -most_overlap * cell)) continue;
            gap = there;
            normal = outward;
        }
    }
    /// Calls f(t) for unit vectors t that are at right angles to n and to each other.
    template <class F>
    static void for_tangents(const Vec<S, D>& n, const F& f) {
        if constexpr (D == 2) {
            f(Vec<S, D>{-n[1], n[0]});
        } else {
            Vec<S, D> axis = Vec<S, D>::zero();
            const S x = std::abs(n[0]), y = std::abs(n[1]), z = std::abs(n[2]);
            axis[x <= y && x <= z ? 0 : y <= z ? 1 : 2] = 1;
            const Vec<S, D> first = direction_or_up(cross(n, axis));
            f(first);
            f(cross(n, first));
        }
    }

    /// Returns the displacement [m] that moves x to a point two cells outside of the other solids. The displacement is
    /// at most `farthest_off` cells along each axis.
    template <class Others>
    FIRN_INLINE Vec<S, D> way_out_of(const Others& others, const Vec<S, D>& x) const {
        const S cell = S(cell_size), off = S(off_others) * cell, most = S(farthest_off) * cell;
        Vec<S, D> up = Vec<S, D>::zero(), down = up;  // the farthest along each axis, so that no order matters
        others(x,
               [&](const S& distance, const Vec<S, D>& normal, const Vec<S, D>&, Contact kind, const S&) FIRN_LAMBDA {
                   if (kind == Contact::none) return;
                   const S length = min(max(off - distance, S(0)), most);
                   if (!any(S(0) < length)) return;
                   const Vec<S, D> way = normal * length;
                   unroll<D>([&](auto a) FIRN_LAMBDA {
                       up.v[a] = max(up.v[a], way.v[a]);
                       down.v[a] = min(down.v[a], way.v[a]);
                   });
               });
        return up + down;
    }
};

}  // namespace firn::inline FIRN_BUILD
