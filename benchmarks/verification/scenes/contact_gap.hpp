/// \file Two blocks approach slowly until they feel each other; or they are pulled apart.
#pragma once

#include <firn/firn.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

namespace verification {

template <int D>
struct GapOptions {
    double cells = 10;               ///< side of each block [cells]
    double turn = 0;                 ///< angle by which both blocks are turned with their lattices [°]
    std::array<double, 2> jitter{};  ///< of each block: largest random shift of a particle per axis [spacings]
    std::uint64_t seed = 1;          ///< of the random shifts
    firn::Vec<double, D> offset{};   ///< of both blocks from a plane of nodes [cells]
    double aside = 0;                ///< by how much the second block is moved along the common face [cells]
    double gap = 0.25;               ///< between the nominal faces at first [cells]
    double speed = 1e-3;             ///< of each block, over c; negative if they part
    firn::ContactNormals normals = firn::ContactNormals::regression;
};

/// Two blocks, E = 1 Pa, ν = 0.3, ρ = 1 kg/m³, h = 1 m, 2^D particles a cell. c = √(E/ρ).
template <int D, class Law = firn::CoulombContact>
struct Blocks {
    static constexpr double h = 1, c = 1;
    static constexpr bool in_groups = Law::between_groups;

    GapOptions<D> options;
    firn::Vec<double, D> normal;  ///< from the first block to the second
    firn::SimulationWith<D, firn::FixedCorotated<double>, firn::Coloured, Law> simulation;
    firn::Body first, second;

    explicit Blocks(const GapOptions<D>& of)
        : options(of),
          simulation(domain(of), firn::FixedCorotated<double>::from_young_poisson(1, 0.3), law(of), firn::Coloured{1}) {
        using namespace firn;
        simulation.gravity = {};
        simulation.fixed_time_step = 0.3 * h / c;
        const Mat<double, D> R = turned(of.turn);
        auto axis = Vec<double, D>::zero();
        axis[0] = 1;
        normal = R * axis;
        for (int side = 0; side < 2; ++side) {
            auto corner = Vec<double, D>::filled(-0.5 * of.cells * h);
            corner[0] = side == 0 ? -(of.cells + 0.5 * of.gap) * h : 0.5 * of.gap * h;
            corner[1] += side * of.aside * h;
            std::array<std::int64_t, D> counts;
            counts.fill(std::int64_t(std::lround(2 * of.cells)));
            Samples<D> block{lattice_points<D>(corner, counts, h / 2, of.jitter[std::size_t(side)],
                                               2 * of.seed + std::uint64_t(side)),
                             std::pow(h / 2, D)};
            const auto middle = 0.5 * (simulation.domain().lower + simulation.domain().upper);
            for (auto& x : block.positions) x = middle + R * x + of.offset * h;
            (side == 0 ? first : second) = simulation.add(block, 1, normal * (side == 0 ? of.speed : -of.speed));
        }
        if constexpr (in_groups) {
            simulation.set_contact_group(second, 1);
            simulation.contact_impulses.emplace();
        }
    }

    /// The gap between the nominal faces of blocks that have not met yet, at the end of the last step [cells].
    double nominal_gap() const { return options.gap - 2 * options.speed * simulation.time() / h; }
    /// The mean velocity of the first block along the normal [m/s].
    double velocity() const {
        const auto& particles = simulation.particles();
        double sum = 0, count = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || !first.holds(particles.id(slot))) continue;
            sum += dot(particles.velocity(slot), normal);
            ++count;
        }
        return sum / count;
    }
    /// The largest error of a particle's velocity, against that of the block at first [m/s].
    double velocity_error() const {
        const auto& particles = simulation.particles();
        double worst = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const double should = first.holds(particles.id(slot)) ? options.speed : -options.speed;
            worst = std::max(worst, norm(particles.velocity(slot) - normal * should));
        }
        return worst;
    }

private:
    static Law law(const GapOptions<D>& of) {
        Law law;
        if constexpr (in_groups) law.normals = of.normals;
        return law;
    }
    static firn::Domain<D> domain(const GapOptions<D>& of) {
        const double half = std::ceil(of.cells * 1.5 + of.aside + 6);
        return {firn::Vec<double, D>::filled(-half), firn::Vec<double, D>::filled(half), h};
    }
    /// In 3D, turned about an axis that is not an axis of the grid.
    static firn::Mat<double, D> turned(double degrees) {
        if constexpr (D == 2)
            return firn::matrix_of(firn::rotor(firn::degrees(degrees)));
        else
            return firn::matrix_of(firn::rotor(firn::Vec<double, 3>{0.0, 0.6, 0.8}, firn::degrees(degrees)));
    }
};

