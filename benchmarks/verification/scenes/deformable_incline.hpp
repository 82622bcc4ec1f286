/// \file A disk or a block on an incline, both elastic; they meet as contact groups. The incline is a slab that is
/// bonded to the floor of the domain, and gravity is askew. After Bardenhagen, Brackbill and Sulsky 2000, "The
/// material-point method for granular materials".
#pragma once

#include <firn/firn.hpp>

#include <numbers>

namespace verification {

/// The way of a body over time.
struct Descent {
    std::vector<double> time;      ///< [s]
    std::vector<double> way;       ///< of the centre of mass down the incline [m]
    std::vector<double> speed;     ///< of the centre of mass down the incline [m/s]
    std::vector<double> spin;      ///< angular velocity [rad/s]; positive if the body rolls down
    std::vector<double> pressing;  ///< force on the incline, normal to it [N/m]
    std::vector<double> holding;   ///< force on the body, up the incline [N/m]

    /// The relative error of the acceleration in the second half of the time; of means over its thirds, so that what
    /// rings is left out. \param expected  [m/s²]
    double error_of_acceleration(double expected) const {
        const std::size_t third = way.size() / 6, begin = way.size() - 3 * third;
        const double span = time[begin + third] - time[begin];
        double mean[3] = {};
        for (std::size_t i = 0; i < 3 * third; ++i) mean[i / third] += way[begin + i] / double(third);
        return std::abs((mean[0] - 2 * mean[1] + mean[2]) / (span * span) / expected - 1);
    }
    /// The slope of a straight line through `of` over time, from the way `from` on [per s].
    double rate(const std::vector<double>& of, double from) const {
        double n = 0, st = 0, sy = 0, stt = 0, sty = 0;
        for (std::size_t i = 0; i < time.size(); ++i) {
            if (way[i] < from) continue;
            const double t = time[i] - time.back(), y = of[i] - of.back();
            n += 1, st += t, sy += y, stt += t * t, sty += t * y;
        }
        return (n * sty - st * sy) / (n * stt - st * st);
    }
};

struct DescentOptions {
    double slope = std::numbers::pi / 6, friction = 0.3;
    double young = 1e7, poisson = 0.3, density = 1000;  ///< [Pa], [1], [kg/m³]
    double h = 1.0 / 64;                                ///< [m]
    bool groups = true;                                 ///< false: all matter shares one field of velocities
    double ramp = 0;                                    ///< time in which gravity grows to its full value [s]
    double hold = 0;  ///< time in which friction is so large that the body cannot slide [s]
};

inline constexpr double gravity_on_earth = 9.81;  ///< [m/s²]

/// A disk of particles on concentric circles: 1, 6, 12, 18, … particles of equal volume. Its rim is smooth: the
/// particles of the outermost circle end at the radius.
inline firn::Samples<2> concentric_disk(const firn::Vec<double, 2>& centre, double radius, double spacing) {
    const int circles = int(std::lround(radius / spacing - 0.5));
    const double count = 1 + 3.0 * circles * (circles + 1);
    firn::Samples<2> samples;
    samples.volume = std::numbers::pi * radius * radius / count;
    samples.positions.push_back(centre);
    for (int k = 1; k <= circles; ++k) {
        const double inner = radius * std::sqrt((1 + 3.0 * (k - 1) * k) / count),
                     outer = radius * std::sqrt((1 + 3.0 * k * (k + 1)) / count);
        const double at = k == circles ? radius - 0.5 * std::sqrt(samples.volume) : 0.5 * (inner + outer);
        for (int i = 0; i < 6 * k; ++i) {
            const double angle = 2 * std::numbers::pi * (i + 0.5 * (k % 2)) / (6 * k);
            samples.positions.push_back(centre + firn::Vec<double, 2>{std::cos(angle), std::sin(angle)} * at);
        }
    }
    return samples;
}

/// An incline with a body on it.
template <class Transfer>
struct Incline {
    static constexpr int slab_cells = 8;

