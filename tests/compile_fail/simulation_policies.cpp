// What is no policy of a simulation, or is none that its type names, is said in a sentence.
// expect: firn: this simulation is given policies that its type does not name. Leave its template arguments out
// expect: firn: a simulation has one boundary; join several with firn::Together
// expect: firn: what is given to a simulation after its material are policies
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
void run(const Domain<3>& box, const Walls<float, 3>& walls, const Collider<Sphere<float, 3>>& ball) {
    Simulation simulation(box, FixedCorotated<float>{}, Together(walls, ball));
}
#else
void run(const Domain<3>& box, const Walls<float, 3>& walls, const Collider<Sphere<float, 3>>& ball) {
    Simulation<3> simulation(box, FixedCorotated<float>{}, Together(walls, ball));
}
SimulationWith<3, Snow<float>, Walls<float, 3>, Collider<Sphere<float, 3>>>* two_boundaries;
SimulationWith<3, Snow<float>, int>* no_policy;
#endif
