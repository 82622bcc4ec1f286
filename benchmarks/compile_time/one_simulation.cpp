/// \file The program whose compile time is measured: all of firn, one simulation.
#include <firn/firn.hpp>

int main() {
    firn::Simulation<3> simulation({.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 64});
    simulation.add(firn::sample_box<3>({0.1, 0.5, 0.4}, {0.35, 0.75, 0.65}, {.spacing = 1.0 / 128}), 1000.0);
    simulation.advance(0.1);
}
