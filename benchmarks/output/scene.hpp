/// \file Elastic blocks that fly at each other in a periodic box without gravity: nothing from outside acts on them, so
/// that mass and momentum stay as they are for as long as it runs.
#pragma once

#include <firn/firn.hpp>

#include <chrono>

namespace output {

using Simulation = firn::Simulation<3, firn::FixedCorotated<float>>;

/// 27 blocks of together about so many particles, eight a cell.
inline Simulation blocks(double particles, int threads) {
    const double across = std::cbrt(particles / 27);           // particles along a block's edge
    const double h = 1 / (16 * std::ceil(1.8 * across / 16));  // blocks take at most 5/6 of the box's edge
    firn::Domain<3> domain{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, h};
    domain.periodic = {true, true, true};
    Simulation simulation(domain, firn::FixedCorotated<float>::from_young_poisson(1e4, 0.3), {threads});
    simulation.gravity = firn::Vec<double, 3>::zero();
    const firn::Vec<double, 3> edge = firn::Vec<double, 3>::filled(across * h / 2);
    for (int block = 0; block < 27; ++block) {
        firn::Vec<double, 3> lower{}, velocity{};
        for (int a = 0; a < 3; ++a) {
            const int place = a == 0 ? block % 3 : a == 1 ? block / 3 % 3 : block / 9;
            lower[a] = (place + 0.5) / 3 - edge[a] / 2;
            velocity[a] = 4 * firn::unit_interval(firn::random_bits(7, std::uint64_t(3 * block + a))) - 1.5;
        }
        simulation.add(firn::sample_box<3>(lower, lower + edge, {.spacing = h / 2}), 1000, velocity);
    }
    return simulation;
}

/// Arguments of a program, each with what stands for it where it is left out.
struct Words {
    int count;
    char** words;
    const char* operator()(int i, const char* otherwise) const { return count > i ? words[i] : otherwise; }
};

/// [s]
inline double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace output
