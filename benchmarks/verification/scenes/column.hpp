/// \file An elastic column under its own weight, held sideways: H = 0.1 m, ρ = 1800 kg/m³, E = 1 MPa, ν = 0, 5 × 5
/// particles a cell; so is cb-geo/mpm's column (mpm-doc, hydrostatic-column.md; 0.2 m wide there, two or three cells
/// here, as nothing depends on the width). At rest, by the height Y before loading: σ_yy = −ρ g (H − Y), also of large
/// strains as the cross-section stays, and u = −ρ g/E (H Y − Y²/2) for the fixed corotated model, whose P_yy = E (F_yy
/// − 1).
#pragma once

#include <firn/firn.hpp>

#include "load_steps.hpp"
#include "sides.hpp"

#include <cmath>
#include <concepts>
#include <numbers>
#include <vector>

namespace verification {

/// Of a column at rest.
struct ColumnRow {
    double before = 0, height = 0;  ///< of its particles [m]
    double stress = 0, across = 0;  ///< Cauchy's σ_yy and σ_xx, mean over the row [Pa]
    int count = 0;
};

struct ColumnErrors {
    double base = 0;          ///< |σ_yy| of the lowest row over ρ g H, minus 1: what cb-geo/mpm reports
    double stress = 0;        ///< L₂ over the height, relative
    double lowest = 0;        ///< the largest of the lowest cell, over ρ g H
    double inner = 0;         ///< the same, from three cells above the floor to three below the top
    double displacement = 0;  ///< as stress
    double support = 0;       ///< what the floor bears over the weight [1]
    double across = 0;        ///< the largest |σ_xx| over ρ g H
};

/// \tparam Time  firn::Explicit, or firn::QuasiStatic: then the column comes to rest by load steps
template <class S, class Force, class Kernel, class Time = firn::Explicit>
struct Column {
    static constexpr double height = 0.1, density = 1800, g = 9.81, pressure = density * g * height;

    firn::SimulationWith<2, firn::FixedCorotated<S>, Force, Kernel, Time> simulation;
    double young;

    /// \param floor  its contact, and the nodes behind floor and sides, which slip
    explicit Column(double h, double young_ = 1e6, int particles_a_cell_and_axis = 5, const Sides& floor = {})
        : simulation({{0.0, 0.0}, {width(floor) * h, 0.12}, h}, firn::FixedCorotated<S>::from_young_poisson(young_, 0)),
          young(young_) {
        auto& boundary = simulation.boundary;
        boundary.at_lower = {firn::Wall{firn::Contact::slip}, firn::Wall{floor.contact}};
        boundary.at_upper = {firn::Wall{firn::Contact::slip}, firn::Wall{firn::Contact::none}};
        boundary.nodes_behind = floor.nodes_behind;
        const auto samples =
            firn::sample_box<2>({0.0, 0.0}, {width(floor) * h, height}, {.spacing = h / particles_a_cell_and_axis});
        simulation.add(samples, density);
        for (const auto& x : samples.positions) before_.push_back(x[1]);
    }

    static double stress(double Y) { return -density * g * (height - Y); }
    double displacement(double Y) const { return -density * g / young * (height * Y - Y * Y / 2); }

    /// For as many periods of the first mode, T = 4 H/c, damped critically in that mode. A mode falls by e^{−2π} a
    /// period. Or by load steps, and one more.
    void settle(double periods, int load_steps = 1) {
        if constexpr (takes_load_steps<decltype(simulation)>) {
            simulation.reactions.emplace();
            return load(simulation, {0.0, -g}, load_steps, 1, std::same_as<S, float> ? 1e-4 : 1e-9);
        }
        const double c = std::sqrt(young / density);
        firn::Damped<double, 2> field{{{0.0, -g}}, std::numbers::pi * c / height};
        simulation.reactions.emplace();
        simulation.advance(periods * 4 * height / c, field);
        // Damping takes a part of what a step gives to the nodes of the floor, too: what they bear is seen without it.
        field.rate = 0;
        simulation.step(field);
    }

