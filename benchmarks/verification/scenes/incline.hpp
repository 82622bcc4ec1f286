/// \file An elastic block slides down an incline with Coulomb friction: ½ g t² (sin θ − μ cos θ). The incline is a
/// solid that lies askew in the grid; or gravity is askew, and the incline is a solid or a wall of the grid.
#pragma once

#include <firn/firn.hpp>

#include "sides.hpp"

#include <numbers>
#include <optional>

namespace verification {

struct InclineOptions {
    double slope = std::numbers::pi / 6, friction = 0.3;
    double h = 1.0 / 40;
    double young = 1e6;                       ///< [Pa]
    double duration = 0.5;                    ///< [s]
    bool askew = false;                       ///< the solid, not gravity
    std::optional<firn::NodesBehind> wall{};  ///< the incline is a wall of the grid, with these nodes behind
};

struct Slide {
    std::vector<double> time, way, expected;  ///< [s], [m], [m]
    double height = 0;                        ///< largest distance that the block moved off its line [m]
    double error() const { return std::abs(way.back() / expected.back() - 1); }
    /// Of the acceleration in the second half, relative; of means over its thirds, so that what rings is left out.
    double error_of_acceleration() const {
        const std::size_t third = way.size() / 6, begin = way.size() - 3 * third;
        const auto curvature = [&](const std::vector<double>& of) {
            double mean[3] = {};
            for (std::size_t i = 0; i < 3 * third; ++i) mean[i / third] += of[begin + i];
            return mean[0] - 2 * mean[1] + mean[2];
        };
        return std::abs(curvature(way) / curvature(expected) - 1);
    }
};

/// \param R       turns the incline's axes to those of space
/// \param corner  of the incline, from where the block starts [m]
template <class Simulation, class Transfer>
Slide slide_on(Simulation& simulation, const InclineOptions& options, const firn::Mat<double, 2>& R,
               const firn::Vec<double, 2>& corner, const Transfer& transfer) {
    using namespace firn;
    const double g = 9.81;
    simulation.gravity = Vec<double, 2>{0.0, -g};
    if (!options.askew) simulation.gravity = Vec<double, 2>{std::sin(options.slope), -std::cos(options.slope)} * g;
    simulation.transfer = transfer;
    auto block = sample_box<2>({0.1, 0.0}, {0.4, 0.1}, {.spacing = options.h / 2});
    for (auto& x : block.positions) x = corner + R * x;
    simulation.add(block, 1000);
    const auto centre = [&] {
        const auto totals = simulation.totals();
        return transpose(R) * (totals.first_moment * (1 / totals.mass));
    };
    const auto start = centre();
    simulation.fixed_time_step = 0.5 * simulation.stable_time_step();
    Slide out;
    while (simulation.time() < options.duration) {
        simulation.step();
        const double t = simulation.time();
        const auto moved = centre() - start;
        out.time.push_back(t);
        out.way.push_back(moved[0]);
        out.expected.push_back(0.5 * g * t * t *
                               (std::sin(options.slope) - options.friction * std::cos(options.slope)));
        out.height = std::max(out.height, std::abs(moved[1]));
    }
    return out;
}

template <class S = double, class Transfer = firn::Apic, class Force = firn::MlsForce,
          class Kernel = firn::QuadraticBSpline>
Slide slide(const InclineOptions& options, const Transfer& transfer = {}) {
    using namespace firn;
    Collider<HalfSpace<S, 2>> ground{.friction = S(options.friction)};
    ground.position = {S(0.2), S(0.5)};
    if (options.askew) ground.rotation = rotor(radians(-options.slope));
    const auto R = cast<double>(matrix_of(ground.rotation));
    const Domain<2> domain{{0.0, -1.0}, {3.0, 1.0}, options.h};
    const auto material = FixedCorotated<S>::from_young_poisson(S(options.young), S(0.3));
    if (options.wall) {
        ground.position[1] = S(0);
        Walls<S, 2> walls{{S(0), S(0)}, {S(3), S(1)}, {}, {}};
        walls.at_lower[1].friction = options.friction;
        walls.nodes_behind = *options.wall;
        Simulation<2, FixedCorotated<S>, Transfer, Force, Kernel> simulation({{0.0, 0.0}, {3.0, 1.0}, options.h},
                                                                             material, {}, walls);
        return slide_on(simulation, options, R, cast<double>(ground.position), transfer);
    }
    Simulation<2, FixedCorotated<S>, Transfer, Force, Kernel, Coloured, decltype(ground)> simulation(domain, material,
                                                                                                     {}, ground);
    return slide_on(simulation, options, R, cast<double>(ground.position), transfer);
}

}  // namespace verification
