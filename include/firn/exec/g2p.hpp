/// \file G2P over all particles: velocity, C, position, the material's state and its stress.
#pragma once

#include <firn/data/check_particles.hpp>
#include <firn/exec/execution.hpp>
#include <firn/exec/gather.hpp>
#include <firn/exec/parallel.hpp>
#include <firn/material/concept.hpp>
#include <firn/stage/time_step.hpp>
#include <firn/transfer/concept.hpp>

#include <limits>
#include <vector>

namespace firn {

/// What a G2P saw while it passed over the particles.
struct G2PReport {
    double signal_speed = 0;   ///< largest |v| + c [m/s]: bounds the next time step
    bool sort_needed = false;  ///< some particle may have left the reach of its block: partition before the next P2G
};

namespace detail {

/// Names the first particle of the group that is not finite or would have moved more than a cell beyond the domain.
template <class View, int D>
[[noreturn, gnu::cold]] void throw_wrong_particle(const View& view, const BlockPartition<D>& partition,
                                                  const BlockGroup& group, const Domain<D>& domain, double dt) {
    constexpr bool in_cells = Positions<View>::in_cells;
    std::size_t of_group = 0;
    for (std::uint32_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
        const BlockRange<D>& range = partition.ranges[r];
        for (std::size_t i = 0; i < range.particles; ++i, ++of_group) {
            const std::size_t slot = group.first_slot + of_group;
            const Slots slots{slot, partition.order.data() + slot};
            const auto position = [&](std::size_t, int a) {
                const double x = double(view.position.at(slots, a));
                if (!in_cells) return x;
                return position_of_place(domain, range.block, a, x);
            };
            const auto velocity = [&](std::size_t, int a) { return double(view.velocity.at(slots, a)); };
            bool finite = true, inside = true;
            for (int a = 0; a < D; ++a) {
                finite = finite && std::isfinite(position(0, a)) && std::isfinite(velocity(0, a));
                inside = inside && dt * std::abs(velocity(0, a)) <= domain.cell_size;
            }
            for (int k = 0; k < symmetric_size<D>; ++k)
                finite = finite && std::isfinite(double(view.stress.at(slots, k)));
            if (finite && inside) continue;
            throw particle_error(sentence(
                "Particle ", partition.order[slot], " at ", point_text(slot, D, position), " m with velocity ",
                point_text(slot, D, velocity), " m/s ", finite ? "has left the domain" : "is not finite any more",
                " after a step of ", dt,
                " s. Compare the step with the bound of the time step, and look for a force or a stiffness that is too "
                "large."));
        }
    }
    // Its stress was finite, its deformation gradient not; or it keeps another velocity than that which moved it: there
    // is no telling which of the block it was.
    throw particle_error(sentence("One of the ", group.particles, " particles from particle ",
                                  partition.order[group.first_slot],
                                  " on is not finite any more, or has left the domain, after a step of ", dt,
                                  " s. Compare the step with the bound of the time step."));
}

/// What a thread saw of its particles.
struct alignas(64) G2PThreadReport {
    double signal_speed = 0;
    bool sort_needed = false;
    std::size_t wrong_group = std::numeric_limits<std::size_t>::max();
};

/// G2P of one group after the other: a pack is gathered row by row, then updated in lanes.
template <class Kernel, class Transfer, class Force, class Material, class View>
class GroupUpdate {
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;
    using P = native_pack<S>;
    using Lifted = with_scalar_t<Material, P>;
    using LiftedState = material_state_t<Lifted, D>;
    static constexpr int lanes = scalar_traits<P>::lanes;

public:
    GroupUpdate(const View& view, const BlockPartition<D>& partition, const SparseGrid<S, D>& grid,
                const Material& material, double dt, const Transfer& transfer)
        : view_(view),
          partition_(partition),
          grid_(grid),
          positions_(grid.domain()),
          material_(lift<P>(material)),
          transfer_(lift<P>(transfer)),
          h_(S(grid.domain().cell_size)),
          dt_(S(dt)),
          per_velocity_(positions_.per_velocity(dt, grid.domain().cell_size)) {}

    void operator()(std::size_t g, G2PThreadReport& report) const {
        const BlockGroup& group = partition_.groups[g];
        Seen seen;
        if (group.sparse)
            update_group<2>(group, seen);
        else
            update_group<1>(group, seen);
        report.signal_speed = std::max(report.signal_speed, double(reduce_max(seen.speed)));
        report.sort_needed = report.sort_needed || any(seen.stray);
        if (any(!(seen.rightness == P(0)))) report.wrong_group = std::min(report.wrong_group, g);
    }

private:
    static constexpr bool blended = blends_velocities<Transfer>;
    /// In place of what only blending schemes gather.
    struct NoNodes {
        template <class... Any>
        FIRN_INLINE explicit NoNodes(const Any&...) {}
    };
    struct NoSums {
        struct Lanes {
            Vec<P, D> velocity;
        };
        FIRN_INLINE static Lanes lanes(int) { return {}; }
    };

