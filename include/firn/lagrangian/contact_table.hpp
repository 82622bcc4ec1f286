/// \file A table that lists the contacts of every point. The table is made once per step.
#pragma once

#include <firn/boundary/contact.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/parallel.hpp>
#include <firn/lagrangian/collision_grid.hpp>
#include <firn/lagrangian/excluded_pairs.hpp>
#include <firn/lagrangian/point_masses.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A surface that a point touches.
template <std::floating_point S, int D>
struct TouchedSurface {
    Vec<S, D> normal,  ///< Outward unit normal at the point.
        velocity;      ///< Velocity of the surface at the point [m/s].
    S friction;        ///< Coulomb's coefficient of friction of the surface [1].
    S overlap;         ///< How far the point is beyond the surface, as a ball [m].
};

}  // namespace detail

/// The impulse of a contact in one step, kept for the next step.
template <std::floating_point S, int D>
struct KeptImpulse {
    /// The ids of the two points, the lower id first. For a contact with a surface: the id of the point, and the code
    /// of the surface; see ContactTable::first_surface.
    std::array<std::uint32_t, 2> ids{};
    /// The first D values are a vector [m/s]: the impulse on the point with the first id, multiplied by the sum of the
    /// inverse masses of the two points. The last value is the length that this vector had one step earlier [m/s].
    std::array<S, std::size_t(D) + 1> numbers{};

    bool operator==(const KeptImpulse&) const = default;
};

namespace detail {

/// Lists the contacts of every point. A contact of two points is listed twice, once for each of the two points.
///
/// The collision grid sorts the points that can collide. The *rank* of a point is its index (0, 1, …) in this sorted
/// order. A Chunk stores the contacts of 256 points with consecutive ranks. The number of threads has no effect on the
/// chunks. The next step uses the same memory again.
template <std::floating_point S, int D>
struct ContactTable {
    static constexpr std::size_t chunk_size = 256;      ///< Number of points per chunk.
    static constexpr std::uint32_t none = no_particle;  ///< Means "no point" in place of an index or rank.
    /// The code of the boundary's first surface. In Chunk::others and Chunk::ids, the code of a surface stands in place
    /// of the rank or id of a point. The surface with index k, counted from 0, has the code first_surface − k.
    static constexpr std::uint32_t first_surface = none - 1;
    /// The smallest code of a surface. The number of points must be below this value.
    static constexpr std::uint32_t most_points = none - 4096;
    /// Returns whether `other`, a value from Chunk::others or Chunk::ids, is the code of a surface.
    static constexpr bool is_surface(std::uint32_t other) { return other >= most_points; }

    /// The contacts of `chunk_size` points with consecutive ranks.
    struct Chunk {
        std::size_t used = 0;               ///< Number of contacts. The arrays below may be longer.
        std::vector<std::uint32_t> others;  ///< Per contact: rank of the other point, or first_surface − k.
        std::vector<std::uint32_t> ids;     ///< Per contact: id of the other point, or first_surface − k.
        /// Four values per contact: the vector from the other point to the own one [m], then zeros. All values of a
        /// contact with a surface are zero.
        aligned_vector<S> apart;
        std::vector<TouchedSurface<S, D>> surfaces;  ///< One per contact with a surface, in the order of contacts.
        std::size_t surfaces_before = 0;             ///< Number of contacts with surfaces in all earlier chunks.
        /// Four values per contact: the elements of KeptImpulse::numbers, followed by a zero in 2D.
        aligned_vector<S> kept;
        std::vector<std::uint32_t> near;  ///< Temporary memory: ranks of the points near one point.
    };
    std::vector<Chunk> chunks;            ///< The point of rank k belongs to chunks[k / chunk_size].
    aligned_vector<std::uint32_t> first,  ///< Per rank: where the point's contacts begin in the chunk's arrays.
        count;                            ///< Per rank: number of contacts of the point.
    /// A point's id and rank.
    struct Place {
        std::uint32_t id,  ///< The point's id.
            rank;          ///< The point's rank; `none` if the point has radius 0 and cannot collide.
    };
    aligned_vector<Place> places;  ///< One per point, in the order of PointMasses.
    bool has_kept = false;         ///< Whether Chunk::kept contains the impulses of this step.
    /// A point's id and group.
    struct Name {
        std::uint32_t id,  ///< The point's id.
            group;         ///< The point's group; see PointMass::group.
    };
    aligned_vector<Name> names;  ///< One per point that can collide, in the order of ranks.

