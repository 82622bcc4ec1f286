/// \file Two equal elastic bars meet head-on: L = 1 m, E = 1 Pa, ρ = 1 kg/m³, ν = 0, so that c = 1 m/s; v = ±0.01 c.
/// The linear theory: a plane wave passes through each bar and back, so contact lasts 2 L/c; its stress is ρ c v; the
/// bars exchange their velocities, and there is no stress and no strain when they part (Graff 1975, "Wave motion in
/// elastic solids", §2.4). Fixed corotated matter with ν = 0 follows the linear theory along the bar, as P = E (F − 1).
#pragma once

#include <firn/firn.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace verification {

struct BarsOptions {
    int cells = 20;        ///< cells along a bar
    double offset = 0;     ///< of the surface where the bars meet from a plane of nodes [cells]
    int across = 4;        ///< cells across a bar; its sides slip along mirrored walls
    double courant = 0.3;  ///< c dt/h
};

/// \tparam Law  a contact law; with OneField, the bars are not in groups of their own
template <int D, class Law = firn::CoulombContact, class Transfer = firn::Apic, class Force = firn::MlsForce>
struct Bars {
    static constexpr bool in_groups = Law::between_groups;
    static constexpr double length = 1, young = 1, density = 1, wave_speed = 1, speed = 0.01;

    double h, gap;  ///< cell size; gap between the bars at first [m]
    firn::SimulationWith<D, firn::FixedCorotated<double>, Transfer, Force, firn::Coloured, Law> simulation;
    firn::Body left, right;

    explicit Bars(const BarsOptions& options, const Transfer& transfer = {}, const Law& law = {})
        : h(length / options.cells),
          gap(4 * h),
          simulation(domain(options), firn::FixedCorotated<double>::from_young_poisson(young, 0), transfer, law,
                     firn::Coloured{1}),
          area_(std::pow(options.across * h, D - 1)) {
        using namespace firn;
        simulation.gravity = {};
        simulation.fixed_time_step = options.courant * h / wave_speed;
        auto& walls = simulation.boundary;
        walls.at_lower.fill({Contact::slip});
        walls.at_upper.fill({Contact::slip});
        walls.nodes_behind = NodesBehind::mirrored;
        const double middle = 0.5 * simulation.domain().upper[0] + options.offset * h;
        auto velocity = Vec<double, D>::zero();
        velocity[0] = speed;
        left = simulation.add(bar(middle - gap / 2 - length, options), density, velocity);
        right = simulation.add(bar(middle + gap / 2, options), density, -velocity);
        if constexpr (in_groups) {
            simulation.set_contact_group(right, 1);
            simulation.contact_impulses.emplace();
        }
    }

    double touch() const { return gap / (2 * speed); }                     ///< When the bars meet [s].
    static double duration() { return 2 * length / wave_speed; }           ///< How long contact lasts [s].
    double force() const { return density * wave_speed * speed * area_; }  ///< Force of the contact [N].

    /// The mean velocity of the left bar [m/s].
    double velocity() const {
        const auto& particles = simulation.particles();
        double momentum = 0, mass = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || !left.holds(particles.id(slot))) continue;
            momentum += particles.mass(slot) * particles.velocity(slot)[0];
            mass += particles.mass(slot);
        }
        return momentum / mass;
    }

private:
    static firn::Domain<D> domain(const BarsOptions& options) {
        const double cell = length / options.cells;
        auto upper = firn::Vec<double, D>::filled(options.across * cell);
        upper[0] = 2 * length + 16 * cell;
        return {firn::Vec<double, D>::zero(), upper, cell};
    }
    firn::Samples<D> bar(double from, const BarsOptions& options) const {
        auto lower = firn::Vec<double, D>::zero(), upper = firn::Vec<double, D>::filled(options.across * h);
        lower[0] = from;
        upper[0] = from + length;
        return firn::sample_box<D>(lower, upper, {.spacing = h / 2});
    }

    double area_;
};

/// What two bars do. Times are in L/c, forces in ρ c v A.
struct BarsOutcome {
    std::vector<double> time{}, force{};  ///< of each step: its middle, since the bars meet; the force on the right bar
    double restitution = 0;               ///< e: speed of the left bar after contact over that before
    double first = 0, last = 0;           ///< the first and the last step with a force: the middle of each
    double tension = 0;                   ///< the largest force that pulls
    double plateau = 0;                   ///< mean force from a quarter to three quarters of the contact
    double impulse = 0;                   ///< of the force, over 2 m v

    double duration() const { return last - first; }
};

/// Two bars meet and part.
/// \param least  a force below this part of ρ c v A counts as none for `first` and `last`
template <class TheBars>
BarsOutcome meet(TheBars& bars, double least = 0) {
    BarsOutcome out;
    auto& simulation = bars.simulation;
    const double unit = TheBars::length / TheBars::wave_speed, dt = simulation.fixed_time_step / unit,
                 end = bars.touch() + bars.duration() + bars.gap / TheBars::speed + unit;
    double before = bars.velocity(), steps = 0;
    bool touched = false;
    while (simulation.time() < end) {
        simulation.step();
        double force = 0;
        if constexpr (TheBars::in_groups) {
            force = simulation.contact_impulses->on(1, 0)[0] / simulation.last_time_step() / bars.force();
        } else {
            const double now = bars.velocity();
            force = (before - now) / TheBars::speed / dt;
            before = now;
        }
        const double t = (simulation.time() - bars.touch()) / unit - 0.5 * dt;
        out.time.push_back(t);
        out.force.push_back(force);
        if (std::abs(force) > least) {
            if (!touched) out.first = t;
            out.last = t;
            touched = true;
        }
        out.tension = std::max(out.tension, -force);
        out.impulse += force * dt / 2;
        if (t > 0.5 && t < 1.5) out.plateau += force, ++steps;
    }
    out.plateau /= steps;
    out.restitution = -bars.velocity() / TheBars::speed;
    return out;
}

}  // namespace verification
