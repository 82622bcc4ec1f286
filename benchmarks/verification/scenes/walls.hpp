/// \file What walls with mirrored nodes promise: half a problem beside a slipping wall moves as the whole problem;
/// stuck matter hangs from its wall, or is sheared beside it, as the exact solutions say; what is pulled off a wall
/// that it may leave feels nothing of it.
#pragma once

#include <firn/firn.hpp>

#include "manufactured.hpp"

#include <cmath>
#include <numbers>
#include <vector>

namespace verification {

/// Waves between walls of the unit square, and the same waves in the periodic square of side 2, which has the square's
/// particles with the same ids, and their mirror images.
template <class Solution, class Transfer>
struct WavesBetweenWalls {
    using Scene = Manufactured<double, Solution, Transfer, firn::MlsForce, firn::QuadraticBSpline>;

    Solution solution;
    double h = 1. / 8;
    int particles = 2;     ///< a cell and axis
    double courant = 0.2;  ///< time step over h/c
    Transfer transfer{};

    double time_step() const { return solution.period() / double(steps()); }
    long steps() const { return std::lround(std::ceil(solution.period() * solution.c() / (courant * h) - 1e-9)); }
    firn::Samples<2> samples() const { return firn::sample_box<2>({0.0, 0.0}, {1.0, 1.0}, {.spacing = h / particles}); }

    Scene walled(const Sides& sides) const {
        return Scene(solution, {{0.0, 0.0}, {1.0, 1.0}, h}, samples(), time_step(), true, transfer, sides);
    }
    Scene periodic() const {
        firn::Domain<2> domain{{0.0, 0.0}, {2.0, 2.0}, h};
        domain.periodic = {true, true};
        firn::Samples<2> whole = samples();
        const auto quarter = whole.positions;
        for (const int image : {1, 2, 3})
            for (const auto& X : quarter)
                whole.positions.push_back({image & 1 ? 2 - X[0] : X[0], image & 2 ? 2 - X[1] : X[1]});
        return Scene(solution, domain, whole, time_step(), true, transfer);
    }
};

/// The largest distance [m] of particles of `part` from those of `whole` with the same id, along one axis.
template <class Part, class Whole>
double largest_distance(const Part& part, const Whole& whole) {
    constexpr int D = Part::dimension;
    const auto& mine = part.particles();
    const auto& theirs = whole.particles();
    std::vector<firn::Vec<double, D>> at(theirs.size());
    for (std::size_t slot = 0; slot < theirs.slots(); ++slot)
        if (theirs.is_particle(slot)) at[theirs.id(slot)] = theirs.exact_position(slot);
    double largest = 0;
    for (std::size_t slot = 0; slot < mine.slots(); ++slot) {
        if (!mine.is_particle(slot)) continue;
        auto off = mine.exact_position(slot) - at[mine.id(slot)];
        for (int a = 0; a < D; ++a) {
            const double extent = whole.domain().upper[a] - whole.domain().lower[a];
            if (whole.domain().periodic[std::size_t(a)]) off[a] -= extent * std::round(off[a] / extent);
            largest = std::max(largest, std::isfinite(off[a]) ? std::abs(off[a]) : 1e300);
        }
    }
    return largest;
}

/// Two cubes (in 2D squares) of side L fly at each other along y and bounce. The plane x = 0 halves both of them. A
/// second plane is z = 0 in 3D, which halves them once more, and in 2D y = 0, where they meet.
template <int D, class Transfer, class Force>
struct HalvedCubes {
    static constexpr double side = 0.25, speed = 1;  ///< L [m], of each [m/s]
    using Vector = firn::Vec<double, D>;
    using Simulation = firn::Simulation<D, firn::FixedCorotated<double>, Transfer, Force>;

    int cells = 8;   ///< a side
    int planes = 1;  ///< how many halve the problem

    /// \param part  only what lies in front of the planes, with slipping walls there; else all, with no wall near
    Simulation make(bool part, firn::NodesBehind nodes_behind = firn::NodesBehind::mirrored) const {
        using namespace firn;
        const double h = side / cells;
        Domain<D> domain{Vector::filled(-2 * side), Vector::filled(2 * side), h};
        for (int k = 0; k < planes && part; ++k) domain.lower[axis(k)] = 0;
        Simulation simulation(domain, FixedCorotated<double>::from_young_poisson(1e4, 0.3));
        simulation.gravity = Vector::zero();
        simulation.boundary.at_lower.fill({Contact::slip});
        simulation.boundary.at_upper.fill({Contact::slip});
        simulation.boundary.nodes_behind = nodes_behind;
        simulation.fixed_time_step = 0.2 * h / 4;  // waves run at 3.7 m/s
        // What is in front of the planes comes first, so that its ids are the same in both runs.
        for (const bool in_front : {true, false}) {
            if (part && !in_front) continue;
            for (const double way : {1.0, -1.0}) {
                Vector lower = Vector::filled(-side / 2), velocity = Vector::zero();
                lower[1] = way > 0 ? -1.25 * side : 0.25 * side;
                velocity[1] = way * speed;
                Samples<D> samples = sample_box<D>(lower, lower + Vector::filled(side), {.spacing = h / 2});
                std::erase_if(samples.positions, [&](const Vector& x) { return is_in_front(x) != in_front; });
                if (!samples.positions.empty()) simulation.add(samples, 1000, velocity);
            }
        }
        return simulation;
    }

private:
    static int axis(int plane) { return D == 3 ? 2 * plane : plane; }
    bool is_in_front(const Vector& x) const {
        for (int k = 0; k < planes; ++k)
            if (x[axis(k)] < 0) return false;
        return true;
    }
};

/// A soft layer that sticks to a floor, is endless along x, and is pulled by an acceleration: along x it is sheared,
/// along y stretched. Neo-Hookean, λ = 0: P_xy = μ F_xy in shear; P_yy = μ (F_yy − 1/F_yy) in tension, of the depth
/// below the surface: P = ρ a (H − Y). So F is known at every Y, and x by integration over Y.
struct SoftLayer {
    using Simulation = firn::Simulation<2, firn::NeoHookean<double>>;

