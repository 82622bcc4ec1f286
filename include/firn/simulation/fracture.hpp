/// \file Finds matter that bears tension and is stretched so far that its kernel does not join its particles any more:
/// it breaks there, whatever its material.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/math/principal_axes.hpp>
#include <firn/simulation/set_of.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace firn::inline FIRN_BUILD::detail {

/// A particle under tension, and the nearest particles before and behind it along the tension. Lengths in cells.
template <std::floating_point S, int D>
class Neighbours {
public:
    /// \param F  the elastic deformation gradient of the particle
    [[gnu::cold]] Neighbours(const ParticleStore<S, D>& particles, std::size_t slot, const Mat<S, D>& F,
                             double cell_size)
        : at_(cells(particles, slot)), spacing_(std::pow(double(particles.volume(slot)), 1.0 / D) / cell_size) {
        const auto principal = principal_stretches(cast<double>(F));
        direction_ = principal.directions.column(0);
        stretch_ = principal.stretches[0];
        const Mat<double, D> stress = cast<double>(particles.stress(slot));
        pull_ = dot(direction_, stress * direction_) / std::sqrt(squared_norm(stress));
    }
    /// Whether the particle is pulled along the direction of its largest stretch, more than in others.
    bool is_pulled() const { return pull_ > 0.3; }

    /// Looks for the neighbours, in the block of the particle and then in the blocks around it. Returns false as soon
    /// as one is found that is nearer than `near` cells.
    template <class Partition>
    [[gnu::cold]] bool are_apart(const ParticleStore<S, D>& particles, const Partition& partition,
                                 const Domain<D>& domain, double near) {
        for (const bool around : {false, true})
            for (const BlockRange<D>& range : partition.ranges) {
                double away = 0;  // along the axis on which the block is farthest
                for (int a = 0; a < D; ++a) {
                    const double middle = block_size * (range.block[std::size_t(a)] + 0.5);
                    away = std::max(away, std::abs(along_axis(middle - at_[a], a, domain)));
                }
                const bool here = away <= block_size / 2;
                if (here == around || away > farthest + block_size / 2 + allowed_drift) continue;
                if (!is_apart_from(particles, range, domain, near)) return false;
            }
        return true;
    }
    /// Returns the mean distance of the two neighbours, or that of the one if the other is missing, as beside a wall or
    /// a surface [cells]; 0 if both are.
    double distance() const {
        const bool one = nearest_[0] < farthest, other = nearest_[1] < farthest;
        const double sum = (one ? nearest_[0] : 0) + (other ? nearest_[1] : 0);
        return one && other ? sum / 2 : sum;
    }
    double stretch() const { return stretch_; }  ///< the largest elastic stretch of the particle
    double spacing() const { return spacing_; }  ///< distance between particles when the matter was made [cells]
    const Vec<double, D>& direction() const { return direction_; }

private:
    static constexpr double farthest = 3;  // particles further apart share no nodes [cells]

    [[gnu::cold]] bool is_apart_from(const ParticleStore<S, D>& particles, const BlockRange<D>& range,
                                     const Domain<D>& domain, double near) {
        for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot) {
            if (!particles.is_particle(slot)) continue;
            Vec<double, D> r = cells(particles, slot) - at_;
            for (int a = 0; a < D; ++a) r[a] = along_axis(r[a], a, domain);
            const double along = dot(r, direction_), across = dot(r, r) - along * along;
            // Particles beside this one are no neighbours along the tension.
            if (!(across < 0.5625 * spacing_ * spacing_) || std::abs(along) < 0.25 * spacing_) continue;
            double& nearest = nearest_[along > 0];
            nearest = std::min(nearest, std::abs(along));
            if (nearest < near) return false;
        }
        return true;
    }

    /// Returns a position counted in cells. Copies of blocks for contact groups are far apart.
    static Vec<double, D> cells(const ParticleStore<S, D>& particles, std::size_t slot) {
        Vec<double, D> x = cast<double>(particles.place(slot));
        const BlockCoordinate<D> block = particles.block(slot);
        for (int a = 0; a < D; ++a) x[a] += block_size * double(block[std::size_t(a)]);
        return x;
    }
    static double along_axis(double cells, int axis, const Domain<D>& domain) {
        const double period = domain.cells(axis);
        return domain.periodic[std::size_t(axis)] ? cells - period * std::round(cells / period) : cells;
    }

    Vec<double, D> at_, direction_;
    double spacing_, stretch_, pull_ = 0, nearest_[2] = {farthest, farthest};
};

/// Returns a sentence about the first particle of a set that is stretched too far; an empty string if there is none.
///
/// F of an elastic material is the whole stretch. But at a surface that leaves another one in the same field of
/// velocities, F of a few particles grows while those inside stay where they are: so no neighbour may be near, and
/// several particles must be stretched. Of another material, stretch_bound() is a bound that also grows while matter is
/// kneaded: there the distance of the neighbours decides.
template <std::floating_point S, int D>
[[gnu::cold]] std::string too_far_stretched(SetOf<S, D>& set, const KernelFacts& kernel, int threads) {
    const ParticleStore<S, D>& particles = set.store();
    const Domain<D>& domain = particles.domain();
    constexpr int needed = 3;  // a single particle may be torn from a surface
    JoinedStretch<D> joined(kernel, domain.cell_size);
    std::string text;
    int found = 0;
    for (const Stretched& one : set.most_stretched(kernel, threads)) {
        Neighbours<S, D> neighbours(particles, one.slot, set.gradient_of(one.slot)->F, domain.cell_size);
        const double limit = joined.of(double(particles.volume(one.slot))), spacing = neighbours.spacing();
        if (!neighbours.is_pulled() || (set.is_elastic() && !(neighbours.stretch() > limit))) continue;
        if (!neighbours.are_apart(particles, set.partition, domain, 0.75 * limit * spacing)) continue;
        const double far = neighbours.distance() / spacing;
        if (!(far > (set.is_elastic() ? 0 : limit))) continue;
        if (++found == needed) return text;
        if (!text.empty()) continue;
        text = sentence("at particle ", one.id, " at ", point_text(particles.exact_position(one.slot).v, D),
                        " m, matter under tension is stretched ", set.is_elastic() ? neighbours.stretch() : far,
                        " times along ", point_text(neighbours.direction().v, D), ": particles that lay ", spacing,
                        " cells apart are joined up to ", limit,
                        " times by the kernel. It breaks there, whatever its material. Take more particles a cell (a "
                        "smaller spacing along the stretch is enough), or a wider kernel.");
    }
    return {};
}

/// Returns the sentence of the first set that has one.
template <std::floating_point S, int D>
[[gnu::cold]] std::string too_far_stretched(SetList<S, D>& sets, const KernelFacts& kernel, int threads) {
    for (SetOf<S, D>& set : sets)
        if (std::string text = too_far_stretched(set, kernel, threads); !text.empty()) return text;
    return {};
}

}  // namespace firn::inline FIRN_BUILD::detail
