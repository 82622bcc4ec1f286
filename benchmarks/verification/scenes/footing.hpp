/// \file A strip footing on weightless soil: the load at which it sinks in is N_c c, of a strip of any roughness and
/// soil whose flow is associated (Prandtl 1920; Hill 1950, "The Mathematical Theory of Plasticity").
#pragma once

#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include "load_steps.hpp"

#include <algorithm>
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

/// The acceleration of a frame, and damping of the motion against it: dv/dt = a − c (v − V).
template <class S, int D>
struct DampedFrame {
    S acceleration = S(0), rate = S(0), speed = S(0);  ///< a and V are upwards [m/s², 1/s, m/s]

    static constexpr const char* name = "damped_frame";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"acceleration", "m/s²", &DampedFrame::acceleration},
                          firn::parameter{"rate", "1/s", &DampedFrame::rate},
                          firn::parameter{"speed", "m/s", &DampedFrame::speed}};
    }
    firn::Vec<S, D> operator()(const firn::Vec<S, D>&, const firn::Vec<S, D>& v, const S& dt) const {
        firn::Vec<S, D> pull = v * -rate;
        pull[1] = pull[1] + acceleration + rate * speed;
        return pull * (S(1) / (S(1) + rate * dt));
    }
};

/// Soil under a footing, of unit strip width B, 1 m.
template <class Material>
struct SoilUnderFooting {
    Material material;
    double mu;                    ///< shear modulus [Pa]
    double strength;              ///< c [Pa]
    double bearing;               ///< N_c, the limit load over c [1]
    firn::Vec<double, 2> extent;  ///< of the half domain, to the side and down [m]
    double settlement;            ///< to which the footing is pushed [m]
};
/// Clay that does not change its volume: von Mises, c_u = 10 kPa, 5 B × 5 B.
inline SoilUnderFooting<firn::VonMises<double>> undrained_clay() {
    const double c = 10e3;
    return {firn::VonMises<double>::from_properties(
                {.young = 1e7, .poisson = 0.49, .yield_stress = std::sqrt(3.0) * c, .hardening = 0}),
            1e7 / 2.98,
            c,
            2 + std::numbers::pi,
            {5.0, 5.0},
            0.02};
}
/// Mohr–Coulomb in plane strain, whose plastic volume change FBar leaves to each particle.
using FlowingSoil = firn::PlaneStrain<firn::PlasticVolume<firn::MohrCoulomb<double>>>;
/// Soil with friction whose flow is associated, ψ = φ: Mohr–Coulomb in plane strain, c = 10 kPa, 8 B × 4 B.
/// E is so large that slip lines shear little before the load stays: matter that has dilated has less strength per
/// present area. N_c = (N_φ e^(π tan φ) − 1) cot φ, N_φ = (1 + sin φ)/(1 − sin φ); 2 + π if φ = 0.
/// \param settlement  to which the footing is pushed [m]
inline SoilUnderFooting<FlowingSoil> associated_soil(firn::Angle friction, double settlement) {
    const double young = 1e9, poisson = 0.3, c = 10e3, phi = friction.in_radians(),
                 ratio = (1 + std::sin(phi)) / (1 - std::sin(phi));
    return {{{firn::MohrCoulomb<double>::from_properties({.young = young,
                                                          .poisson = poisson,
                                                          .cohesion = c,
                                                          .friction_angle = friction,
                                                          .dilatancy_angle = friction})}},
            young / (2 * (1 + poisson)),
            c,
            phi > 0 ? (ratio * std::exp(std::numbers::pi * std::tan(phi)) - 1) / std::tan(phi) : 2 + std::numbers::pi,
            {8.0, 4.0},
            settlement};
}

/// The footing in a frame that moves with the strip, so that the strip stays on a plane of nodes: the base of the soil
/// is pushed upwards against the strip. (If the strip moves by s against the grid, the soil below moves away from the
/// nodes that push it, and the load is as of a strip that is narrower by up to 2 s.)
/// \tparam Policies  transfer, force form and whatever else the simulation is to have
template <class Material, class... Policies>
struct Footing {
    using Vector = firn::Vec<double, 2>;
    using Boundary = firn::Together<firn::Walls<double, 2>, Plate<double, 2>, Plate<double, 2>>;
    static constexpr double width = 1, density = 1000;  ///< B [m]; [kg/m³]

