/// \file Finds matter that bears tension and is stretched so far that its kernel does not join its particles any more:
/// it breaks there, whatever its material.
#pragma once

#include <firn/core/lanes.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particle_store.hpp>
#include <firn/data/particle_view.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/principal_axes.hpp>
#include <firn/math/stretch_bound.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Whether F of a particle of the material M is its whole deformation: M is elastic.
template <class M, int D>
inline constexpr bool is_elastic =
    requires(const material_state_t<M, D> s) { s.F; } && !has_returned<M, D> && !has_updated<M, D>;
/// Whether particles of M are stretched by a known factor while they bear tension: M is elastic, or has
/// stretch_bound().
template <class M, int D>
inline constexpr bool tells_stretch = has_stretch_bound<M, D> || is_elastic<M, D>;

/// Returns an upper bound of how many times as long as at first a particle is, along any direction.
template <class M, class State>
FIRN_INLINE auto stretch_of(const M& model, const State& state) {
    if constexpr (requires { model.stretch_bound(state); })
        return model.stretch_bound(state);
    else
        return sqrt(squared_stretch_bound(state.F));
}

/// A particle that may be stretched too far.
struct Stretched {
    double ratio;  ///< the bound of its stretch, divided by the largest stretch at which neighbours are joined
    std::uint32_t id;
    std::size_t slot;

    bool operator<(const Stretched& other) const { return ratio != other.ratio ? other.ratio < ratio : id < other.id; }
};
/// The particles with the largest ratios; these are the same whatever the order in which particles are added.
struct MostStretched {
    static constexpr std::size_t most = 64;
    std::vector<Stretched> all{};  ///< in descending order

    double least() const { return all.size() < most ? 1 : all.back().ratio; }  ///< smaller ratios are not kept
    void add(const Stretched& one) {
        if (all.size() == most && !(one < all.back())) return;
        all.insert(std::lower_bound(all.begin(), all.end(), one), one);
        if (all.size() > most) all.pop_back();
    }
};

/// The largest stretch at which the kernel joins particles of the volume V0 [m^D] at rest; computed once for particles
/// of equal volumes.
template <class Kernel, int D>
class JoinedStretch {
public:
    explicit JoinedStretch(double cell_size) : cell_size_(cell_size) {}
    double of(double volume) {
        if (volume != volume_) {
            volume_ = volume;
            stretch_ = volume > 0 ? joined_stretch<Kernel>(cell_size_ / std::pow(volume, 1.0 / D)) : INFINITY;
        }
        return stretch_;
    }

private:
    double cell_size_, volume_ = -1, stretch_ = 0;
};

/// Returns the particles of a set that are stretched most beyond what the kernel joins, and are not compressed.
template <class Kernel, class Set>
std::vector<Stretched> most_stretched(Set& set, double cell_size, int threads) {
    using S = typename Set::S;
    using P = native_pack<S>;
    constexpr int D = Set::dimension, lanes = scalar_traits<P>::lanes;
    using Lifted = with_scalar_t<decltype(Set::material), P>;
    using LiftedState = material_state_t<Lifted, D>;
    const auto lifted = lift<P>(set.material);
    const auto view = set.particles.view();
    std::vector<MostStretched> of_threads(std::size_t(threads), MostStretched{});
    const auto look = [&](std::size_t first, std::size_t last, MostStretched& most) {
        JoinedStretch<Kernel, D> joined(cell_size);
        for (std::size_t slot = first; slot < last; slot += std::size_t(lanes)) {
            const Slots slots{slot, nullptr};
            const P stretch = stretch_of(lifted, load_state<LiftedState>(view.state, slots));
            const P volume = view.volume.template load<P>(slots, 0);
            // What is below the least of those that are kept, with a margin for rounding, is not looked at further.
            const auto beyond = P(S(0.99999 * most.least() * joined.of(double(reduce_max(volume))))) < stretch;
            if (!any(beyond)) continue;
            const P pull = trace(load_symmetric<P, D>(view.stress, slots));
            if (!any(beyond & (P(0) < pull))) continue;
            for (int l = 0; l < lanes; ++l) {
                const std::size_t one = slot + std::size_t(l);
                if (!set.particles.is_particle(one) || !(lane_value(pull, l) > 0)) continue;
                const double ratio = double(lane_value(stretch, l)) / joined.of(double(lane_value(volume, l)));
                if (ratio > 1) most.add({ratio, set.particles.id(one), one});
            }
        }
    };
    parallel_for(
        set.particles.slots() / pack_size, threads,
        [&](std::size_t pack, int thread) {
            look(pack * pack_size, (pack + 1) * pack_size, of_threads[std::size_t(thread)]);
        },
        64);
    MostStretched most;
    for (const MostStretched& of_thread : of_threads)
        for (const Stretched& one : of_thread.all) most.add(one);
    return most.all;
}

