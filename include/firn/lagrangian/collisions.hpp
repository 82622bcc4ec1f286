/// \file Collisions of point masses with each other: balls that push each other apart, with restitution and friction.
///
/// Contacts are found once a step. Each is kept at both of its points, so that a point sums up what it feels by itself
/// and in the same order for any number of threads. What the two points of a contact feel are exact opposites in
/// floating point, too: formulas only change sign when the points are swapped. Momentum is conserved to the rounding of
/// the sums.
#pragma once

#include <firn/core/error.hpp>
#include <firn/data/random.hpp>
#include <firn/exec/parallel.hpp>
#include <firn/lagrangian/collision_grid.hpp>
#include <firn/lagrangian/excluded_pairs.hpp>
#include <firn/lagrangian/impact.hpp>
#include <firn/lagrangian/net.hpp>
#include <firn/lagrangian/point_masses.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace firn {

namespace detail {

/// A unit vector for two points in one place, from one to the other: by their ids, the opposite when they are swapped.
template <std::floating_point S, int D>
Vec<S, D> direction_of_ids(std::uint32_t from, std::uint32_t to) {
    const std::uint64_t seed = std::uint64_t(std::min(from, to)) << 32 | std::max(from, to);
    Vec<double, D> way{};
    for (std::uint64_t k = 0; !(dot(way, way) > 0.01 && dot(way, way) < 1); k += D)
        for (int a = 0; a < D; ++a) way[a] = 2 * unit_interval(random_bits(seed, k + std::uint64_t(a))) - 1;
    return cast<S>(way * ((from < to ? 1 : -1) / norm(way)));
}

}  // namespace detail

/// Two points collide when they are nearer than the sum of their radii, unless a radius is 0, both are of the same
/// group other than 0, or the pair is excluded.
///
/// Velocities: passes of impulses along the lines of centres, J = (u − v_n) / (w_i + w_j) wherever the points separate
/// at v_n < u, with inverse masses w and Coulomb friction of at most μ J. u is what restitution asks for: −e times v_n
/// before the passes where that was an approach, else 0. The impulses of a pass are found from the same velocities and
/// applied together (Jacobi), each divided by the larger number of contacts of its two points: a point then moves by
/// no more than a mean of what its contacts ask for, so that without restitution no pass adds energy. A contact of two
/// points that touch nothing else is resolved in the first pass. Others are approached, the nearer the more passes; all
/// contacts of a step act at the same time: a row of balls in contact is thrown apart by restitution as a whole, not
/// one after the other as balls a little apart would be.
///
/// Positions: passes of shifts, shared likewise by inverse masses and contacts, remove the overlaps. They change no
/// velocity.
template <std::floating_point S, int D>
class Collisions {
public:
    using V = Vec<S, D>;

    double restitution = 0;   ///< Newton's e, from 0 to 1 [1]
    double friction = 0;      ///< Coulomb's μ [1]
    int velocity_passes = 4;  ///< a step
    int shift_passes = 2;     ///< a step

    /// \throws parameter_error  unless 0 ≤ e ≤ 1, μ is finite and not negative, and the numbers of passes are not
    void check() const {
        check_restitution(restitution);
        if (!(friction >= 0) || !std::isfinite(S(friction)))
            throw parameter_error(sentence("The friction of collisions is ", friction,
                                           "; Coulomb's coefficient must be finite and not negative."));
        for (const int passes : {velocity_passes, shift_passes})
            if (passes < 0)
                throw parameter_error(
                    sentence("Collisions have ", passes, " passes a step; there must be none (0) or more."));
    }

    /// Pairs of places that shall not collide, besides those named before.
    void exclude(std::span<const std::array<std::uint32_t, 2>> pairs) { excluded_.add(pairs); }
    /// The ends of links. \param first  the place of what they call point 0
    void exclude(std::span<const Link> links, std::uint32_t first = 0) {
        std::vector<std::array<std::uint32_t, 2>> pairs;
        pairs.reserve(links.size());
        for (const Link& link : links) pairs.push_back({first + link.a, first + link.b});
        excluded_.add(pairs);
    }
    const std::vector<std::array<std::uint32_t, 2>>& excluded() const { return excluded_.pairs(); }
    /// When points have been taken out. \param new_place  as PointMasses::remove_if says
    void renumber(std::span<const std::uint32_t> new_place) { excluded_.renumber(new_place); }

    /// Once a step, when points have moved: finds contacts, velocities, shifts.
    /// \throws as find() and check()
    void apply(PointMasses<S, D>& points, int threads = 0) {
        find(points, threads);
        change_velocities(points, threads);
        shift(points, threads);
    }

