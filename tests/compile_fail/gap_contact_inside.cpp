// A GapContact is the outermost boundary: it does not act as a part of others.
// expect: firn: a GapContact acts by the gap between particles and surfaces, which a node alone does not know
#include <firn/firn.hpp>

using namespace firn;

void run() {
    const auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {});
    const Collider<Sphere<float, 2>> ball{};
#ifdef FIRN_GOOD
    Simulation simulation(Domain<2>{}, FixedCorotated<float>{}, GapContact{Together(walls, ball)});
#else
    Simulation simulation(Domain<2>{}, FixedCorotated<float>{}, Together(walls, GapContact{ball}));
#endif
    simulation.step();
}
