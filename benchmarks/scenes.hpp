/// \file The scenes that benchmarks run.
#pragma once

#include <firn/firn.hpp>

#include <chrono>
#include <ctime>
#include <vector>

namespace scenes {

/// Seconds while it runs, of wall time and of all threads' CPU time: the rates that benchmarks report. (Google
/// Benchmark's own rates are by the CPU time of one thread, or else it changes the benchmark's name.)
class Stopwatch {
public:
    template <class F>
    void run(const F& f) {
        const auto begin = std::chrono::steady_clock::now();
        const std::clock_t cpu_begin = std::clock();
        f();
        cpu_seconds_ += double(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
        seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }
    double seconds() const { return seconds_; }
    double cpu_seconds() const { return cpu_seconds_; }

private:
    double seconds_ = 0, cpu_seconds_ = 0;
};

/// A body of 1 kg/m³ (kg/m² in 2D) that moves and turns.
template <int D>
struct Matter {
    firn::Samples<D> samples;
    firn::Vec<double, D> velocity{};  ///< of the centre [m/s]
    firn::Vec<double, D> centre{};    ///< about which it turns [m]
    double spin = 0;                  ///< about z [rad/s]
    double strain = 0;                ///< F is I and up to ± this at random in each component
    double jostle = 0;                ///< up to ± this at random in each component of each velocity [m/s]
};

// Of the two cubes, the scene that all others are compared with.
inline firn::Domain<3> unit_box() { return {{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 1.0 / 128}; }
inline constexpr double time_step = 1e-4;            // [s]
inline constexpr double young = 1e3, poisson = 0.3;  // [Pa], [1]

/// Which steps of a scene are timed.
struct Steps {
    int before = 10;  ///< not timed: memory is touched, and matter comes to where it shall be measured
    int all = 500;    ///< then it starts anew: long enough to be sorted many times, short of the walls
    int least = 20;   ///< so many that sorting has its share, even if Google Benchmark asks for one
};

template <int D>
struct Scene {
    firn::Domain<D> domain;
    std::vector<Matter<D>> matter;
    double time_step = scenes::time_step;
    double young = scenes::young, poisson = scenes::poisson;
    firn::Vec<double, D> gravity{0.0, -9.81};  ///< [m/s²]
    Steps steps;

    std::size_t size() const {
        std::size_t sum = 0;
        for (const Matter<D>& body : matter) sum += body.samples.positions.size();
        return sum;
    }
};

/// A number in [−1, 1) that depends on a particle and a component only.
inline double random_number(std::uint64_t seed, std::size_t particle, int component) {
    return 2 * firn::unit_interval(firn::random_bits(seed, 16 * particle + std::uint64_t(component))) - 1;
}

/// Calls f(x, v, C, F) for every particle of a body, in order.
template <int D, class F>
void for_particles(const Matter<D>& body, const F& f) {
    firn::Mat<double, D> C = firn::Mat<double, D>::zero();
    C(0, 1) = -body.spin;
    C(1, 0) = body.spin;
    for (std::size_t i = 0; i < body.samples.positions.size(); ++i) {
        const firn::Vec<double, D>& x = body.samples.positions[i];
        firn::Vec<double, D> v = body.velocity + C * (x - body.centre);
        firn::Mat<double, D> deformation = firn::Mat<double, D>::identity();
        for (int k = 0; k < D; ++k) v[k] += body.jostle * random_number(11, i, k);
        for (int k = 0; k < D * D; ++k) deformation.m[k] += body.strain * random_number(12, i, k);
        f(x, v, C, deformation);
    }
}

/// Gives a simulation, made with the scene's domain, the scene's matter and settings.
template <class Simulation, int D>
void add(Simulation& simulation, const Scene<D>& scene) {
    using S = typename Simulation::scalar_type;
    for (const Matter<D>& matter : scene.matter) {
        const firn::Body body = simulation.add(matter.samples, 1.0);
        std::vector<std::uint32_t> slot_of(body.count);
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot) && particles.id(slot) >= body.first)
                slot_of[particles.id(slot) - body.first] = std::uint32_t(slot);
        std::size_t i = 0;
        for_particles(matter, [&](const auto&, const auto& v, const auto& C, const auto& F) {
            const std::size_t slot = slot_of[i++];
            particles.set_velocity(slot, firn::cast<S>(v));
            particles.set_affine(slot, firn::cast<S>(C));
            if (matter.strain == 0) return;
            auto state = particles.state(slot);
            state.F = firn::cast<S>(F);
            particles.set_state(slot, state);
        });
    }
    simulation.gravity = scene.gravity;
    simulation.fixed_time_step = scene.time_step;
    simulation.most_steps_between_sorts = 10;
    simulation.warn = [](const std::string&) {};
}

/// Two cubes (squares in 2D) that fly past each other, turn and touch, so that particles drift over borders of blocks
/// and must be sorted again. In 3D, unless another number of particles is asked for: 128³ cells of a unit box, and each
/// cube the first 72,027 points of a lattice of 42 × 42 × 41, eight a cell, moved at random by up to 0.05 h. Other
/// numbers: the same cubes in finer or coarser cells, and the time step with them.
template <int D>
Scene<D> two_cubes(std::size_t particles = 144'054) {
    const std::size_t in_cube = particles / 2;
    const auto side = std::int64_t(std::lround(std::pow(double(in_cube), 1.0 / D)));  // in particles, two a cell
    std::int64_t in_layer = 1;
    std::array<std::int64_t, D> counts{};
    for (std::size_t a = 0; a < D - 1; ++a) in_layer *= counts[a] = side;
    counts[D - 1] = (std::int64_t(in_cube) + in_layer - 1) / in_layer;
    const double cells = std::round(128 * double(side) / 42), h = 1 / cells;

    Scene<D> scene;
    scene.domain.cell_size = h;
    scene.time_step = time_step * 128 / cells;
    const double corners[2][3] = {{40, 40, 40}, {64, 60, 58}}, velocity[3] = {2, 1.4, 1};
    for (std::uint64_t cube = 0; cube < 2; ++cube) {
        const double sign = cube == 0 ? 1 : -1;
        Matter<D> body;
        firn::Vec<double, D> corner{};
        for (int a = 0; a < D; ++a) {
            corner[a] = corners[cube][a] * (cells / 128) * h;
            body.velocity[a] = sign * velocity[a];
            body.centre[a] = corner[a] + double(side) * h / 4;
        }
        body.spin = 6 * sign;
        body.samples = {firn::lattice_points<D>(corner, counts, h / 2, 0.1, cube + 1, in_cube), std::pow(h / 2, D)};
        scene.matter.push_back(std::move(body));
    }
    return scene;
}

/// The same, all of its steps timed, from before the cubes touch until they are strained: code that decomposes F may
/// become slower on the way.
inline Scene<3> all_of_two_cubes() {
    Scene<3> scene = two_cubes<3>();
    scene.steps.least = scene.steps.all;
    return scene;
}

/// The two cubes of as many particles.
template <std::size_t particles>
Scene<3> cubes_of() {
    return two_cubes<3>(particles);
}

/// The two cubes of 144,054 particles.
template <class Simulation>
void add_two_cubes(Simulation& simulation) {
    add(simulation, two_cubes<Simulation::dimension>());
}

}  // namespace scenes