    static constexpr double height = 0.1, density = 1000, mu = 1e4;
    double acceleration;  ///< the strain at the floor is ρ a H/μ in shear
    bool sheared;
    double h;
    std::vector<firn::Vec<double, 2>> before{};  ///< by id [m]
    Simulation simulation;

    SoftLayer(bool shear, double pull, double cell, firn::NodesBehind nodes_behind, int particles = 2)
        : acceleration(pull), sheared(shear), h(cell), simulation(domain(cell), {mu, 0.0}) {
        simulation.boundary.at_lower[1] = {firn::Contact::stick};
        simulation.boundary.nodes_behind = nodes_behind;
        const auto samples = firn::sample_box<2>({0.0, 0.0}, {16 * h, height}, {.spacing = h / particles});
        before = samples.positions;
        simulation.add(samples, density);
    }

    /// To rest, damped critically in its first mode, while the pull grows over the first third of the time.
    void settle(double periods = 12) {
        const double period = 4 * height / std::sqrt((sheared ? 1 : 2) * mu / density);
        const int parts = 40;
        for (int i = 1; i <= parts; ++i) {
            const double pull = acceleration * std::min(1.0, 3.0 * i / parts);
            firn::Damped<double, 2> field{{sheared ? firn::Vec<double, 2>{pull, 0.0} : firn::Vec<double, 2>{0.0, pull}},
                                          4 * std::numbers::pi / period};
            simulation.advance(periods * period / parts, field);
        }
    }

    double strain(double Y) const { return density * acceleration * (height - Y) / mu; }
    /// F_xy or F_yy.
    double gradient(double Y) const {
        const double s = strain(Y);
        return sheared ? s : s / 2 + std::sqrt(s * s / 4 + 1);
    }
    /// Along the pull [m].
    double displacement(double Y) const {
        if (sheared) return density * acceleration / mu * (height * Y - Y * Y / 2);
        // Of F − 1, by the midpoint rule
        const int parts = 2000;
        double sum = 0;
        for (int i = 0; i < parts; ++i) sum += gradient(Y * (i + 0.5) / parts) - 1;
        return sum * Y / parts;
    }

    struct Row {
        double before = 0, moved = 0, expected = 0, gradient = 0, expected_gradient = 0;
        int count = 0;
    };
    /// From the lowest up; means over x.
    std::vector<Row> rows() const {
        std::vector<Row> rows;
        const auto& particles = simulation.particles();
        const double spacing = 2 * before.front()[1], width = 16 * h;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const auto X = before[particles.id(slot)];
            const std::size_t i = std::size_t(X[1] / spacing);
            if (rows.size() <= i) rows.resize(i + 1);
            Row& row = rows[i];
            row.before = X[1];
            row.expected = displacement(X[1]);
            row.expected_gradient = gradient(X[1]);
            double moved = (particles.exact_position(slot) - X)[sheared ? 0 : 1];
            if (sheared) moved -= width * std::round((moved - row.expected) / width);
            row.moved += moved;
            row.gradient += particles.state(slot).F(sheared ? 0 : 1, 1);
            ++row.count;
        }
        for (Row& row : rows) row.moved /= row.count, row.gradient /= row.count;
        return rows;
    }

private:
    static firn::Domain<2> domain(double h) {
        firn::Domain<2> domain{{0.0, 0.0}, {16 * h, 0.25}, h};
        domain.periodic[0] = true;
        return domain;
    }
};

/// A block at rest on a floor that it may leave, and has friction with, is pulled off: nothing may hold it back.
struct PulledOff {
    firn::Simulation<2, firn::FixedCorotated<double>> simulation;
    firn::Vec<double, 2> pull;  ///< [m/s²]
    std::vector<firn::Vec<double, 2>> before{};

    PulledOff(const firn::Vec<double, 2>& acceleration, firn::NodesBehind nodes_behind, double friction = 0.5)
        : simulation({{0.0, 0.0}, {2.0, 1.0}, 1. / 32}, firn::FixedCorotated<double>::from_young_poisson(1e4, 0.3)),
          pull(acceleration) {
        simulation.gravity = pull;
        simulation.boundary.at_lower[1] = {firn::Contact::separate, friction};
        simulation.boundary.nodes_behind = nodes_behind;
        simulation.reactions.emplace();
        const auto samples = firn::sample_box<2>({0.5, 0.0}, {1.0, 0.25}, {.spacing = 1. / 64});
        before = samples.positions;
        simulation.add(samples, 1000);
    }

    struct Felt {
        double impulse = 0;   ///< the floor's, in all, over the block's mass times the speed it has reached
        double stress = 0;    ///< largest |τ_yy| over E
        double velocity = 0;  ///< largest difference from a free fall's, over that
    };
    Felt after(double duration) {
        Felt felt;
        while (simulation.time() < duration - 1e-12) {
            simulation.fixed_time_step = std::min(duration - simulation.time(), 1e-3);
            simulation.step();
            felt.impulse += norm(simulation.reactions->parts[0].impulse);
        }
        const double speed = norm(pull) * duration;
        felt.impulse /= simulation.totals().mass * speed;
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            felt.stress = std::max(felt.stress, std::abs(particles.stress(slot)(1, 1)) / 1e4);
            felt.velocity = std::max(felt.velocity, norm(particles.velocity(slot) - pull * duration) / speed);
        }
        return felt;
    }
};

}  // namespace verification
