/// \file The scenes that benchmarks run.
#pragma once

#include <firn/firn.hpp>

#include <chrono>

namespace scenes {

/// Seconds of wall time while it runs: the rates that benchmarks report. (Google Benchmark's own rates are by the CPU
/// time of one thread, or else it changes the benchmark's name.)
class Stopwatch {
public:
    template <class F>
    void run(const F& f) {
        const auto begin = std::chrono::steady_clock::now();
        f();
        seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }
    double seconds() const { return seconds_; }

private:
    double seconds_ = 0;
};

/// The material, box and time step of the two cubes: 128³ cells of a unit box, dt = 0.1 ms, E = 1 kPa, ν = 0.3.
inline firn::Domain<3> unit_box() { return {{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 1.0 / 128}; }
inline constexpr double time_step = 1e-4;
inline constexpr double young = 1e3, poisson = 0.3;

/// Two cubes that fly past each other, turn and touch: 2 × 72,027 particles, eight a cell, on a lattice of spacing h/2
/// moved at random by up to 0.05 h, at ±(2, 1.4, 1) m/s and turning by ±6 rad/s about z, so that they drift over
/// borders of blocks and must be sorted again.
template <class Simulation>
void add_two_cubes(Simulation& simulation) {
    using S = typename Simulation::scalar_type;
    const double h = unit_box().cell_size;
    const firn::Vec<double, 3> corners[] = {{40 * h, 40 * h, 40 * h}, {64 * h, 60 * h, 58 * h}};
    for (int cube = 0; cube < 2; ++cube) {
        const double sign = cube == 0 ? 1 : -1;
        const auto points =
            firn::lattice_points<3>(corners[cube], {42, 42, 41}, h / 2, 0.1, std::uint64_t(cube + 1), 72'027);
        const firn::Body body = simulation.add({points, h * h * h / 8}, 1.0);
        const auto centre = corners[cube] + firn::Vec<double, 3>::filled(10.5 * h);
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || particles.id(slot) < body.first) continue;
            const auto from_centre = firn::cast<double>(particles.position(slot)) - centre;
            const firn::Vec<double, 3> v{sign * (2 - 6 * from_centre[1]), sign * (1.4 + 6 * from_centre[0]), sign};
            particles.set_velocity(slot, firn::cast<S>(v));
            particles.set_affine(slot, firn::Mat<S, 3>::rows(0, -6 * sign, 0, 6 * sign, 0, 0, 0, 0, 0));
        }
    }
    simulation.fixed_time_step = time_step;
}

}  // namespace scenes
