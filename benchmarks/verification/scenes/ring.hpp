/// \file A ring turns on a disk under load: friction brakes it. Both are elastic; they meet as contact groups.
#pragma once

#include <firn/firn.hpp>

#include <numbers>

namespace verification {

struct RingOptions {
    double friction = 0.3;
    double inner = 8, outer = 16;  ///< radii of the ring [cells]
    bool turned = false;           ///< the disk's particles lie askew in the grid, by 30° about the axis
    bool groups = true;            ///< false: all matter shares one field of velocities
};

/// A ring of equal particles on concentric circles, in layers along y.
struct RingSamples {
    firn::Samples<3> samples;
    double area = 0;  ///< of the face that one column of particles stands for [m²]
    std::size_t columns = 0;
};

/// \param bottom  the lower face [m];  \param layers  of particles
inline RingSamples sample_ring(const firn::Vec<double, 3>& bottom, double inner, double outer, int layers,
                               double spacing) {
    const int circles = int(std::lround((outer - inner) / spacing));
    std::vector<int> counts;
    RingSamples ring;
    for (int k = 0; k < circles; ++k) {
        const double radius = inner + (k + 0.5) * (outer - inner) / circles;
        counts.push_back(int(std::lround(2 * std::numbers::pi * radius / spacing)));
        ring.columns += std::size_t(counts.back());
    }
    ring.area = std::numbers::pi * (outer * outer - inner * inner) / double(ring.columns);
    ring.samples.volume = ring.area * spacing;
    double from = inner;
    for (int k = 0; k < circles; ++k) {
        const int n = counts[std::size_t(k)];
        const double to = std::sqrt(from * from + n * ring.area / std::numbers::pi);
        // At the mean radius of the annulus, so that the sum of μ N r is the integral.
        const double radius = 2.0 / 3 * (to * to * to - from * from * from) / (to * to - from * from);
        for (int i = 0; i < n; ++i) {
            const double angle = 2 * std::numbers::pi * (i + 0.5 * (k % 2)) / n;
            for (int j = 0; j < layers; ++j)
                ring.samples.positions.push_back(bottom + firn::Vec<double, 3>{radius * std::cos(angle),
                                                                               (j + 0.5) * spacing,
                                                                               radius * std::sin(angle)});
        }
        from = to;
    }
    return ring;
}

/// What brakes the ring, over time.
struct Braking {
    std::vector<double> time, spin;           ///< [s], [rad/s]
    std::vector<double> normal, torque;       ///< force and torque on the ring, means between the times [N], [N m]
    double mean_normal = 0, mean_torque = 0;  ///< over the second half of the time [N], [N m]
    /// Σ N_p r_p/Σ N_p of the lowest particles of the ring, over the second half of the time; N_p from their stress [m]
    double arm = 0;
};

/// \tparam Transfer  e.g. Apic
template <class Transfer>
Braking brake_ring(const RingOptions& options, const Transfer& transfer) {
    using namespace firn;
    constexpr double h = 1.0 / 64, young = 1e7, density = 1000, pressure = 1e4,
                     spin = 16;  // [m], [Pa], [kg/m³], [Pa], [rad/s]
    constexpr int disk_cells = 3, ring_cells = 3;
    const double inner = options.inner * h, outer = options.outer * h, disk = outer + 2 * h,
                 side = 2 * std::ceil(disk / h + 3) * h;
    const Domain<3> domain{{0, 0, 0}, {side, (disk_cells + ring_cells + 4) * h, side}, h};
    Walls<double, 3> walls = Walls<double, 3>::all(domain.lower, domain.upper, {Contact::separate, 0});
    walls.at_lower[1] = {Contact::stick, 0};
    walls.nodes_behind = NodesBehind::mirrored;
    Simulation simulation(domain, FixedCorotated<double>::from_young_poisson(young, 0.3), walls, transfer,
                          CoulombContact{.friction = options.friction}, Coloured{1});
    simulation.gravity = {};
    const Vec<double, 3> axis{0.5 * side, 0, 0.5 * side};

    Samples<3> base;
    base.volume = h * h * h / 8;
    const double angle = options.turned ? std::numbers::pi / 6 : 0, c = std::cos(angle), s = std::sin(angle);
    const int reach = int(std::ceil(2 * disk / h)) + 1;
    for (int i = -reach; i < reach; ++i)
        for (int k = -reach; k < reach; ++k) {
            const double x = (i + 0.5) * h / 2, z = (k + 0.5) * h / 2;
            if (x * x + z * z > disk * disk) continue;
            for (int j = 0; j < 2 * disk_cells; ++j)
                base.positions.push_back(axis + Vec<double, 3>{c * x - s * z, (j + 0.5) * h / 2, s * x + c * z});
        }
    simulation.add(base, density);
    const RingSamples ring =
        sample_ring(axis + Vec<double, 3>{0, disk_cells * h, 0}, inner, outer, 2 * ring_cells, h / 2);
    const Body body = simulation.add(ring.samples, density);
    if (options.groups) simulation.set_contact_group(body, 1);
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && body.holds(particles.id(slot))) {
            const auto x = particles.position(slot) - axis;
            particles.set_velocity(slot, Vec<double, 3>{spin * x[2], 0.0, -spin * x[0]});
        }
    // The load grows from zero, so that the ring does not bounce.
    const double full = pressure * ring.area / (2 * ring_cells), ramp = 0.008, end = 0.032;
    simulation.add_load(body, [=](const Vec<double, 3>&, double time) {
        return Vec<double, 3>{0.0, -full * std::min(time / ramp, 1.0), 0.0};
    });
    simulation.contact_impulses.emplace();
    simulation.fixed_time_step = 0.5 * simulation.stable_time_step();

