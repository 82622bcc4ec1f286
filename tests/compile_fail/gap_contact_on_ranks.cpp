// Boundaries that act by the gap of particles do not run on several processes, and the compiler says so.
// expect: firn: boundaries that act by the gap of particles (GapContact) do not run on several processes yet
#include <firn/firn.hpp>

using namespace firn;

struct ManyRanks : OneRank {};
struct OnRanks : Coloured {};
ManyRanks ranks_of(const OnRanks&) { return {}; }

#ifdef FIRN_GOOD
using How = Coloured;
#else
using How = OnRanks;
#endif

void run() {
    Simulation simulation(Domain<2>{}, FixedCorotated<float>{}, How{},
                          GapContact{Walls<float, 2>::all({0, 0}, {1, 1}, {})});
    simulation.step();
}
