// A policy of one's own that firn cannot call is refused in one sentence each, and not deep inside.
// expect: firn: a boundary offers `template <class S> firn::Vec<S, D> velocity(
// expect: firn: a boundary that is a template over its scalar lists its parameters
// expect: firn: a boundary offers `bool reaches(lower, upper) const`
// expect: firn: velocity(x, v, mass, dt) is not called inside of a GapContact
// expect: firn: a transfer offers `template <class T, int D> firn::Mat<T, D> affine_field(
// expect: firn: the function blended() of this transfer cannot be called
// expect: firn: a force form offers static functions affine_part
// expect: firn: a volumetric policy that averages offers a static function velocity_gradient
// expect: firn: a contact law offers `template <int D> firn::Vec<double, D> relative_velocity(
// errors: 10
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
constexpr bool good = true;
#else
constexpr bool good = false;
#endif

struct OfFloats {  // no branch on lanes: it is a function of floats
    template <class S>
        requires(good || std::same_as<S, float>)
    Vec<S, 2> velocity(const Vec<S, 2>& x, const Vec<S, 2>& v) const {
        return select(S(0.5) < x[1], Vec<S, 2>::zero(), v);
    }
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>&) const { return true; }
};
template <class S>
struct Unlisted {
    S height = S(0.5);
    static constexpr auto parameters()
        requires good
    {
        return std::tuple{parameter{"height", "m", &Unlisted::height}};
    }
    Vec<S, 2> velocity(const Vec<S, 2>& x, const Vec<S, 2>& v) const {
        return select(height < x[1], Vec<S, 2>::zero(), v);
    }
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>&) const { return true; }
};
struct Nowhere {
    template <class S>
    Vec<S, 2> velocity(const Vec<S, 2>&, const Vec<S, 2>& v) const {
        return v;
    }
    template <int D>
        requires good
    bool reaches(const Vec<double, D>&, const Vec<double, D>&) const {
        return true;
    }
};
struct Soft {
    template <class S>
    Vec<S, 2> velocity(const Vec<S, 2>&, const Vec<S, 2>& v, const S& mass, const S& dt) const {
        return v * (mass / (mass + dt));
    }
    template <class Act>
        requires good
    Vec<double, 2> velocity_by_gap(const Vec<double, 2>&, const Vec<double, 2>& v, const Act&) const {
        return v;
    }
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>&) const { return true; }
};
template <scalar S>
struct Kept {
    static constexpr bool affine = true;
    S share = S(0.5);
    static constexpr auto parameters() { return std::tuple{parameter{"share", "1", &Kept::share}}; }
    template <class T, int D>
        requires good
    Mat<T, D> affine_field(const Mat<T, D>& C) const {
        return C * share;
    }
};
struct Blend : Pic {
    template <class T, int D>
    ParticleVelocity<T, D> blended(const Vec<T, D>& after, const Vec<T, D>&, const Vec<T, D>& own,
                                   const Mat<T, D>&) const
        requires good
    {
        return {own, after};
    }
    template <class T, int D>
    Vec<T, D> blended(const Vec<T, D>& after, const Vec<T, D>&, const Vec<T, D>&) const {
        return after;
    }
};
struct Halves {
    static constexpr bool weight_gradients = false, needs_inertia = false;
    template <class S, int D>
        requires good
    static Mat<S, D> affine_part(const Mat<S, D>&, const S&, const S&) {
        return {};
    }
    template <class S, int D>
    static Mat<S, D> gradient_part(const Mat<S, D>&, const S&) {
        return {};
    }
};
struct Average {
    static constexpr bool averages_volume = !good;
};
struct Ghosts {
    static constexpr bool between_groups = !good;
};

const Domain<2> box;
const FixedCorotated<float> jelly;
void boundaries() {
    Simulation(box, jelly, OfFloats{}).step();
    Simulation(box, jelly, Together(Walls<float, 2>{}, Unlisted<float>{})).step();
    Simulation(box, jelly, Together(Walls<float, 2>{}, Nowhere{})).step();
    Simulation(box, jelly, GapContact{Soft{}}).step();
}
template <class Policy>
constexpr std::size_t with = sizeof(Simulation(box, jelly, Policy{}));
constexpr std::size_t others = with<Kept<float>> + with<Blend> + with<Halves> + with<Average> + with<Ghosts>;
