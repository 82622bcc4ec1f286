/// \file Collisions of point masses with each other, with restitution and friction.
///
/// Contacts are found once per step. A contact is stored twice, once for each of its two points. So the impulses on a
/// point can be summed over the contacts stored for this point, in the same order for any number of threads. The
/// impulses on the two points of a contact are computed separately and are exact opposites in floating point, because
/// swapping the two points only changes the sign of each formula. Momentum is conserved up to the rounding errors of
/// the sums.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/random.hpp>
#include <firn/lagrangian/collision_grid.hpp>
#include <firn/lagrangian/contact_table.hpp>
#include <firn/lagrangian/excluded_pairs.hpp>
#include <firn/lagrangian/impact.hpp>
#include <firn/lagrangian/net.hpp>
#include <firn/lagrangian/point_masses.hpp>
#include <firn/lagrangian/surface_contact.hpp>
#include <firn/simd/transpose.hpp>
#include <firn/stage/grid_update.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the unit normal of the contact between two points that are at the same position. The direction of this
/// vector is pseudo-random and depends only on the ids of the two points. If the two ids are swapped, the sign of the
/// vector changes.
template <std::floating_point S, int D>
Vec<S, D> direction_of_ids(std::uint32_t from, std::uint32_t to) {
    const std::uint64_t seed = std::uint64_t(std::min(from, to)) << 32 | std::max(from, to);
    Vec<double, D> way{};
    for (std::uint64_t k = 0; !(dot(way, way) > 0.01 && dot(way, way) < 1); k += D)
        for (int a = 0; a < D; ++a) way[a] = 2 * unit_interval(random_bits(seed, k + std::uint64_t(a))) - 1;
    return cast<S>(way * ((from < to ? 1 : -1) / norm(way)));
}

}  // namespace detail

/// Resolves collisions of points with each other, and with the surfaces of a boundary.
///
/// Two points collide if their distance is below the sum of their radii. They do not collide if one of the radii is 0,
/// if both points belong to the same group other than group 0, or if the pair is excluded; see exclude().
///
/// Velocities. Each contact has an impulse J, which is computed in several passes. Let v be the relative velocity that
/// the two points would have without J. The target of J is the impulse that changes v to the result of
/// velocity_after_impact(): the points then separate with at least the speed u, and friction is at most μ times the
/// normal part of the impulse. Here u is the speed of rebound() after the approach before the first pass, which is the
/// coefficient of restitution e times the speed of approach, or 0 if the points were not approaching or rest on each
/// other; μ is Coulomb's coefficient of friction. Each pass changes J by
/// the fraction 1/n of the difference between J and its target. To get n, count the contacts of each of the two points;
/// n is the larger count. All contacts are updated at the same time (Jacobi iteration). Because of the factor 1/n, the
/// velocity of a point never changes by more than the mean of the changes that its contacts would cause one by one. For
/// two points without other contacts, the first pass is exact; otherwise the impulses converge.
///
/// The first pass starts from the impulses at the end of the last step. If the impulse of a contact was smaller in the
/// step before the last one, the smaller size is used. So the impulse of an impact, which lasts one step, is not
/// repeated, but an impulse that supports a weight is kept. This is why piles come to rest with few passes.
///
/// All contacts of a step act at the same time. So if a ball hits a row of balls that touch each other, restitution
/// drives all balls of the row apart at once. If there were small gaps between the balls, they would collide one after
/// the other.
///
/// Points that rebound have passed each other by a part of their last step before the contact is found. They are moved
/// to where they would be if J had acted when they met.
///
/// Positions. Further passes shift overlapping points apart until the overlap is at most contact_slack times the sum of
/// the two radii. The two points of a contact are shifted in proportion to their inverse masses; each pass applies the
/// fraction 1/n of the shift that is still needed. Shifts do not change velocities.
template <std::floating_point S, int D>
class Collisions {
public:
    using V = Vec<S, D>;  ///< A vector in space.

