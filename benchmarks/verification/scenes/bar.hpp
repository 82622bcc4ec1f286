/// \file The fixed-free elastic bar in its first mode: L = 25 m, E = 100 Pa, ρ = 1 kg/m³, ν = 0, v(x, 0) = v0 sin(βx),
/// β = π/2L; linear theory: period 10 s, v_cm = (2/π) v0 cos(ωt). Sulsky, Chen and Schreyer 1994; Bardenhagen and Kober
/// 2004.
#pragma once

#include <firn/firn.hpp>

#include <numbers>

namespace verification {

template <class S, class Transfer, class Force, class Kernel, class Execution = firn::Coloured>
struct Bar {
    static constexpr double length = 25, height = 2, v0 = 0.1, beta = std::numbers::pi / (2 * length), period = 10,
                            amplitude = 2 / std::numbers::pi * v0;

    firn::Simulation<2, firn::FixedCorotated<S>, Transfer, Force, Kernel, Execution> simulation;

    explicit Bar(double h, const Transfer& transfer = {}, int particles_a_cell_and_axis = 2)
        : simulation({{0.0, 0.0}, {30.0, height}, h}, firn::FixedCorotated<S>::from_young_poisson(100, 0)) {
        using firn::Contact;
        simulation.transfer = transfer;
        for (auto* wall : {&simulation.boundary.at_lower, &simulation.boundary.at_upper})
            (*wall)[1] = {Contact::slip, 0};
        simulation.boundary.at_lower[0] = {Contact::stick, 0};
        simulation.gravity = {0.0, 0.0};
        simulation.add(firn::sample_box<2>({0.0, 0.0}, {length, height}, {.spacing = h / particles_a_cell_and_axis}),
                       1.0);
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const double x = particles.exact_position(slot)[0];
            particles.set_velocity(slot, {S(v0 * std::sin(beta * x)), S(0)});
            if (Transfer::affine)
                particles.set_affine(slot, firn::Mat<S, 2>::rows(S(v0 * beta * std::cos(beta * x)), S(0), S(0), S(0)));
        }
    }

    /// The speed of the centre of mass, by theory ωt turned from its amplitude [m/s].
    double velocity() const {
        const auto totals = simulation.totals();
        return totals.momentum[0] / totals.mass;
    }
    static double theory(double time) { return amplitude * std::cos(2 * std::numbers::pi / period * time); }
};

}  // namespace verification
