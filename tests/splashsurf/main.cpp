/// \file A dam of water that has begun to fall: writes its particles and its surface as PLY files, which read.py gives
/// to splashsurf, and prints what read.py compares. With a number above 200000 nothing moves, to compare times.
///
///     firn_splashsurf FOLDER PARTICLES [THREADS]
#include <firn/firn.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/io/surface.hpp>
#include <firn/simulation/surface.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>

namespace {

int dam(const std::filesystem::path& folder, double particles, int threads) {
    const double spacing = std::cbrt(1 / particles);
    firn::Simulation simulation(firn::Domain<3>{.lower = {0, 0, 0}, .upper = {3, 2, 1}, .cell_size = 2 * spacing},
                                firn::Fluid<float>{.bulk = 1e5F}, {threads});
    simulation.boundary = firn::Walls<float, 3>::all({0, 0, 0}, {3, 2, 1}, {firn::Contact::separate, 0});
    simulation.add(firn::sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = spacing, .pattern = firn::Pattern::jittered}),
                   1000);
    if (particles <= 2e5) simulation.advance(0.25);
    firn::write_ply(folder / "points.ply", firn::state_of(simulation), {"velocity", "mass"});

    const auto start = std::chrono::steady_clock::now();
    const firn::SurfaceMesh surface = firn::surface_of(simulation, {.threads = threads});
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    firn::write_ply(folder / "surface.ply", firn::surface_of(simulation, {.threads = threads}, {"velocity"}));
    std::printf("%zu %.9g %.9g %zu %zu %.3f\n", simulation.particles().size(), spacing, firn::signed_volume(surface),
                surface.vertices.size(), surface.triangles.size(), seconds.count());
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return argc < 3 ? 2 : dam(argv[1], std::atof(argv[2]), argc > 3 ? std::atoi(argv[3]) : 0);
    } catch (const std::exception& problem) {
        std::fprintf(stderr, "%s\n", problem.what());
        return 1;
    }
}