    double restitution = 0;   ///< Newton's coefficient of restitution e, from 0 to 1 [1].
    double friction = 0;      ///< Coulomb's coefficient of friction μ [1].
    int velocity_passes = 4;  ///< Number of passes per step that change velocities.
    int shift_passes = 2;     ///< Number of passes per step that shift positions.
    bool remember = true;     ///< true: start from the impulses of the last step; false: start from zero.

    /// Checks the parameters above.
    /// \throws parameter_error  unless restitution is from 0 to 1, friction is finite and not negative, and
    ///                          velocity_passes and shift_passes are not negative
    void check() const {
        check_restitution(restitution);
        if (!(friction >= 0) || !std::isfinite(S(friction)))
            throw parameter_error(sentence("The friction of collisions is ", friction,
                                           "; Coulomb's coefficient must be finite and not negative."));
        for (const int passes : {velocity_passes, shift_passes})
            if (passes < 0)
                throw parameter_error(sentence("Collisions have ", passes, " passes per step; give 0 or more."));
    }

    /// Excludes pairs of points from collisions, in addition to pairs excluded earlier.
    /// \param pairs  the indices (into PointMasses) of the two points of each pair
    void exclude(std::span<const std::array<std::uint32_t, 2>> pairs) { excluded_.add(pairs); }
    /// Excludes collisions between the two end points of each link, in addition to pairs excluded earlier.
    /// \param links  links of a net
    /// \param first  the index of the net's first point in the system, as ParticleSystem::add returned it
    void exclude(std::span<const Link> links, std::uint32_t first = 0) {
        std::vector<std::array<std::uint32_t, 2>> pairs;
        pairs.reserve(links.size());
        for (const Link& link : links) pairs.push_back({first + link.a, first + link.b});
        excluded_.add(pairs);
    }
    /// Returns all excluded pairs, as indices into PointMasses.
    const std::vector<std::array<std::uint32_t, 2>>& excluded() const { return excluded_.pairs(); }
    /// Updates the point indices of the excluded pairs. Call renumber() after points are removed.
    /// \param new_place  the list that PointMasses::remove_if returned: the new index for each old one
    /// \throws parameter_error  if a pair names a point without an entry in new_place
    void renumber(std::span<const std::uint32_t> new_place) { excluded_.renumber(new_place); }

    /// Applies the collisions of points with each other: finds contacts, changes velocities and shifts positions. Call
    /// apply() once per step, after points have moved.
    /// \param points   the points, changed in place
    /// \param threads  number of threads; 0: the number that thread_count() returns
    /// \throws parameter_error, particle_error  if find() throws it
    void apply(PointMasses<S, D>& points, int threads = 0) { apply(points, NoBoundary{}, 0, threads); }
    /// Applies the collisions of points with each other and with the surfaces of a boundary: finds contacts, changes
    /// velocities and shifts positions. Call apply() once per step, after points have moved. Contacts with surfaces
    /// that have Contact::separate take part in the passes, so that piles can rest on these surfaces. Finally,
    /// meet_surfaces() applies the contact with all surfaces.
    /// \param points                   the points, changed in place
    /// \param boundary                 a boundary with scalar type S and a member function surfaces(), see has_surfaces
    /// \param restitution_of_surfaces  Newton's coefficient of restitution between points and surfaces, from 0 to 1 [1]
    /// \param threads                  number of threads; 0: the number that thread_count() returns
    /// \throws parameter_error, particle_error  if find() or meet_surfaces() throws it
    template <class B>
    void apply(PointMasses<S, D>& points, const B& boundary, double restitution_of_surfaces, int threads = 0) {
        find(points, boundary, restitution_of_surfaces, threads);
        change_velocities(points, threads);
        shift(points, threads);
        if constexpr (!std::same_as<B, NoBoundary>) meet_surfaces(points, boundary, restitution_of_surfaces, threads);
    }