    static auto make(const DescentOptions& options, const firn::Vec<double, 2>& upper, const Transfer& transfer) {
        using namespace firn;
        const Domain<2> domain{{0.0, 0.0}, upper, options.h};
        Walls<double, 2> walls{domain.lower, domain.upper, {}, {}};
        walls.at_lower = {Wall{Contact::slip, 0}, Wall{Contact::stick, 0}};
        walls.at_upper = {Wall{Contact::slip, 0}, Wall{Contact::separate, 0}};
        walls.nodes_behind = NodesBehind::mirrored;
        return Simulation(domain, FixedCorotated<double>::from_young_poisson(options.young, options.poisson), walls,
                          transfer, CoulombContact{.friction = options.friction}, Coloured{1});
    }

    DescentOptions options;
    decltype(make(DescentOptions{}, {}, Transfer{})) simulation;
    firn::Body slab, body;

    /// \param samples  the particles of the body, with the incline's surface at y = 0 and its beginning at x = 0 [m]
    /// \param length   of the incline, a multiple of h [m];  \param height  of the space above the incline [m]
    Incline(const DescentOptions& how, firn::Samples<2> samples, double length, double height, const Transfer& transfer)
        : options(how), simulation(make(how, {length, surface() + std::ceil(height / how.h) * how.h}, transfer)) {
        using namespace firn;
        slab =
            simulation.add(sample_box<2>({0.0, 0.0}, {length, surface()}, {.spacing = options.h / 2}), options.density);
        for (auto& x : samples.positions) x[1] += surface();
        body = simulation.add(samples, options.density);
        if (options.groups) simulation.set_contact_group(body, 1);
        simulation.contact_impulses.emplace();
    }
    double surface() const { return slab_cells * options.h; }

    /// Position, velocity [m], [m/s] of the centre of mass, and angular velocity [rad/s] of the body.
    struct Motion {
        firn::Vec<double, 2> centre, velocity;
        double spin;
    };
    Motion motion() const {
        using namespace firn;
        const auto& particles = simulation.particles();
        double mass = 0, turn = 0, inertia = 0;
        Vec<double, 2> first{}, momentum{};
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || !body.holds(particles.id(slot))) continue;
            const double m = particles.mass(slot);
            const auto x = particles.position(slot);
            const auto v = particles.velocity(slot);
            mass += m;
            first += x * m;
            momentum += v * m;
            turn += m * (x[0] * v[1] - x[1] * v[0]);
            inertia += m * dot(x, x);
        }
        const auto centre = first * (1 / mass), velocity = momentum * (1 / mass);
        turn -= mass * (centre[0] * velocity[1] - centre[1] * velocity[0]);
        inertia -= mass * dot(centre, centre);
        return {centre, velocity, -turn / inertia};
    }

    /// Takes steps until the body has come as far as `way` [m], or until the time `end` [s].
    Descent run(double way, double end, int steps_between_records = 10) {
        const double start = motion().centre[0];
        simulation.fixed_time_step = 0.5 * simulation.stable_time_step();
        Descent out;
        firn::Vec<double, 2> impulse{};
        for (int step = 1;; ++step) {
            const double share = simulation.time() < options.ramp ? simulation.time() / options.ramp : 1.0;
            simulation.gravity =
                firn::Vec<double, 2>{std::sin(options.slope), -std::cos(options.slope)} * (gravity_on_earth * share);
            simulation.contact.friction = simulation.time() < options.hold ? 5.0 : options.friction;
            simulation.step();
            impulse += simulation.contact_impulses->on(1, 0);
            if (step % steps_between_records != 0) continue;
            const Motion now = motion();
            const double span = steps_between_records * simulation.fixed_time_step;
            out.time.push_back(simulation.time());
            out.way.push_back(now.centre[0] - start);
            out.speed.push_back(now.velocity[0]);
            out.spin.push_back(now.spin);
            out.pressing.push_back(impulse[1] / span);
            out.holding.push_back(-impulse[0] / span);
            impulse = {};
            if (out.way.back() >= way || simulation.time() >= end) return out;
        }
    }
};

}  // namespace verification
