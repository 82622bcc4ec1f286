/// \file An elastic ball falls on a floor and bounces; in 3D against Hertz's contact (Hertz 1882; Johnson 1985, §11.4).
#pragma once

#include <firn/firn.hpp>

#include "sides.hpp"

#include <numbers>

namespace verification {

template <int D, class S, class Transfer = firn::Apic>
struct Ball {
    static constexpr double radius = 0.25, density = 1000, poisson = 0.3;
    double h, young, drop;  ///< [m], [Pa], free way to the floor [m]

    firn::Simulation<D, firn::FixedCorotated<S>, Transfer> simulation;

    Ball(double cell_size, double youngs_modulus, double drop_height, const Transfer& transfer = {},
         firn::NodesBehind nodes_behind = firn::NodesBehind::held)
        : h(cell_size), young(youngs_modulus), drop(drop_height), simulation(domain(), material()) {
        using namespace firn;
        simulation.transfer = transfer;
        simulation.boundary.at_lower[1] = {Contact::separate, 0};
        simulation.boundary.nodes_behind = nodes_behind;
        simulation.reactions.emplace();
        auto centre = Vec<double, D>::filled(0.5);
        centre[1] = radius + drop;
        simulation.add(sample_sphere<D>(centre, radius, {.spacing = h / 2}), density);
    }
    /// How far the centre of mass is above where an undeformed ball touches [m].
    double height() const {
        const auto totals = simulation.totals();
        return totals.first_moment[1] / totals.mass - radius;
    }
    double energy() const {
        const auto totals = simulation.totals();
        return totals.kinetic_energy + totals.elastic_energy - simulation.gravity[1] * totals.mass * height();
    }

private:
    firn::Domain<D> domain() const {
        auto upper = firn::Vec<double, D>::filled(1);
        upper[1] = std::ceil((2 * radius + drop) / h + 4) * h;
        return {firn::Vec<double, D>::zero(), upper, h};
    }
    firn::FixedCorotated<S> material() const {
        return firn::FixedCorotated<S>::from_young_poisson(S(young), S(poisson));
    }
};

/// What the floor does to a ball after Hertz, gravity included: m α̈ = m g − 4/3 E* √R α^(3/2), integrated.
struct Hertz {
    double approach = 0, duration = 0;  ///< the greatest [m], [s]
    std::vector<double> time, force;    ///< from the first touch [s], [N]

    Hertz(double mass, double radius, double speed, double young, double poisson) {
        const double stiffness = 4.0 / 3 * young / (1 - poisson * poisson) * std::sqrt(radius), dt = 1e-6;
        double a = 0, v = speed;
        for (int i = 0; a >= 0; ++i) {
            const double push = stiffness * std::pow(a, 1.5);
            if (i % 1000 == 0) {
                time.push_back(i * dt);
                force.push_back(push);
            }
            v += (9.81 - push / mass) * dt;
            a += v * dt;
            approach = std::max(approach, a);
            duration = i * dt;
        }
    }
};

}  // namespace verification
