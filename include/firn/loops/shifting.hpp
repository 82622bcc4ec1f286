/// \file The pass that moves particles off overfull nodes. It comes before P2G, while the partition holds.
/// \see VolumeFilter
#pragma once

#include <firn/boundary/measured_from.hpp>
#include <firn/boundary/room.hpp>
#include <firn/loops/volume_filter.hpp>
#include <firn/stage/shifting.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// The arrays of a set of particles that the scatter of volumes reads.
template <class View>
struct VolumeView {
    using scalar_type = typename View::scalar_type;
    static constexpr int dimension = View::dimension;
    using Field = decltype(View::position);

    Field position, volume;
};

/// The room between the walls and the ends of a domain, for its nodes and particles.
template <std::floating_point S, int D>
class RoomOfDomain {
public:
    /// \param boundary  the boundary, whose walls narrow the domain
    template <class Boundary>
    RoomOfDomain(const Boundary& boundary, const Domain<D>& domain) {
        constexpr double far = std::numeric_limits<float>::max();
        RoomBox<D> box{domain.lower, domain.upper};
        narrow_to_walls(box, boundary);
        for (int a = 0; a < D; ++a) {
            const bool open = domain.periodic[std::size_t(a)];
            low_[a] = open ? -far : (box.lower[a] - domain.lower[a]) / domain.cell_size;
            high_[a] = open ? far : (box.upper[a] - domain.lower[a]) / domain.cell_size;
        }
    }
    Vec<S, D> lower() const { return cast<S>(low_); }   ///< Lower corner [cells from the domain's lower corner].
    Vec<S, D> upper() const { return cast<S>(high_); }  ///< Upper corner [cells from the domain's lower corner].

private:
    Vec<double, D> low_{}, high_{};
};

/// The solids of a boundary, converted to registers, and where they are.
template <class Kernel, class Boundary, std::floating_point S, int D>
class SolidsOfGrid {
    using P = native_pack<S>;

public:
    SolidsOfGrid(const Boundary& boundary, const Domain<D>& domain)
        : h_(domain.cell_size),
          here_(on_grid(measured_from(boundary, domain.lower), domain.cell_size)),
          lifted_(lift<P>(here_)) {}

    /// Returns whether solids may be near a box of nodes or particles.
    /// \param lower, upper  corners of the box [cells from the domain's lower corner]
    bool are_near(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        const Vec<double, D> margin = Vec<double, D>::filled(0.5 * Kernel::support);
        return here_.reaches((lower - margin) * h_, (upper + margin) * h_);
    }
    /// Calls seen(distance [cells], normal) for each solid.
    /// \param x  positions [cells from the domain's lower corner]
    template <class Seen>
    FIRN_INLINE void around(const Vec<P, D>& x, const Seen& seen) const {
        const P h = P(S(h_));
        solids_around(lifted_, x * h, h,
                      [&](const P& distance, const Vec<P, D>& normal) FIRN_LAMBDA { seen(distance / h, normal); });
    }

private:
    using Here = decltype(measured_from(std::declval<const Boundary&>(), Vec<double, D>{}));

    double h_;  // cell size [m]
    Here here_;
    with_scalar_t<Here, P> lifted_;
};

