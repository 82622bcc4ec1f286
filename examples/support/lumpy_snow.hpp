/// \file Snow whose strength differs from lump to lump, so that it breaks where it is weak.
///
///     using Simulation = firn::Simulation<3, example::LumpySnow>;
///     example::vary(simulation, simulation.add(ball, 400), {.stiffness = 6, .variation = 1.2});
#pragma once

#include <firn/data/random.hpp>
#include <firn/data/samples.hpp>
#include <firn/material/per_particle.hpp>
#include <firn/material/snow.hpp>
#include <firn/simulation/body.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace example {

/// Snow in which each particle has its own strength.
using LumpySnow = firn::PerParticle<firn::Snow<float>, "mu", "lambda", "lowest_stretch", "highest_stretch">;

/// Smooth noise of mean 0 and variance 1: a sum of waves in random directions. `lump` is the size of its lumps [m].
inline double noise(const firn::Vec<double, 3>& x, double lump) {
    static const auto waves = [] {
        std::array<std::array<double, 4>, 48> all{};
        firn::RandomSequence random(7);
        for (auto& wave : all) {
            for (double& k : wave) k = 2 * firn::unit_interval(random.bits()) - 1;
        }
        return all;
    }();
    double sum = 0;
    for (const auto& [a, b, c, phase] : waves)
        sum += std::cos(std::numbers::pi * ((a * x[0] + b * x[1] + c * x[2]) * 1.7 / lump + phase));
    return sum / std::sqrt(0.5 * double(waves.size()));
}

/// Factors by which a body differs from the material's parameters.
struct SnowKind {
    double stiffness = 1, compression = 1, stretch = 1;
    double variation = 0.7;  ///< standard deviation of the logarithm of its strength
    double lump = 0.12;      ///< size of the lumps [m]
};

/// Gives a body's particles their strengths.
/// \param snow  a simulation with LumpySnow only, or its set<LumpySnow>()
template <class Set>
void vary(Set&& snow, const firn::Body& body, const SnowKind& kind) {
    snow.set_states(body, [&](const auto& x, auto& state) {
        // The hardest lumps bound the time step, so the noise is cut off at 1.5 standard deviations.
        const double harder = std::exp(kind.variation * std::clamp(noise(x, kind.lump), -1.5, 1.5));
        const auto stretched = [](float stretch, double factor) { return 1 + (stretch - 1) * float(factor); };
        firn::of<"mu">(state) *= float(kind.stiffness * harder);
        firn::of<"lambda">(state) *= float(kind.stiffness * harder);
        firn::of<"lowest_stretch">(state) = stretched(firn::of<"lowest_stretch">(state), kind.compression);
        firn::of<"highest_stretch">(state) = stretched(firn::of<"highest_stretch">(state), kind.stretch * harder);
    });
}

}  // namespace example
