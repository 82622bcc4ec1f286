/// \file A short run. Header-only it writes where its particles are; with firn::compiled it finds the same bits there.
#include <firn/firn.hpp>

#include <cstdio>
#include <fstream>
#include <string>

int main(int, char** argv) {
    firn::Simulation<2> simulation({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 16});
    simulation.add(firn::sample_box<2>({0.1, 0.1}, {0.4, 0.4}, {.spacing = 1.0 / 32}), 1000.0, {1, -2});
    for (int k = 0; k < 20; ++k) simulation.step();
    std::string numbers;
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot) {
        const firn::Vec<double, 2> x = simulation.particles().exact_position(slot);
        numbers.append(reinterpret_cast<const char*>(x.v), sizeof x.v);
    }
#ifdef FIRN_COMPILED
    std::string others(numbers.size(), '\0');
    std::ifstream(argv[1], std::ios::binary).read(others.data(), std::streamsize(others.size()));
    if (numbers == others) return 0;
    std::puts("firn::compiled gives other bits than the headers.");
    return 1;
#else
    std::ofstream(argv[1], std::ios::binary) << numbers;
#endif
}
