/// \file write_scene FILE STEPS: the two cubes of the benchmarks, and where firn has them after so many steps, as
/// 32-bit floats of this machine: cells, time step, E, ν, volume of a particle (its mass is the same number); then 18
/// for each particle: position, velocity, C by rows, and the position after the steps.
#include "../scenes.hpp"

#include <cstdio>
#include <fstream>

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "usage: write_scene FILE STEPS\n");
        return 2;
    }
    const scenes::Scene<3> scene = scenes::two_cubes<3>();
    firn::Simulation<3> simulation(scene.domain,
                                   firn::FixedCorotated<float>::from_young_poisson(scene.young, scene.poisson));
    scenes::add(simulation, scene);
    for (long step = std::atol(argv[2]); step > 0; --step) simulation.step();
    std::vector<firn::Vec<float, 3>> after(scene.size());
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) after[particles.id(slot)] = particles.position(slot);

    std::ofstream file(argv[1], std::ios::binary);
    const auto write = [&](double number) {
        const float rounded = float(number);
        file.write(reinterpret_cast<const char*>(&rounded), sizeof rounded);
    };
    write(scene.domain.cells(0));
    write(scene.time_step);
    write(scene.young);
    write(scene.poisson);
    write(scene.matter.front().samples.volume);
    std::size_t id = 0;
    for (const auto& body : scene.matter)
        scenes::for_particles(body, [&](const auto& x, const auto& v, const auto& C, const auto&) {
            for (int a = 0; a < 3; ++a) write(x[a]);
            for (int a = 0; a < 3; ++a) write(v[a]);
            for (int k = 0; k < 9; ++k) write(C(k / 3, k % 3));
            for (int a = 0; a < 3; ++a) write(after[id][a]);
            ++id;
        });
    file.close();
    if (!file) std::fprintf(stderr, "%s cannot be written.\n", argv[1]);
    return file ? 0 : 1;
}
