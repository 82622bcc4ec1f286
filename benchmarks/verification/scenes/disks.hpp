/// \file Two elastic disks collide in free space. Sulsky, Chen and Schreyer 1994: E = ρ = 1000, ν = 0.3, R = 0.2 m,
/// centres (0.2, 0.2) and (0.8, 0.8), v = ±(0.1, 0.1) m/s, unit box, 20² cells, 2 × 2 particles a cell.
#pragma once

#include <firn/firn.hpp>

namespace verification {

template <class S, class Transfer = firn::Apic, class Force = firn::MlsForce, class Kernel = firn::QuadraticBSpline,
          class Execution = firn::Coloured>
struct Disks {
    static constexpr double radius = 0.2, young = 1000, density = 1000;
    static inline const firn::Vec<double, 2> velocity{0.1, 0.1};
    /// When rigid disks would touch [s], and how fast they near each other [m/s].
    static inline const double approach = 0.2 * std::sqrt(2.0), onset = (0.6 * std::sqrt(2.0) - 2 * radius) / approach;

    firn::Simulation<2, firn::FixedCorotated<S>, Transfer, Force, Kernel, Execution> simulation;
    firn::Body lower, upper;

    explicit Disks(double h, const Transfer& transfer = {})
        // The box is larger than that of the paper: nothing shall touch its walls.
        : simulation({{-0.2, -0.2}, {1.2, 1.2}, h}, firn::FixedCorotated<S>::from_young_poisson(S(young), S(0.3))) {
        simulation.transfer = transfer;
        simulation.gravity = {};
        lower = simulation.add(firn::sample_sphere<2>({0.2, 0.2}, radius, {.spacing = h / 2}), density, velocity);
        upper = simulation.add(firn::sample_sphere<2>({0.8, 0.8}, radius, {.spacing = h / 2}), density, -velocity);
    }
    double energy() const {
        const auto totals = simulation.totals();
        return totals.kinetic_energy + totals.elastic_energy;
    }
    /// The mean velocity of a disk along the line of their centres [m/s].
    double speed(const firn::Body& body) const {
        const auto& particles = simulation.particles();
        double momentum = 0, mass = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || !body.holds(particles.id(slot))) continue;
            const auto v = firn::cast<double>(particles.velocity(slot));
            momentum += double(particles.mass(slot)) * (v[0] + v[1]) / std::sqrt(2.0);
            mass += double(particles.mass(slot));
        }
        return momentum / mass;
    }
};

}  // namespace verification