    /// Finds the contacts between points, and the speed at which the two points of each contact approach each other.
    /// \param points   the points; they do not change
    /// \param threads  number of threads; 0: the number that thread_count() returns
    /// \throws particle_error   if a position or radius is not finite, if a radius is negative, or if there are
    ///                          ContactTable::most_points or more points
    /// \throws parameter_error  if check() throws it, or if an excluded pair names a point that does not exist
    void find(const PointMasses<S, D>& points, int threads = 0) { find(points, NoBoundary{}, 0, threads); }
    /// Finds the contacts of points with each other and with the surfaces of a boundary, and the speed of approach at
    /// each contact. Surfaces with a Contact other than Contact::separate are ignored.
    /// \param points                   the points; they do not change
    /// \param boundary                 a boundary with scalar type S and a member function surfaces(), see has_surfaces
    /// \param restitution_of_surfaces  Newton's coefficient of restitution between points and surfaces, from 0 to 1 [1]
    /// \param threads                  number of threads; 0: the number that thread_count() returns
    /// \param approach                 how the points have come to their positions; by default not known: points that
    ///                                 rebound are then not moved for it
    /// \throws particle_error   if a position or radius is not finite, if a radius is negative, or if there are
    ///                          ContactTable::most_points or more points
    /// \throws parameter_error  if check() or check_distances() throws it, if an excluded pair names a point that does
    ///                          not exist, or if restitution_of_surfaces is not from 0 to 1
    template <class B, class Acceleration = NoAcceleration<S, D>>
    void find(const PointMasses<S, D>& points, const B& boundary, double restitution_of_surfaces, int threads = 0,
              const Approach<Acceleration>& approach = {}) {
        check();
        check_restitution(restitution_of_surfaces);
        check_distances(points, boundary);
        threads = thread_count(threads);
        excluded_.prepare(points.size());
        grid_.build(points, threads);
        std::swap(table_, before_);
        detail::with_surfaces<S, D>(boundary,
                                    [&](const auto& see) { table_.find(grid_, points, excluded_, see, threads); });
        begun_ = false;
        rebounds_ = approach.is_known() && std::max(restitution, restitution_of_surfaces) > 0;
        const std::size_t all = grid_.size() + table_.surface_count();
        for (auto* field : {&x_, &v_, &next_}) renew(*field, 4 * all, threads);
        if (rebounds_) renew(a_, 4 * all, threads);
        renew(w_, grid_.size(), threads);
        blocks_.resize(table_.chunks.size());
        asides_.resize(table_.chunks.size());
        phases_.assign(2, blocks_.size());
        felt_.resize(std::max(felt_.size(), std::size_t(threads)));
        const Times times{S(restitution_of_surfaces), S(approach.lag), S(approach.step)};
        parallel_phases(phases_, threads, [&](std::size_t phase, std::size_t which, int thread) {
            if (phase == 0)
                copy_points(which, points, approach.acceleration);
            else if (rebounds_)
                describe_contacts<true>(which, times, felt_[std::size_t(thread)]);
            else
                describe_contacts<false>(which, times, felt_[std::size_t(thread)]);
        });
    }

    /// Returns the number of contacts between two points. Contacts with surfaces are not counted.
    std::size_t contacts() const {
        std::size_t both_sides = 0;
        for (const auto& chunk : table_.chunks) both_sides += chunk.used - chunk.surfaces.size();
        return both_sides / 2;
    }
    /// Calls f(i, j) and f(j, i) for each contact of two points, where i and j are the indices (into PointMasses) of
    /// the two points. Call for_contacts() after find() and before points are removed.
    template <class F>
    void for_contacts(const F& f) const {
        for (std::size_t k = 0; k < grid_.size(); ++k)
            for (std::size_t c = table_.first[k]; c < table_.first[k] + table_.count[k]; ++c)
                if (const std::uint32_t other = table_.chunks[k / chunk_size].others[c]; !Table::is_surface(other))
                    f(grid_.place(k), grid_.place(other));
    }

