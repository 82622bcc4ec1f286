/// \file The contacts of every point, found once per step.
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

namespace firn {

/// A surface that a point touches.
template <std::floating_point S, int D>
struct TouchedSurface {
    Vec<S, D> normal,  ///< Outward unit normal.
        velocity;      ///< [m/s]
    S friction;        ///< Coulomb's μ [1].
};

/// The impulse of a contact in one step, kept for the next step.
template <std::floating_point S, int D>
struct KeptImpulse {
    std::array<std::uint32_t, 2> ids{};  ///< Of two points, ascending, or of a point and a surface; see ContactTable.
    /// The impulse on the first, times the sum of the inverse masses, and its length one step earlier [m/s].
    std::array<S, std::size_t(D) + 1> numbers{};

    bool operator==(const KeptImpulse&) const = default;
};

/// Lists every contact at both of its points, in the order of the collision grid. Consecutive points share a chunk; the
/// chunks do not depend on the number of threads. Memory is kept for the next step.
///
/// The *rank* of a point is its index in the order of the collision grid.
template <std::floating_point S, int D>
struct ContactTable {
    static constexpr std::size_t chunk_size = 256;      ///< Points per chunk.
    static constexpr std::uint32_t none = no_particle;  ///< No point.
    /// The first surface that a point touches, instead of another point. The second surface is one less, and so on.
    static constexpr std::uint32_t first_surface = none - 1;
    static constexpr std::uint32_t most_points = none - 4096;  ///< The number of points must be below this.
    /// Whether an entry of Chunk::others or Chunk::ids is a surface.
    static constexpr bool is_surface(std::uint32_t other) { return other >= most_points; }

    /// The contacts of `chunk_size` consecutive points.
    struct Chunk {
        std::size_t used = 0;                        ///< Number of contacts; the arrays may be longer.
        std::vector<std::uint32_t> others;           ///< Ranks of the other points, or surfaces.
        std::vector<std::uint32_t> ids;              ///< Ids of the other points, or surfaces.
        std::vector<TouchedSurface<S, D>> surfaces;  ///< Those touched, in the order of contacts.
        std::size_t surfaces_before = 0;             ///< Number of surfaces in the chunks before this one.
        aligned_vector<S> kept;           ///< Four numbers per contact, kept for the next step; see KeptImpulse.
        std::vector<std::uint32_t> near;  ///< Scratch memory for the candidates of one point.
    };
    std::vector<Chunk> chunks;            ///< By rank / `chunk_size`.
    aligned_vector<std::uint32_t> first,  ///< By rank: a point's first contact in its chunk.
        count;                            ///< By rank: the number of a point's contacts.
    /// A point's id and rank.
    struct Place {
        std::uint32_t id,  ///< The point's id.
            rank;          ///< Its rank, or none.
    };
    aligned_vector<Place> places;  ///< Of all points, by place.
    bool has_kept = false;         ///< Whether Chunk::kept holds the impulses of this step.
    /// A point's id and group.
    struct Name {
        std::uint32_t id,  ///< The point's id.
            group;         ///< Its group; see PointMass.
    };
    aligned_vector<Name> names;  ///< By rank.

    /// Number of contacts with surfaces.
    std::size_t surface_count() const {
        return chunks.empty() ? 0 : chunks.back().surfaces_before + chunks.back().surfaces.size();
    }

    /// Finds all contacts.
    /// \param surfaces  surfaces(x, seen) calls `seen` as a boundary does. \see has_surfaces
    /// \throws particle_error  if there are too many points
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

    /// The rank that the point of this id had when the table was made, or none. `place` is where to look first.
    FIRN_INLINE std::uint32_t rank_of(std::uint32_t place, std::uint32_t wanted) const {
        if (place < places.size() && places[place].id == wanted) return places[place].rank;
        const auto before = [](const Place& one, std::uint32_t id) { return one.id < id; };
        const auto found = std::lower_bound(places.begin(), places.end(), wanted, before);  // its place has changed
        return found == places.end() || found->id != wanted ? none : found->rank;
    }
    /// The four numbers kept of the contact of a point, given by its rank, with another; or nullptr.
    FIRN_INLINE const S* kept_of(std::uint32_t of_rank, std::uint32_t other_id) const {
        if (of_rank == none) return nullptr;
        const Chunk& chunk = chunks[of_rank / chunk_size];
        for (std::size_t c = first[of_rank], end = c + count[of_rank]; c < end; ++c)
            if (chunk.ids[c] == other_id) return chunk.kept.data() + 4 * c;
        return nullptr;
    }

    /// The kept impulses in the order of ids. Each contact is there once: the other point feels the exact opposite.
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
    /// Replaces the table by one that holds these kept impulses and nothing else.
    /// \throws parameter_error  unless they are in the order of ids, each once, and finite; nothing has changed then
    void resume(std::span<const KeptImpulse<S, D>> all) {
        std::vector<KeptImpulse<S, D>> sides;  // both sides of all contacts
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

    /// Memory in use [bytes].
    std::size_t bytes() const {
        std::size_t sum = (first.capacity() + count.capacity()) * 4 + places.capacity() * sizeof(Place) +
                          names.capacity() * sizeof(Name);
        for (const Chunk& chunk : chunks)
            sum += (chunk.others.capacity() + chunk.ids.capacity() + chunk.near.capacity()) * 4 +
                   chunk.surfaces.capacity() * sizeof(TouchedSurface<S, D>) + chunk.kept.capacity() * sizeof(S);
        return sum;
    }

private:
    static void make_room(Chunk& chunk, std::size_t more) {
        if (chunk.others.size() >= chunk.used + more) return;
        chunk.others.resize(2 * (chunk.used + more));
        chunk.ids.resize(chunk.others.size());
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
        const P radius(r[k]);
        for (const SortedRange& range : ranges) {
            const std::size_t most = found + (range.end - range.begin);
            if (chunk.near.size() < most) chunk.near.resize(2 * most + 64);
            std::uint32_t* const near = chunk.near.data();
            for (std::uint32_t j = range.begin; j < range.end; j += lanes) {
                Vec<P, D> apart;
                unroll<D>([&](auto a) FIRN_LAMBDA { apart.v[a] = own.v[a] - P::load(x[a] + j); });
                const P reach = radius + P::load(r + j);
                std::uint32_t bits = lane_bits(dot(apart, apart) < reach * reach);
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
            chunk.others[chunk.used] = other;
            chunk.ids[chunk.used++] = names[other].id;
        }
    }

    /// Lists the surfaces of contacts that separate. Points that stick or slip are handled by meet_surfaces().
    template <class Surfaces>
    static void list_surfaces(Chunk& chunk, std::size_t i, const PointMasses<S, D>& points, const Surfaces& surfaces) {
        std::uint32_t name = first_surface;
        surfaces(points.position[i],
                 [&](S distance, const Vec<S, D>& normal, const Vec<S, D>& velocity, Contact contact, S friction) {
                     const std::uint32_t own_name = name--;
                     if (contact != Contact::separate || !(distance < points.radius[i]) || !is_surface(own_name))
                         return;
                     make_room(chunk, 1);
                     chunk.surfaces.push_back({normal, velocity, friction});
                     chunk.others[chunk.used] = chunk.ids[chunk.used] = own_name;
                     ++chunk.used;
                 });
    }
};

}  // namespace firn