    /// Finds the contacts, and the approach velocities that restitution goes by.
    /// \throws particle_error   naming points whose position or radius is not finite
    /// \throws parameter_error  as check(), and if an excluded pair names a point that is not there
    void find(const PointMasses<S, D>& points, int threads = 0) {
        check();
        excluded_.prepare(points.size());
        grid_.build(points, threads);
        const std::size_t n = grid_.size();
        chunks_.resize((n + chunk_size - 1) / chunk_size);
        for (auto* field : {&first_, &count_}) field->resize(n);
        for (auto* field : {&x_, &v_, &next_}) field->resize(n);
        w_.resize(n);
        group_.resize(n);
        const std::size_t counts[] = {chunks_.size(), chunks_.size(), chunks_.size()};
        parallel_phases(counts, thread_count(threads), [&](std::size_t phase, std::size_t chunk, int) {
            if (phase == 0)
                copy_points(chunk, points);
            else if (phase == 1)
                list_contacts(chunk);
            else
                describe_contacts(chunk, points);
        });
    }

    /// How many pairs are in contact.
    std::size_t contacts() const {
        std::size_t both_sides = 0;
        for (const Chunk& chunk : chunks_) both_sides += chunk.used;
        return both_sides / 2;
    }
    /// f(place, place of the other), for each contact from both sides.
    template <class F>
    void for_contacts(const F& f) const {
        for (std::size_t k = 0; k < grid_.size(); ++k)
            for (const PairContact& c : contacts_of(k)) f(grid_.place(k), grid_.place(c.other));
    }

    /// Pairs of points in contact act on each other. \param points  those that contacts were found of
    void change_velocities(PointMasses<S, D>& points, int threads = 0) {
        relax(points.velocity, v_, velocity_passes, thread_count(threads), [&](std::size_t k) {
            const V v = v_[k];
            const S mu = S(friction);
            V sum = V::zero();
            for (const PairContact& c : contacts_of(k)) {
                const V relative = v - v_[c.other];
                if (!(dot(relative, c.normal) < c.leaving)) continue;
                sum +=
                    (velocity_after_impact(relative, c.normal, Contact::separate, mu, c.leaving) - relative) * c.factor;
            }
            return v + sum * w_[k];
        });
    }

    /// Pairs of points that overlap move apart.
    void shift(PointMasses<S, D>& points, int threads = 0) {
        relax(points.position, x_, shift_passes, thread_count(threads), [&](std::size_t k) {
            const V x = x_[k];
            V sum = V::zero();
            for (const PairContact& c : contacts_of(k)) {
                const V apart = x - x_[c.other];
                const S square = dot(apart, apart), reach = grid_.radii()[k] + grid_.radii()[c.other];
                if (!(square < reach * reach)) continue;
                const S distance = std::sqrt(square);
                const V normal = square > least_square ? apart * (1 / distance) : c.normal;
                sum += normal * ((reach - distance) * c.factor);
            }
            return x + sum * w_[k];
        });
    }

    const CollisionGrid<S, D>& grid() const { return grid_; }
    /// What it holds in memory.
    std::size_t bytes() const {
        std::size_t sum = grid_.bytes() + (first_.capacity() + count_.capacity() + group_.capacity()) * 4 +
                          (x_.capacity() + v_.capacity() + next_.capacity()) * sizeof(V) + w_.capacity() * sizeof(S);
        for (const Chunk& chunk : chunks_)
            sum += chunk.contacts.capacity() * sizeof(PairContact) + chunk.near.capacity() * 4;
        return sum;
    }

private:
    /// As one of its points sees it.
    struct PairContact {
        V normal;             ///< of unit length, from the other
        S factor;             ///< 1 / ((w_i + w_j) · the larger number of contacts)
        S leaving;            ///< the speed of separation that restitution asks for [m/s]
        std::uint32_t other;  ///< its number in the grid's order
    };
    /// The contacts of consecutive points. Kept from step to step for its memory.
    struct Chunk {
        std::vector<PairContact> contacts;
        std::size_t used = 0;
        std::vector<std::uint32_t> near;  ///< room for the candidates of one point
    };
    static constexpr std::size_t chunk_size = 512;
    /// Below this distance squared [m²], as in direction_or_up, differences have no direction.
    static constexpr S least_square = S(1e-30);

    FIRN_INLINE std::span<const PairContact> contacts_of(std::size_t k) const {
        return {chunks_[k / chunk_size].contacts.data() + first_[k], count_[k]};
    }

    std::size_t end_of(std::size_t chunk) const { return std::min((chunk + 1) * chunk_size, grid_.size()); }