    Braking out;
    double impulse = 0, previous = 0;
    // The angular momentum of the ring about its axis, with the share of the affine field, and its spin.
    const auto turning = [&](double& momentum, double& rate) {
        double inertia = 0, moment = 0;
        momentum = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || !body.holds(particles.id(slot))) continue;
            const auto x = particles.position(slot) - axis, v = particles.velocity(slot);
            const auto C = particles.affine(slot);
            const double m = particles.mass(slot), along = x[2] * v[0] - x[0] * v[2];
            moment += m * along;
            momentum += m * (along + (C(0, 2) - C(2, 0)) * h * h / 4);
            inertia += m * (x[0] * x[0] + x[2] * x[2]);
        }
        rate = moment / inertia;
    };
    // The forces of the lowest particles on the disk, and their moments, up to a factor.
    double forces = 0, moments = 0;
    const auto add_forces = [&] {
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || !body.holds(particles.id(slot))) continue;
            if ((particles.id(slot) - body.first) % (2 * ring_cells) != 0) continue;
            const auto x = particles.position(slot) - axis;
            const double force = -particles.stress(slot)(1, 1);
            forces += force;
            moments += force * std::sqrt(x[0] * x[0] + x[2] * x[2]);
        }
    };
    double start = -1, normal = 0, from = 0, rate = 0;
    for (int step = 1; simulation.time() < end; ++step) {
        simulation.step();
        impulse += simulation.contact_impulses->on(1, 0)[1];
        if (step % 10 != 0) continue;
        double momentum = 0;
        turning(momentum, rate);
        const double span = 10 * simulation.fixed_time_step;
        out.time.push_back(simulation.time());
        out.spin.push_back(rate);
        out.normal.push_back(impulse / span);
        out.torque.push_back((previous - momentum) / span);
        if (simulation.time() > 0.5 * end) {
            add_forces();
            out.arm = moments / forces;
            if (start < 0)
                start = simulation.time(), from = momentum;
            else
                normal += impulse;
            out.mean_normal = normal / (simulation.time() - start);
            out.mean_torque = (from - momentum) / (simulation.time() - start);
        }
        previous = momentum;
        impulse = 0;
    }
    out.torque.front() = 0;  // the first one would count from rest
    return out;
}

}  // namespace verification
