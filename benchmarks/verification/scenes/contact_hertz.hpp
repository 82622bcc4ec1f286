/// \file Round elastic bodies of different contact groups are pressed together (Hertz 1882; Johnson 1985, §4): two
/// cylinders in plane strain, a ball on a block, a ball on a floor. Without friction, in a quarter of the space: x = 0,
/// and in 3D z = 0, are planes of symmetry, walls with mirrored nodes.
#pragma once

#include <firn/firn.hpp>

#include "elastic_ball.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace verification {

/// Particles, each with its own volume [m^D].
template <int D>
struct RoundBody {
    firn::Samples<D> samples{};
    std::vector<double> volumes{};
    std::vector<int> layers{};  ///< of each particle, from the surface: 0, 1, …

    void add(const firn::Vec<double, D>& x, double volume, int layer) {
        samples.positions.push_back(x);
        volumes.push_back(volume);
        layers.push_back(layer);
    }
};

/// The quarter x ≥ 0 (in 3D z ≥ 0, too) of a ball that touches the plane y = 0 from above, up to a height a little
/// above its centre. The particles lie in shells `spacing` apart; the outermost is half a spacing below the surface. So
/// the particles' own surfaces are the ball's.
template <int D>
RoundBody<D> shells(double radius, double spacing, double height) {
    RoundBody<D> body;
    body.samples.volume = std::pow(spacing, D);
    const double quarter = std::numbers::pi / 2;
    const int count = int(std::lround(radius / spacing));
    const auto parts = [&](double length) { return std::max(1, int(std::lround(length / spacing))); };
    for (int k = 0; k < count; ++k) {
        const double r = (k + 0.5) * spacing;
        const int bands = parts(quarter * r);
        for (int m = 0; m < 2 * bands; ++m) {
            const double wide = quarter / bands, angle = (m + 0.5) * wide, y = radius - r * std::cos(angle);
            if (y > height) break;
            if constexpr (D == 2) {
                body.add({r * std::sin(angle), y}, quarter * r * spacing / bands, count - 1 - k);
            } else {
                const int points = parts(quarter * r * std::sin(angle));
                const double thick = (std::pow(r + spacing / 2, 3) - std::pow(r - spacing / 2, 3)) / 3;
                const double band = std::cos(angle - wide / 2) - std::cos(angle + wide / 2);
                for (int j = 0; j < points; ++j) {
                    const double around = (j + 0.5) * quarter / points, across = r * std::sin(angle);
                    body.add({across * std::cos(around), y, across * std::sin(around)}, quarter * thick * band / points,
                             count - 1 - k);
                }
            }
        }
    }
    return body;
}

/// The same quarter of a disk, of the points of a lattice that lie in it; their volumes are those of whole squares.
inline RoundBody<2> lattice_in_disk(double radius, double spacing, double height) {
    RoundBody<2> body;
    body.samples.volume = spacing * spacing;
    for (int i = 0; i * spacing < radius; ++i)
        for (int j = 0; j * spacing < height; ++j) {
            const double x = (i + 0.5) * spacing, y = (j + 0.5) * spacing;
            const double deep = radius - std::hypot(x, y - radius);
            if (deep > 0) body.add({x, y}, spacing * spacing, int(deep / spacing));
        }
    return body;
}

/// Gives the particles of a set, which has no other, the volumes of a body.
template <int D, class Set>
void set_volumes(Set&& set, const std::vector<double>& volumes, double density) {
    auto& particles = set.edit_particles();
    using S = decltype(particles.mass(0));
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) {
            const double volume = volumes[particles.id(slot)];
            particles.set_volume(slot, S(volume));
            particles.set_mass(slot, S(volume * density));
        }
}

/// A semi-ellipse of pressures, p = p₀ √(1 − x²/b²) for x < b, else 0.
struct PressureEllipse {
    double b = 0, highest = 0;  ///< b [m] and p₀ [Pa]

    double operator()(double x) const { return x < b ? highest * std::sqrt(1 - x * x / (b * b)) : 0; }

    /// Fits the ellipse to pressures by least squares. \param near  b is looked for from 0.4 to 1.8 times this [m]
    static PressureEllipse fitted(const std::vector<double>& x, const std::vector<double>& p, double near) {
        PressureEllipse best;
        double least = std::numeric_limits<double>::infinity();
        for (double b = 0.4 * near; b < 1.8 * near; b += 2e-4 * near) {
            PressureEllipse unit{b, 1};
            double both = 0, square = 0, rest = 0;
            for (std::size_t i = 0; i < x.size(); ++i) {
                const double e = unit(x[i]);
                both += e * p[i];
                square += e * e;
                rest += p[i] * p[i];
            }
            rest -= both * both / square;
            if (rest < least) least = rest, best = {b, both / square};
        }
        return best;
    }
};