    struct Seen {
        P speed = P(0);
        P rightness = P(0);  // 0, or NaN once a number was not finite
        mask_t<P> stray = P(1) < P(0);
    };

    template <int Blocks>
    FIRN_INLINE void update_group(const BlockGroup& group, Seen& seen) const {
        const GroupPlaces<View> places(view_, partition_, group, positions_);
        const BlocksOfSlots<S, D>& blocks = places.blocks();
        const ArenaBox<D> box = places.template box<Kernel>(group.packs());
        const BlocksAround<D, Blocks> around(grid_, partition_, group);
        using Nodes = GroupNodes<Kernel, S, D, Blocks>;
        const Nodes nodes(grid_.nodes(0), around, box);
        using NodesBefore = std::conditional_t<blended, Nodes, NoNodes>;
        const NodesBefore nodes_before(blended ? grid_.layer(1) : nullptr, around, box);

        TransferSums<Kernel, Transfer, Force, S, D> sums;
        std::conditional_t<blended, PackSums<Kernel, false, false, S, D>, NoSums> before;
        for (std::size_t slot = 0; slot < group.packs() * pack_size; slot += pack_size) {
            prefetch(group.first_slot + slot + pack_size);
            nodes.gather(sums, places, slot);
            if constexpr (blended) nodes_before.gather(before, places, slot);
            for (int lane = 0; lane < pack_size; lane += lanes)
                update(places.slots(slot + std::size_t(lane)), blocks.template lower<P>(slot + std::size_t(lane)),
                       sums.offset(lane), sums.lanes(lane), before.lanes(lane).velocity, seen);
        }
    }

    /// Calls the particles of the pack that begins at `slot` into the cache, also those numbers that are only written.
    FIRN_INLINE void prefetch(std::size_t slot) const {
        view_.template prefetch<Transfer::affine>(slot);
        for (const auto& field : view_.state) field.prefetch(slot);
    }

    /// \param block   lower corner of the particle's block [cells];  \param offset  from its centre node [cells]
    /// \param before  Σ N v_i before forces acted, for schemes that blend
    FIRN_INLINE void update(const Slots& slots, const Vec<P, D>& block, const Vec<P, D>& offset,
                            const G2PSums<P, D>& sums, const Vec<P, D>& before, Seen& seen) const {
        const View view = view_;  // out of reach of every store below: where its numbers lie is worked out once
        const auto taken = take_from_grid<Kernel, Transfer, Force>(sums, offset, P(h_));
        const P mass = view.mass.template load_or_zero<P>(slots, 0);
        const auto real = mass > P(0);

        LiftedState state = load_state<LiftedState>(view.state, slots);
        state = updated(material_, state, taken.velocity_gradient, P(dt_));
        const Mat<P, D> stress = stress_of(material_, state, taken.velocity_gradient);
        store_state(view.state, slots, state);
        store_symmetric(view.stress, slots, stress);
        if constexpr (Transfer::affine)
            unroll<D * D>([&](auto k) FIRN_LAMBDA { view.affine.store(slots, k, taken.affine.m[k]); });

        // A sum that is finite exactly if all its numbers are (they are far from overflow, or wrong already).
        P sum = trace(stress);
        const Vec<P, D> lowest = positions_.lowest(block), highest = positions_.highest(block);
        const Vec<P, D> position = load_vector<P, D>(view.position, slots);
        const auto v = velocities(view, slots, taken, before);
        const auto move = moved_by(v.motion, P(per_velocity_), position, lowest, highest);
        const Vec<P, D> new_position = select(real, move.position, position);
        sum = sum + select(move.outside <= P(positions_.cell()), P(0), P(std::numeric_limits<S>::infinity()));
        unroll<D>([&](auto a) FIRN_LAMBDA {
            sum = sum + v.velocity.v[a];
            view.position.store(slots, a, new_position.v[a]);
            view.velocity.store(slots, a, v.velocity.v[a]);
        });
        seen.stray = seen.stray | (real & strays<Kernel>(positions_.in_block(new_position, block)));
        seen.rightness = seen.rightness + select(real, sum * P(0), P(0));
        const P volume = view.volume.template load<P>(slots, 0);
        seen.speed = max(seen.speed, signal_speed(material_, v.velocity, mass, volume, state, P(h_)));
    }

