/// \file Collisions of point masses with each other: balls that push each other apart, with restitution and friction.
///
/// Contacts are found once a step. Each is kept at both of its points, so that a point sums up what it feels by itself
/// and in the same order for any number of threads. What the two points of a contact feel are exact opposites in
/// floating point, too: formulas only change sign when the points are swapped. Momentum is conserved to the rounding of
/// the sums.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/pack.hpp>
#include <firn/data/random.hpp>
#include <firn/exec/parallel.hpp>
#include <firn/exec/transpose.hpp>
#include <firn/lagrangian/collision_grid.hpp>
#include <firn/lagrangian/excluded_pairs.hpp>
#include <firn/lagrangian/impact.hpp>
#include <firn/lagrangian/net.hpp>
#include <firn/lagrangian/point_masses.hpp>

#include <algorithm>
#include <array>
#include <bit>
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
        for (auto* field : {&first_, &count_, &group_}) field->resize(n);
        for (auto* field : {&x_, &v_, &next_}) field->resize(4 * n);
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
            for (std::size_t c = first_[k]; c < first_[k] + count_[k]; ++c)
                f(grid_.place(k), grid_.place(chunks_[k / chunk_size].others[c]));
    }

    /// Pairs of points in contact act on each other. \param points  those that contacts were found of
    void change_velocities(PointMasses<S, D>& points, int threads = 0) {
        const P mu = P(S(friction));
        relax(points.velocity, v_, velocity_passes, thread_count(threads),
              [&](const Block& block, const Seen& own, const Seen& other) FIRN_LAMBDA {
                  const PV relative = own.vector - other.vector, normal = block.vector(block.normal);
                  const P leaving = P::load(block.leaving);
                  const PV after = velocity_after_impact(relative, normal, Contact::separate, mu, leaving);
                  const P share = select(dot(relative, normal) < leaving, P::load(block.factor), P(0));
                  return (after - relative) * share;
              });
    }

    /// Pairs of points that overlap move apart.
    void shift(PointMasses<S, D>& points, int threads = 0) {
        relax(points.position, x_, shift_passes, thread_count(threads),
              [&](const Block& block, const Seen& own, const Seen& other) FIRN_LAMBDA {
                  const PV apart = own.vector - other.vector;
                  const P square = dot(apart, apart), reach = own.number + other.number;
                  const auto has_direction = P(least_square) < square;
                  const P distance = sqrt(square);
                  const PV normal = select(has_direction, apart * (P(1) / select(has_direction, distance, P(1))),
                                           block.vector(block.normal));
                  return normal * (max(reach - distance, P(0)) * P::load(block.factor));
              });
    }

    const CollisionGrid<S, D>& grid() const { return grid_; }
    /// What it holds in memory.
    std::size_t bytes() const {
        std::size_t sum = grid_.bytes() + (first_.capacity() + count_.capacity() + group_.capacity()) * 4 +
                          (x_.capacity() + v_.capacity() + next_.capacity()) * sizeof(S);
        for (const Chunk& chunk : chunks_)
            sum += chunk.blocks.capacity() * sizeof(Block) + (chunk.others.capacity() + chunk.near.capacity()) * 4;
        return sum;
    }

