/// \file The faces of the simulation box. Nodes on a face and the ghost nodes beyond it follow its condition.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/core/error.hpp>

#include <limits>

namespace firn {

/// One face of the box.
struct Wall {
    Contact contact = Contact::separate;
    double friction = 0;  ///< Coulomb's coefficient μ [1]
};

/// A wall that slips without friction is a plane of symmetry: half a body against it moves as the whole would, but for
/// the two cells next to it. The nodes behind it are held like those on it, and do not move as mirror images would, so
/// that splines see too small a velocity gradient at the wall: stresses there are off by a fifth, and no finer cells
/// mend that.
template <scalar S, int D>
struct Walls {
    Vec<S, D> lower{};  ///< lower corner of the box [m]
    Vec<S, D> upper{};  ///< upper corner [m]
    std::array<Wall, D> at_lower{}, at_upper{};

    /// \throws parameter_error, as check()
    static Walls all(const Vec<S, D>& lower, const Vec<S, D>& upper, Wall wall) {
        Walls walls{lower, upper, {}, {}};
        walls.at_lower.fill(wall);
        walls.at_upper.fill(wall);
        walls.check();
        return walls;
    }

    /// \throws parameter_error unless lower < upper, and friction ≥ 0 and finite on every face
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

    /// "lower face of axis 0: separate, friction 0; …", for files.
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
    /// Once a step, before any node is touched. \throws parameter_error, as check()
    template <class T>
    Walls<T, D> lifted() const {
        if constexpr (std::floating_point<S>) check();
        return {cast<T>(lower), cast<T>(upper), at_lower, at_upper};
    }

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

    /// The faces, with matter on their inner side. \see has_surfaces
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

    bool reaches(const Vec<double, D>& low, const Vec<double, D>& high) const
        requires std::floating_point<S>
    {
        bool inside = true;
        unroll<D>([&](auto a) {
            const double near = 2 * double(slack(a));  // a block's corner is rounded, too
            inside = inside && low[a] > double(lower[a]) + near && high[a] < double(upper[a]) - near;
        });
        return !inside;
    }

private:
    /// A node on a face can miss it by rounding: lower + i h against upper is off by up to 3 ε (|lower| + |upper|).
    FIRN_INLINE S slack(int axis) const {
        return S(4 * double(std::numeric_limits<value_type_t<S>>::epsilon())) *
               (abs(lower.v[axis]) + abs(upper.v[axis]));
    }
};

}  // namespace firn
