/// \file Water at rest in a box, without viscosity: 0.2 m wide, H = 0.1 m deep, ρ = 1800 kg/m³, K = 1 MPa, as in
/// cb-geo/mpm's hydrostatic column (mpm-doc, hydrostatic-column.md); 2 × 2 particles a cell, slip walls. At rest
/// p = ρ g (H − y), to the 0.2 % of compression; let go at once, the load on the floor is a triangular wave between 0
/// and twice the weight, of the period 4 H/c (the linear wave equation).
#pragma once

#include <firn/firn.hpp>

#include <cmath>
#include <numbers>

namespace verification {

/// Of the water, at one time.
struct WaterState {
    double noise = 0;  ///< root of the mean square of p − ρ g (H − y) over ρ g H, three cells from floor, walls and top
    double whole = 0;  ///< the same over all particles
    double centre = 0;  ///< height of the centre of mass over ½ H, minus 1: twice the change of the level
    double speed = 0;   ///< root of the mean square over √(g H)
};

template <class S, class Transfer, class Force, class Kernel, class Volume = firn::OwnVolume>
struct Hydrostatic {
    static constexpr double height = 0.1, width = 0.2, density = 1800, bulk = 1e6, g = 9.81,
                            pressure = density * g * height;

    firn::SimulationWith<2, firn::Fluid<S>, Transfer, Force, Kernel, Volume> simulation;

    explicit Hydrostatic(double h, firn::NodesBehind behind = firn::NodesBehind::held)
        : simulation({{0.0, 0.0}, {width, 0.15}, h}, firn::Fluid<S>::from_properties({.bulk = bulk, .gamma = 7})) {
        auto& boundary = simulation.boundary;
        boundary.at_lower = {firn::Wall{firn::Contact::slip}, firn::Wall{firn::Contact::slip}};
        boundary.at_upper[0] = {firn::Contact::slip};
        boundary.nodes_behind = behind;
        simulation.reactions.emplace();
        simulation.add(firn::sample_box<2>({0.0, 0.0}, {width, height}, {.spacing = h / 2}), density);
    }

    /// WaterState::centre at rest: the mean of u = −ρ g/K (H y − ½ y²) over ½ H.
    static double centre_at_rest() { return -2.0 / 3 * pressure / bulk; }
    static double sound() { return std::sqrt(bulk / density); }
    static double period() { return 4 * height / sound(); }
    /// Of the load, over the weight, of water that is let go at t = 0.
    static double wave(double t) {
        const double phase = std::fmod(t / period(), 1);
        return 4 * (phase < 0.5 ? phase : 1 - phase);
    }

    /// Damped critically in the first mode, or not.
    void advance(double duration, bool damped) {
        const double rate = damped ? std::numbers::pi * sound() / height : 0;
        simulation.advance(duration, firn::Damped<double, 2>{{{0.0, -g}}, rate});
    }
    void step() { simulation.step(firn::Damped<double, 2>{{{0.0, -g}}, 0}); }

    /// What the floor bore in the last step, over the weight.
    double load() const {
        return simulation.reactions->parts[0].impulse[1] / (density * width * height * g * simulation.last_time_step());
    }
    double pressure_of(std::size_t slot) const {
        return double(simulation.material().pressure(simulation.particles().state(slot).J));
    }
    WaterState state() const {
        WaterState state;
        double within = 0, mass = 0;
        const auto& particles = simulation.particles();
        const double margin = 3 * simulation.domain().cell_size;
        std::size_t inner = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const auto x = particles.exact_position(slot);
            const auto v = firn::cast<double>(particles.velocity(slot));
            const double off = std::pow(pressure_of(slot) / pressure - (1 - x[1] / height), 2);
            state.whole += off;
            if (x[0] > margin && x[0] < width - margin && x[1] > margin && x[1] < height - margin)
                within += off, ++inner;
            state.centre += x[1];
            state.speed += dot(v, v);
            ++mass;
        }
        state.noise = std::sqrt(within / double(inner));
        state.whole = std::sqrt(state.whole / mass);
        state.centre = state.centre / mass / (height / 2) - 1;
        state.speed = std::sqrt(state.speed / mass / (g * height));
        return state;
    }
};

}  // namespace verification