/// Replaces the volume of matter at each node by the volume beyond the node's room; component 1 becomes the room.
/// \see ShiftSums
template <class Kernel, class Boundary, std::floating_point S, int D>
void find_excess(SparseGrid<S, D>& grid, const RoomOfDomain<S, D>& room, const Boundary& boundary, int threads) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    constexpr bool solid = may_have_solids<Boundary, S, D>;
    const S per_volume = S(std::pow(grid.domain().cell_size, -D));
    const Vec<S, D> lower = room.lower(), upper = room.upper();
    const auto find_in = [&](const auto& solids) {
        parallel_for(
            grid.block_count(), threads,
            [&](std::size_t b, int) {
                S along[D][block_size];
                Vec<double, D> low{}, high{};
                for (int a = 0; a < D; ++a) {
                    const int node = block_size * grid.block_along(b, a);
                    for (int k = 0; k < block_size; ++k) {
                        const S at = S(node + k), reach = S(0.5 * Kernel::support);
                        const bool whole = upper[a] - at >= reach && at - lower[a] >= reach;
                        along[a][k] = whole ? S(1) : room_along<Kernel>(at, lower[a], upper[a]);
                    }
                    low[a] = node, high[a] = node + block_size - 1;
                }
                bool near = false;
                if constexpr (solid) near = solids.are_near(low, high);
                S* const nodes = grid.nodes(b);
                for (int from = 0; from < block_nodes<D>; from += lanes) {
                    S of_box[lanes], index[D][lanes];
                    for (int l = 0; l < lanes; ++l) {
                        const int node = from + quad_of_lane<P>(l);
                        of_box[l] = S(1);
                        for (int a = 0; a < D; ++a) {
                            const int k = place_in_block<D>(node, a);
                            of_box[l] *= along[a][k];
                            index[a][l] = S(k);
                        }
                    }
                    P free = P::load(of_box), r[4];
                    if constexpr (solid)
                        if (near) {
                            Vec<P, D> x;
                            unroll<D>([&](auto a) FIRN_LAMBDA { x.v[a] = P(S(low.v[a])) + P::load(index[a]); });
                            solids.around(x, [&](const P& distance, const Vec<P, D>&)
                                                 FIRN_LAMBDA { free = free * room_outside<Kernel>(distance); });
                        }
                    load_quads(nodes + from * node_width, r);
                    r[0] = excess_volume(r[node_mass] * P(per_volume), free);
                    r[1] = free;
                    r[2] = P(S(0));
                    store_quads(r, nodes + from * node_width);
                }
            },
            16);
    };
    if constexpr (solid)
        find_in(SolidsOfGrid<Kernel, Boundary, S, D>(boundary, grid.domain()));
    else
        find_in(nullptr);
}

/// Moves the particles of a set off overfull nodes. Returns whether one of them may now be too far from its block.
template <class Kernel, class View, class Boundary, std::floating_point S, int D>
bool shift_set(const ParticleSet<View>& set, const SparseGrid<S, D>& grid, const RoomOfDomain<S, D>& room,
               const Boundary& boundary, S share, int threads) {
    using P = native_pack<S>;
    constexpr bool solid = may_have_solids<Boundary, S, D>;
    const Positions<View> positions(grid.domain());
    const Vec<P, D> lower = cast<P>(room.lower()), upper = cast<P>(room.upper());
    std::vector<std::uint8_t> strays(set.partition.groups.size());
    const auto shift = [&](const auto& solids) {
        parallel_for(set.partition.groups.size(), threads, [&](std::size_t g, int) {
            const BlockGroup& group = set.partition.groups[g];
            const GroupPlaces<View> places(set.view, set.partition, group, positions);
            bool near = false;
            if constexpr (solid) {
                Vec<double, D> low{}, high{};
                for (int a = 0; a < D; ++a) {
                    const int block = set.partition.block_along(group.first_range, a);
                    low[a] = block_size * (group.sparse ? block & ~1 : block) - allowed_drift;
                    high[a] = low[a] + block_size * (group.sparse ? cube_blocks : 1) + 2 * allowed_drift + 1;
                }
                near = solids.are_near(low, high);
            }
            mask_t<P> stray = P(1) < P(0);
            const auto shift_some = [&](std::size_t at, const auto& of, const auto&) FIRN_LAMBDA {
                ShiftSums<P, D> sums{of.velocity.v[0], of.velocity.v[1], {}, {}};
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    sums.excess_gradient.v[a] = of.gradient(0, a);
                    sums.room_gradient.v[a] = of.gradient(1, a);
                });
                const auto crowded = sums.excess > P(S(0));
                if (!any(crowded)) return;
                const Slots slots = places.slots(at);
                const Vec<P, D> block = places.blocks().template lower<P>(at), place = places.template position<P>(at),
                                x = block + place;
                Vec<P, D> way = kept_in_box(shift_of(sums, P(share)), x, lower, upper);
                if constexpr (solid)
                    if (near) way = kept_out_of(solids, x, way);
                const Vec<P, D> before = load_vector<P, D>(set.view.position, slots);
                const Vec<P, D> after =
                    moved_by(way, P(positions.cell()), before, positions.lowest(block), positions.highest(block))
                        .position;
                const auto real = set.view.mass.template load_or_zero<P>(slots, 0) > P(S(0));
                const Vec<P, D> position = select(real & crowded, after, before);
                unroll<D>([&](auto a) FIRN_LAMBDA { set.view.position.store(slots, a, position.v[a]); });
                stray = stray | (real & firn::strays<Kernel>(positions.in_block(position, block)));
            };
            gather_to_group<Kernel, false, true>(set.partition, group, places, grid, 0, shift_some);
            strays[g] = any(stray);
        });
    };
    if constexpr (solid)
        shift(SolidsOfGrid<Kernel, Boundary, S, D>(boundary, grid.domain()));
    else
        shift(nullptr);
    return std::find(strays.begin(), strays.end(), 1) != strays.end();
}

