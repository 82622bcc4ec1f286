/// \file A beam held at one end, in plane strain: E = 40 MPa, ν = 0.3, ρ = 1000 kg/m³, 1 m long, 0.125 m thick. Small
/// deflections: Euler and Bernoulli's beam with Timoshenko's correction for shear and rotary inertia (Timoshenko 1921).
#pragma once

#include <firn/firn.hpp>

#include "load_steps.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace verification {

/// The theory of the beam, per metre of width.
struct BeamTheory {
    static constexpr double young = 4e7, poisson = 0.3, density = 1000, length = 1, thickness = 0.125, gravity = 9.81;
    static constexpr double plane_modulus = young / (1 - poisson * poisson);  ///< E' [Pa]
    static constexpr double inertia = thickness * thickness * thickness / 12;
    static constexpr double shear_stiffness = 5. / 6 * young / (2 * (1 + poisson)) * thickness;  ///< κ G A [N/m]
    static constexpr double load = density * gravity * thickness;                                ///< q [N/m²]

    /// Under gravity, at x from the clamp [m]; at the end, of Euler and Bernoulli alone, q L⁴/(8 E'I).
    static double deflection(double x, bool with_shear = true) {
        const double bent = x * x * (x * x - 4 * length * x + 6 * length * length) / (24 * plane_modulus * inertia);
        return load * (bent + (with_shear ? (length - x / 2) * x / shear_stiffness : 0));
    }

    static constexpr double root = 1.8751040687119611;  ///< βL: cosh βL cos βL = −1
    /// φ, or a derivative of it, of the first mode; φ(L) = 2.
    static double mode(double x, int derivative = 0) {
        const double beta = root / length, b = beta * x;
        const double sigma = (std::cosh(root) + std::cos(root)) / (std::sinh(root) + std::sin(root));
        const double cosines[] = {std::cos(b), -std::sin(b), -std::cos(b), std::sin(b)};
        const double sines[] = {std::sin(b), std::cos(b), -std::sin(b), -std::cos(b)};
        const bool odd = derivative % 2 == 1;
        const double cosh = odd ? std::sinh(b) : std::cosh(b), sinh = odd ? std::cosh(b) : std::sinh(b);
        return std::pow(beta, derivative) * (cosh - cosines[derivative] - sigma * (sinh - sines[derivative]));
    }
    /// ∫ of the square of a derivative of φ.
    static double squared_mode(int derivative) {
        double sum = 0;
        for (int i = 0; i < 1000; ++i) {
            const double f = mode((i + 0.5) * length / 1000, derivative);
            sum += f * f * length / 1000;
        }
        return sum;
    }
    /// 2π/ω, ω = 1.8751² √(E'I/(ρA L⁴)); with shear and rotary inertia: 1/ω² grows by the share
    /// (I/A) ∫φ'²/∫φ² + E'I/(κGA) ∫φ'''²/∫φ''², to first order in (thickness/length)². [s]
    static double period(bool with_shear = true) {
        const double squared = std::pow(root / length, 4) * plane_modulus * inertia / (density * thickness);
        double share = 0;
        if (with_shear)
            share = inertia / thickness * squared_mode(1) / squared_mode(0) +
                    plane_modulus * inertia / shear_stiffness * squared_mode(3) / squared_mode(2);
        return 2 * std::numbers::pi / std::sqrt(squared / (1 + share));
    }
};

/// The line of a beam that bends far but does not stretch, under `weight` times its own:
/// E'I θ'' = −q (L − s) cos θ, θ(0) = θ'(L) = 0, by shooting. Deflections at s [m], in steps of L/1000, with shear
/// added as at small ones.
inline std::vector<double> elastica(double weight) {
    using B = BeamTheory;
    constexpr int n = 1000;
    constexpr double ds = B::length / n;
    const double k = weight * B::load / (B::plane_modulus * B::inertia);
    std::vector<double> down(n + 1);
    const auto shoot = [&](double curvature) {
        double angle = 0;
        down[0] = 0;
        for (int i = 0; i < n; ++i) {  // the midpoint rule
            const double s = i * ds, half = angle + curvature * ds / 2;
            const double change = -k * (B::length - s) * std::cos(angle);
            const double middle = curvature + change * ds / 2;
            curvature += -k * (B::length - s - ds / 2) * std::cos(half) * ds;
            down[std::size_t(i) + 1] = down[std::size_t(i)] + std::sin(half) * ds;
            angle += middle * ds;
        }
        return curvature;
    };
    double low = 0, high = k * B::length * B::length;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (shoot(middle) < 0 ? low : high) = middle;
    }
    shoot(high);
    for (std::size_t i = 0; i <= std::size_t(n); ++i) {
        const double s = double(i) * ds;
        down[i] += weight * (B::deflection(s) - B::deflection(s, false));
    }
    return down;
}

/// \tparam Time  firn::Explicit, or firn::QuasiStatic: then the beam comes to rest by load steps
template <class Transfer, class Force, class Kernel, class Time = firn::Explicit>
struct Cantilever {
    using Theory = BeamTheory;
    using Field = firn::Damped<double, 2>;