    /// Changes the velocities of points in contact, and moves points that rebound to where they would be if their
    /// velocities had changed when they met. Call find() first.
    /// \param points   the points that were passed to find()
    /// \param threads  number of threads; 0: the number that thread_count() returns
    void change_velocities(PointMasses<S, D>& points, int threads = 0) {
        if (velocity_passes == 0) return;
        threads = thread_count(threads);
        const auto begin = [](Block& block, const Aside&, const Seen&, const Seen&)
                               FIRN_LAMBDA { return block.vector(block.impulse) * P::load(block.mass); };
        const auto improve = [](Block& block, const Aside&, const Seen& own, const Seen& other) FIRN_LAMBDA {
            const PV normal = block.vector(block.normal), impulse = block.vector(block.impulse);
            const PV without = own.vector - other.vector - impulse;
            const P leaving = P::load(block.leaving);
            const PV with = velocity_after_impact(without, normal, Contact::separate, P::load(block.friction), leaving);
            const PV wanted = select(dot(without, normal) < leaving, with - without, PV::zero());
            const PV change = (wanted - impulse) * P::load(block.share);
            unroll<D>([&](auto a) FIRN_LAMBDA { (impulse.v[a] + change.v[a]).store(block.impulse[a]); });
            return change * P::load(block.mass);
        };
        gather(v_, threads, [&](std::size_t k) FIRN_LAMBDA { return points.velocity[grid_.place(k)]; });
        if (!begun_ && before_.has_kept && remember) relax(v_, 1, threads, begin);
        relax(v_, velocity_passes, threads, improve);
        for_touching(threads, [&](std::size_t k, std::uint32_t i) FIRN_LAMBDA {
            unroll<D>([&](auto a) FIRN_LAMBDA { points.velocity[i].v[a] = v_[4 * k + a]; });
        });
        if (rebounds_) {
            gather(x_, threads, [](std::size_t) FIRN_LAMBDA { return V::zero(); });
            relax(x_, 1, threads, [](Block& block, const Aside& aside, const Seen&, const Seen&) FIRN_LAMBDA {
                return block.vector(block.impulse) * (P::load(block.mass) * P::load(aside.since));
            });
            for_touching(threads, [&](std::size_t k, std::uint32_t i) FIRN_LAMBDA {
                unroll<D>([&](auto a) FIRN_LAMBDA { points.position[i].v[a] += double(x_[4 * k + a]); });
            });
        }
        parallel_for(blocks_.size(), threads, [&](std::size_t which, int) { keep(which); });
        begun_ = table_.has_kept = true;
    }

    /// Returns the impulses of all contacts in the last step, sorted by the ids of the points. The next step starts
    /// from these impulses. Returns std::nullopt if there was no step yet, or if velocity_passes is 0.
    std::optional<std::vector<KeptImpulse<S, D>>> kept() const {
        if (!table_.has_kept) return {};
        return table_.kept();
    }
    /// Makes the next step start from the kept impulses of another run.
    /// \param kept  the impulses that kept() returned in the other run
    /// \throws parameter_error  if ContactTable::resume throws it; this object has not changed then
    void resume(const std::optional<std::vector<KeptImpulse<S, D>>>& kept) {
        Table resumed;
        if (kept) resumed.resume(*kept);
        table_ = std::move(resumed);
    }

    /// Moves overlapping points apart. Velocities do not change. Call find() first.
    /// \param points   the points that were passed to find()
    /// \param threads  number of threads; 0: the number that thread_count() returns
    void shift(PointMasses<S, D>& points, int threads = 0) {
        if (shift_passes == 0) return;
        threads = thread_count(threads);
        gather(
            x_, threads,
            [&](std::size_t k) FIRN_LAMBDA { return cast<S>(points.position[grid_.place(k)] - grid_.position(k)); },
            [&](std::size_t k) FIRN_LAMBDA { return grid_.radii()[k]; });
        const auto part = [](Block& block, const Aside& aside, const Seen& own, const Seen& other) FIRN_LAMBDA {
            const PV apart = block.vector(block.normal) * P::load(aside.distance) + (own.vector - other.vector);
            const P square = dot(apart, apart), reach = own.number + other.number;
            const auto has_direction = P(least_square) < square;
            const P distance = sqrt(square);
            const PV normal = select(has_direction, apart * (P(1) / select(has_direction, distance, P(1))),
                                     block.vector(block.normal));
            return normal *
                   (max(reach * P(1 - contact_slack) - distance, P(0)) * P::load(block.share) * P::load(block.mass));
        };
        relax(x_, shift_passes, threads, part);
        for_touching(threads, [&](std::size_t k, std::uint32_t i) FIRN_LAMBDA {
            const auto x = grid_.position(k);
            unroll<D>([&](auto a) FIRN_LAMBDA { points.position[i].v[a] = x.v[a] + double(x_[4 * k + a]); });
        });
    }