/// The gap between the nominal faces when the blocks feel the first force [cells]; NaN if they feel none until their
/// nominal faces overlap by half a cell. Without groups, a change of the mean velocity by 1e-6 counts as a force.
template <int D, class Law = firn::CoulombContact>
double gap_at_first_force(const GapOptions<D>& options) {
    Blocks<D, Law> blocks(options);
    while (blocks.nominal_gap() > -0.5) {
        blocks.simulation.step();
        if constexpr (Law::between_groups) {
            const auto impulse = blocks.simulation.contact_impulses->on(0, 1);
            if (dot(impulse, impulse) > 0) return blocks.nominal_gap();
        } else if (std::abs(blocks.velocity() / options.speed - 1) > 1e-6) {
            return blocks.nominal_gap();
        }
    }
    return std::numeric_limits<double>::quiet_NaN();
}

/// Force on the first block along the normal, over the nominal gap.
struct Approach {
    std::vector<double> gap{}, force{};  ///< [cells]; force over ρ c v A, against the approach
};
/// Two blocks approach, and bounce.
/// \param until  nominal gap at the end [cells]: the gap that blocks would have if they passed through each other
template <int D, class Law = firn::CoulombContact>
Approach approach(const GapOptions<D>& options, double until) {
    Blocks<D, Law> blocks(options);
    Approach out;
    const double scale = Blocks<D, Law>::c * options.speed * std::pow(options.cells, D - 1),
                 mass = std::pow(options.cells, D);
    double before = blocks.velocity();
    while (blocks.nominal_gap() > until) {
        blocks.simulation.step();
        const double now = blocks.velocity();
        out.gap.push_back(blocks.nominal_gap());
        out.force.push_back((before - now) * mass / blocks.simulation.last_time_step() / scale);
        before = now;
    }
    return out;
}

/// What is felt when two blocks part.
struct Parting {
    double impulse = 0;   ///< the largest impulse between the groups in a step, over m v
    double pull = 0;      ///< the largest impulse that pulls, over m v
    double velocity = 0;  ///< largest error of a particle's velocity, over v
};
/// Two blocks that touch are pulled apart.
/// \param steps  number of time steps
template <int D, class Law = firn::CoulombContact>
Parting part(GapOptions<D> options, int steps) {
    options.speed = -std::abs(options.speed);
    Blocks<D, Law> blocks(options);
    Parting out;
    const double momentum = -options.speed * std::pow(options.cells, D);
    for (int i = 0; i < steps; ++i) {
        blocks.simulation.step();
        if constexpr (Law::between_groups) {
            const auto impulse = blocks.simulation.contact_impulses->on(1, 0);
            out.impulse = std::max(out.impulse, norm(impulse) / momentum);
        }
        out.velocity = std::max(out.velocity, blocks.velocity_error() / -options.speed);
    }
    return out;
}

/// Two blocks that touch are pressed together by a body force that grows and wanes, and then pulled apart by one.
struct Pressed {
    double pull = 0;  ///< the largest force that pulls, over the largest that presses
    double late = 0;  ///< the last time with a force, over the duration of the pressing [1]
};
template <int D>
Pressed press_and_pull(GapOptions<D> options, double strain, double period) {
    using namespace firn;
    options.speed = options.gap = 0;
    Blocks<D> blocks(options);
    // A half sine pushes; a half sine pulls. At the common face, the stress of a slow push is ρ a × side.
    const double most = strain / options.cells, pi = std::numbers::pi;
    for (int side = 0; side < 2; ++side) {
        const auto direction = blocks.normal * (side == 0 ? 1.0 : -1.0);
        blocks.simulation.add_load(side == 0 ? blocks.first : blocks.second,
                                   [=](const Vec<double, D>&, double time) -> Vec<double, D> {
                                       return direction * (most * std::pow(0.5, D) * std::sin(2 * pi * time / period));
                                   });
    }
    Pressed out;
    double press = 0, pull = 0;
    while (blocks.simulation.time() < period) {
        blocks.simulation.step();
        // On the second block by the first: along the normal if it presses.
        const double impulse = dot(blocks.simulation.contact_impulses->on(1, 0), blocks.normal);
        press = std::max(press, impulse);
        pull = std::max(pull, -impulse);
        if (impulse != 0) out.late = blocks.simulation.time() / (period / 2);
    }
    out.pull = pull / press;
    return out;
}

}  // namespace verification
