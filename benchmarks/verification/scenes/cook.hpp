/// \file Cook's membrane in plane strain: a tapered panel held at its left edge, with a shear force on its right edge.
/// Corners (0, 0), (48, 44), (48, 60), (0, 44) mm, E = 240.565 MPa, a traction of 1/16 MPa upwards: 1 N in all per mm
/// of thickness (Cook 1974; with these moduli: Simo and Armero 1992). Strains are below a thousandth.
#pragma once

#include <firn/firn.hpp>

#include "load_steps.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace verification {

/// Displacements upwards [m] of a mixed finite-element method that does not lock: quadrilaterals with nine nodes and
/// three pressures (Q2, discontinuous P1), small strain, 64 × 64 elements, and 128 × 128 for ν = 0.3 and
/// 0.499.
struct CookReference {
    double poisson;
    double middle;  ///< of (48, 52) mm
    double corner;  ///< of (48, 60) mm
};
inline constexpr std::array<CookReference, 5> cook_references{{{0.3, 9.122e-5, 9.580e-5},
                                                               {0.4, 8.523e-5, 8.943e-5},
                                                               {0.49, 7.785e-5, 8.166e-5},
                                                               {0.499, 7.702e-5, 8.081e-5},
                                                               {0.4999, 7.692e-5, 8.068e-5}}};

/// (σ_xx + σ_yy)/2 of the same method for ν = 0.499, at s = 65/128, t = (3 i + 1/2)/64 of the map [MPa]
inline constexpr std::array cook_mean_stress{
    0.11739, 0.10999, 0.10230,  0.09408,  0.08558,  0.07663,  0.06744,  0.05787,  0.04810,  0.03802,  0.02777,
    0.01726, 0.00660, -0.00430, -0.01533, -0.02659, -0.03801, -0.04969, -0.06157, -0.07377, -0.08624, -0.09911};

/// \tparam Policies  transfer, force form and whatever else the simulation is to have
template <class... Policies>
struct CookMembrane {
    using Vector = firn::Vec<double, 2>;
    static constexpr double young = 240.565e6, density = 1000, force = 1000;  ///< [Pa], [kg/m³], [N per m]
    static constexpr double width = 0.048, left = 0.044, right = 0.016;       ///< length, and heights at both ends [m]

    using Simulation = firn::SimulationWith<2, firn::FixedCorotated<double>, Policies...>;
    Simulation simulation;
    int n;                  ///< particles along an edge
    std::vector<Vector> X;  ///< of each particle at first, by its id: n s + t along the map

    /// \param cells      on the height of the left edge
    /// \param particles  along an edge: n × n, at the images of the centres of n × n squares
    /// \param behind     how nodes behind the held edge move
    explicit CookMembrane(double poisson, int cells = 32, int particles = 64,
                          firn::NodesBehind behind = firn::NodesBehind::held)
        : simulation(domain(left / cells), firn::FixedCorotated<double>::from_young_poisson(young, poisson)),
          n(particles) {
        simulation.gravity = {0.0, 0.0};
        simulation.execution.threads = 1;  // few particles: more threads cost more than they bring
        for (auto* walls : {&simulation.boundary.at_lower, &simulation.boundary.at_upper})
            walls->fill({firn::Contact::none, 0});
        simulation.boundary.at_lower[0] = {firn::Contact::stick, 0};
        simulation.boundary.nodes_behind = behind;
        for (int i = 0; i < n; ++i) {  // the Jacobian of the map depends on s only: a body for each column
            const double s = (i + 0.5) / n;
            firn::Samples<2> column;
            for (int j = 0; j < n; ++j) column.positions.push_back(image(s, (j + 0.5) / n));
            column.volume = width * (left - (left - right) * s) / (n * n);
            X.insert(X.end(), column.positions.begin(), column.positions.end());
            const firn::Body body = simulation.add(column, density);
            if (i == n - 1)
                simulation.add_load(body, [up = force / n](const Vector&, double time) {
                    return Vector{0.0, up * part_of_load<Simulation>(time)};
                });
        }
    }

    /// Of (s, t), both from 0 to 1.
    static Vector image(double s, double t) { return {width * s, (left - (left - right) * s) * t + left * s}; }
    /// T of a shear beam; that of the first mode is longer by a quarter [s].
    double shear_period() const { return 4 * width / std::sqrt(simulation.material().mu / density); }
    /// Until it rests: after 5 periods, nearly critically damped in its first mode, 0.2 % of the way are left at most.
    /// Or by a load step.
    /// \param small_nodes  nodes with less than this part of the largest one's volume follow others in a load step; the
    ///                     default of SmallNodeRule, 0.1, makes the slanting edges stiffer
    void settle([[maybe_unused]] double small_nodes = 0.01) {
        if constexpr (takes_load_steps<Simulation>) {
            simulation.integration.small_nodes.threshold = small_nodes;
            return load(simulation, 1);
        }
        const double period = shear_period();
        simulation.advance(5 * period, firn::Damped<double, 2>{{{0.0, 0.0}}, 4 / period});
    }

    /// Displacement upwards of (48, 52) mm, the middle of the right edge [m].
    double middle() const {
        const auto edge = at_edge();
        const std::size_t half = edge.size() / 2;
        return (edge[half - 1] + edge[half]) / 2;
    }
    /// Of (48, 60) mm [m].
    double corner() const {
        const auto edge = at_edge();
        return 1.5 * edge[edge.size() - 1] - 0.5 * edge[edge.size() - 2];
    }
    /// Mean stress in the plane, (σ_xx + σ_yy)/2, of the particles of the middle column, over t [Pa].
    std::vector<double> mean_stress() const {
        std::vector<double> stress(std::size_t(n), 0.0);
        each([&](std::size_t slot, int i, int j) {
            if (i == n / 2) stress[std::size_t(j)] = firn::trace(simulation.particles().stress(slot)) / 2;
        });
        return stress;
    }

private:
    static firn::Domain<2> domain(double h) {
        return {{0.0, -4 * h}, {h * (std::ceil(width / h) + 4), h * (std::ceil(0.06 / h) + 4)}, h};
    }
    template <class F>
    void each(const F& f) const {
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) f(slot, int(particles.id(slot)) / n, int(particles.id(slot)) % n);
    }
    /// Displacements upwards at the right edge, by a straight line through the last two columns.
    std::vector<double> at_edge() const {
        std::vector<double> edge(std::size_t(n), 0.0);
        each([&](std::size_t slot, int i, int j) {
            if (i < n - 2) return;
            const double moved =
                simulation.particles().exact_position(slot)[1] - X[std::size_t(simulation.particles().id(slot))][1];
            edge[std::size_t(j)] += (i == n - 1 ? 1.5 : -0.5) * moved;
        });
        return edge;
    }
};

}  // namespace verification
