/// \file Water that splashes and comes to rest in a box of 1 m: a column that collapses, or a layer that is let go.
///
/// At rest the depth is the volume over the width. Waves lift the centre of mass: in the mean over time their potential
/// energy is as large as their kinetic energy E, as of every linear oscillation, so the centre is E/(m g) too high.
#pragma once

#include <firn/loops/separation.hpp>
#include <firn/firn.hpp>

#include <cmath>
#include <numbers>
#include <vector>

namespace verification {

/// A box of 1 m with slipping walls, filled from the lower left corner: ρ = 1000 kg/m³, K = 100 kPa, no viscosity.
template <class S, class Volume>
struct Splash {
    static constexpr double density = 1000, bulk = 1e5, g = 9.81;

    firn::SimulationWith<2, firn::Fluid<S>, Volume> simulation;
    double depth_at_rest = 0, released = 0;  ///< [m], and the energy of the fall [J]

    /// \param per_cell  particles along each axis of a cell
    Splash(double width, double height, double h, double per_cell, firn::NodesBehind behind, std::uint64_t seed = 0,
           const Volume& volume = {})
        : simulation({{0.0, 0.0}, {1.0, 1.0}, h}, firn::Fluid<S>::from_properties({.bulk = bulk}), volume) {
        simulation.gravity = {0, -g};
        simulation.boundary = firn::Walls<S, 2>::all({0, 0}, {1, 1}, {firn::Contact::separate, 0});
        simulation.boundary.nodes_behind = behind;
        const auto samples =
            firn::sample_box<2>({0.0, 0.0}, {width, height},
                                {.spacing = h / per_cell,
                                 .pattern = seed > 0 ? firn::Pattern::jittered : firn::Pattern::lattice,
                                 .seed = seed});
        depth_at_rest = double(samples.positions.size()) * samples.volume;
        simulation.add(samples, density);
        released = mass() * g * (height - depth_at_rest) / 2;
    }
    /// The depth of water that is compressed by its own weight, over that without, to first order.
    double compressed() const { return 1 - density * g * depth_at_rest / (2 * bulk); }
    double mass() const { return density * depth_at_rest; }

    /// What the water is like over some time, in the mean.
    struct Mean {
        double depth = 0,                 ///< twice the height of the centre of mass, less that of the waves [m]
            raw_depth = 0,                ///< with the waves [m]
            kinetic = 0,                  ///< kinetic energy [J]
            kinetic_besides_waves = 0;    ///< without that of the four longest standing waves [J]
        std::vector<double> pressures{};  ///< of the layers of a cell, over ρ g d at the depth d of their middles
        /// The largest |p / ρ g d − 1| of a layer, except of the lowest one and of the two below the surface.
        double worst_layer() const {
            double worst = 0;
            for (std::size_t k = 1; k + 2 < pressures.size(); ++k) worst = std::max(worst, std::abs(pressures[k] - 1));
            return worst;
        }
        /// |p / ρ g d − 1| of the lowest layer.
        double at_floor() const { return std::abs(pressures.at(0) - 1); }
    };
    /// Goes on for `duration` [s], and looks at the water every 0.1 s.
    /// \param see  called as see(time, depth now), without correction for waves
    template <class See>
    Mean go_on(double duration, const See& see) {
        Mean mean;
        const double h = simulation.domain().cell_size;
        std::vector<double> sums(std::size_t(1 / h) + 1), counts(sums.size());
        const int looks = int(std::lround(duration / 0.1));
        for (int i = 0; i < looks; ++i) {
            simulation.advance(0.1);
            const auto totals = simulation.totals();
            const double depth = 2 * totals.first_moment[1] / totals.mass;
            mean.raw_depth += depth / looks;
            mean.kinetic += totals.kinetic_energy / looks;
            mean.kinetic_besides_waves += (totals.kinetic_energy - kinetic_of_waves()) / looks;
            see(simulation.time(), depth);
            const auto& particles = simulation.particles();
            for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
                if (!particles.is_particle(slot)) continue;
                const auto k = std::size_t(particles.exact_position(slot)[1] / h);
                sums[k] += double(simulation.material().pressure(S(1) + volume_change(particles.state(slot))));
                ++counts[k];
            }
        }
        mean.depth = mean.raw_depth - 2 * mean.kinetic / (mass() * g);
        for (std::size_t k = 0; (double(k) + 1) * h < mean.depth; ++k)
            mean.pressures.push_back(sums[k] / counts[k] / (density * g * (mean.depth - (double(k) + 0.5) * h)));
        return mean;
    }
    Mean go_on(double duration) {
        return go_on(duration, [](double, double) {});
    }

    /// The kinetic energy of the part of the velocities that the potentials cos(n π x) cosh(n π y), n = 1, …, 4, make
    /// up [J] (Lamb, Hydrodynamics, §228): by least squares.
    double kinetic_of_waves() const {
        constexpr int waves = 4;
        double A[waves][waves] = {}, b[waves] = {}, right[waves];
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const auto x = particles.exact_position(slot);
            const auto v = firn::cast<double>(particles.velocity(slot));
            firn::Vec<double, 2> u[waves];
            for (int n = 0; n < waves; ++n) {
                const double k = (n + 1) * std::numbers::pi;
                u[n] = {-std::sin(k * x[0]) * std::cosh(k * x[1]), std::cos(k * x[0]) * std::sinh(k * x[1])};
            }
            for (int i = 0; i < waves; ++i) {
                b[i] += dot(u[i], v);
                for (int j = 0; j < waves; ++j) A[i][j] += dot(u[i], u[j]);
            }
        }
        std::copy(b, b + waves, right);
        if (!firn::detail::solve_definite(A, b)) return 0;
        double sum = 0;
        for (int i = 0; i < waves; ++i) sum += b[i] * right[i];
        return 0.5 * sum * mass() / double(particles.size());
    }
};

}  // namespace verification
