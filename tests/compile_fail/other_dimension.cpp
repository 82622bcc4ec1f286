// Two and three dimensions do not meet: a sentence for each case, and no more.
// expect: firn: the boundary is of another precision or dimension than the particles and the grid
// expect: firn: these samples have another dimension than the simulation
// expect: firn: this domain has another dimension than the simulation
// expect: firn: this velocity has another dimension than the simulation
// errors: 4
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
constexpr int N = 3;
#else
constexpr int N = 2;
#endif
const auto near_corner = Vec<double, N>::zero(), far_corner = Vec<double, N>::filled(1);

void of_walls() {
    Simulation simulation(Domain<3>{}, FixedCorotated<float>{}, Coloured{},
                          Walls<float, N>::all(cast<float>(near_corner), cast<float>(far_corner), {}));
    simulation.step();
}
void of_samples_and_velocities(Simulation<3>& simulation) {
    simulation.add(sample_box<N>(near_corner, far_corner, {.spacing = 0.1}), 1000);
    simulation.add(sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = 0.1}), 1000, far_corner);
}
void of_domains() { Simulation<3> simulation(Domain<N>{}); }