private:
    using P = native_pack<S>;
    using PV = Vec<P, D>;
    using Row = pack<S, 4>;
    static constexpr std::size_t lanes = std::size_t(scalar_traits<P>::lanes);

    /// As many contacts as there are lanes, each as one of its points sees it.
    struct alignas(64) Block {
        S normal[D][lanes];                      ///< of unit length, from the other
        S factor[lanes];                         ///< 1 / ((w_i + w_j) · the larger number of contacts)
        S leaving[lanes];                        ///< the speed of separation that restitution asks for [m/s]
        std::uint32_t own[lanes], other[lanes];  ///< points, in the grid's order; by contacts, not lanes

        FIRN_INLINE static PV vector(const S (&of)[D][lanes]) {
            PV r;
            unroll<D>([&](auto a) FIRN_LAMBDA { r.v[a] = P::load(of[a]); });
            return r;
        }
    };
    /// The contacts of consecutive points. Kept from step to step for its memory.
    struct Chunk {
        std::size_t used = 0;               ///< of others, which may hold more
        std::vector<std::uint32_t> others;  ///< in the grid's order
        aligned_vector<Block> blocks;
        std::vector<std::uint32_t> near;  ///< room for the candidates of one point
    };
    /// What contacts see of a point each: a vector and a number.
    struct Seen {
        PV vector;
        P number;
    };
    static constexpr std::size_t chunk_size = 256;
    /// Below this distance squared [m²], as in direction_or_up, differences have no direction.
    static constexpr S least_square = S(1e-30);

    std::size_t end_of(std::size_t chunk) const { return std::min((chunk + 1) * chunk_size, grid_.size()); }

    void copy_points(std::size_t which, const PointMasses<S, D>& points) {
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k) {
            const std::uint32_t i = grid_.place(k);
            unroll<D>([&](auto a) FIRN_LAMBDA {
                x_[4 * k + a] = points.position[i].v[a];
                v_[4 * k + a] = points.velocity[i].v[a];
            });
            x_[4 * k + D] = points.radius[i];
            v_[4 * k + D] = points.inverse_mass[i];
            if constexpr (D == 2) x_[4 * k + 3] = v_[4 * k + 3] = 0;
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
            PV own;
            unroll<D>([&](auto a) FIRN_LAMBDA { own.v[a] = P(x[a][k]); });
            const P radius(r[k]);
            for (const SortedRange& range : ranges)
                for (std::uint32_t j = range.begin; j < range.end; j += std::uint32_t(lanes)) {
                    PV apart;
                    unroll<D>([&](auto a) FIRN_LAMBDA { apart.v[a] = own.v[a] - P::load(x[a] + j); });
                    const P reach = radius + P::load(r + j);
                    std::uint32_t bits = lane_bits(dot(apart, apart) < reach * reach);
                    if (range.end - j < lanes) bits &= (1u << (range.end - j)) - 1;
                    for (; bits != 0; bits &= bits - 1) near[found++] = j + std::uint32_t(std::countr_zero(bits));
                }
            if (chunk.others.size() < chunk.used + found) chunk.others.resize(2 * (chunk.used + found));
            first_[k] = std::uint32_t(chunk.used);
            for (std::size_t f = 0; f < found; ++f) {
                if (near[f] == k || do_not_collide(k, near[f])) continue;
                chunk.others[chunk.used++] = near[f];
            }
            count_[k] = std::uint32_t(chunk.used) - first_[k];
        }
    }

    FIRN_INLINE bool do_not_collide(std::size_t k, std::size_t j) const {
        return (group_[k] != 0 && group_[k] == group_[j]) ||
               (excluded_.any() && excluded_.contains(grid_.place(k), grid_.place(j)));
    }

    /// A contact q of a block is seen in the lane l with quad_of_lane(l) = q.
    FIRN_INLINE static Seen load(const S* of_points, const std::uint32_t (&points)[lanes]) {
        alignas(64) S quads[4 * lanes];
        for (std::size_t q = 0; q < lanes; ++q) Row::load(of_points + 4 * std::size_t(points[q])).store(quads + 4 * q);
        P r[4];
        load_quads(quads, r);
        Seen seen;
        unroll<D>([&](auto a) FIRN_LAMBDA { seen.vector.v[a] = r[a]; });
        seen.number = r[D];
        return seen;
    }

    void describe_contacts(std::size_t which, const PointMasses<S, D>& points) {
        Chunk& chunk = chunks_[which];
        chunk.blocks.resize((chunk.used + lanes - 1) / lanes);
        if (chunk.used == 0) return;
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k)
            for (std::size_t c = first_[k]; c < first_[k] + count_[k]; ++c) {
                chunk.blocks[c / lanes].own[c % lanes] = std::uint32_t(k);
                chunk.blocks[c / lanes].other[c % lanes] = chunk.others[c];
            }
        for (std::size_t c = chunk.used; c < chunk.blocks.size() * lanes; ++c)  // a point with itself feels nothing
            chunk.blocks[c / lanes].own[c % lanes] = chunk.blocks[c / lanes].other[c % lanes] =
                std::uint32_t(which * chunk_size);
        for (Block& block : chunk.blocks) {
            S more[lanes];
            for (std::size_t l = 0; l < lanes; ++l) {
                const std::size_t q = std::size_t(quad_of_lane<P>(int(l)));
                more[l] = S(std::max({count_[block.own[q]], count_[block.other[q]], 1u}));
            }
            const Seen x = load(x_.data(), block.own), x_other = load(x_.data(), block.other);
            const PV apart = x.vector - x_other.vector;
            const P square = dot(apart, apart);
            const auto has_direction = P(least_square) < square;
            const P inverse = select(has_direction, P(1) / sqrt(select(has_direction, square, P(1))), P(0));
            PV normal = apart * inverse;
            if (any(!has_direction)) {
                for (std::size_t l = 0; l < lanes; ++l) {
                    const std::size_t q = std::size_t(quad_of_lane<P>(int(l)));
                    if (has_direction[int(l)] || block.own[q] == block.other[q]) continue;
                    const V way = detail::direction_of_ids<S, D>(points.id[grid_.place(block.other[q])],
                                                                 points.id[grid_.place(block.own[q])]);
                    for (int a = 0; a < D; ++a) normal[a].set(int(l), way[a]);
                }
            }
            const Seen v = load(v_.data(), block.own), v_other = load(v_.data(), block.other);
            const P w = v.number + v_other.number;
            unroll<D>([&](auto a) FIRN_LAMBDA { normal.v[a].store(block.normal[a]); });
            select(P(0) < w, P(1) / select(P(0) < w, w * P::load(more), P(1)), P(0)).store(block.factor);
            (P(S(restitution)) * max(-dot(v.vector - v_other.vector, normal), P(0))).store(block.leaving);
        }
    }

    /// Passes in which every point in contact gets the sum of act(block, own, other) over its contacts, times its
    /// inverse mass, all from the values of the pass before. Begins with the values of all points, in `field`, and
    /// leaves them there. \param values  a vector and a number, a quad for each point
    template <class Act>
    void relax(aligned_vector<V>& field, aligned_vector<S>& values, int passes, int threads, const Act& act) {
        if (passes == 0 || grid_.size() == 0) return;
        felt_.resize(std::max(felt_.size(), std::size_t(threads)));
        // Gathering, the passes, and putting back.
        phases_.assign(std::size_t(passes) + 2, chunks_.size());
        parallel_phases(phases_, threads, [&](std::size_t phase, std::size_t which, int thread) {
            const std::size_t first = which * chunk_size, end = end_of(which);
            S* const now = phase % 2 == 1 ? values.data() : next_.data();
            S* const next = phase % 2 == 1 ? next_.data() : values.data();
            if (phase == 0)
                for (std::size_t k = first; k < end; ++k) {
                    const V& value = field[grid_.place(k)];
                    unroll<D>([&](auto a) FIRN_LAMBDA { next[4 * k + a] = value.v[a]; });
                }
            else if (phase <= std::size_t(passes))
                pass(which, now, next, felt_[std::size_t(thread)], act);
            else
                for (std::size_t k = first; k < end; ++k)
                    if (count_[k] > 0 && v_[4 * k + D] > 0)
                        unroll<D>([&](auto a) FIRN_LAMBDA { field[grid_.place(k)].v[a] = now[4 * k + a]; });
        });
    }

    template <class Act>
    FIRN_INLINE void pass(std::size_t which, const S* now, S* next, aligned_vector<S>& felt, const Act& act) {
        const Chunk& chunk = chunks_[which];
        if (felt.size() < 4 * lanes * chunk.blocks.size()) felt.resize(8 * lanes * chunk.blocks.size());
        for (std::size_t b = 0; b < chunk.blocks.size(); ++b) {
            const Block& block = chunk.blocks[b];
            const PV of_contact = act(block, load(now, block.own), load(now, block.other));
            P r[4]{P(0), P(0), P(0), P(0)};
            unroll<D>([&](auto a) FIRN_LAMBDA { r[a] = of_contact.v[a]; });
            store_quads(r, felt.data() + 4 * lanes * b);
        }
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k) {
            Row sum(0);
            for (const S *f = felt.data() + 4 * first_[k], *last = f + 4 * count_[k]; f < last; f += 4)
                sum += Row::load(f);
            (Row::load(now + 4 * k) + sum * Row(v_[4 * k + D])).store(next + 4 * k);
        }
    }

    ExcludedPairs excluded_;
    CollisionGrid<S, D> grid_;
    std::vector<Chunk> chunks_;
    aligned_vector<std::uint32_t> first_, count_;  ///< of a point's contacts in its chunk; in the grid's order, as all
    aligned_vector<std::uint32_t> group_;
    aligned_vector<S> x_, v_, next_;  ///< quads: position and radius, velocity and inverse mass, those of a pass
    std::vector<std::size_t> phases_;
    std::vector<aligned_vector<S>> felt_;  ///< by a thread: quads, what the contacts of a chunk do
};

}  // namespace firn