    /// What the particles keep, and what moves them.
    FIRN_INLINE auto velocities(const View& view, const Slots& slots, const G2PResult<P, D>& taken,
                                const Vec<P, D>& before) const {
        struct Taken {
            const Vec<P, D>&velocity, &motion;
        };
        if constexpr (blended)
            return transfer_.blended(taken.velocity, before, load_vector<P, D>(view.velocity, slots),
                                     taken.velocity_gradient);
        else
            return Taken{taken.velocity, taken.velocity};
    }

    const View& view_;
    const BlockPartition<D>& partition_;
    const SparseGrid<S, D>& grid_;
    Positions<View> positions_;
    Lifted material_;
    with_scalar_t<Transfer, P> transfer_;
    S h_, dt_, per_velocity_;
};

}  // namespace detail

/// Grid to particles: interpolates velocities, moves the particles, updates the material's state and stress.
/// Particles are kept inside the domain. A transfer that blends needs before_p2g(). \see exec/transfer_passes.hpp
/// \throws particle_error naming the first particle that is not finite or has left the domain
template <class Kernel, class Transfer, class Force, class Execution, class Material, std::floating_point S, int D,
          class Field, class State>
G2PReport g2p(const Execution& execution, const ParticleView<S, D, Field, State>& view,
              const BlockPartition<D>& partition, const SparseGrid<S, D>& grid, const Material& material, double dt,
              const Transfer& transfer = {}) {
    static_assert(require_material<Material, D>() && require_kernel<Kernel>());
    if constexpr (requires { transfer.check(); }) transfer.check();
    if (blends_velocities<Transfer> && !grid.layer(1))
        throw usage_error(
            "This transfer blends with the velocities that nodes had before forces acted, and the grid does "
            "not hold them. Call before_p2g() before every p2g().");
    const int threads = thread_count(requested_threads(execution));
    const detail::GroupUpdate<Kernel, Transfer, Force, Material, ParticleView<S, D, Field, State>> update(
        view, partition, grid, material, dt, transfer);
    std::vector<detail::G2PThreadReport> reports{std::size_t(threads)};
    parallel_for(partition.groups.size(), threads,
                 [&](std::size_t g, int thread) { update(g, reports[std::size_t(thread)]); });

    G2PReport report;
    std::size_t wrong_group = std::numeric_limits<std::size_t>::max();
    for (const auto& of_thread : reports) {
        report.signal_speed = std::max(report.signal_speed, of_thread.signal_speed);
        report.sort_needed = report.sort_needed || of_thread.sort_needed;
        wrong_group = std::min(wrong_group, of_thread.wrong_group);
    }
    if (wrong_group < partition.groups.size())
        detail::throw_wrong_particle(view, partition, partition.groups[wrong_group], grid.domain(), dt);
    return report;
}

/// The stress and signal speed of particles as they are: before the first step, and after a state was changed by hand.
/// A stress that depends on the rate takes C for the velocity gradient, or zero where the view has no C.
/// \param cell_size  h of the grid to come [m]
template <class Execution, class Material, std::floating_point S, int D, class Field, class State>
G2PReport update_stress(const Execution& execution, const ParticleView<S, D, Field, State>& view,
                        const BlockPartition<D>& partition, const Material& material, double cell_size) {
    using P = native_pack<S>;
    using LiftedState = material_state_t<with_scalar_t<Material, P>, D>;
    const auto lifted = lift<P>(material);
    const std::size_t packs = partition.slots() / pack_size;
    const int threads = thread_count(requested_threads(execution));
    std::vector<double> speeds(packs);
    parallel_for(
        packs, threads,
        [&](std::size_t pack, int) {
            P speed = P(0);
            for (std::size_t lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
                const std::size_t slot = pack * pack_size + lane;
                const Slots slots{slot, partition.order.data() + slot};
                const LiftedState state = load_state<LiftedState>(view.state, slots);
                if constexpr (has_rate_dependent_stress<with_scalar_t<Material, P>, D>) {
                    Mat<P, D> C = Mat<P, D>::zero();
                    if (view.affine.data)
                        unroll<D * D>([&](auto k) FIRN_LAMBDA { C.m[k] = view.affine.template load<P>(slots, k); });
                    store_symmetric(view.stress, slots, stress_of(lifted, state, C));
                } else {
                    store_symmetric(view.stress, slots, kirchhoff_stress(lifted, state));
                }
                const P mass = view.mass.template load_or_zero<P>(slots, 0);
                const P volume = view.volume.template load<P>(slots, 0);
                speed = max(speed, signal_speed(lifted, load_vector<P, D>(view.velocity, slots), mass, volume, state,
                                                P(S(cell_size))));
            }
            speeds[pack] = double(reduce_max(speed));
        },
        64);
    G2PReport report;
    for (double speed : speeds) report.signal_speed = std::max(report.signal_speed, speed);
    return report;
}

}  // namespace firn