    /// From the lowest to the highest.
    std::vector<ColumnRow> rows() const {
        std::vector<ColumnRow> rows;
        const double spacing = 2 * before_.front();
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const double Y = before_[particles.id(slot)];
            const std::size_t i = std::size_t(Y / spacing);
            if (rows.size() <= i) rows.resize(i + 1);
            const double J = double(firn::determinant(particles.state(slot).F));
            ColumnRow& row = rows[i];
            row.before = Y;
            row.height += particles.exact_position(slot)[1];
            row.stress += double(particles.stress(slot)(1, 1)) / J;
            row.across += double(particles.stress(slot)(0, 0)) / J;
            ++row.count;
        }
        for (ColumnRow& row : rows) row.height /= row.count, row.stress /= row.count, row.across /= row.count;
        return rows;
    }

    ColumnErrors errors() const {
        ColumnErrors errors;
        double off = 0, all = 0, astray = 0, moved = 0, off_within = 0, all_within = 0;
        const auto of = rows();
        const double margin = 3 * simulation.domain().cell_size;
        for (const ColumnRow& row : of) {
            const double u = displacement(row.before), should = stress(row.before);
            off += std::pow(row.stress - should, 2), all += should * should;
            if (row.before < margin / 3)
                errors.lowest = std::max(errors.lowest, std::abs(row.stress - should) / pressure);
            if (row.before > margin && row.before < height - margin)
                off_within += std::pow(row.stress - should, 2), all_within += should * should;
            astray += std::pow(row.height - row.before - u, 2), moved += u * u;
            errors.across = std::max(errors.across, std::abs(row.across) / pressure);
        }
        const double weight = simulation.totals().mass * g * simulation.last_time_step();
        errors.support = simulation.reactions->parts[0].impulse[1] / weight;
        errors.base = -of.front().stress / pressure - 1;
        errors.stress = std::sqrt(off / all);
        errors.inner = std::sqrt(off_within / all_within);
        errors.displacement = std::sqrt(astray / moved);
        return errors;
    }

private:
    /// In cells: mirrored walls must be three cells apart.
    static double width(const Sides& floor) { return floor.nodes_behind == firn::NodesBehind::mirrored ? 3 : 2; }

    std::vector<double> before_;  ///< height of each particle at first, by id [m]
};

/// The column and its mirror image below, 2 H high, pulled towards y = 0 from both sides, with no floor between them:
/// what the floor should do to the upper half, which is 0 ≤ y ≤ H.
struct MirroredColumn {
    using Half = Column<double, firn::MlsForce, firn::QuadraticBSpline>;

    /// Damped gravity towards y = 0.
    struct Pull {
        double rate;

        template <class P>
        firn::Vec<P, 2> operator()(const firn::Vec<P, 2>& x, const firn::Vec<P, 2>& v, const P& dt) const {
            using firn::abs, firn::select;
            const P c(rate), down = select(P(0) < x[1], P(-Half::g), P(Half::g));
            const P pull = select(abs(x[1]) < P(1e-9), P(0), down);
            return (firn::Vec<P, 2>{P(0), pull} - v * c) * (P(1) / (P(1) + c * dt));
        }
    };

    /// At rest: particles of one file, from y = 0 up.
    static std::vector<ColumnRow> rows(double h, double young = 1e6) {
        firn::Simulation<2, firn::FixedCorotated<double>> simulation(
            {{0.0, -0.12}, {2 * h, 0.12}, h}, firn::FixedCorotated<double>::from_young_poisson(young, 0));
        simulation.boundary.at_lower[0] = simulation.boundary.at_upper[0] = {firn::Contact::slip};
        const auto samples = firn::sample_box<2>({0.0, -Half::height}, {2 * h, Half::height}, {.spacing = h / 5});
        simulation.add(samples, Half::density);
        const double c = std::sqrt(young / Half::density);
        simulation.advance(24 * Half::height / c, Pull{std::numbers::pi * c / Half::height});
        std::vector<ColumnRow> rows(std::size_t(std::lround(Half::height / (h / 5))));
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const auto before = samples.positions[particles.id(slot)];
            if (before[1] < 0 || before[0] > h / 5) continue;
            rows[std::size_t(before[1] / (h / 5))] = {
                before[1], particles.exact_position(slot)[1],
                particles.stress(slot)(1, 1) / determinant(particles.state(slot).F), 0, 1};
        }
        return rows;
    }
};

}  // namespace verification