    void copy_points(std::size_t which, const PointMasses<S, D>& points) {
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k) {
            const std::uint32_t i = grid_.place(k);
            x_[k] = points.position[i];
            v_[k] = points.velocity[i];
            w_[k] = points.inverse_mass[i];
            group_[k] = points.group[i];
        }
    }

    void list_contacts(std::size_t which) {
        Chunk& chunk = chunks_[which];
        chunk.used = 0;
        const S* const r = grid_.radii();
        std::array<const S*, std::size_t(D)> x;
        for (int a = 0; a < D; ++a) x[std::size_t(a)] = grid_.coordinates(a);
        typename CollisionGrid<S, D>::Neighbours neighbours(grid_);
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k) {
            const auto& ranges = neighbours.of(k);
            std::size_t candidates = 0;
            for (const SortedRange& range : ranges) candidates += range.end - range.begin;
            if (chunk.near.size() < candidates + 1) chunk.near.resize(2 * candidates + 1);
            std::uint32_t* const near = chunk.near.data();
            std::size_t found = 0;
            V own;
            unroll<D>([&](auto a) FIRN_LAMBDA { own.v[a] = x[a][k]; });
            const S radius = r[k];
            for (const SortedRange& range : ranges)
                for (std::uint32_t j = range.begin; j < range.end; ++j) {
                    V apart;
                    unroll<D>([&](auto a) FIRN_LAMBDA { apart.v[a] = own.v[a] - x[a][j]; });
                    const S reach = radius + r[j];
                    near[found] = j;
                    found += dot(apart, apart) < reach * reach;
                }
            if (chunk.contacts.size() < chunk.used + found) chunk.contacts.resize(2 * (chunk.used + found));
            first_[k] = std::uint32_t(chunk.used);
            for (std::size_t f = 0; f < found; ++f) {
                if (near[f] == k || do_not_collide(k, near[f])) continue;
                chunk.contacts[chunk.used++].other = near[f];
            }
            count_[k] = std::uint32_t(chunk.used) - first_[k];
        }
    }

    FIRN_INLINE bool do_not_collide(std::size_t k, std::size_t j) const {
        return (group_[k] != 0 && group_[k] == group_[j]) ||
               (excluded_.any() && excluded_.contains(grid_.place(k), grid_.place(j)));
    }

    void describe_contacts(std::size_t which, const PointMasses<S, D>& points) {
        Chunk& chunk = chunks_[which];
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k)
            for (std::size_t c = first_[k]; c < first_[k] + count_[k]; ++c) {
                PairContact& contact = chunk.contacts[c];
                const std::size_t j = contact.other;
                const V apart = x_[k] - x_[j];
                const S square = dot(apart, apart);
                contact.normal = square > least_square ? apart * (1 / std::sqrt(square))
                                                       : detail::direction_of_ids<S, D>(points.id[grid_.place(j)],
                                                                                        points.id[grid_.place(k)]);
                const S w = w_[k] + w_[j];
                contact.factor = w > 0 ? 1 / (w * S(std::max(count_[k], count_[j]))) : S(0);
                contact.leaving = S(restitution) * std::max(-dot(v_[k] - v_[j], contact.normal), S(0));
            }
    }

    /// Passes in which every point in contact gets a value from those of the pass before: changed(k). Begins with the
    /// values of all points, in `field`, and leaves them there.
    template <class Changed>
    void relax(aligned_vector<V>& field, aligned_vector<V>& values, int passes, int threads, const Changed& changed) {
        const std::size_t n = grid_.size();
        if (passes == 0 || n == 0) return;
        const auto gather = [&](std::size_t k, int) { values[k] = field[grid_.place(k)]; };
        parallel_for(n, threads, gather, chunk_size);
        for (int pass = 0; pass < passes; ++pass) {
            const auto change = [&](std::size_t k, int) {
                next_[k] = count_[k] > 0 && w_[k] > 0 ? changed(k) : values[k];
            };
            parallel_for(n, threads, change, chunk_size);
            values.swap(next_);
        }
        const auto scatter = [&](std::size_t k, int) {
            if (count_[k] > 0 && w_[k] > 0) field[grid_.place(k)] = values[k];
        };
        parallel_for(n, threads, scatter, chunk_size);
    }

    ExcludedPairs excluded_;
    CollisionGrid<S, D> grid_;
    std::vector<Chunk> chunks_;
    aligned_vector<std::uint32_t> first_, count_;  ///< of a point's contacts in its chunk; in the grid's order, as all
    aligned_vector<std::uint32_t> group_;
    aligned_vector<V> x_, v_, next_;
    aligned_vector<S> w_;
};

}  // namespace firn