    /// Returns the grid in which find() sorted the points.
    const CollisionGrid<S, D>& grid() const { return grid_; }
    /// Returns the size of the allocated memory [bytes].
    std::size_t bytes() const {
        std::size_t sum =
            grid_.bytes() + table_.bytes() + before_.bytes() +
            (x_.capacity() + v_.capacity() + a_.capacity() + next_.capacity() + w_.capacity()) * sizeof(S);
        for (const auto& blocks : blocks_) sum += blocks.capacity() * sizeof(Block);
        for (const auto& asides : asides_) sum += asides.capacity() * sizeof(Aside);
        return sum;
    }

private:
    using P = native_pack<S>;
    using PV = Vec<P, D>;
    using Row = pack<S, 4>;
    using Table = detail::ContactTable<S, D>;
    static constexpr std::size_t lanes = std::size_t(scalar_traits<P>::lanes);
    static constexpr std::size_t chunk_size = Table::chunk_size;
    /// If the squared distance of two points is less [m²], direction_of_ids() gives the normal of the contact.
    static constexpr S least_square = S(detail::least_square);

    /// The data of several contacts, one per SIMD lane. Of the two points of a contact, `own` is the point that the
    /// impulse acts on, and `other` is the point that `own` collides with. The contact with index q in the block is in
    /// the lane l for which quad_of_lane(l) is q.
    struct alignas(64) Block {
        S normal[D][lanes];   ///< unit vector towards `own`, from `other`
        S impulse[D][lanes];  ///< change of the relative velocity: impulse times sum of inverse masses [m/s]
        S share[lanes];       ///< 1/n; n: number of contacts of `own` or of `other`, whichever is larger
        S mass[lanes];        ///< 1 / (sum of the two inverse masses), or 0 if both points are pinned [kg]
        S leaving[lanes];     ///< normal speed after the collision [m/s]; see rebound()
        S friction[lanes];    ///< Coulomb's coefficient of friction [1]
        /// own[q] and other[q] are the ranks of the two points of the contact with index q. (A rank is an index in the
        /// sorted order of grid_.) The index q differs from the lane l.
        std::uint32_t own[lanes], other[lanes];

        FIRN_INLINE static PV vector(const S (&of)[D][lanes]) {
            PV r;
            unroll<D>([&](auto a) FIRN_LAMBDA { r.v[a] = P::load(of[a]); });
            return r;
        }
    };
    /// The data of a Block's contacts that the passes over velocities do not use.
    struct alignas(64) Aside {
        S last[lanes];      ///< length of Block::impulse at the end of the previous step [m/s]
        S distance[lanes];  ///< distance of the two points when the contact was found; 0 for a surface [m]
        S since[lanes];     ///< time since the impact, for which points are moved [s]; only if rebounds_
    };
    /// The values of several points, one point per SIMD lane. `vector` and `number` are the velocity and the inverse
    /// mass, or the displacement since find() and the radius.
    struct Seen {
        PV vector;
        P number;
    };

    /// What the description of contacts needs to know of the step.
    struct Times {
        S restitution_of_surfaces;
        S lag, step;  // see Approach
    };

    std::size_t end_of(std::size_t chunk) const { return std::min((chunk + 1) * chunk_size, grid_.size()); }

    FIRN_INLINE static void set_quad(S* to, const V& vector, S number) {
        for (int a = 0; a < 4; ++a) to[a] = a < D ? vector[a < D ? a : 0] : a == D ? number : S(0);
    }

