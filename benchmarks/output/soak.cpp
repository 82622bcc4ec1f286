/// \file A run of hours with states in the background: does memory grow, do mass and momentum drift?
///
///     firn_soak [MINUTES] [PARTICLES] [THREADS] [FOLDER]
///
/// A line a minute, and at the end the drifts. States of the last tenth thousand steps stay in FOLDER.
#include <firn/io/states.hpp>

#include "scene.hpp"
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>

namespace {

/// What the process holds in memory now [MB].
double resident() {
    std::ifstream status("/proc/self/statm");
    double all = 0, pages = 0;
    status >> all >> pages;
    return pages * double(::sysconf(_SC_PAGESIZE)) / 1e6;
}

constexpr int steps_a_state = 100, states_a_series = 10;

}  // namespace

int main(int count, char** words) {
    const output::Words word{count, words};
    const double minutes = std::atof(word(1, "60"));
    auto simulation = output::blocks(std::atof(word(2, "1e6")), std::atoi(word(3, "0")));
    const std::filesystem::path folder = word(4, "soak");

    const auto first = simulation.totals();
    double pushing = 0;  // Σ m |v|: what momentum is measured by
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) pushing += double(particles.mass(slot) * norm(particles.velocity(slot)));
    std::printf("%zu particles, %g kg, sum of m|v| %g kg m/s\n", first.particles, first.mass, pushing);
    std::puts("minutes   steps   time [s]   memory [MB]   states   lost mass   drift of momentum   energy [J]");

    std::unique_ptr<firn::BackgroundSeries<float>> series;
    std::size_t states = 0;
    double early = 0;  // memory after the first minute
    const double start = output::now();
    for (int told = 0; output::now() - start < 60 * minutes;) {
        if (simulation.steps() % (steps_a_state * states_a_series) == 0) {
            if (series) series->finish();
            series = std::make_unique<firn::BackgroundSeries<float>>(folder, "soak");  // replaces the one before
        }
        if (simulation.steps() % steps_a_state == 0) {
            auto state = series->spare();
            firn::state_of(simulation, state);
            series->write(std::move(state));
            ++states;
        }
        simulation.step();
        if (output::now() - start < 60 * (told + 1)) continue;
        ++told;
        const auto all = simulation.totals();
        if (told == 1) early = resident();
        std::printf("%7d %7llu %10.4f %13.0f %8zu %11.1e %19.1e %12.5g\n", told,
                    static_cast<unsigned long long>(simulation.steps()), simulation.time(), resident(), states,
                    1 - all.mass / first.mass, norm(all.momentum - first.momentum) / pushing,
                    all.kinetic_energy + all.elastic_energy);
        std::fflush(stdout);
    }
    if (series) series->finish();
    const auto all = simulation.totals();
    std::printf(
        "%llu steps, %.3g particle-steps, %zu states; memory %.0f MB after a minute, %.0f MB at the end; "
        "particles lost %zu, mass %.1e, drift of momentum %.1e of the sum of m|v|\n",
        static_cast<unsigned long long>(simulation.steps()), double(simulation.steps()) * double(all.particles), states,
        early, resident(), first.particles - all.particles, 1 - all.mass / first.mass,
        norm(all.momentum - first.momentum) / pushing);
}
