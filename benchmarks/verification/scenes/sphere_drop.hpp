/// \file A ball that hits a bed of dry sand: how deep it comes.
///
/// Uehara, Ambroso, Ojha and Durian 2003, "Low-speed impact craters in loose granular media".
#pragma once

#include <firn/firn.hpp>
#include <firn/rigid_body.hpp>
#include <firn/soil.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

namespace verification {

/// A drop; lengths in diameters D of the ball.
struct Drop {
    double fall = 2;              ///< height of the lowest point above the sand
    int cells = 10;               ///< of D
    double width = 4, depth = 3;  ///< of the bed
    double young = 1e6;           ///< of the sand [Pa]
    double ball_density = 2500;   ///< [kg/m³]
    double repose = 27;           ///< of the sand [degrees]: √J2/p = tan of this where it flows
    double friction = 0.3;        ///< of sand at the ball
    double layer = 0.5;           ///< Collider::thickness_in_cells
    bool whole = false;           ///< the whole bed, in place of a quarter between planes of symmetry

    /// μ = √J2/p of flowing sand, which is τ/σ in simple shear.
    double mu() const { return std::tan(firn::degrees(repose).in_radians()); }
    /// φ of the Drucker–Prager cone with this μ = M/√3, where M = 6 sin φ/(3 − sin φ).
    firn::Angle friction_angle() const {
        const double M = std::sqrt(3.0) * mu();
        return firn::radians(std::asin(3 * M / (6 + M)));
    }
};

/// The bed at rest, and the ball just above it with the velocity of its fall.
/// \tparam Policies  what differs from the defaults of a simulation
template <class... Policies>
struct SphereDrop {
    using Point = firn::Vec<double, 3>;
    using Ball = firn::RigidBody<firn::Collider<firn::Sphere<float, 3>>>;
    using Boundary = firn::GapContact<firn::Together<firn::Walls<float, 3>, Ball>>;
    using Simulation = firn::SimulationWith<3, firn::Sand<float>, Boundary, Policies...>;
    static constexpr double diameter = 0.025, density = 1600, g = 9.81;  ///< D [m], of the sand [kg/m³], [m/s²]

    Drop drop;
    double h, level, speed;  ///< cell size, height of the sand [m]; of the ball at impact [m/s]
    Simulation simulation;

    explicit SphereDrop(const Drop& of, int threads = 0)
        : drop(of),
          h(diameter / of.cells),
          level(std::round(of.depth * of.cells) * h),
          speed(std::sqrt(2 * g * of.fall * diameter)),
          simulation(room(), sand(of), firn::Coloured{threads}, boundary()) {
        const Point lower = room().lower;
        Point upper = room().upper;
        upper[1] = level;
        const firn::Body bed = simulation.add(firn::sample_box<3>(lower, upper, {.spacing = h / 2}), density);
        set_at_rest(simulation.set(), bed,
                    {.surface = [this](const Point&) { return level; },
                     .gravity = g,
                     .earth_pressure = firn::earth_pressure_at_rest(of.friction_angle())});
        simulation.gravity = {0, -g, 0};
        simulation.warn = {};
    }
    static firn::Sand<float> sand(const Drop& of) {
        return firn::Sand<float>::from_properties(
            {.young = of.young, .poisson = 0.3, .friction_angle = of.friction_angle()});
    }
    firn::Domain<3> room() const {
        const double half = std::round(drop.width * drop.cells / 2) * h, from = drop.whole ? -half : 0;
        return {{from, 0.0, from}, {half, level + 3 * diameter, half}, h};
    }
    Boundary boundary() const {
        const auto domain = room();
        auto walls = firn::Walls<float, 3>::all(domain.lower, domain.upper, {firn::Contact::slip, 0});
        walls.nodes_behind = firn::NodesBehind::mirrored;
        walls.at_lower[1].contact = firn::Contact::stick;
        walls.at_upper[1].contact = firn::Contact::separate;
        firn::Collider<firn::Sphere<float, 3>> solid{
            .shape = {float(diameter / 2)}, .friction = drop.friction, .thickness_in_cells = drop.layer};
        solid.position = {0, level + diameter / 2, 0};
        solid.linear_velocity = {0, -speed, 0};
        auto mass = mass_of(solid.shape, drop.ball_density);
        if (!drop.whole) mass.mass /= 4, mass.inertia = mass.inertia * 0.25;
        Ball ball(solid, mass);
        ball.drive.keep_upright();
        if (!drop.whole) ball.drive.keep(0, 0).keep(2, 0);
        return Boundary{firn::Together(walls, ball)};
    }
    const Ball& ball() const { return std::get<1>(simulation.boundary.boundary.parts); }
    /// Depth of the lowest point below the first surface, over D.
    double sunk() const { return (level + diameter / 2 - ball().collider.position[1]) / diameter; }
    /// Downwards [m/s].
    double velocity() const { return -ball().velocity()[1]; }
    /// The height of free fall and depth, over D.
    double total() const { return drop.fall + sunk(); }
};

/// d/D of Uehara et al. 2003 for a total drop H [D]: 0.14/μ (ρ_b/ρ_g)^½ (H/D)^⅓.
inline double depth_of_uehara(const Drop& drop, double total, double density) {
    return 0.14 / drop.mu() * std::sqrt(drop.ball_density / density) * std::cbrt(total);
}

}  // namespace verification
