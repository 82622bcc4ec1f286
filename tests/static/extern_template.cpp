/// \file A program that leaves the compiling of its simulation to another file, for check_extern_template.sh.
#include <firn/simulation.hpp>

#ifndef FIRN_PLANT_COPY
extern template class firn::Simulation<3>;
#endif

int main() {
    firn::Simulation<3> simulation({.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 64});
    simulation.add(firn::sample_box<3>({0.1, 0.5, 0.4}, {0.35, 0.75, 0.65}, {.spacing = 1.0 / 128}), 1000.0);
    simulation.step();
    simulation.advance(0.1);
    return simulation.report().sort_needed ? 0 : int(simulation.partition().particles);
}
