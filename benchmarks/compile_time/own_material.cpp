/// \file The same program with states, for a material of the user's own that no library has compiled: that of
/// examples/own_material.hpp.
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include <own_material.hpp>

int main() {
    firn::Simulation<3, SoftTissue<>> simulation({.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 64});
    simulation.add(firn::sample_box<3>({0.1, 0.5, 0.4}, {0.35, 0.75, 0.65}, {.spacing = 1.0 / 128}), 1000.0);
    simulation.advance(0.1);
    firn::write_state("state.hdf", firn::state_of(simulation));
    firn::restore(simulation, firn::read_state<float>("state.hdf"));
}
