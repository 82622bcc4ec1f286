/// \file The passes of a simulation's step. Time integration gives the first list; the transfer, the volumetric policy,
/// the contact law and the boundary each add theirs.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/loops/g2p.hpp>
#include <firn/loops/gap_contact.hpp>
#include <firn/loops/grid_update.hpp>
#include <firn/loops/group_contact.hpp>
#include <firn/loops/p2g_fixed_point.hpp>
#include <firn/loops/p2g_with_velocities.hpp>
#include <firn/loops/shifting.hpp>
#include <firn/loops/volume_passes.hpp>
#include <firn/simulation/material_set.hpp>
#include <firn/simulation/run_of.hpp>

#include <algorithm>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// The passes of a type of simulation. Each function does the work of the pass of its name.
template <class Simulation, class Kernel, class Transfer, class Force, class Boundary, class Volume, class Law>
struct PassesOf {
    using S = typename Simulation::scalar_type;
    static constexpr int D = Simulation::dimension;
    using Run = RunOf<S, D>;
    using Now = StepNow<S, D>;
    using Sets = ParticleSets<MotionView<S, D, BlockedSpan<S>>>;

    /// Returns the passes, in their order.
    static PassList<S, D> list() {
        using enum Data;
        using enum PassKind;
        constexpr bool by_gap = acts_by_gap<Boundary>, averages_volume = Volume::averages_volume;
        PassList<S, D> all;
        all.add({"sort", PassKind::sort, places | reports, partition, false, by<&PassesOf::sort>});
        all.add({"push", particle, places, velocities, false, by<&PassesOf::push>});
        if constexpr (filters_volume<Volume>)
            all.add({"filter volumes", run, states, states | stresses | places | partition, false,
                     by<&PassesOf::filter_volumes>});
        if constexpr (by_gap) all.add({"find gaps", gather, places | boundary, gaps, false, by<&PassesOf::find_gaps>});
        all.add({"p2g", scatter, places | velocities | affine | stresses,
                 blends_velocities<Transfer> ? momenta | velocities_before_forces : momenta, false,
                 by<&PassesOf::p2g>});
        if constexpr (refines_velocities<Transfer>)
            all.add({"refine velocities", scatter, momenta | places, momenta, false, by<&PassesOf::refine>});
        if constexpr (Law::between_groups)
            all.add({"contact", node, momenta | places, momenta, false, by<&PassesOf::meet>});
        all.add({"grid update", node, momenta | boundary, node_velocities, false, by<&PassesOf::update_grid>});
        static_assert(by_gap || !has_rigid_bodies<Boundary>,
                      "firn: a RigidBody moves by the gap between matter and its surface. Put the boundary into a "
                      "GapContact: firn::GapContact{firn::Together(walls, body)}.");
        if constexpr (by_gap && has_rigid_bodies<Boundary>)
            all.add({"act by gap", node, node_velocities | gaps | boundary, node_velocities | boundary, false,
                     by<&PassesOf::template push_bodies<>>});
        else if constexpr (by_gap)
            all.add({"act by gap", node, node_velocities | gaps | boundary, node_velocities, false,
                     by<&PassesOf::act_by_gap>});
        if constexpr (averages_volume)
            all.add({"average volumes", scatter, node_velocities | places, averages, true,
                     by<&PassesOf::template average_volumes<>>});
        all.add({"g2p", gather, averages_volume ? node_velocities | averages : node_velocities,
                 places | velocities | affine | stresses | states | reports, true, by<&PassesOf::g2p>});
        if constexpr (averages_volume)
            all.add(
                {"restore masses", node, averages, node_velocities, true, by<&PassesOf::template restore_masses<>>});
        all.add({"end g2p", run, reports, boundary, false, by<&PassesOf::end_g2p>});
        all.add({"sinks and sources", run, places, particles, false, by<&PassesOf::end_step>});
        return all;
    }

    /// Lets gather(set) do the work of G2P for the set of this pass; it returns the set's PassReport.
    static void gather_set(Simulation& of, Now& now, const auto& gather) {
        if (now.set == 0) of.spoil();  // particles cannot be used before G2P has moved them all
        of.for_materials([&](auto& set, std::size_t k) {
            if (k != now.set) return;
            const PassReport pass = gather(set);
            set.report = pass.report;
            now.right = now.right && pass.right;
        });
    }

protected:
    /// A pass calls one of the functions below.
    template <auto function>
    static void by(Run& run, Now& now) {
        function(static_cast<Simulation&>(run), now);
    }
    static Reactions<D>* reactions(Simulation& of) { return of.reactions ? &*of.reactions : nullptr; }
    static const auto& mirrors(const Simulation& of, const Now& now) {
        if constexpr (acts_by_gap<Boundary>)
            return of.gap_memory_.mirrors;
        else
            return now.mirrors;
    }
    /// Calls body(sets) with what P2G sees of the sets.
    static void with_sets(Simulation& of, const auto& body) {
        const auto sets = of.motions();
        body(Sets(sets));
    }