    /// Copies the velocities of the points of the chunk with index `which` to v_, as quads (groups of four numbers),
    /// and the accelerations to a_ if they are needed. The surfaces that these points touch are stored after the quads
    /// of all points, as if they were pinned points. The radius stored for a surface is a huge negative number, so that
    /// shift() ignores the surface.
    template <class Acceleration>
    void copy_points(std::size_t which, const PointMasses<S, D>& points, const Acceleration& acceleration) {
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k) {
            const std::uint32_t i = grid_.place(k);
            w_[k] = points.inverse_mass[i];
            set_quad(v_.data() + 4 * k, points.velocity[i], w_[k]);
            if (rebounds_) set_quad(a_.data() + 4 * k, w_[k] > 0 ? acceleration(i) : V::zero(), S(0));
        }
        const auto& chunk = table_.chunks[which];
        for (std::size_t s = 0; s < chunk.surfaces.size(); ++s) {
            const std::size_t at = 4 * (grid_.size() + chunk.surfaces_before + s);
            set_quad(x_.data() + at, V::zero(), -std::numeric_limits<S>::max() / 4);
            set_quad(v_.data() + at, chunk.surfaces[s].velocity, S(0));
            if (rebounds_) set_quad(a_.data() + at, V::zero(), S(0));
        }
    }

    FIRN_INLINE static Seen load(const S* of_points, const std::uint32_t (&points)[lanes]) {
        P r[4];
        load_quads_of(of_points, [&](int l) FIRN_LAMBDA { return points[quad_of_lane<P>(l)]; }, r);
        Seen seen;
        unroll<D>([&](auto a) FIRN_LAMBDA { seen.vector.v[a] = r[a]; });
        seen.number = r[D];
        return seen;
    }

    template <bool Rebounds>
    void describe_contacts(std::size_t which, const Times& times, aligned_vector<S>& scratch) {
        auto& chunk = table_.chunks[which];
        auto& blocks = blocks_[which];
        blocks.resize((chunk.used + lanes - 1) / lanes);
        asides_[which].resize(blocks.size());
        if (chunk.used == 0) return;
        if (scratch.size() < 4 * lanes * blocks.size()) scratch.resize(8 * lanes * blocks.size());
        const bool begins = before_.has_kept && remember;
        auto surface = std::uint32_t(grid_.size() + chunk.surfaces_before);
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k) {
            if (table_.count[k] == 0) continue;
            const std::uint32_t rank = begins ? before_.rank_of(grid_.place(k), table_.names[k].id) : Table::none;
            for (std::size_t c = table_.first[k], last = c + table_.count[k]; c < last; ++c) {
                blocks[c / lanes].own[c % lanes] = std::uint32_t(k);
                blocks[c / lanes].other[c % lanes] = Table::is_surface(chunk.others[c]) ? surface++ : chunk.others[c];
                const S* const kept = before_.kept_of(rank, chunk.ids[c]);
                (kept ? Row::load(kept) : Row(0)).store(scratch.data() + 4 * c);
            }
        }
        for (std::size_t c = chunk.used; c < lanes * blocks.size(); ++c) {  // unused lanes get contacts without effect
            blocks[c / lanes].own[c % lanes] = blocks[c / lanes].other[c % lanes] = std::uint32_t(which * chunk_size);
            Row(0).store(scratch.data() + 4 * c);
            Row(0).store(chunk.apart.data() + 4 * c);
        }
        for (std::size_t b = 0; b < blocks.size(); ++b)
            describe<Rebounds>(blocks[b], asides_[which][b], chunk, chunk.apart.data() + 4 * lanes * b,
                               scratch.data() + 4 * lanes * b, times);
    }

    FIRN_INLINE static PV vector_of_quads(const S* quads) {
        P r[4];
        load_quads(quads, r);
        PV vector;
        unroll<D>([&](auto a) FIRN_LAMBDA { vector.v[a] = r[a]; });
        return vector;
    }

    template <bool Rebounds>
    FIRN_INLINE void describe(Block& block, Aside& aside, const typename Table::Chunk& chunk, const S* quads_apart,
                              const S* kept, const Times& times) {
        const std::size_t n = grid_.size();
        const Seen v = load(v_.data(), block.own), v_other = load(v_.data(), block.other);
        const PV apart = vector_of_quads(quads_apart);
        const P square = dot(apart, apart);
        const auto has_direction = P(least_square) < square;
        const P distance = sqrt(select(has_direction, square, P(0)));
        PV normal = apart * select(has_direction, P(1) / select(has_direction, distance, P(1)), P(0));
        P e = P(S(restitution)), mu = P(S(friction)), overlap = P(0);
        alignas(64) S more[lanes];
        bool of_surfaces = false;
        for (std::size_t l = 0; l < lanes; ++l) {
            const std::size_t q = std::size_t(quad_of_lane<P>(int(l)));
            const std::uint32_t other = block.other[q];
            of_surfaces = of_surfaces || other >= n;
            more[l] = S(std::max({1u, table_.count[block.own[q]], other < n ? table_.count[other] : 0}));
            if constexpr (Rebounds)
                overlap.set(int(l), other < n ? grid_.radii()[block.own[q]] + grid_.radii()[other] : S(0));
        }
        overlap -= distance;
        if (of_surfaces || any(!has_direction)) {
            for (std::size_t l = 0; l < lanes; ++l) {
                const std::size_t q = std::size_t(quad_of_lane<P>(int(l)));
                const std::uint32_t own = block.own[q], other = block.other[q];
                V way;
                if (other >= n) {
                    const auto& surface = chunk.surfaces[other - n - chunk.surfaces_before];
                    way = surface.normal;
                    e.set(int(l), times.restitution_of_surfaces);
                    mu.set(int(l), surface.friction);
                    overlap.set(int(l), surface.overlap);
                } else if (has_direction[int(l)] || own == other) {
                    continue;
                } else {
                    way = detail::direction_of_ids<S, D>(table_.names[other].id, table_.names[own].id);
                }
                for (int a = 0; a < D; ++a) normal[a].set(int(l), way[a]);
            }
        }
        const P w = v.number + v_other.number;
        P r[4];
        load_quads(kept, r);
        PV impulse;
        unroll<D>([&](auto a) FIRN_LAMBDA { impulse.v[a] = r[a]; });
        const P length = norm(impulse);
        const P kept_part = select(r[D] < length, r[D] / max(length, P(std::numeric_limits<S>::min())), P(1));
        unroll<D>([&](auto a) FIRN_LAMBDA {
            normal.v[a].store(block.normal[a]);
            (impulse.v[a] * kept_part).store(block.impulse[a]);
        });
        length.store(aside.last);
        (P(1) / P::load(more)).store(block.share);
        select(P(0) < w, P(1) / select(P(0) < w, w, P(1)), P(0)).store(block.mass);
        distance.store(aside.distance);
        const P rate = dot(v.vector - v_other.vector, normal);
        if constexpr (Rebounds) {
            const PV a = load(a_.data(), block.own).vector, a_other = load(a_.data(), block.other).vector;
            const Rebound<P> after =
                rebound(max(overlap, P(0)), rate, dot(a - a_other, normal), P(times.lag), P(times.step), e);
            // A point that others support falls towards them with its whole acceleration in every step, and rests.
            const P of_a_step = P(std::max(times.step, 2 * std::abs(times.lag)));
            const auto comes = rate < -sqrt(max(dot(a, a), dot(a_other, a_other))) * of_a_step;
            select(comes, after.leaving, P(0)).store(block.leaving);
            select(comes, after.since, P(0)).store(aside.since);
        } else {
            (e * max(-rate, P(0))).store(block.leaving);
        }
        mu.store(block.friction);
    }

    /// Stores the impulses of the contacts of the chunk with index `which` in Chunk::kept, for the next step. Stores
    /// with each impulse the length that the impulse had one step earlier.
    void keep(std::size_t which) {
        auto& chunk = table_.chunks[which];
        const auto& blocks = blocks_[which];
        chunk.kept.resize(4 * lanes * blocks.size());
        for (std::size_t b = 0; b < blocks.size(); ++b) {
            P r[4]{P(0), P(0), P(0), P(0)};
            unroll<D>([&](auto a) FIRN_LAMBDA { r[a] = P::load(blocks[b].impulse[a]); });
            r[D] = P::load(asides_[which][b].last);
            store_quads(r, chunk.kept.data() + 4 * lanes * b);
        }
    }

    /// Fills quads of all sorted points.
    /// \param vector  vector(k) returns the first D numbers of the quad of the point of rank k
    /// \param number  number(k) returns the next number; without it, this number does not change
    template <class Vector, class... Number>
    void gather(aligned_vector<S>& values, int threads, const Vector& vector, const Number&... number) {
        const auto copy = [&](std::size_t k, int) FIRN_LAMBDA {
            const V value = vector(k);
            unroll<D>([&](auto a) FIRN_LAMBDA { values[4 * k + a] = value.v[a]; });
            ((values[4 * k + D] = number(k)), ...);
        };
        parallel_for(grid_.size(), threads, copy, chunk_size);
        std::copy(values.begin() + std::ptrdiff_t(4 * grid_.size()), values.end(),
                  next_.begin() + std::ptrdiff_t(4 * grid_.size()));
    }
    /// Calls f(k, i) for each point that has contacts and is not pinned; k is its rank, i its index in PointMasses.
    template <class F>
    void for_touching(int threads, const F& f) {
        const auto one = [&](std::size_t k, int) FIRN_LAMBDA {
            if (table_.count[k] > 0 && w_[k] > 0) f(k, grid_.place(k));
        };
        parallel_for(grid_.size(), threads, one, chunk_size);
    }

    /// Runs passes over all contacts. In each pass, the vector (velocity or position) of each point changes by the
    /// point's inverse mass times the sum of act(block, aside, own, other) over the contacts of the point. The
    /// arguments `own` and `other` are the values of the two points of a contact after the previous pass.
    /// \param values  one quad per point: see x_ and v_
    template <class Act>
    void relax(aligned_vector<S>& values, int passes, int threads, const Act& act) {
        felt_.resize(std::max(felt_.size(), std::size_t(threads)));
        phases_.assign(std::size_t(passes), blocks_.size());
        parallel_phases(phases_, threads, [&](std::size_t phase, std::size_t which, int thread) {
            const bool odd = phase % 2 == 1;
            pass(which, (odd ? next_ : values).data(), (odd ? values : next_).data(), felt_[std::size_t(thread)], act);
        });
        if (passes % 2 == 1) values.swap(next_);
    }

    template <class Act>
    FIRN_INLINE void pass(std::size_t which, const S* now, S* next, aligned_vector<S>& felt, const Act& act) {
        auto& blocks = blocks_[which];
        if (felt.size() < 4 * lanes * blocks.size()) felt.resize(8 * lanes * blocks.size());
        for (std::size_t b = 0; b < blocks.size(); ++b) {
            const PV of_contact =
                act(blocks[b], asides_[which][b], load(now, blocks[b].own), load(now, blocks[b].other));
            P r[4]{P(0), P(0), P(0), P(0)};
            unroll<D>([&](auto a) FIRN_LAMBDA { r[a] = of_contact.v[a]; });
            store_quads(r, felt.data() + 4 * lanes * b);
        }
        for (std::size_t k = which * chunk_size, end = end_of(which); k < end; ++k) {
            Row sum(0);
            for (const S *f = felt.data() + 4 * table_.first[k], *last = f + 4 * table_.count[k]; f < last; f += 4)
                sum += Row::load(f);
            (Row::load(now + 4 * k) + sum * Row(w_[k])).store(next + 4 * k);
        }
    }

    detail::ExcludedPairs excluded_;
    CollisionGrid<S, D> grid_;
    Table table_, before_;  ///< table_: contacts of this step; before_: of the last step
    /// For each chunk of points: the contacts of these points.
    std::vector<aligned_vector<Block>> blocks_;
    std::vector<aligned_vector<Aside>> asides_;
    /// Quads (four numbers per point, in the sorted order of grid_). x_: displacement since find() and radius; v_:
    /// velocity and inverse mass; a_: acceleration, only if rebounds_; next_: the values that a pass computes.
    aligned_vector<S> x_, v_, a_, next_;
    aligned_vector<S> w_;    ///< inverse masses, in the sorted order of grid_ [1/kg]
    bool begun_ = false;     ///< whether the impulses of the last step were applied in this step
    bool rebounds_ = false;  ///< whether points that rebound are moved
    std::vector<std::size_t> phases_;
    std::vector<aligned_vector<S>>
        felt_;  ///< for each thread: the result of act() for each contact of one chunk, as quads
};

}  // namespace firn::inline FIRN_BUILD