/// How a scene of this file differs from its default.
struct HertzVariant {
    int cells = 20;        ///< R/h
    double offset = 0.25;  ///< how far the plane of contact lies above a plane of nodes [cells]
    bool groups = true;    ///< whether the bodies are two contact groups
    bool lattice = false;  ///< whether particles lie on a lattice instead of shells (cylinders only)
};

/// Two equal cylinders, from y = −R to R. Rigid plates above and below, in which matter may slip, hold their halves
/// beyond the middle planes. The plates press until b is 0.15 R by Hertz.
struct PressedCylinders {
    using Vector = firn::Vec<double, 2>;
    using Plate = firn::Collider<firn::HalfSpace<double, 2>>;
    using Boundary = firn::Together<firn::Walls<double, 2>, Plate, Plate>;
    static constexpr double radius = 1, young = 1e6, poisson = 0.3, density = 1000, wanted = 0.15;  ///< wanted: b/R

    firn::SimulationWith<2, firn::FixedCorotated<double>, Boundary, firn::CoulombContact> simulation;
    HertzVariant variant;
    double h, c;               ///< cell size [m], speed of sound [m/s]
    RoundBody<2> body;         ///< the upper one
    double load = 0;           ///< P′ between the cylinders: force on the plates [N/m]
    double contact_force = 0;  ///< the same, by the impulses between the groups [N/m]

    static constexpr double modulus() { return young / (2 * (1 - poisson * poisson)); }  ///< E* [Pa]
    static double half_width(double load) {
        return std::sqrt(4 * load * (radius / 2) / (std::numbers::pi * modulus()));
    }
    static double highest_pressure(double load) { return 2 * load / (std::numbers::pi * half_width(load)); }

    explicit PressedCylinders(const HertzVariant& which)
        : simulation(domain(which), firn::FixedCorotated<double>::from_young_poisson(young, poisson)),
          variant(which),
          h(radius / which.cells),
          c(std::sqrt(young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson) * density))) {
        using firn::Contact;
        auto& [walls, above, below] = simulation.boundary.parts;
        walls = firn::Walls<double, 2>::all(simulation.domain().lower, simulation.domain().upper, {Contact::none, 0});
        walls.at_lower[0] = {Contact::slip, 0};
        walls.nodes_behind = firn::NodesBehind::mirrored;
        for (Plate* plate : {&above, &below}) plate->contact = Contact::slip, plate->thickness_in_cells = 0;
        above.shape.outward = {0.0, -1.0};
        above.position = {0.0, radius};
        below.shape.outward = {0.0, 1.0};
        below.position = {0.0, -radius};
        simulation.gravity = {};
        simulation.warn = {};  // of particles in the plates, which are to hold them
        simulation.fixed_time_step = 0.4 * h / c;
        simulation.reactions.emplace();
        simulation.contact_impulses.emplace();
        body = variant.lattice ? lattice_in_disk(radius, h / 2, radius + 2.5 * h)
                               : shells<2>(radius, h / 2, radius + 2.5 * h);
        simulation.add(body.samples, density);
        auto lower = body.samples;
        for (Vector& x : lower.positions) x[1] = -x[1];
        const firn::Body second = simulation.add(lower, density);
        auto volumes = body.volumes;
        volumes.insert(volumes.end(), body.volumes.begin(), body.volumes.end());
        set_volumes<2>(simulation, volumes, density);
        if (variant.groups) simulation.set_contact_group(second, 1);
    }

    /// Presses the cylinders together, and waits until they are at rest. The plates slow down as the load comes near to
    /// the wanted one. \return false if the load is not reached
    bool press() {
        const double b = wanted * radius, target = std::numbers::pi * modulus() * b * b / (2 * radius);
        const double unit = radius / c, dt = simulation.fixed_time_step, speed = 0.05 * radius / (40 * unit);
        const firn::Damped<double, 2> damping{{{0.0, 0.0}}, 1 / unit};
        const double undamped = 1 + damping.rate * dt;  // the damping takes this part of what plates bear
        auto& [walls, above, below] = simulation.boundary.parts;
        double smooth = 0, rest = 0;
        int count = 0;
        while (rest < 6 * unit) {
            if (simulation.time() > 150 * unit) return false;
            const double part = std::clamp((1 - smooth / target) / 0.1, -1.0, 1.0);
            above.linear_velocity = {0.0, -speed * part};
            below.linear_velocity = {0.0, speed * part};
            simulation.step(damping);
            const double force =
                undamped * (simulation.reactions->parts[2].impulse[1] - simulation.reactions->parts[1].impulse[1]) /
                dt;  // of both plates, on half
            smooth += (force - smooth) * std::min(dt / (0.3 * unit), 1.0);
            if (std::abs(smooth / target - 1) < 2e-3) rest += dt;
            if (rest > 5 * unit) {
                load += force;
                contact_force -= 2 * simulation.contact_impulses->on(1, 0)[1] / dt;
                ++count;
            }
        }
        load /= count;
        contact_force /= count;
        return true;
    }

    /// The pressure −σ_yy of the particles of the two outermost layers of both cylinders, up to 0.3 R from the middle.
    void pressures(std::vector<double>& x, std::vector<double>& p) const {
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const Vector at = particles.exact_position(slot);
            if (body.layers[particles.id(slot) % body.layers.size()] > 1) continue;
            if (at[0] > 0.3 * radius || std::abs(at[1]) > 0.3 * radius) continue;
            x.push_back(at[0]);
            p.push_back(-particles.stress(slot)(1, 1) / firn::determinant(particles.state(slot).F));
        }
    }

