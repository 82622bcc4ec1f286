// Float and double do not meet by accident: a sentence for each case, and no more.
// expect: firn: the boundary is of another precision or dimension than the particles and the grid
// expect: firn: the materials of one simulation are of one precision
// expect: firn: the particles, their partition and the grid are of one precision and dimension
// expect: firn: the material and the particles are of one precision
// errors: 4
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Other = float;
#else
using Other = double;
#endif

void of_boundaries(const Domain<3>& box) {
    Simulation simulation(
        box, FixedCorotated<float>{}, Coloured{},
        Together(Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {}), Collider<Sphere<Other, 3>>{.shape = {Other(0.2)}}));
    simulation.step();
}
void of_materials(const Domain<3>& box) {
    Simulation<3, Materials<FixedCorotated<float>, Hencky<Other>>> simulation(box);
    simulation.step();
}
void of_grids(const ForeignParticles<float, 3>& view, const BlockPartition<3>& partition, SparseGrid<Other, 3>& grid) {
    p2g<QuadraticBSpline, Apic, MlsForce>(Coloured{}, view, partition, grid, 1e-3);
}
void of_stages(const ForeignParticles<float, 3>& view, const BlockPartition<3>& partition, SparseGrid<float, 3>& grid) {
    g2p<QuadraticBSpline, Apic, MlsForce>(Coloured{}, view, partition, grid, FixedCorotated<Other>{}, 1e-3);
}