    /// Returns the number of contacts with surfaces.
    std::size_t surface_count() const {
        return chunks.empty() ? 0 : chunks.back().surfaces_before + chunks.back().surfaces.size();
    }

    /// Fills the table with all contacts.
    /// \param grid      the collision grid that has sorted the points
    /// \param points    the points that the grid has sorted
    /// \param excluded  pairs of points that do not collide; call excluded.prepare() first
    /// \param surfaces  a function; surfaces(x, seen) must call seen(…) for each surface of the boundary, for a point
    ///                  at x; see has_surfaces
    /// \param threads   number of threads
    /// \throws particle_error  if there are `most_points` or more points
    template <class Surfaces>
    void find(const CollisionGrid<S, D>& grid, const PointMasses<S, D>& points, const ExcludedPairs& excluded,
              const Surfaces& surfaces, int threads) {
        const std::size_t n = grid.size();
        if (points.size() >= most_points)
            throw particle_error(
                sentence("There are ", points.size(), " points; up to ", most_points - 1, " can collide."));
        chunks.resize((n + chunk_size - 1) / chunk_size);
        renew(first, n, threads);
        renew(count, n, threads);
        renew(places, points.size(), threads);
        parallel_for(places.size(), threads, [&](std::size_t i, int) { places[i] = {points.id[i], none}; }, 4096);
        renew(names, n, threads);
        has_kept = false;
        const auto name = [&](std::size_t k, int) {
            const std::uint32_t i = grid.place(k);
            places[i].rank = std::uint32_t(k);
            names[k] = {places[i].id, points.group[i]};
        };
        parallel_for(n, threads, name, chunk_size);
        parallel_for(chunks.size(), threads, [&](std::size_t which, int) {
            Chunk& chunk = chunks[which];
            chunk.used = 0;
            chunk.surfaces.clear();
            typename CollisionGrid<S, D>::Neighbours neighbours(grid);
            for (std::size_t k = which * chunk_size, end = std::min(k + chunk_size, n); k < end; ++k) {
                const std::uint32_t i = grid.place(k);
                first[k] = std::uint32_t(chunk.used);
                list_points(chunk, k, grid, neighbours.of(k), excluded);
                if (points.inverse_mass[i] > 0) list_surfaces(chunk, i, points, surfaces);
                count[k] = std::uint32_t(chunk.used) - first[k];
            }
        });
        std::size_t before = 0;
        for (Chunk& chunk : chunks) {
            chunk.surfaces_before = before;
            before += chunk.surfaces.size();
        }
    }

    /// Returns the rank that a point had when this table was made, or `none` if the point had no rank then.
    /// \param place   the point's present index; if it has not changed since then, no search is needed
    /// \param wanted  the point's id
    FIRN_INLINE std::uint32_t rank_of(std::uint32_t place, std::uint32_t wanted) const {
        if (place < places.size() && places[place].id == wanted) return places[place].rank;
        const auto before = [](const Place& one, std::uint32_t id) { return one.id < id; };
        // The point's index has changed since then, so its id is searched.
        const auto found = std::lower_bound(places.begin(), places.end(), wanted, before);
        return found == places.end() || found->id != wanted ? none : found->rank;
    }
    /// Returns the four values in Chunk::kept for the contact between the point of rank `of_rank` and the point with id
    /// `other_id` (or the surface with the code `other_id`); nullptr if there is no such contact.
    FIRN_INLINE const S* kept_of(std::uint32_t of_rank, std::uint32_t other_id) const {
        if (of_rank == none) return nullptr;
        const Chunk& chunk = chunks[of_rank / chunk_size];
        for (std::size_t c = first[of_rank], end = c + count[of_rank]; c < end; ++c)
            if (chunk.ids[c] == other_id) return chunk.kept.data() + 4 * c;
        return nullptr;
    }