private:
    static firn::Domain<2> domain(const HertzVariant& of) {
        const double cell = radius / of.cells, far = (of.cells + 5) * cell;
        return {{0.0, -far - of.offset * cell}, {far, far - of.offset * cell}, cell};
    }
};

/// A ball is pressed into the middle of a square block that stands between slipping walls, on a slipping base. A rigid
/// plate, in which matter may slip, holds the half of the ball above its middle plane, and moves down by R/16.
struct PressedBall {
    using S = float;
    using Material = firn::FixedCorotated<S>;
    using Plate = firn::Collider<firn::HalfSpace<S, 3>>;
    using Boundary = firn::Together<firn::Walls<S, 3>, Plate>;
    static constexpr double radius = 1, young = 1e6, poisson = 0.3, density = 1000, way = radius / 16;

    firn::SimulationWith<3, firn::Materials<Material, Material>, Boundary, firn::CoulombContact> simulation;
    HertzVariant variant;
    double stiffness;                ///< of the block, over that of the ball
    double h, c, half, depth;        ///< cell size [m], speed of sound [m/s], half the block's side [m], its height [m]
    double approach = 0;             ///< how far the plate has moved [m]
    double force = 0, on_plate = 0;  ///< between the groups, and on the plate [N]
    std::vector<double> approaches, forces;  ///< on the way

