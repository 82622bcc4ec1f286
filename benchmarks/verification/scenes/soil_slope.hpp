/// \file A slope of soil, and how much strength it can lose before it fails.
#pragma once

#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include "places.hpp"

#include <cmath>
#include <vector>

namespace verification {

/// A slope that falls by 1 over 2, H = 10 m high, on a rigid rough base at the level of its toe, between smooth walls.
struct SoilSlope {
    static constexpr double height = 10, crest = 12, width = 36, density = 2000, g = 9.81;  // [m], [kg/m³], [m/s²]
    using Soil = firn::PlaneStrain<firn::MohrCoulomb<double>>;
    using Run = firn::SimulationWith<2, Soil, firn::FBar, firn::Walls<double, 2>>;

    /// Height of the surface at x [m].
    static double surface(double x) { return std::clamp(height - (x - crest) / 2, 0.0, height); }

    /// The soil of Griffiths and Lane 1999: c = 0.05 ρ g H, φ = 20°, ψ = 0, ν = 0.3.
    static firn::MohrCoulombProperties strength() {
        return {
            .young = 1e7, .poisson = 0.3, .cohesion = 0.05 * density * g * height, .friction_angle = firn::degrees(20)};
    }

    /// Makes the slope and lets it come to rest.
    /// \param h  cell size [m]
    static Run at_rest(double h) {
        using namespace firn;
        const Domain<2> domain{{0, 0}, {width, height + 4 * h}, h};
        auto walls = Walls<double, 2>::all(domain.lower, domain.upper, {Contact::slip, 0});
        walls.at_lower[1] = {Contact::stick, 0};
        walls.at_upper[1] = {Contact::none, 0};
        Run run(domain, Soil{MohrCoulomb<double>::from_properties(strength())}, walls);
        auto samples = sample_box<2>({0, 0}, {width, height}, {.spacing = h / 2});
        std::erase_if(samples.positions, [](const auto& x) { return x[1] > surface(x[0]); });
        const Body soil = run.add(samples, density);
        run.gravity = {0, -g};
        set_at_rest(run.set(), soil, {.surface = [](const auto& x) { return surface(x[0]); }, .earth_pressure = 1.0});
        const double period = 4 * height / std::sqrt(strength().young / density);
        const Damped<double, 2> damped{.field = {{0, -g}}, .rate = 2 / period};
        run.advance(20 * period, damped);
        auto& particles = run.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) {
                particles.set_velocity(slot, {});
                particles.set_affine(slot, Mat<double, 2>::zero());
            }
        return run;
    }
    /// Returns how far the soil at the crest has moved from `start` [m].
    static double moved(const Run& run, const std::vector<firn::Vec<double, 2>>& start) {
        return largest_motion(start, places_of(run),
                              [](const auto& x) { return std::abs(x[0] - crest) < 1 && x[1] > height - 1; });
    }
    /// Whether a slope fails: its crest moves by more than 0.02 H within 20 √(H/g).
    static bool fails(Run& run) {
        const auto start = places_of(run);
        const double end = run.time() + 20 * std::sqrt(height / g);
        while (run.time() < end - 1e-9) {
            run.advance(std::min(1.0, end - run.time()));
            if (moved(run, start) > 0.02 * height) return true;
        }
        return false;
    }
};

}  // namespace verification