    /// Returns one KeptImpulse per contact, sorted by KeptImpulse::ids. A KeptImpulse contains the impulse on the point
    /// with the lower id. The impulse on the point with the higher id is the exact opposite.
    std::vector<KeptImpulse<S, D>> kept() const {
        std::vector<KeptImpulse<S, D>> all;
        for (const Place& place : places) {
            if (place.rank == none) continue;
            const Chunk& chunk = chunks[place.rank / chunk_size];
            for (std::size_t c = first[place.rank], end = c + count[place.rank]; c < end; ++c) {
                if (chunk.ids[c] < place.id) continue;
                all.push_back({.ids = {place.id, chunk.ids[c]}});
                std::copy_n(chunk.kept.data() + 4 * c, D + 1, all.back().numbers.begin());
            }
        }
        std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.ids < b.ids; });
        return all;
    }
    /// Replaces the contents of the table by the given kept impulses.
    /// \param all  the impulses, as kept() returned them
    /// \throws parameter_error  unless the impulses are finite and sorted by ids, with one impulse per contact; the
    ///                          table has not changed then
    void resume(std::span<const KeptImpulse<S, D>> all) {
        std::vector<KeptImpulse<S, D>> sides;  // a contact of two points has two entries, one per point
        for (std::size_t k = 0; k < all.size(); ++k) {
            const auto [own, other] = all[k].ids;
            const auto finite = [](S number) { return std::isfinite(number); };
            if (own >= other || (k > 0 && all[k].ids <= all[k - 1].ids) || !std::ranges::all_of(all[k].numbers, finite))
                throw parameter_error(sentence("The impulse kept of points ", own, " and ", other,
                                               " is not finite, or not in the order of ids."));
            sides.push_back(all[k]);
            if (is_surface(other)) continue;
            sides.push_back({{other, own}, all[k].numbers});
            for (std::size_t a = 0; a < std::size_t(D); ++a) sides.back().numbers[a] *= -1;
        }
        std::sort(sides.begin(), sides.end(), [](const auto& a, const auto& b) { return a.ids < b.ids; });
        *this = {};
        for (const KeptImpulse<S, D>& side : sides) {
            if (places.empty() || places.back().id != side.ids[0]) {
                if (places.size() % chunk_size == 0) chunks.emplace_back();
                places.push_back({side.ids[0], std::uint32_t(places.size())});
                first.push_back(std::uint32_t(chunks.back().ids.size()));
                count.push_back(0);
            }
            ++count.back();
            chunks.back().ids.push_back(side.ids[1]);
            std::array<S, 4> quad{};
            std::ranges::copy(side.numbers, quad.begin());
            chunks.back().kept.insert(chunks.back().kept.end(), quad.begin(), quad.end());
        }
        has_kept = true;
    }

    /// Returns the size of the allocated memory [bytes].
    std::size_t bytes() const {
        std::size_t sum = (first.capacity() + count.capacity()) * 4 + places.capacity() * sizeof(Place) +
                          names.capacity() * sizeof(Name);
        for (const Chunk& chunk : chunks)
            sum += (chunk.others.capacity() + chunk.ids.capacity() + chunk.near.capacity()) * 4 +
                   chunk.surfaces.capacity() * sizeof(TouchedSurface<S, D>) +
                   (chunk.kept.capacity() + chunk.apart.capacity()) * sizeof(S);
        return sum;
    }

