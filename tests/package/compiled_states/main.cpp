/// \file A run that is written, read and gone on from has the bits of one that was not stopped.
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include <cstdio>

firn::Simulation<2> made() { return firn::Simulation<2>({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 16}); }

int main() {
    firn::Simulation<2> whole = made(), again = made();
    whole.add(firn::sample_box<2>({0.1, 0.1}, {0.4, 0.4}, {.spacing = 1.0 / 32}), 1000.0, {1, -2});
    for (int k = 0; k < 10; ++k) whole.step();
    firn::write_state("state.hdf", firn::state_of(whole));
    firn::restore(again, firn::read_state<float>("state.hdf"));
    for (int k = 0; k < 10; ++k) whole.step(), again.step();
    if (firn::state_of(whole) == firn::state_of(again)) return 0;
    std::puts("firn::compiled_hdf5 goes on to other bits.");
    return 1;
}
