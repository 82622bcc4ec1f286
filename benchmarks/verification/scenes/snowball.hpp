/// \file A disk of snow, R = 0.1 m, is thrown at a floor and breaks. Stomakhin et al. 2013, "A material point method
/// for snow simulation": material of table 2, 400 kg/m³. Plane strain.
#pragma once

#include <firn/firn.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_map>
#include <vector>

namespace verification {

/// Sizes of the connected parts, in particles, largest first: particles closer than `link` are connected.
inline std::vector<int> connected_parts(const std::vector<firn::Vec<double, 2>>& x, double link) {
    std::vector<std::size_t> parent(x.size());
    std::iota(parent.begin(), parent.end(), std::size_t(0));
    const auto root = [&](std::size_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells;
    const auto key = [](std::int64_t i, std::int64_t j) {
        return std::uint64_t(i + (1 << 30)) << 32 | std::uint64_t(j + (1 << 30));
    };
    for (std::size_t p = 0; p < x.size(); ++p) {
        const auto i = std::int64_t(std::floor(x[p][0] / link)), j = std::int64_t(std::floor(x[p][1] / link));
        for (int di = -1; di <= 1; ++di)
            for (int dj = -1; dj <= 1; ++dj)
                if (const auto found = cells.find(key(i + di, j + dj)); found != cells.end())
                    for (const std::size_t q : found->second)
                        if (norm(x[p] - x[q]) < link) parent[root(p)] = root(q);
        cells[key(i, j)].push_back(p);
    }
    std::vector<int> sizes(x.size());
    for (std::size_t p = 0; p < x.size(); ++p) ++sizes[root(p)];
    std::sort(sizes.rbegin(), sizes.rend());
    sizes.resize(std::size_t(std::find(sizes.begin(), sizes.end(), 0) - sizes.begin()));
    return sizes;
}

template <class Material>
struct Snowball {
    static constexpr double radius = 0.1, density = 400, g = 9.81, start = 0.15;  ///< start: height of the centre [m]

    firn::Simulation<2, Material> simulation;
    double h;

    Snowball(const Material& material, double speed, int cells_a_radius)
        : simulation({{-1.0, 0.0}, {1.0, 1.0}, radius / cells_a_radius}, material, {1}), h(radius / cells_a_radius) {
        simulation.gravity = {0.0, -g};
        simulation.reactions.emplace();
        simulation.boundary.at_lower[1] = {firn::Contact::separate, 0.5};
        simulation.add(firn::sample_sphere<2>({0.0, start}, radius, {.spacing = h / 2}), density, {0.0, -speed});
    }

    /// What momentum, fall and energy are off by.
    struct Balance {
        double momentum = 0;  ///< |Δp − g M t − Σ impulses of the floor| over M v₀
        double fall = 0;      ///< |y − what its steps make of g| of the centre of mass, before it touches, over its way
        double most_energy = 0;  ///< over that at first
        double touched = 0;      ///< when the floor first gave an impulse [s]
    };
    /// Steps to a time; every `interval` look(*this) is called.
    template <class Look>
    Balance run(double end, double interval, const Look& look) {
        const auto first = simulation.totals();
        const double weight = g * first.mass, energy_at_first = energy();
        double impulse[2] = {0, 0}, speed = first.momentum[1] / first.mass, height = first.first_moment[1] / first.mass;
        const double from = height;
        Balance balance;
        for (double next = 0; next <= end + 1e-12; next += interval) {
            while (simulation.time() < next - 1e-12) {
                const double dt = std::min(simulation.stable_time_step(), next - simulation.time());
                simulation.fixed_time_step = dt;
                simulation.step();
                const auto& given = simulation.reactions->parts[0].impulse;
                impulse[0] += given[0], impulse[1] += given[1];
                speed -= g * dt, height += speed * dt;
                if (balance.touched == 0 && given[1] != 0) balance.touched = simulation.time();
            }
            const auto now = simulation.totals();
            const double t = simulation.time(), scale = std::abs(first.momentum[1]);
            const double off[2] = {now.momentum[0] - first.momentum[0] - impulse[0],
                                   now.momentum[1] - first.momentum[1] - impulse[1] + weight * t};
            balance.momentum = std::max(balance.momentum, std::hypot(off[0], off[1]) / scale);
            if (balance.touched == 0 && t > 0)
                balance.fall =
                    std::max(balance.fall, std::abs(now.first_moment[1] / now.mass - height) / (from - height));
            balance.most_energy = std::max(balance.most_energy, energy() / energy_at_first);
            look(*this);
        }
        return balance;
    }

    double energy() const {
        const auto totals = simulation.totals();
        return totals.kinetic_energy + totals.elastic_energy + g * totals.first_moment[1];
    }
    std::vector<firn::Vec<double, 2>> positions() const {
        std::vector<firn::Vec<double, 2>> x;
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) x.push_back(particles.exact_position(slot));
        return x;
    }
    /// Parts that are farther than a cell, two spacings, from each other: sizes, largest first.
    std::vector<int> parts() const { return connected_parts(positions(), h); }
};

}  // namespace verification
