/// \file Water that sloshes in a box with slip walls, 1 m wide and H = 0.5 m deep: the first wave, of the wave number
/// k = π/L and the amplitude a = 0.02 m. Linear theory (Lamb, Hydrodynamics, §228, §348): ω² = g k tanh kH; with a
/// small viscosity ν the amplitude decays as exp(−2 ν k² t), as no wall and no floor holds the water.
#pragma once

#include <firn/firn.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace verification {

template <class Transfer, class Force, class Volume = firn::OwnVolume, class Kernel = firn::QuadraticBSpline>
struct Sloshing {
    static constexpr double length = 1, height = 0.5, amplitude = 0.02, density = 1000, bulk = 1e6, g = 9.81;
    static constexpr double k = std::numbers::pi / length, pressure = density * g * height;

    firn::SimulationWith<2, firn::Fluid<double>, Transfer, Force, Kernel, Volume> simulation;
    std::vector<double> times, centres;  ///< Centre of mass from the middle of the box, over that at first.

    Sloshing(double h, firn::NodesBehind behind, double viscosity)
        : simulation({{0.0, 0.0}, {length, 0.75}, h},
                     firn::Fluid<double>::from_properties({.bulk = bulk, .gamma = 7, .viscosity = viscosity})) {
        auto& boundary = simulation.boundary;
        boundary.at_lower = {firn::Wall{firn::Contact::slip}, firn::Wall{firn::Contact::slip}};
        boundary.at_upper[0] = {firn::Contact::slip};
        boundary.nodes_behind = behind;
        simulation.gravity = {0.0, -g};
        auto samples = firn::sample_box<2>({0.0, 0.0}, {length, height}, {.spacing = h / 2});
        std::vector<double> pressures;
        for (auto& x : samples.positions) {
            const double X = x[0], Y = x[1];
            x[0] -= amplitude * std::sin(k * X) * std::cosh(k * Y) / std::sinh(k * height);
            x[1] += amplitude * std::cos(k * X) * std::sinh(k * Y) / std::sinh(k * height);
            const double wave = std::cosh(k * Y) / std::cosh(k * height) - std::sinh(k * Y) / std::sinh(k * height);
            pressures.push_back(density * g * (height - Y + amplitude * std::cos(k * X) * wave));
        }
        const auto body = simulation.add(samples, density);
        std::size_t i = 0;
        simulation.set_states(body, [&](const auto&, auto& state) {
            state.J = std::pow(1 + 7 * std::max(pressures[i++], 0.0) / bulk, -1.0 / 7);
        });
        scale_ = 1 / centre();
        note();
    }

    static double frequency() { return std::sqrt(g * k * std::tanh(k * height)); }
    static double period() { return 2 * std::numbers::pi / frequency(); }
    /// With which the amplitude decays by exp(−decay) in a period [Pa s].
    static double viscosity_for(double decay) { return density * decay / (2 * k * k * period()); }

    void run(double periods) {
        while (simulation.time() < periods * period()) {
            simulation.step();
            note();
        }
    }
    /// Mean of those between the zeros of the centre of mass, over that of linear theory.
    double relative_period() const {
        const auto zeros = crossings();
        return 2 * (zeros.back() - zeros.front()) / double(zeros.size() - 1) / period();
    }
    /// Decay of the logarithm of the amplitude in a period: least squares through the extremes after the first zero.
    double decay() const {
        const auto zeros = crossings();
        double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
        for (std::size_t z = 0; z + 1 < zeros.size(); ++z) {
            double most = 0;
            for (std::size_t i = 0; i < times.size(); ++i)
                if (times[i] > zeros[z] && times[i] < zeros[z + 1]) most = std::max(most, std::abs(centres[i]));
            const double x = double(z) / 2, y = std::log(most);
            ++n, sx += x, sy += y, sxx += x * x, sxy += x * y;
        }
        return -(n * sxy - sx * sy) / (n * sxx - sx * sx);
    }
    /// Root of the mean square of the difference of the pressures from their average through the grid, over ρ g H,
    /// three cells and more from walls, floor and surface.
    double noise() const {
        const auto& particles = simulation.particles();
        const double h = simulation.domain().cell_size;
        const int across = int(std::lround(length / h)) + 5, up = int(std::lround(0.75 / h)) + 5;
        std::vector<double> sum(std::size_t(across * up)), weight(sum.size());
        const auto for_nodes = [&](std::size_t slot, const auto& f) {
            const auto x = particles.exact_position(slot) * (1 / h);
            std::array<double, 2> fraction;
            std::array<int, 2> base;
            for (std::size_t a = 0; a < 2; ++a) {
                base[a] = int(std::floor(x[int(a)] - 0.5));
                fraction[a] = x[int(a)] - base[a];
            }
            const auto w = firn::QuadraticBSpline::weights(fraction[0]),
                       v = firn::QuadraticBSpline::weights(fraction[1]);
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t j = 0; j < 3; ++j)
                    f(std::size_t(base[0] + int(i) + 2) * std::size_t(up) + std::size_t(base[1] + int(j) + 2),
                      w[i] * v[j]);
        };
        const auto pressure_of = [&](std::size_t slot) {
            return simulation.material().pressure(particles.state(slot).J) / pressure;
        };
        const auto for_all = [&](const auto& f) {
            for (std::size_t slot = 0; slot < particles.slots(); ++slot)
                if (particles.is_particle(slot)) f(slot);
        };
        for_all([&](std::size_t slot) {
            const double p = pressure_of(slot);
            for_nodes(slot, [&](std::size_t node, double w) { sum[node] += w * p, weight[node] += w; });
        });
        double squares = 0, count = 0;
        for_all([&](std::size_t slot) {
            const auto x = particles.exact_position(slot);
            if (x[0] < 3 * h || x[0] > length - 3 * h || x[1] < 3 * h || x[1] > height - amplitude - 3 * h) return;
            double off = pressure_of(slot);
            for_nodes(slot, [&](std::size_t node, double w) { off -= w * sum[node] / weight[node]; });
            squares += off * off, ++count;
        });
        return std::sqrt(squares / count);
    }

private:
    double scale_ = 1;

    double centre() const {
        double sum = 0;
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) sum += particles.exact_position(slot)[0];
        return sum / double(particles.size()) - length / 2;
    }
    void note() {
        times.push_back(simulation.time());
        centres.push_back(centre() * scale_);
    }
    std::vector<double> crossings() const {
        std::vector<double> zeros;
        for (std::size_t i = 1; i < times.size(); ++i)
            if (centres[i] * centres[i - 1] < 0)
                zeros.push_back(times[i - 1] +
                                (times[i] - times[i - 1]) * centres[i - 1] / (centres[i - 1] - centres[i]));
        return zeros;
    }
};

}  // namespace verification
