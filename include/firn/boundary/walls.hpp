/// \file Walls on the faces of a box.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/core/error.hpp>

#include <limits>

namespace firn {

/// The wall on one face of a box.
struct Wall {
    Contact contact = Contact::separate;  ///< How matter may move at the face.
    double friction = 0;                  ///< Coulomb's friction coefficient μ [1]
};

/// Walls on the faces of a box, with matter inside: the default boundary of a simulation.
///
/// Nodes on a face, and the ghost nodes outside of the box, get the velocity that velocity_after_contact() returns.
/// Each face has its own contact and friction; a face with Contact::none has no wall.
///
/// A wall with contact `slip` and without friction is a plane of symmetry: half a body in contact with the wall moves
/// as the whole body would, except in the two cells next to the wall. In these two cells the stresses have an error of
/// about a fifth, also with finer cells. The reason: the nodes behind the wall should move like mirror images of the
/// nodes in front of the wall, but their normal velocity is set to zero, too. The velocity gradient at particles near
/// the wall is therefore too small.
template <scalar S, int D>
struct Walls {
    Vec<S, D> lower{};               ///< lower corner of the box [m]
    Vec<S, D> upper{};               ///< upper corner of the box [m]
    std::array<Wall, D> at_lower{},  ///< the wall at the lower end of each axis
        at_upper{};                  ///< the wall at the upper end of each axis

    /// Returns walls on all faces of the box [lower, upper] [m], each with the contact and the friction of `wall`.
    /// \throws parameter_error if check() throws it
    static Walls all(const Vec<S, D>& lower, const Vec<S, D>& upper, Wall wall) {
        Walls walls{lower, upper, {}, {}};
        walls.at_lower.fill(wall);
        walls.at_upper.fill(wall);
        walls.check();
        return walls;
    }

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
            for (const Wall* wall : {&at_lower[std::size_t(a)], &at_upper[std::size_t(a)]})
                if (!(wall->friction >= 0) || !std::isfinite(wall->friction))
                    throw parameter_error(sentence("The friction of a wall across axis ", a, " is ", wall->friction,
                                                   "; Coulomb's coefficient must be finite and not negative."));
        }
    }

    /// Returns a description, as it is written into files: "lower face of axis 0: separate, friction 0; …".
    std::string description() const {
        std::string text;
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            for (const bool upper_face : {false, true}) {
                const Wall& wall = (upper_face ? at_upper : at_lower)[a];
                text += sentence(text.empty() ? "" : "; ", upper_face ? "upper" : "lower", " face of axis ", a, ": ",
                                 name_of(wall.contact), ", friction ", wall.friction);
            }
        }
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
        return {cast<T>(lower), cast<T>(upper), at_lower, at_upper};
    }

    /// Returns the velocity [m/s] of a node at x [m] after contact; v [m/s] is the node's velocity before.
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, Vec<S, D> v) const {
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            Vec<S, D> inward = Vec<S, D>::zero();
            inward[axis] = S(1);
            const Wall &low = at_lower[axis], &high = at_upper[axis];
            const S near = slack(axis);
            v = select(x.v[axis] <= lower.v[axis] + near,
                       velocity_after_contact(v, inward, low.contact, S(low.friction)), v);
            v = select(x.v[axis] >= upper.v[axis] - near,
                       velocity_after_contact(v, -inward, high.contact, S(high.friction)), v);
        });
        return v;
    }

    /// Calls `seen` for every face; the normals point into the box. \see has_surfaces
    template <class Seen>
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        const Vec<S, D> at_rest = Vec<S, D>::zero();
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            Vec<S, D> inward = Vec<S, D>::zero();
            inward[axis] = S(1);
            const Wall &low = at_lower[axis], &high = at_upper[axis];
            seen(x.v[axis] - lower.v[axis], inward, at_rest, low.contact, S(low.friction));
            seen(upper.v[axis] - x.v[axis], -inward, at_rest, high.contact, S(high.friction));
        });
    }

    /// Returns true if nodes in the box [low, high] [m] may lie on a face of the walls or outside of the walls.
    bool reaches(const Vec<double, D>& low, const Vec<double, D>& high) const
        requires std::floating_point<S>
    {
        bool inside = true;
        unroll<D>([&](auto a) {
            const double near = 2 * double(slack(a));  // the corners of the box [low, high] are rounded, too
            inside = inside && low[a] > double(lower[a]) + near && high[a] < double(upper[a]) - near;
        });
        return !inside;
    }

private:
    /// Returns a small distance [m]. A node counts as lying on a face if it is nearer to the face than this distance.
    /// Because of rounding, the computed position of a node on the upper face differs from `upper` by at most 3 ε
    /// (|lower| + |upper|), where ε is the machine epsilon of S.
    FIRN_INLINE S slack(int axis) const {
        return S(4 * double(std::numeric_limits<value_type_t<S>>::epsilon())) *
               (abs(lower.v[axis]) + abs(upper.v[axis]));
    }
};

}  // namespace firn