/// Does the work of find_present_volumes().
template <class Material, std::floating_point S, class View>
void note_present_volumes(int threads, FilterMemory<S>& memory, std::size_t k, const ParticleSet<View>& set) {
    using P = native_pack<S>;
    using State = material_state_t<with_scalar_t<Material, P>, View::dimension>;
    if (memory.present.size() <= k) memory.present.resize(k + 1);
    parallel_region(threads, [&] {
        const auto volumes = numbers_like(set.view, memory.present[k], set.partition.slots(), threads);
        for_registers(set, threads, [&](const Slots& slots) {
            P volume = set.view.volume.template load_or_zero<P>(slots, 0);
            if constexpr (has_volume<State>) volume = present_volume(load_state<State>(set.view.state, slots), volume);
            const P mass = set.view.mass.template load_or_zero<P>(slots, 0);
            volumes.store(slots, 0, select(mass > P(S(0)), volume, P(S(0))));
        });
    });
}

}  // namespace detail

/// Finds the present volumes V0 J of the particles of set k, for shift_particles().
template <class Material, class Execution, std::floating_point S, class View>
void find_present_volumes(const Execution& execution, FilterMemory<S>& memory, std::size_t k,
                          const ParticleSet<View>& set) {
    detail::note_present_volumes<Material>(detail::threads_of(execution), memory, k, set);
}

/// Moves particles off overfull nodes. Velocities, affine fields and states stay. The numbers of the nodes are
/// overwritten: call this function before p2g().
/// \param memory    memory in which find_present_volumes() has found the volumes of all sets
/// \param boundary  its walls and solids leave less room for matter, and no particle is moved into them
/// \param share     s, from 0 to 1. \see shift_of
/// \param copies    copies(grid, threads) adds up the sums of contact groups. \see sum_copies
/// \param moves     for each set, whether its particles are moved: those whose state contains a volume ratio J
/// \param sets      all sets on the grid, in the order of p2g()
/// \return for each set, whether a particle may now be too far from its block: sort the set before p2g()
/// \throws overflow_error  if fixed-point sums could overflow
template <class Kernel, class Execution, std::floating_point S, int D, class Boundary, class Copies, class View>
std::vector<bool> shift_particles(const Execution& execution, SparseGrid<S, D>& grid, FilterMemory<S>& memory,
                                  const Boundary& boundary, S share, const Copies& copies,
                                  const std::vector<bool>& moves, ParticleSets<View> sets) {
    const int threads = detail::threads_of(execution);
    std::vector<bool> strays(sets.size());
    parallel_region(threads, [&] {
        std::vector<ParticleSet<detail::VolumeView<View>>> all;
        for (const ParticleSet<View>& set : sets) {
            auto& volumes = memory.present[all.size()];
            all.push_back({{set.view.position, detail::numbers_like(set.view, volumes, set.partition.slots(), threads)},
                           set.partition});
        }
        std::swap(grid.last_scale, memory.scale_of_present);
        p2g<Kernel, detail::RateTransfer, detail::NoForceNoField>(execution, grid, 0.0,
                                                                  ParticleSets<detail::VolumeView<View>>(all));
        std::swap(grid.last_scale, memory.scale_of_present);
        copies(grid, threads);
        const detail::RoomOfDomain<S, D> room(boundary, grid.domain());
        detail::find_excess<Kernel>(grid, room, boundary, threads);
        for (std::size_t k = 0; k < sets.size(); ++k)
            if (moves[k]) strays[k] = detail::shift_set<Kernel>(sets[k], grid, room, boundary, share, threads);
    });
    return strays;
}

}  // namespace firn::inline FIRN_BUILD