private:
    static void make_room(Chunk& chunk, std::size_t more) {
        if (chunk.others.size() >= chunk.used + more) return;
        chunk.others.resize(2 * (chunk.used + more));
        chunk.ids.resize(chunk.others.size());
        // Collisions reads whole groups of as many contacts as a register has lanes.
        chunk.apart.resize(4 * (chunk.others.size() + std::size_t(scalar_traits<native_pack<S>>::lanes)));
    }

    void list_points(Chunk& chunk, std::size_t k, const CollisionGrid<S, D>& grid,
                     const std::array<SortedRange, CollisionGrid<S, D>::rows>& ranges,
                     const ExcludedPairs& excluded) const {
        using P = native_pack<S>;
        constexpr std::uint32_t lanes = std::uint32_t(scalar_traits<P>::lanes);
        static_assert(lanes <= CollisionGrid<S, D>::padding);
        const S* const r = grid.radii();
        std::array<const S*, std::size_t(D)> x;
        for (int a = 0; a < D; ++a) x[std::size_t(a)] = grid.coordinates(a);
        std::size_t found = 0;
        Vec<P, D> own;
        unroll<D>([&](auto a) FIRN_LAMBDA { own.v[a] = P(x[a][k]); });
        // The points whose coordinates are this near are looked at in double.
        const P radius(r[k]), error(S(1.000001 * grid.error_of_distance()));
        for (const SortedRange& range : ranges) {
            const std::size_t most = found + (range.end - range.begin);
            if (chunk.near.size() < most) chunk.near.resize(2 * most + 64);
            std::uint32_t* const near = chunk.near.data();
            for (std::uint32_t j = range.begin; j < range.end; j += lanes) {
                Vec<P, D> apart;
                unroll<D>([&](auto a) FIRN_LAMBDA { apart.v[a] = own.v[a] - P::load(x[a] + j); });
                const P reach = (radius + P::load(r + j)) * P(1 + 4 * std::numeric_limits<S>::epsilon()) + error;
                std::uint32_t bits = lane_bits(dot(apart, apart) <= reach * reach);
                if (range.end - j < lanes) bits &= (1u << (range.end - j)) - 1;
                for (; bits != 0; bits &= bits - 1) near[found++] = j + std::uint32_t(std::countr_zero(bits));
            }
        }
        make_room(chunk, found);
        const std::uint32_t group = names[k].group;
        for (std::size_t f = 0; f < found; ++f) {
            const std::uint32_t other = chunk.near[f];
            if (other == k || (group != 0 && group == names[other].group)) continue;
            if (excluded.any() && excluded.contains(grid.place(k), grid.place(other))) continue;
            S* const quad = chunk.apart.data() + 4 * chunk.used;
            grid.write_vector(other, k, quad);
            Vec<S, D> apart;
            unroll<D>([&](auto a) FIRN_LAMBDA { apart.v[a] = quad[a]; });
            const S reach = r[k] + r[other];
            if (!(dot(apart, apart) < reach * reach)) continue;
            chunk.others[chunk.used] = other;
            chunk.ids[chunk.used++] = names[other].id;
        }
    }

    /// Adds to the chunk the contacts between the point with index i and all surfaces that have Contact::separate. All
    /// other surfaces are handled by meet_surfaces() only.
    template <class Surfaces>
    static void list_surfaces(Chunk& chunk, std::size_t i, const PointMasses<S, D>& points, const Surfaces& surfaces) {
        std::uint32_t name = first_surface;
        surfaces(points.position[i],
                 [&](S distance, const Vec<S, D>& normal, const Vec<S, D>& velocity, Contact contact, S friction) {
                     const std::uint32_t own_name = name--;
                     if (contact != Contact::separate || !(distance < points.radius[i]) || !is_surface(own_name))
                         return;
                     make_room(chunk, 1);
                     std::fill_n(chunk.apart.data() + 4 * chunk.used, 4, S(0));
                     chunk.surfaces.push_back({normal, velocity, friction, points.radius[i] - distance});
                     chunk.others[chunk.used] = chunk.ids[chunk.used] = own_name;
                     ++chunk.used;
                 });
    }
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
