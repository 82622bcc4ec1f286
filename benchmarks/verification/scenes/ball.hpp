/// \file An elastic ball falls on a floor and bounces; in 3D against Hertz's contact (Hertz 1882; Johnson 1985, §11.4).
#pragma once

#include <firn/firn.hpp>

#include "elastic_ball.hpp"
#include "sides.hpp"

#include <numbers>
#include <type_traits>
#include <utility>
#include <vector>

namespace verification {

/// \tparam ByGap  the floor acts by the gap of particles
template <int D, class S, class Transfer = firn::Apic, bool ByGap = false>
struct Ball {
    using Box = firn::Walls<S, D>;
    using Boundary = std::conditional_t<ByGap, firn::GapContact<Box>, Box>;

    static constexpr double radius = 0.25, density = 1000, poisson = 0.3;
    double h, young, drop;  ///< [m], [Pa], free way to the floor [m]

    firn::SimulationWith<D, firn::FixedCorotated<S>, Transfer, Boundary> simulation;

    Ball(double cell_size, double youngs_modulus, double drop_height, const Transfer& transfer = {},
         firn::NodesBehind nodes_behind = firn::NodesBehind::held)
        : h(cell_size), young(youngs_modulus), drop(drop_height), simulation(domain(), material()) {
        using namespace firn;
        simulation.transfer = transfer;
        Box& walls = [&]() -> Box& {
            if constexpr (ByGap)
                return simulation.boundary.boundary;
            else
                return simulation.boundary;
        }();
        walls.at_lower[1] = {Contact::separate, 0};
        walls.nodes_behind = nodes_behind;
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

/// How far an elastic ball, pressed on a rigid floor by its own inertia, approaches the floor, over Hertz's approach of
/// an elastic half-space under the same pressure: the pressure p₀ √(1 − s²/a²) acts at the distance s < a from the
/// middle of the contact, and a uniform body force balances it. The displacement of the middle of the contact against
/// the centre of mass is a series of Legendre polynomials (Lurie 1964, Three-dimensional problems of the theory of
/// elasticity, ch. 8; linear elasticity).
/// \param a  radius of the contact over that of the ball
inline double whole_ball_over_hertz(double a, double poisson) {
    const double shear = 1 / (2 * (1 + poisson)), lame = poisson / ((1 + poisson) * (1 - 2 * poisson));  // over E
    constexpr int points = 1000, terms = 1500;
    std::vector<double> mu(points), weight(points), before(points, 1.0), now(points);
    double force = 0;
    for (std::size_t i = 0; i < points; ++i) {  // sin θ = a sin φ
        const double phi = (double(i) + 0.5) / points * std::numbers::pi / 2, sine = a * std::sin(phi);
        now[i] = mu[i] = std::sqrt(1 - sine * sine);
        weight[i] = -std::cos(phi) * sine * a * std::cos(phi) / mu[i] * std::numbers::pi / 2 / points;  // p sin θ dθ
        force -= 2 * std::numbers::pi * weight[i] * mu[i];
    }
    double moved = 0;
    for (int n = 0; n < terms; ++n) {
        double pressure = 0;
        for (std::size_t i = 0; i < points; ++i) {
            if (n > 1) before[i] = std::exchange(now[i], ((2 * n - 1) * mu[i] * now[i] - (n - 1) * before[i]) / n);
            pressure += (n == 0 ? 1.0 : now[i]) * weight[i] * (n + 0.5);
        }
        moved += pressure * (n == 1 ? 1.2 / (6 * lame + 4 * shear)  // with the body force
                                    : displacement_of_ball(n, poisson));
    }
    return -moved / (a * a) * (4.0 / 3 * a * a * a / (1 - poisson * poisson)) / force;
}

/// What the floor does to a ball after Hertz, gravity included: m α̈ = m g − 4/3 E* √R α^(3/2), integrated.
/// \see whole_ball_over_hertz
struct Hertz {
    double approach = 0, duration = 0;  ///< the greatest [m], [s]
    std::vector<double> time, force;    ///< from the first touch [s], [N]

    /// \param whole  the ball is a ball, and not a half-space beyond the contact
    Hertz(double mass, double radius, double speed, double young, double poisson, bool whole = false) {
        const double stiffness = 4.0 / 3 * young / (1 - poisson * poisson) * std::sqrt(radius), dt = 1e-6;
        std::vector<double> softer{1};  // for radii of the contact of 0, 0.05, … radii of the ball
        for (int i = 1; whole && i <= 14; ++i) softer.push_back(whole_ball_over_hertz(0.05 * i, poisson));
        double a = 0, v = speed, of_hertz = 1;
        for (int i = 0; a >= 0; ++i) {
            if (whole) {  // the factor changes slowly: that of the step before will do to find the contact's radius
                const double contact = std::min(std::sqrt(a / of_hertz / radius) / 0.05, 13.9);
                const auto k = std::size_t(contact);
                of_hertz = softer[k] + (contact - double(k)) * (softer[k + 1] - softer[k]);
            }
            const double push = stiffness * std::pow(a / of_hertz, 1.5);
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
