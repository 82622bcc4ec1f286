/// \file A column of dry sand beside a smooth wall, L0 = 0.1 m wide and H0 = a L0 high, that is let go on a rough
/// floor. Lube, Huppert, Sparks and Freundt 2005, "Collapses of two-dimensional granular columns"; Lajeunesse, Monnier
/// and Homsy 2005, "Granular slumping on a horizontal surface".
#pragma once

#include <firn/firn.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace verification {

/// What is known of the deposit, by the aspect ratio a; as Lagrée, Staron and Popinet 2011 give it (eq. 3.1, 3.2).
namespace deposit {
/// (L∞ − L0)/L0 of Lube et al., sand, rice, sugar, couscous: 1.2 a for a < 1.8, 1.9 a^(2/3) for a > 2.8
inline double run_out_of_lube(double a) {
    const double low = 1.2 * a, high = 1.9 * std::cbrt(a * a);
    return a < 1.8 ? low : a > 2.8 ? high : low + (high - low) * (a - 1.8);
}
/// Of Lajeunesse et al., glass beads: 1.8 a for a < 3, 2.3 a^(2/3) beyond
inline double run_out_of_lajeunesse(double a) { return a < 3 ? 1.8 * a : 2.3 * std::cbrt(a * a); }
/// H∞/L0 of Lube et al.: a, at most a^0.4
inline double height_of_lube(double a) { return a < 1.15 ? a : std::pow(a, 0.4); }
/// Both of Lagrée et al. 2011, computed with the μ(I) rheology
inline double run_out_of_lagree(double a) { return a < 7 ? 2.2 * a : 3.9 * std::pow(a, 0.7); }
inline double height_of_lagree(double a) { return 0.65 * std::pow(a, 0.35); }
/// 3.3 √(H0/g), what Lube et al. give for the time until the front stops [s]
inline double time_of_lube(double height, double g) { return 3.3 * std::sqrt(height / g); }
}  // namespace deposit

/// \tparam Policies  what differs from the defaults of a simulation
template <class S, class... Policies>
struct SandColumn {
    static constexpr double width = 0.1, density = 1600, g = 9.81;  ///< L0 [m]

    firn::SimulationWith<2, firn::Sand<S>, Policies...> simulation;
    double aspect, h;

    SandColumn(double aspect_, int cells_across, firn::Angle friction_angle = firn::degrees(30))
        : simulation({{0.0, 0.0}, {width * (2 + 3.5 * aspect_), width * (aspect_ + 1)}, width / cells_across},
                     firn::Sand<S>::from_properties({.young = 1e6, .poisson = 0.3, .friction_angle = friction_angle})),
          aspect(aspect_),
          h(width / cells_across) {
        simulation.boundary.at_lower[1] = {firn::Contact::stick, 0};
        simulation.add(firn::sample_box<2>({0.0, 0.0}, {width, width * aspect}, {.spacing = h / 2}), density);
    }

    double height() const { return width * aspect; }

    /// The highest particle over each cell of the floor, until one has less than two, a layer of half a cell. [m]
    std::vector<double> surface() const {
        std::vector<int> count;
        std::vector<double> top;
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const auto x = particles.exact_position(slot);
            const std::size_t i = std::size_t(x[0] / h);
            if (count.size() <= i) count.resize(i + 1), top.resize(i + 1);
            ++count[i];
            top[i] = std::max(top[i], x[1] + h / 4);
        }
        const auto end = std::find_if(count.begin(), count.end(), [](int n) { return n < 2; });
        top.resize(std::size_t(end - count.begin()));
        return top;
    }
    /// (L − L0)/L0 and H/L0 of the deposit as it is.
    double run_out() const { return double(surface().size()) * h / width - 1; }
    double top() const {
        const auto heights = surface();
        return *std::max_element(heights.begin(), heights.end()) / width;
    }
    /// Area below the surface over that of the column.
    double area() const {
        double area = 0;
        for (const double height_here : surface()) area += height_here * h;
        return area / (width * height());
    }
    /// Σ V0 J over Σ V0: what the sand takes up by its deformation gradient, with what opened under no stress.
    double volume() const {
        const auto& particles = simulation.particles();
        double now = 0, first = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const auto state = particles.state(slot);
            const double V0 = double(particles.volume(slot));
            first += V0;
            now += V0 * double(firn::determinant(state.F)) * std::exp(double(state.volume_gain));
        }
        return now / first;
    }
    /// Root of the mean square of the particles' speeds [m/s].
    double speed() const {
        const auto totals = simulation.totals();
        return std::sqrt(2 * totals.kinetic_energy / totals.mass);
    }
};

}  // namespace verification