    /// \param stiff  of the block, over that of the ball; its density is as many times that of the ball, so that both
    ///               have one speed of sound
    /// \param high   height of the block [R]
    PressedBall(const HertzVariant& which, double stiff, double high)
        : simulation(domain(which, high), firn::Materials<Material, Material>{material(1), material(stiff)}),
          variant(which),
          stiffness(stiff),
          h(radius / which.cells),
          c(std::sqrt(young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson) * density))),
          half(simulation.domain().upper[0]),
          depth(-simulation.domain().lower[1]) {
        using firn::Contact;
        auto& [walls, plate] = simulation.boundary.parts;
        walls = firn::Walls<S, 3>::all(firn::cast<S>(simulation.domain().lower),
                                       firn::cast<S>(simulation.domain().upper), {Contact::slip, 0});
        walls.at_upper[1] = {Contact::none, 0};
        walls.nodes_behind = firn::NodesBehind::mirrored;
        plate.contact = Contact::slip;
        plate.thickness_in_cells = 0;
        plate.shape.outward = {0.0, -1.0, 0.0};
        plate.position = {0.0, radius, 0.0};
        simulation.gravity = {};
        simulation.warn = {};  // of particles in the plate, which is to hold them
        simulation.fixed_time_step = 0.4 * h / c;
        simulation.reactions.emplace();
        simulation.contact_impulses.emplace();
        const RoundBody<3> ball = shells<3>(radius, h / 2, radius + 2.5 * h);
        simulation.set<0>().add(ball.samples, density);
        set_volumes<3>(simulation.set<0>(), ball.volumes, density);
        if (variant.groups) simulation.set<0>().set_contact_group(1);
        firn::Samples<3> block;
        const auto layers = std::int64_t(std::lround(depth / (h / 2))),
                   across = std::int64_t(std::lround(half / (h / 2)));
        const double thick = depth / double(layers);
        for (std::int64_t i = 0; i < across; ++i)
            for (std::int64_t j = 0; j < layers; ++j)
                for (std::int64_t k = 0; k < across; ++k)
                    block.positions.push_back(
                        {(double(i) + 0.5) * h / 2, -depth + (double(j) + 0.5) * thick, (double(k) + 0.5) * h / 2});
        block.volume = h / 2 * h / 2 * thick;
        simulation.set<1>().add(block, density * stiffness);
    }

    double modulus() const { return young / ((1 - poisson * poisson) * (1 + 1 / stiffness)); }  ///< E* [Pa]

    /// Hertz's force for an approach of points far from the contact [N].
    double hertz(double of_far_points) const {
        return 4.0 / 3 * modulus() * std::sqrt(radius) * std::pow(of_far_points, 1.5);
    }

    /// By how much a force F lets points far from the contact of two half-spaces approach each other farther than it
    /// lets the middle plane of the ball approach the base of the block [m]. Both are linear in F:
    ///
    /// Ball: pressed by Hertz's pressures at both poles (its middle plane is a plane of symmetry). Legendre series of
    /// the radial displacement of a pole. \see displacement_of_ball
    ///
    /// Block: its walls and base are planes of symmetry, so it is a layer under a square lattice of forces. A layer of
    /// depth H answers to a pressure with the wave number k as a half-space does, times (cosh 2kH − 1)/(sinh 2kH + 2kH)
    /// (Johnson 1985, §5.8). The half-spaces' displacement is the sum of 1/r over the lattice, −3.90026/period with a
    /// neutral background.
    double beyond(double F) const {
        const double a = std::sqrt(radius * way) / radius, pi = std::numbers::pi, nu = poisson;
        double ball = (1 - 2 * nu) / (2 * pi);  // over F/(E R); degree 0
        for (int n = 2; n < 4000; n += 2) {
            const double x = (n + 0.5) * a, hertzian = 3 * (std::sin(x) - x * std::cos(x)) / (x * x * x);
            ball += (2 * n + 1) / (2 * pi) * hertzian * displacement_of_ball(n, nu);
        }
        ball -= 0.75 * (1 - nu * nu) / a;
        const double period = 2 * half;
        double layer = -3.9002649 / period * (1 - nu * nu) / pi;  // over F/E
        for (int i = -40; i <= 40; ++i)
            for (int j = -40; j <= 40; ++j) {
                if (i == 0 && j == 0) continue;
                const double k = 2 * pi / period * std::hypot(i, j), twice = 2 * k * depth;
                if (twice > 60) continue;
                const double ratio = (std::cosh(twice) - 1) / (std::sinh(twice) + twice);
                layer += 2 * (1 - nu * nu) / (period * period) * (ratio - 1) / k;
            }
        layer += depth * (1 + nu) * (1 - 2 * nu) / (1 - nu) / (period * period);
        return -F / young * (ball / radius + layer / stiffness);
    }

    /// Moves the plate down, and waits until all is at rest.
    void press() {
        const double unit = radius / c, duration = 14 * unit, dt = simulation.fixed_time_step;
        const firn::Damped<S, 3> damping{{{S(0), S(0), S(0)}}, S(1.5 / unit)};
        const double undamped = 1 + double(damping.rate) * dt;  // the damping takes this part of what the plate bears
        auto& plate = std::get<1>(simulation.boundary.parts);
        double sum = 0, began = 0;
        int count = 0;
        while (simulation.time() < 1.7 * duration) {
            const double s = simulation.time() / duration;
            // The mean of this profile over 0 < s < 1 is 1.
            const double speed = approach < way ? way / duration * std::min(s / 0.1 + 0.01, 1.0) *
                                                      std::clamp((1.2 - s) / 0.5, 0.05, 1.0) / 0.845
                                                : 0;
            plate.linear_velocity = {0.0, -std::min(speed, (way - approach) / dt), 0.0};
            const double before = plate.position[1];
            simulation.step(damping);
            approach += before - plate.position[1];
            const double impulse = 4 * (variant.groups ? simulation.contact_impulses->on(1, 0)[1]
                                                       : -undamped * simulation.reactions->parts[1].impulse[1]);
            sum += impulse;
            if (simulation.time() > began + duration / 40) {
                approaches.push_back(approach);
                forces.push_back(sum / (simulation.time() - began));
                sum = 0;
                began = simulation.time();
            }
            if (s > 1.6) {
                force += impulse / dt;
                on_plate -= 4 * undamped * simulation.reactions->parts[1].impulse[1] / dt;
                ++count;
            }
        }
        force /= count;
        on_plate /= count;
    }

private:
    static Material material(double stiff) { return Material::from_young_poisson(S(young * stiff), S(poisson)); }
    static firn::Domain<3> domain(const HertzVariant& of, double high) {
        const double cell = radius / of.cells, half = std::round(1.375 * of.cells) * cell;
        const double depth = (std::round(high * of.cells) + of.offset) * cell;
        return {{0.0, -depth, 0.0}, {half, -depth + std::ceil((depth + radius) / cell + 5) * cell, half}, cell};
    }
};

}  // namespace verification
