/// \file A column of water, a = 57.15 mm wide and 2 a high, that is let go on a dry floor. Martin and Moyce 1952, "An
/// experimental study of the collapse of liquid columns on a rigid horizontal plane", n² = 2: front Z = x/a over
/// T = t √(2 g/a).
#pragma once

#include "support/csv.hpp"
#include <firn/firn.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace verification {

/// Z over T, in even intervals from T = 0.
struct FrontHistory {
    double interval = 0.05;
    std::vector<double> Z{};
    double most_energy = 0;  ///< over that at first

    /// 1 before T = 0; linear between.
    double at(double T) const {
        if (T <= 0) return 1;
        const double place = std::min(T / interval, double(Z.size() - 1) - 1e-9);
        const std::size_t i = std::size_t(place);
        return Z[i] + (Z[i + 1] - Z[i]) * (place - double(i));
    }
    double last() const { return interval * double(Z.size() - 1); }
};

/// What a front differs from those that Martin and Moyce measured, relative.
struct FrontError {
    double mean = 0, largest = 0;
    double delay = 0;  ///< by which the measured T are later
};

/// Against one transcription of their figures (tests/reference/martin_moyce_1952.csv), as far as the history goes.
inline FrontError front_error(const FrontHistory& of, const std::string& set, double delay = 0) {
    FrontError error{0, 0, delay};
    int count = 0;
    for (const auto& row : csv::read("martin_moyce_1952.csv")) {
        const double T = csv::number(row, "T"), Z = csv::number(row, "Z");
        if (row.at("set") != set || T > of.last()) continue;
        const double off = std::abs(of.at(T - delay) / Z - 1);
        error.mean += off;
        error.largest = std::max(error.largest, off);
        ++count;
    }
    error.mean /= count;
    return error;
}
/// With the delay, of 0 to 0.6, that leaves the least.
inline FrontError delayed_front_error(const FrontHistory& of, const std::string& set) {
    FrontError best = front_error(of, set);
    for (int i = 1; i <= 120; ++i) {
        const FrontError error = front_error(of, set, 0.005 * i);
        if (error.mean < best.mean) best = error;
    }
    return best;
}

template <class S, class Transfer, class Volume = firn::OwnVolume>
struct DamBreak {
    static constexpr double a = 0.05715, g = 9.81, density = 1000, length = 16;  ///< length of the floor over a
    /// c = 20 m/s, ten times the speed of the front.
    static constexpr double bulk = 4e5;

    firn::SimulationWith<2, firn::Fluid<S>, Transfer, Volume> simulation;

    explicit DamBreak(int cells_across, const Transfer& transfer = {})
        : simulation({{0.0, 0.0}, {length * a, 3 * a}, a / cells_across},
                     firn::Fluid<S>::from_properties({.bulk = bulk})) {
        simulation.transfer = transfer;
        simulation.gravity = {0.0, -g};
        simulation.add(firn::sample_box<2>({0.0, 0.0}, {a, 2 * a}, {.spacing = a / cells_across / 2}), density);
        cells_across_ = cells_across;
    }

    static double scaled(double time) { return time * std::sqrt(2 * g / a); }
    static double unscaled(double T) { return T / std::sqrt(2 * g / a); }
    void advance_to(double T) { simulation.advance(std::max(0.0, unscaled(T) - simulation.time())); }

    /// Z: before it lies all but the foremost four particles, the water of one cell.
    double front() const {
        std::vector<double> x;
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) x.push_back(particles.exact_position(slot)[0]);
        std::nth_element(x.begin(), x.begin() + 4, x.end(), std::greater<>());
        return x[4] / a + 0.25 / cells_across_;  // and half a spacing
    }
    /// Runs to T = end.
    FrontHistory history(double end) {
        FrontHistory history;
        const double start = energy();
        for (int i = 0; i * history.interval <= end + 1e-9; ++i) {
            advance_to(i * history.interval);
            history.Z.push_back(front());
            history.most_energy = std::max(history.most_energy, energy() / start);
        }
        return history;
    }
    /// Kinetic, elastic and potential energy [J].
    double energy() const {
        const auto totals = simulation.totals();
        return totals.kinetic_energy + totals.elastic_energy + g * totals.first_moment[1];
    }

private:
    int cells_across_ = 0;
};

}  // namespace verification
