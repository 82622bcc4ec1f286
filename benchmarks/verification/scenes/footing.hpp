/// \file A strip footing on clay that does not change its volume: the load at which it sinks in is (2 + π) c_u of a
/// strip of any roughness on weightless soil (Prandtl 1920; Hill 1950, "The Mathematical Theory of Plasticity").
#pragma once

#include <firn/firn.hpp>

#include <cmath>
#include <numbers>
#include <tuple>
#include <vector>

namespace verification {

/// A boundary: nodes in a box, edges included, move upwards at a given speed. The box moves with them.
template <firn::scalar S, int D>
struct Plate {
    firn::Vec<S, D> lower{}, upper{};  ///< [m]
    S speed = S(0);                    ///< upwards [m/s]

    static constexpr const char* name = "plate";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"lower", "m", &Plate::lower}, firn::parameter{"upper", "m", &Plate::upper},
                          firn::parameter{"speed", "m/s", &Plate::speed}};
    }
    firn::Vec<S, D> velocity(const firn::Vec<S, D>& x, const firn::Vec<S, D>& v) const {
        auto within = lower[0] <= x[0];
        for (int a = 0; a < D; ++a) within = within & (lower[a] <= x[a]) & (x[a] <= upper[a]);
        firn::Vec<S, D> moved = firn::Vec<S, D>::zero();
        moved[1] = speed;
        return firn::select(within, moved, v);
    }
    bool reaches(const firn::Vec<double, D>& low, const firn::Vec<double, D>& high) const {
        bool apart = false;
        for (int a = 0; a < D; ++a)
            apart = apart || high[a] < double(lower[a]) - 1e-6 || low[a] > double(upper[a]) + 1e-6;
        return !apart;
    }
    Plate advanced(double dt) const {
        Plate later = *this;
        later.lower[1] += speed * S(dt);
        later.upper[1] += speed * S(dt);
        return later;
    }
    double largest_speed(const firn::Vec<double, D>& low, const firn::Vec<double, D>& high) const {
        return reaches(low, high) ? std::abs(double(speed)) : 0;
    }
};

/// \tparam Policies  transfer, force form and whatever else the simulation is to have
template <class... Policies>
struct Footing {
    using Vector = firn::Vec<double, 2>;
    using Strip = Plate<double, 2>;
    using Boundary = firn::Together<firn::Walls<double, 2>, Strip>;
    static constexpr double width = 1, depth = 5 * width, strength = 10e3;  ///< B, of the half domain [m]; c_u [Pa]
    static constexpr double young = 1e7, poisson = 0.49, density = 1000, settlement = 0.02 * width;
    static constexpr double limit = 2 + std::numbers::pi;  ///< load over c_u [1]

    firn::SimulationWith<2, firn::VonMises<double>, Boundary, Policies...> simulation;
    std::vector<double> sunk, load;  ///< settlement [m], and mean pressure under the strip over c_u [1]

    /// The right half: a plane of symmetry at x = 0; soil sticks to the base, y = −5 B, and slips at x = 5 B. The nodes
    /// of the surface, y = 0, that are under the strip or on its edge, and those above them, move as the strip does.
    explicit Footing(int cells_on_strip)
        : simulation({{0.0, -depth}, {depth, 4 * width / cells_on_strip}, width / cells_on_strip},
                     firn::VonMises<double>::from_properties({.young = young,
                                                              .poisson = poisson,
                                                              .yield_stress = std::sqrt(3.0) * strength,
                                                              .hardening = 0})) {
        const double h = width / cells_on_strip;
        auto& [walls, strip] = simulation.boundary.parts;
        walls = firn::Walls<double, 2>::all({0.0, -depth}, {depth, 4 * h}, {firn::Contact::slip, 0});
        walls.at_lower[1] = {firn::Contact::stick, 0};
        walls.at_upper[1] = {firn::Contact::none, 0};
        strip.lower = {-10 * h, -0.01 * h};
        strip.upper = {width / 2 + 0.01 * h, 100 * h};
        simulation.gravity = {0.0, 0.0};
        simulation.execution.threads = 1;
        simulation.reactions.emplace();
        simulation.add(firn::sample_box<2>({0.0, -depth}, {depth, 0.0}, {.spacing = h / 2}), density);
    }

    /// Time that a shear wave takes over B [s].
    double unit() const { return width / std::sqrt(simulation.material().mu / density); }

    /// Pushes it in. The speed rises over the first tenth of `duration`, and falls to a tenth over the last half.
    /// \param duration  in unit()s
    /// \param damping   rate of the damping, over unit()
    void push(double duration, double damping) {
        const double time = duration * unit(), mean = settlement / time;
        const firn::Damped<double, 2> field{{{0.0, 0.0}}, damping / unit()};
        const auto profile = [](double s) {  // its mean is 1
            const double rising = std::min(s / 0.1, 1.0), falling = std::min((1 - s) / 0.5, 1.0);
            return rising * (0.1 + 0.9 * falling) / 0.725;
        };
        auto& strip = std::get<1>(simulation.boundary.parts);
        double way = 0, impulse = 0, began = 0;
        while (way < settlement * (1 - 1e-9)) {
            const double now = simulation.time() / time;
            strip.speed = -mean * profile(std::min(now + 1e-3, 1.0));
            simulation.step(field);
            const double dt = simulation.last_time_step();
            way -= strip.speed * dt;
            impulse -= simulation.reactions->parts[1].impulse[1];
            if (simulation.time() - began > time / 200 || way >= settlement * (1 - 1e-9)) {
                sunk.push_back(way);
                load.push_back(impulse / (simulation.time() - began) / (width / 2) / strength);
                impulse = 0;
                began = simulation.time();
            }
        }
    }
    /// Over the last tenth of the settlement [c_u].
    double last_load() const {
        double sum = 0;
        int count = 0;
        for (std::size_t i = 0; i < sunk.size(); ++i)
            if (sunk[i] > 0.95 * settlement) sum += load[i], ++count;
        return sum / count;
    }
};

}  // namespace verification