/// A particle under tension, and the nearest particles before and behind it along the tension. Lengths in cells.
template <std::floating_point S, int D>
class Neighbours {
public:
    /// \param F  the elastic deformation gradient of the particle
    Neighbours(const ParticleStore<S, D>& particles, std::size_t slot, const Mat<S, D>& F, double cell_size)
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
    bool are_apart(const ParticleStore<S, D>& particles, const Partition& partition, const Domain<D>& domain,
                   double near) {
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

    bool is_apart_from(const ParticleStore<S, D>& particles, const BlockRange<D>& range, const Domain<D>& domain,
                       double near) {
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
template <class Kernel, class Set, int D>
[[gnu::cold]] std::string too_far_stretched(Set& set, const Domain<D>& domain, int threads) {
    using M = decltype(Set::material);
    const double h = domain.cell_size;
    constexpr int needed = 3;  // a single particle may be torn from a surface
    JoinedStretch<Kernel, D> joined(h);
    std::string text;
    int found = 0;
    for (const Stretched& one : most_stretched<Kernel>(set, h, threads)) {
        Neighbours<typename Set::S, D> neighbours(set.particles, one.slot, set.particles.state(one.slot).F, h);
        const double limit = joined.of(double(set.particles.volume(one.slot))), spacing = neighbours.spacing();
        if (!neighbours.is_pulled() || (is_elastic<M, D> && !(neighbours.stretch() > limit))) continue;
        if (!neighbours.are_apart(set.particles, set.partition, domain, 0.75 * limit * spacing)) continue;
        const double far = neighbours.distance() / spacing;
        if (!(far > (is_elastic<M, D> ? 0 : limit))) continue;
        if (++found == needed) return text;
        if (!text.empty()) continue;
        text = sentence("at particle ", one.id, " at ", point_text(set.particles.exact_position(one.slot).v, D),
                        " m, matter under tension is stretched ", is_elastic<M, D> ? neighbours.stretch() : far,
                        " times along ", point_text(neighbours.direction().v, D), ": particles that lay ", spacing,
                        " cells apart are joined up to ", limit,
                        " times by the kernel. It breaks there, whatever its material. Take more particles a cell (a "
                        "smaller spacing along the stretch is enough), or a wider kernel.");
    }
    return {};
}

/// Returns a sentence about matter of any set that is stretched too far, as above.
/// \param sets  a tuple of MaterialSet
template <class Kernel, class Sets, int D>
std::string too_far_stretched_of(Sets& sets, const Domain<D>& domain, int threads) {
    std::string text;
    const auto look = [&](auto& set) {
        using Set = std::remove_cvref_t<decltype(set)>;
        if constexpr (tells_stretch<decltype(Set::material), D>)
            if (text.empty()) text = too_far_stretched<Kernel>(set, domain, threads);
    };
    std::apply([&](auto&... set) { (look(set), ...); }, sets);
    return text;
}

}  // namespace firn::inline FIRN_BUILD::detail
