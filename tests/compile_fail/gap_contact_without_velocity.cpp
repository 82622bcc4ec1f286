// A boundary of one's own that cannot act by the gap of particles is named in a sentence.
// expect: firn: this boundary cannot act by the gap of particles
#include <firn/firn.hpp>

using namespace firn;

struct Lid {
    template <class S>
    Vec<S, 2> velocity(const Vec<S, 2>&, const Vec<S, 2>& v) const {
        return v;
    }
#ifdef FIRN_GOOD
    template <class Act>
    Vec<double, 2> velocity_by_gap(const Vec<double, 2>& x, const Vec<double, 2>& v, const Act& act) const {
        return x[1] < 0.9 ? v : act(v, 0.9 - x[1], {0, -1}, {0, 0}, Contact::separate, 0);
    }
#endif
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>&) const { return true; }
};

void run() {
    Simulation simulation(Domain<2>{}, FixedCorotated<float>{}, GapContact{Lid{}});
    simulation.step();
}