    static void sort(Simulation& of, Now& now) {
        if (of.sort_if_due(now.ranks, now.threads)) of.activate();
    }
    static void push(Simulation& of, Now& now) {
        of.push(now.dt, requested_float_steps(of.execution), now.ranks, now.threads);
    }
    static void filter_volumes(Simulation& of, Now& now) {
        of.volume.check();
        if (!of.volume.is_due(of.steps())) return;
        const S crossed =
            now.time_step().template cells_per_velocity<S>(of.domain().cell_size) * S(fastest_signal(of.sets()));
        bool stray = false;
        with_sets(of, [&](Sets sets) {
            if (const S share = of.volume.share(crossed); share > 0)
                of.for_materials([&](auto& set, std::size_t k) {
                    firn::filter_volumes<Kernel>(of.execution, of.grid_, of.filter_memory_, now.mirrors, share,
                                                 set.material, ParticleSet{set.particles.view(), set.partition}, k,
                                                 sets, now.start);
                });
            if constexpr (shifts_particles<Volume>)
                if (const S share = of.volume.shifted_share(crossed); share > 0) stray = shift(of, now, share, sets);
        });
        if (!shifts_particles<Volume> || now.ranks.sum(std::size_t(stray)) == 0) return;
        for (std::size_t k = 0; k < of.sets().size(); ++k) of.sort(k, now.ranks, now.threads);
        of.activate();
    }
    /// Moves particles off overfull nodes. \return whether some may be too far from their blocks
    static bool shift(Simulation& of, const Now& now, const S& share, Sets sets) {
        std::vector<bool> moves;
        of.for_materials([&]<class M>(const MaterialSet<D, M>&, std::size_t) {
            moves.push_back(has_volume_ratio<material_state_t<with_scalar_t<M, native_pack<S>>, D>>);
        });
        if (std::ranges::count(moves, true) == 0) return false;
        of.for_materials([&]<class M>(MaterialSet<D, M>& set, std::size_t k) {
            note_present_volumes<M>(now.threads, of.filter_memory_, k,
                                    ParticleSet{set.particles.view(), set.partition});
        });
        const auto copies = [&](auto& grid, int threads) {
            if constexpr (Law::between_groups)
                sum_copies(ranks_of(of.execution), grid, of.contact_memory_.meetings, threads);
        };
        const std::vector<bool> strays =
            shift_particles<Kernel>(of.execution, of.grid_, of.filter_memory_, of.boundary, share, copies, moves, sets);
        return std::ranges::count(strays, true) > 0;
    }
    static void find_gaps(Simulation& of, Now& now) {
        with_sets(of, [&](Sets sets) {
            of.gap_memory_.mirrors =
                mirrors_by_gap<Kernel>(of.execution, of.grid_, of.boundary, now.dt, of.gap_memory_, sets);
        });
    }
    static void p2g(Simulation& of, Now& now) {
        with_sets(of, [&](Sets sets) {
            p2g_with_velocities<Kernel, Transfer, Force>(of.execution, of.grid_, mirrors(of, now), now.dt, sets);
        });
    }
    static void refine(Simulation& of, Now& now) {
        with_sets(of, [&](Sets sets) {
            after_p2g<Kernel>(of.execution, of.grid_, of.transfer, of.transfer_memory_, mirrors(of, now), sets);
        });
    }
    static void meet(Simulation& of, Now& now) {
        with_sets(of, [&](Sets sets) {
            meet_groups<Kernel>(of.execution, of.grid_, of.contact, now.dt, mirrors(of, now), of.contact_memory_,
                                of.contact_impulses ? &*of.contact_impulses : nullptr, sets);
        });
    }
    static void update_grid(Simulation&, Now& now) { now.largest_acceleration = now.update_grid(); }
    static void act_by_gap(Simulation& of, Now& now) {
        with_sets(of, [&](Sets sets) {
            firn::act_by_gap<Kernel>(of.execution, of.grid_, of.boundary, now.dt, mirrors(of, now), of.gap_memory_,
                                     reactions(of), sets);
        });
    }
    /// The function that does it comes with firn/rigid_body.hpp; its namespace is that of the boundary.
    template <class Shaped = Boundary>
    static void push_bodies(Simulation& of, Now& now) {
        if (!now.is_uniform)
            throw usage_error(
                "Rigid bodies feel an acceleration that is the same everywhere; this one depends on the place. Give "
                "the simulation a vector, and add what is more to the body's force.");
        Shaped& boundary = of.boundary;
        with_sets(of, [&](Sets sets) {
            const bool found = act_with_bodies<Kernel>(of.execution, of.grid_, boundary, now.dt, now.acceleration,
                                                       mirrors(of, now), of.gap_memory_, reactions(of), sets);
            of.warnings_.of_bodies(found, of.warn, of.speaks_);
        });
    }
    template <class Moves = Transfer, class Averaged = Volume>
    static void average_volumes(Simulation& of, Now& now) {
        std::optional<BlockedSpan<S>> plastic;
        of.for_materials([&](auto& set, std::size_t k) {
            if (k == now.set) plastic = plastic_volume_rates(set.particles.view());
        });
        with_sets(of, [&](Sets sets) {
            average_volume<Kernel, Moves, Force, Averaged>(of.execution, of.grid_, of.volume_memory_, now.mirrors,
                                                           now.set, sets, now.dt, plastic);
        });
    }
    static void g2p(Simulation& of, Now& now) {
        gather_set(of, now, [&](auto& set) {
            return g2p_pass<Kernel, Transfer, Force, Volume>(now.threads, set.particles.view(), set.partition, of.grid_,
                                                             set.material, now.time_step(), of.transfer);
        });
    }
    template <class Moves = Transfer>
    static void restore_masses(Simulation& of, Now& now) {
        put_back_masses<Moves>(now.threads, of.grid_);
    }
    static void end_g2p(Simulation& of, Now& now) {
        of.Run::end_g2p(now);
        of.boundary = advanced(of.boundary, now.dt);
    }
    static void end_step(Simulation& of, Now& now) { of.Run::end_step(now.ranks, now.threads); }
};

}  // namespace firn::inline FIRN_BUILD::detail
