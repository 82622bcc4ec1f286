/// \file The faces of the simulation box. Nodes on a face and the ghost nodes beyond it follow its condition.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/core/error.hpp>

namespace firn {

/// One face of the box.
struct Wall {
    Contact contact = Contact::separate;
    double friction = 0;  ///< Coulomb's coefficient μ [1]
};

template <scalar S, int D>
struct Walls {
    Vec<S, D> lower{};  ///< lower corner of the box [m]
    Vec<S, D> upper{};  ///< upper corner [m]
    std::array<Wall, D> at_lower{}, at_upper{};

    static Walls all(const Vec<S, D>& lower, const Vec<S, D>& upper, Wall wall) {
        Walls walls{lower, upper, {}, {}};
        walls.at_lower.fill(wall);
        walls.at_upper.fill(wall);
        return walls;
    }

    static constexpr const char* name = "walls";
    static constexpr auto parameters() {
        return std::tuple{parameter{"lower", "m", &Walls::lower}, parameter{"upper", "m", &Walls::upper}};
    }
    template <class T>
    Walls<T, D> lifted() const {
        return {cast<T>(lower), cast<T>(upper), at_lower, at_upper};
    }

    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, Vec<S, D> v) const {
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            Vec<S, D> inward = Vec<S, D>::zero();
            inward[axis] = S(1);
            const Wall &low = at_lower[axis], &high = at_upper[axis];
            v = select(x.v[axis] <= lower.v[axis], velocity_after_contact(v, inward, low.contact, S(low.friction)), v);
            v = select(x.v[axis] >= upper.v[axis], velocity_after_contact(v, -inward, high.contact, S(high.friction)), v);
        });
        return v;
    }

    bool reaches(const Vec<double, D>& low, const Vec<double, D>& high) const
        requires std::floating_point<S>
    {
        bool inside = true;
        unroll<D>([&](auto a) { inside = inside && low[a] > double(lower[a]) && high[a] < double(upper[a]); });
        return !inside;
    }
};

}  // namespace firn