    using Simulation = firn::SimulationWith<2, Material, Boundary, Policies...>;
    SoilUnderFooting<Material> soil;
    Simulation simulation;
    std::vector<double> sunk, load;  ///< settlement [m], and mean pressure under the strip over c [1]

    /// The right half: a plane of symmetry at x = 0; soil sticks to the base and slips at the far side. The nodes of
    /// the surface, y = 0, that are under the strip or on its edge, and those above them, stand still.
    /// \param behind  how nodes behind the plane of symmetry and the far side move
    Footing(const SoilUnderFooting<Material>& under, int cells_on_strip,
            firn::NodesBehind behind = firn::NodesBehind::mirrored)
        : soil(under),
          simulation({{0.0, -under.extent[1] - 4 * width / cells_on_strip},
                      {under.extent[0], 4 * width / cells_on_strip},
                      width / cells_on_strip},
                     under.material) {
        const double h = width / cells_on_strip, far = 100 * width;
        auto& [walls, strip, base] = simulation.boundary.parts;
        walls =
            firn::Walls<double, 2>::all(simulation.domain().lower, simulation.domain().upper, {firn::Contact::none, 0});
        walls.at_lower[0] = walls.at_upper[0] = {firn::Contact::slip, 0};
        walls.nodes_behind = behind;
        strip.lower = {-far, -0.01 * h};
        strip.upper = {width / 2 + 0.01 * h, far};
        base.lower = {-far, -far};
        base.upper = {far, -soil.extent[1] + 0.01 * h};
        simulation.gravity = {0.0, 0.0};
        simulation.reactions.emplace();
        simulation.add(firn::sample_box<2>({0.0, -soil.extent[1]}, {soil.extent[0], 0.0}, {.spacing = h / 2}), density);
    }

    /// Time that a shear wave takes over B [s].
    double unit() const { return width / std::sqrt(soil.mu / density); }

    /// Pushes it in. The speed rises over the first tenth of `duration`, falls from four to seven tenths, and is then a
    /// tenth, as numerical viscosity adds to the load in proportion to speed.
    /// \param duration  in unit()s
    /// \param damping   rate of the damping, over unit()
    void push(double duration, double damping) {
        const double time = duration * unit(), mean = soil.settlement / time;
        const auto profile = [](double s) {  // its mean is 1
            const double falling = std::clamp((0.7 - s) / 0.3, 0.0, 1.0);
            return std::min(s / 0.1, 1.0) * (0.1 + 0.9 * falling) / 0.545;
        };
        auto& base = std::get<2>(simulation.boundary.parts);
        double way = 0, impulse = 0, began = 0;
        while (way < soil.settlement * (1 - 1e-9)) {
            const double dt = simulation.stable_time_step(), before = base.speed;
            base.speed = mean * profile(std::min(simulation.time() / time + 1e-3, 1.0));
            simulation.fixed_time_step = dt;
            simulation.step(DampedFrame<double, 2>{(base.speed - before) / dt, damping / unit(), base.speed});
            way += base.speed * dt;
            impulse -= simulation.reactions->parts[1].impulse[1];
            if (simulation.time() - began > time / 200 || way >= soil.settlement * (1 - 1e-9)) {
                record(way, impulse, simulation.time() - began);
                impulse = 0;
                began = simulation.time();
            }
        }
    }
    /// Pushes it in by load steps of the same settlement. With a hundredth of the tolerance of Newton's method, the
    /// load differs by 2e-4.
    void push_by_load_steps(int steps) {
        std::get<2>(simulation.boundary.parts).speed = soil.settlement / steps;
        for (int k = 1; k <= steps; ++k) {
            simulation.advance(1);
            record(soil.settlement * k / steps, -simulation.reactions->parts[1].impulse[1],
                   simulation.last_time_step());
        }
    }
    /// Mean over the last fiftieth of the settlement [c_u].
    double last_load() const {
        double sum = 0;
        int count = 0;
        for (std::size_t i = 0; i < sunk.size(); ++i)
            if (sunk[i] > 0.98 * soil.settlement) sum += load[i], ++count;
        return sum / count;
    }

private:
    /// Appends to the curve. \param way  settlement [m];  \param impulse  of the strip on the half domain [N s], in
    /// `time` [s]
    void record(double way, double impulse, double time) {
        sunk.push_back(way);
        load.push_back(impulse / time / (width / 2) / soil.strength);
    }
};

}  // namespace verification
