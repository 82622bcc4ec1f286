//! # Several materials
//!
//! `firn::Materials{a, b, …}` puts several materials on one grid. Each material has its own *set* of particles. All
//! materials share one field of velocities, so they stick together within a cell.
//!
//! In 2D, as here, a simulation is a slice of matter one metre thick, in plane strain. So densities are those of 3D
//! [kg/m³], and masses, forces and energies are in kg, N and J.
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include <cstdio>

using Water = firn::Fluid<float>;
using Jelly = firn::FixedCorotated<float>;

int main() {
    const firn::Domain<2> tank{.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 50};
    const auto water = Water::from_properties({.bulk = 1e5});  // sound at 10 m/s, some ten times what moves
    const auto jelly = Jelly::from_young_poisson(2e4, 0.3);
    firn::Simulation simulation(tank, firn::Materials{water, jelly});

    //! `simulation.set<Water>()` returns a handle to the set of a material. You use it like a simulation of one
    //! material: `add`, `totals`, `add_load`, `remove_if`, `state_of`, `restore`. If two materials have the same type,
    //! name a set by its index in the list of materials: `simulation.set<0>()`.
    auto in_tank = simulation.set<Water>();
    auto block = simulation.set<Jelly>();
    in_tank.add(firn::sample_box<2>({0, 0}, {1, 0.4}, {.spacing = 0.01}), 1000);  // kg/m³
    block.add(firn::sample_box<2>({0.4, 0.42}, {0.6, 0.62}, {.spacing = 0.01}), 500);

    //! The material with the fastest sound limits the time step of all. Each set has its own states.
    //! [States and restart](07_states.cpp) tells how to go on from them.
    firn::StateSeries water_states("out", "water"), jelly_states("out", "jelly");
    for (int frame = 0; frame <= 10; ++frame) {
        if (frame > 0) simulation.advance(0.1);
        water_states.write(firn::state_of(in_tank));
        jelly_states.write(firn::state_of(block));
    }
    const auto totals = block.totals();
    const double height = totals.first_moment[1] / totals.mass;
    std::printf("the block floats: its centre is at a height of %.3f m\n", height);
    return height > 0.36 && height < 0.48 ? 0 : 1;
}
