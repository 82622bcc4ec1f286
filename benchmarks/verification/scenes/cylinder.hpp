/// \file A thick cylinder under internal pressure, in plane strain: a = 1 m, b = 2 m, p = 1e-3 E. Lamé's solution:
/// u(r) = (1 + ν)/E p a²/(b² − a²) ((1 − 2ν) r + b²/r), σ_rr = p a²/(b² − a²) (1 − b²/r²).
#pragma once

#include <firn/firn.hpp>

#include "load_steps.hpp"

#include <cmath>
#include <numbers>
#include <tuple>
#include <type_traits>
#include <vector>

namespace verification {

/// What the particles of a ring have in common.
struct CylinderRing {
    double radius = 0;  ///< at first [m]
    int count = 0;
    double moved = 0;             ///< mean displacement outwards [m]
    double radial = 0, hoop = 0;  ///< mean Cauchy stresses [Pa]
    double scatter = 0;           ///< standard deviation of (σ_rr + σ_θθ)/2 over the ring [Pa]
};

/// A boundary: nodes on the axes of coordinates keep to them, as those of a body do that has them as lines of symmetry.
template <firn::scalar S, int D>
struct SymmetricAxes {
    S nearest = S(1e-6);  ///< nodes as near are on an axis [m]

    static constexpr const char* name = "symmetric_axes";
    static constexpr auto parameters() { return std::tuple{firn::parameter{"nearest", "m", &SymmetricAxes::nearest}}; }
    firn::Vec<S, D> velocity(const firn::Vec<S, D>& x, const firn::Vec<S, D>& v) const {
        firn::Vec<S, D> along = v;
        for (int a = 0; a < D; ++a) along[a] = firn::select(firn::abs(x[a]) < nearest, S(0), v[a]);
        return along;
    }
    bool reaches(const firn::Vec<double, D>& low, const firn::Vec<double, D>& high) const {
        bool across = false;
        for (int a = 0; a < D; ++a) across = across || (low[a] < double(nearest) && high[a] > -double(nearest));
        return across;
    }
};

/// \tparam Policies  transfer, force form and whatever else the simulation is to have; with firn::QuasiStatic, the
///                   cylinder comes to rest by load steps, in which its axes of symmetry hold it
template <class... Policies>
struct ThickCylinder {
    using Vector = firn::Vec<double, 2>;
    static constexpr double inner = 1, outer = 2, young = 1e6, density = 1000, pressure = 1e-3 * young;

    using Free = firn::SimulationWith<2, firn::FixedCorotated<double>, Policies...>;
    using Held = firn::SimulationWith<2, firn::FixedCorotated<double>, SymmetricAxes<double, 2>, Policies...>;
    using Simulation = std::conditional_t<takes_load_steps<Free>, Held, Free>;
    Simulation simulation;
    double poisson;
    std::vector<double> R;      ///< radius of each particle at first, by its id [m]
    std::vector<double> radii;  ///< of the rings [m]

    /// Rings h/2 apart, on each as many particles as its length asks for; the internal pressure as a force outwards of
    /// 2π a p in all on the innermost ring.
    explicit ThickCylinder(double nu, int cells_a_metre = 32)
        : simulation(domain(1.0 / cells_a_metre), firn::FixedCorotated<double>::from_young_poisson(young, nu)),
          poisson(nu) {
        simulation.gravity = {0.0, 0.0};
        simulation.execution.threads = 1;
        if constexpr (!takes_load_steps<Free>)
            for (auto* walls : {&simulation.boundary.at_lower, &simulation.boundary.at_upper})
                walls->fill({firn::Contact::none, 0});
        const int rings = 2 * cells_a_metre;
        const double apart = (outer - inner) / rings;
        for (int k = 0; k < rings; ++k) {
            const double r = inner + (k + 0.5) * apart;
            const int count = int(std::lround(2 * std::numbers::pi * r / apart));
            firn::Samples<2> ring;
            for (int j = 0; j < count; ++j) {
                const double angle = 2 * std::numbers::pi * (j + 0.37 * k) / count;
                ring.positions.push_back({r * std::cos(angle), r * std::sin(angle)});
            }
            ring.volume = 2 * std::numbers::pi * r * apart / count;
            radii.push_back(r);
            R.insert(R.end(), std::size_t(count), r);
            const firn::Body body = simulation.add(ring, density);
            const double force = 2 * std::numbers::pi * inner * pressure / count;
            if (k == 0)
                simulation.add_load(body, [force](const Vector& x, double time) {
                    return Vector(x * (force * part_of_load<Simulation>(time) / firn::norm(x)));
                });
        }
    }

    double displacement(double r) const {
        return (1 + poisson) / young * pressure * inner * inner / (outer * outer - inner * inner) *
               ((1 - 2 * poisson) * r + outer * outer / r);
    }
    static double radial_stress(double r) {
        return pressure * inner * inner / (outer * outer - inner * inner) * (1 - outer * outer / (r * r));
    }

    /// Two periods of breathing, u ~ 1/r: ω² = 3/2 μ/ρ / ln 2 without volume change; critically damped. Or by load
    /// steps.
    void settle(double periods = 2, int load_steps = 1) {
        if constexpr (takes_load_steps<Simulation>) return load(simulation, load_steps);
        const double omega = std::sqrt(1.5 * simulation.material().mu / density / std::numbers::ln2);
        simulation.advance(periods * 2 * std::numbers::pi / omega, firn::Damped<double, 2>{{{0.0, 0.0}}, 2 * omega});
    }

    /// From the innermost on.
    std::vector<CylinderRing> rings() const {
        std::vector<CylinderRing> all(radii.size());
        for (std::size_t k = 0; k < radii.size(); ++k) all[k].radius = radii[k];
        const auto& particles = simulation.particles();
        const double apart = radii[1] - radii[0];
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const double before = R[particles.id(slot)];
            CylinderRing& ring = all[std::size_t((before - inner) / apart)];
            const Vector x = particles.exact_position(slot), along = x * (1 / firn::norm(x));
            const auto stress = particles.stress(slot);
            const double radial = firn::dot(along, stress * along), mean = firn::trace(stress) / 2;
            ring.moved += firn::norm(x) - before;
            ring.radial += radial;
            ring.hoop += 2 * mean - radial;
            ring.scatter += mean * mean;
            ++ring.count;
        }
        for (CylinderRing& ring : all) {
            ring.moved /= ring.count, ring.radial /= ring.count, ring.hoop /= ring.count;
            const double mean = (ring.radial + ring.hoop) / 2;
            ring.scatter = std::sqrt(std::max(ring.scatter / ring.count - mean * mean, 0.0));
        }
        return all;
    }
    /// u(b), by a straight line through the last two rings [m].
    double outer_displacement() const {
        const auto all = rings();
        return 1.5 * all[all.size() - 1].moved - 0.5 * all[all.size() - 2].moved;
    }

private:
    static firn::Domain<2> domain(double h) {
        const double far = outer + 4 * h;
        return {{-far, -far}, {far, far}, h};
    }
};

}  // namespace verification
