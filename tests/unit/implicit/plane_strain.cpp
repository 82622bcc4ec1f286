// quick: no
/// \file Plane strain in quasi-static steps: a block in two dimensions settles as a slab in three.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include <vector>

namespace implicit_plane_strain_tests {

using namespace firn;

namespace {

constexpr double h = 1.0 / 8, g = 9.81;

/// Settles a block of 4 × 4 cells that sticks to a floor, and returns the places of its particles, by id.
template <int D, class Material>
std::vector<Vec<double, D>> settled(const Material& material) {
    Domain<D> domain;
    domain.lower = Vec<double, D>::zero();
    domain.upper = Vec<double, D>::filled(1);
    if constexpr (D == 3) domain.upper[2] = 3 * h;
    domain.cell_size = h;
    auto walls = Walls<double, D>::all(domain.lower, domain.upper, {Contact::none, 0});
    walls.at_lower[1] = {Contact::stick, 0};
    if constexpr (D == 3) walls.at_lower[2] = walls.at_upper[2] = {Contact::slip, 0};
    walls.nodes_behind = NodesBehind::mirrored;
    Simulation simulation(domain, material, walls, QuasiStatic{});
    simulation.integration.newton.tolerance = 1e-10;
    simulation.gravity = Vec<double, D>::zero();
    simulation.gravity[0] = 0.3 * g;
    simulation.gravity[1] = -g;
    Vec<double, D> low = Vec<double, D>::zero(), high = Vec<double, D>::filled(0.5);
    low[0] = 0.25, high[0] = 0.75;
    if constexpr (D == 3) high[2] = 3 * h;
    simulation.add(sample_box<D>(low, high, {.spacing = h / 2}), 1000);
    simulation.advance(1);
    const auto& particles = simulation.particles();
    std::vector<Vec<double, D>> all(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) all[particles.id(slot)] = particles.exact_position(slot);
    return all;
}
/// The largest distance between a particle of the block and the nearest one of the slab, in the plane.
double apart(const std::vector<Vec<double, 2>>& block, const std::vector<Vec<double, 3>>& slab) {
    double most = 0;
    for (const auto& x : block) {
        double nearest = 1;
        for (const auto& y : slab) nearest = std::min(nearest, std::hypot(x[0] - y[0], x[1] - y[1]));
        most = std::max(most, nearest);
    }
    return most;
}

}  // namespace

TEST_CASE("In plane strain a load step moves a block as a slab between mirrored walls, elastic and plastic") {
    const auto solid = Hencky<double>::from_young_poisson(2e5, 0.3);
    CHECK(apart(settled<2>(PlaneStrain<Hencky<double>>{solid}), settled<3>(solid)) < 1e-8 * h);
    const auto metal = VonMises<double>::from_properties({.young = 2e5, .poisson = 0.3, .yield_stress = 3e3});
    const auto flown = settled<2>(PlaneStrain<VonMises<double>>{metal});
    CHECK(apart(flown, settled<3>(metal)) < 1e-8 * h);
    CHECK(apart(flown, settled<3>(solid)) > 1e-3 * h);
}

}  // namespace implicit_plane_strain_tests
