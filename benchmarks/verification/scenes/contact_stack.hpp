/// \file Four elastic blocks lie on each other on a floor: E = 1e6 Pa, ν = 0.3, ρ = 1000 kg/m³, side 0.25 m, 10 cells
/// each; the whole stack is 1 m high. It starts from the geostatic state of linear elasticity, that of one prism of the
/// same height that stands on a floor without friction. In the undeformed state, with the height Y above the floor and
/// the distance X from the axis (in 3D also Z):
///
///     σ_yy = −ρ g (H − Y),  all other stresses 0
///
/// In plane strain the moduli are E' = E/(1 − ν²) and ν' = ν/(1 − ν); in 3D E and ν. Then
///
///     u_y = −ρ g/E' (H Y − Y²/2 − ν' r²/2),  u_x = ν' ρ g/E' (H − Y) X,  r² = X² + Z²
///
/// Timoshenko and Goodier 1970, "Theory of elasticity", §102 (prism stretched by its own weight).
#pragma once

#include <firn/firn.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace verification {

struct StackOptions {
    int cells = 10;         ///< of the side of a block
    double young = 1e6;     ///< E [Pa]
    double friction = 0.5;  ///< between the blocks, and of the floor [1]
    bool geostatic = true;  ///< Whether the stack starts from the geostatic state; otherwise it is not stressed.
};

/// \tparam Law  a contact law; with OneField, all blocks are one body
template <int D, class Law = firn::CoulombContact, class Transfer = firn::Apic, class Force = firn::MlsForce>
struct Stack {
    static constexpr bool in_groups = Law::between_groups;
    static constexpr int count = 4;  ///< of blocks
    static constexpr double side = 0.25, height = count * side, poisson = 0.3, density = 1000, g = 9.81;

    StackOptions options;
    double h;
    firn::SimulationWith<D, firn::FixedCorotated<double>, Transfer, Force, firn::Coloured, Law> simulation;
    std::array<firn::Body, count> blocks;

    explicit Stack(const StackOptions& of, const Law& law = {}, int threads = 1)
        : options(of),
          h(side / of.cells),
          simulation(domain(of), firn::FixedCorotated<double>::from_young_poisson(of.young, poisson), law,
                     firn::Coloured{threads}) {
        using namespace firn;
        auto& walls = simulation.boundary;
        walls.at_lower[1] = {Contact::separate, of.friction};
        walls.nodes_behind = NodesBehind::mirrored;
        for (int i = 0; i < count; ++i) {
            auto lower = Vec<double, D>::filled(-0.5 * side);
            lower[1] = i * side;
            std::array<std::int64_t, D> counts;
            counts.fill(2 * of.cells);
            Samples<D> block{lattice_points<D>(lower, counts, h / 2), std::pow(h / 2, D)};
            const auto before = block.positions;
            if (of.geostatic)
                for (auto& x : block.positions) x = x + displacement(x);
            const auto body = blocks[std::size_t(i)] = simulation.add(block, density);
            if constexpr (in_groups) simulation.set_contact_group(body, i);
            before_.insert(before_.end(), before.begin(), before.end());
        }
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!of.geostatic || !particles.is_particle(slot)) continue;
            auto state = particles.state(slot);
            state.F = deformation(before_[particles.id(slot)]);
            particles.set_state(slot, state);
        }
        if constexpr (in_groups) simulation.contact_impulses.emplace();
    }

    double modulus() const { return D == 2 ? options.young / (1 - poisson * poisson) : options.young; }
    static double widening() { return D == 2 ? poisson / (1 - poisson) : poisson; }
    /// u of the geostatic state [m], at a point of the undeformed stack.
    firn::Vec<double, D> displacement(const firn::Vec<double, D>& X) const {
        const double s = density * g / modulus(), n = widening();
        auto u = firn::Vec<double, D>::zero();
        double r2 = 0;
        for (int a = 0; a < D; a += 2) {
            u[a] = n * s * (height - X[1]) * X[a];
            r2 += X[a] * X[a];
        }
        u[1] = -s * (height * X[1] - 0.5 * X[1] * X[1] - 0.5 * n * r2);
        return u;
    }
    /// I + ∇u of the geostatic state.
    firn::Mat<double, D> deformation(const firn::Vec<double, D>& X) const {
        const double s = density * g / modulus(), n = widening();
        auto F = firn::Mat<double, D>::identity();
        F(1, 1) -= s * (height - X[1]);
        for (int a = 0; a < D; a += 2) {
            F(a, a) += n * s * (height - X[1]);
            F(a, 1) -= n * s * X[a];
            F(1, a) += n * s * X[a];
        }
        return F;
    }
    /// The elastic energy of the geostatic state [J].
    double elastic_energy() const {
        return std::pow(density * g, 2) * std::pow(height, 3) / (6 * modulus()) * std::pow(side, D - 1);
    }
    /// Elastic and potential energy [J].
    double stored_energy() const {
        const auto totals = simulation.totals();
        return totals.elastic_energy + g * totals.first_moment[1];
    }
    /// The mean height of the topmost row of particles [m].
    double top() const { return mean(count - 1, true)[1]; }
    /// The mean position of the lowest or the topmost row of a block [m].
    firn::Vec<double, D> mean(int block, bool topmost) const {
        const auto& particles = simulation.particles();
        auto sum = firn::Vec<double, D>::zero();
        double n = 0;
        const double row = topmost ? (block + 1) * side - 0.25 * h : block * side + 0.25 * h;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || std::abs(before_[particles.id(slot)][1] - row) > 0.1 * h) continue;
            sum += particles.exact_position(slot);
            ++n;
        }
        return sum * (1 / n);
    }
    /// The distance between the facing rows of block i and the block above, less half a cell: the gap between their
    /// nominal faces [cells].
    double gap(int i) const { return (mean(i + 1, false)[1] - mean(i, true)[1]) / h - 0.5; }

private:
    static firn::Domain<D> domain(const StackOptions& of) {
        const double cell = side / of.cells;
        auto lower = firn::Vec<double, D>::filled(-0.5 * side - 4 * cell), upper = -lower;
        lower[1] = 0;
        upper[1] = height + 4 * cell;
        return {lower, upper, cell};
    }

    std::vector<firn::Vec<double, D>> before_;  ///< undeformed position of each particle, by id [m]
};

}  // namespace verification