    firn::SimulationWith<2, firn::FixedCorotated<double>, Transfer, Force, Kernel, Time> simulation;
    std::vector<firn::Vec<double, 2>> X;  ///< of each particle at first, by its id; the beam's axis is y = 0
    double h;

    /// \param cells  through the thickness, even
    explicit Cantilever(int cells, const Transfer& transfer = {}, int particles_a_cell_and_axis = 2)
        : simulation({{0.0, -0.5}, {1.5, 0.5}, Theory::thickness / cells},
                     firn::FixedCorotated<double>::from_young_poisson(Theory::young, Theory::poisson)),
          h(Theory::thickness / cells) {
        simulation.transfer = transfer;
        simulation.execution.threads = 1;  // few particles: more threads cost more than they bring
        simulation.boundary.at_lower[0] = {firn::Contact::stick, 0};
        const firn::Samples<2> samples =
            firn::sample_box<2>({0.0, -Theory::thickness / 2}, {Theory::length, Theory::thickness / 2},
                                {.spacing = h / particles_a_cell_and_axis});
        X = samples.positions;
        simulation.add(samples, Theory::density);
    }

    /// Deflections [m] over x at first [m], downwards, mean over the thickness.
    std::map<double, double> deflections() const {
        std::map<double, double> sum, count;
        each([&](std::size_t slot, const auto& from) {
            sum[from[0]] += from[1] - simulation.particles().exact_position(slot)[1];
            count[from[0]] += 1;
        });
        for (auto& [x, total] : sum) total /= count[x];
        return sum;
    }
    /// Under gravity, or a multiple of it, until it rests: with critical damping of the first mode, of whose motion
    /// (1 + 2πn) e^{−2πn} is left after n periods; or by load steps, and one more.
    void settle(double weight = 1, double periods = 2.5, int load_steps = 1) {
        if constexpr (takes_load_steps<decltype(simulation)>)
            return load(simulation, {0.0, -weight * Theory::gravity}, load_steps, 1);
        const double rate = 4 * std::numbers::pi / Theory::period();
        simulation.advance(periods * Theory::period(), Field{{{0.0, -weight * Theory::gravity}}, rate});
    }
    /// The last deflection over the theory's at its place.
    double tip_over_theory() const {
        const auto last = *deflections().rbegin();
        return last.second / Theory::deflection(last.first);
    }

    /// The axial strain of a layer of particles.
    struct Layer {
        double y;             ///< at first [m]
        double of_F;          ///< ½ (FᵀF − 1) along the axis, by the particles' F
        double of_positions;  ///< the same, by the distance between the neighbours of each particle
    };
    /// Of each layer, the mean over the particles that were at first between two places along the axis [m].
    std::vector<Layer> layers(double from, double to) const {
        const auto& particles = simulation.particles();
        std::map<double, std::map<double, std::size_t>> slots;  // by y, then by x
        each([&](std::size_t slot, const auto& at_first) { slots[at_first[1]][at_first[0]] = slot; });
        std::vector<Layer> all;
        for (const auto& [y, row] : slots) {
            Layer layer{y, 0, 0};
            double count = 0;
            for (auto next = std::next(row.begin(), 2), at = std::next(row.begin()), last = row.begin();
                 next != row.end(); ++next, ++at, ++last) {
                if (at->first < from || at->first > to) continue;
                const auto& F = particles.state(at->second).F;
                const auto apart = particles.exact_position(next->second) - particles.exact_position(last->second);
                const double before = next->first - last->first;
                layer.of_F += (F(0, 0) * F(0, 0) + F(1, 0) * F(1, 0) - 1) / 2;
                layer.of_positions += (dot(apart, apart) / (before * before) - 1) / 2;
                count += 1;
            }
            all.push_back({y, layer.of_F / count, layer.of_positions / count});
        }
        return all;
    }

    /// Sets it moving in its first mode: 1 cm at the tip.
    void strike() {
        const double speed = 0.005 * 2 * std::numbers::pi / Theory::period();
        auto& particles = simulation.edit_particles();
        each([&](std::size_t slot, const auto& from) {
            const double x = from[0], y = from[1];
            const double turn = speed * Theory::mode(x, 1), bend = -y * speed * Theory::mode(x, 2);
            particles.set_velocity(slot, {-y * turn, speed * Theory::mode(x)});
            if (Transfer::affine) particles.set_affine(slot, firn::Mat<double, 2>::rows(bend, -turn, turn, 0.0));
        });
    }
    void swing(double duration) { simulation.advance(duration, Field{}); }
    double upward_speed() const {
        const auto totals = simulation.totals();
        return totals.momentum[1] / totals.mass;
    }
    double energy() const {
        const auto totals = simulation.totals();
        return totals.kinetic_energy + totals.elastic_energy;
    }

private:
    template <class F>
    void each(const F& f) const {
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) f(slot, X[particles.id(slot)]);
    }
};

}  // namespace verification
