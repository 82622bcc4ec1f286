/// \file The passes of an implicit or quasi-static step of a simulation.
#pragma once

#include <firn/implicit/f_bar_of_step.hpp>
#include <firn/implicit/integration.hpp>
#include <firn/implicit/loads.hpp>
#include <firn/implicit/nodal_step.hpp>
#include <firn/simulation.hpp>
#include <firn/transfer/pic.hpp>

#include <tuple>

namespace firn::inline FIRN_BUILD::detail {

/// The passes of a type of simulation whose steps are solved. Those that are not here are PassesOf's.
template <class Time, class Simulation, class Kernel, class Transfer, class Force, class Boundary, class Volume,
          class Law>
struct ImplicitPassesOf : PassesOf<Simulation, Kernel, Transfer, Force, Boundary, Volume, Law> {
    using Base = PassesOf<Simulation, Kernel, Transfer, Force, Boundary, Volume, Law>;
    using Base::D;
    using typename Base::Now;
    using typename Base::S;
    using typename Base::Sets;
    /// How velocities go to the nodes and back. Without inertia, matter moves as the nodes do.
    using Moves = std::conditional_t<Time::has_inertia, Transfer, Pic>;

    static_assert(std::same_as<decltype(Simulation::execution), Coloured>,
                  "firn: implicit and quasi-static steps run with the execution Coloured.");
    static_assert(!Law::between_groups && !acts_by_gap<Boundary>,
                  "firn: implicit and quasi-static steps know no contact groups and no GapContact.");
    static_assert(
        std::same_as<Volume, OwnVolume> || std::same_as<Volume, FBar>,
        "firn: implicit and quasi-static steps filter no volumes, and know no averages but those of FBar: take "
        "OwnVolume or FBar.");
    /// FBar averages the trace of ∇u, which is the change of volume in short steps only.
    using VolumeOfStep = std::conditional_t<Volume::averages_volume, FBarOfStep, OwnVolume>;

    static constexpr bool in_two_stages = Time::stages == 2;
    static constexpr bool can_take_stages = !in_two_stages || requires(Transfer transfer) { transfer.ratio; };
    static_assert(can_take_stages && !(in_two_stages && Transfer::affine),
                  "firn: the velocities of TrBdf2 at the end of a step are not those with which matter has moved; of "
                  "the transfers, Flip tells them apart. Take firn::Flip{1}.");

    /// Returns the passes, in their order.
    static PassList<S, D> list() {
        using enum Data;
        using enum PassKind;
        PassList<S, D> all;
        all.add({"sort", PassKind::sort, places | reports, partition, false, Base::template by<&Base::sort>});
        all.add({"loads", scatter, places, node_loads, false, Base::template by<&ImplicitPassesOf::loads>});
        all.add({"p2g", scatter, places | velocities | affine,
                 blends_velocities<Moves> ? momenta | velocities_before_forces : momenta, false,
                 Base::template by<&ImplicitPassesOf::p2g>});
        if constexpr (refines_velocities<Moves>)
            all.add({"refine velocities", scatter, momenta | places, momenta, false, Base::template by<&Base::refine>});
        all.add({"solve", run, momenta | node_loads | places | states | boundary, node_velocities, false,
                 Base::template by<&ImplicitPassesOf::solve>});
        if constexpr (Volume::averages_volume)
            all.add({"average volumes", scatter, node_velocities | places, averages, true,
                     Base::template by<&Base::template average_volumes<Moves, VolumeOfStep>>});
        all.add({"g2p", gather, Volume::averages_volume ? node_velocities | averages : node_velocities,
                 places | velocities | affine | stresses | states | reports, true,
                 Base::template by<&ImplicitPassesOf::g2p>});
        if constexpr (Volume::averages_volume)
            all.add({"restore masses", node, averages, node_velocities, true,
                     Base::template by<&Base::template restore_masses<Moves>>});
        all.add({"end g2p", run, reports, boundary, false, Base::template by<&Base::end_g2p>});
        all.add({"sinks and sources", run, places, particles, false, Base::template by<&Base::end_step>});
        return all;
    }

    /// Prepares the particles and returns the length of the next step [s]: the fixed time step, or what the motion of
    /// matter allows; infinite if nothing limits it. \param duration  how long to advance [s]
    template <class Acceleration>
    static double next_time_step(Simulation& of, const Acceleration& acceleration, double duration) {
        check_acceleration<D>(acceleration);
        of.integration.check();
        check_linear_mirrors(mirrors_of<Kernel>(of.boundary, of.domain()), of.domain());
        if constexpr (in_two_stages)
            if (!(of.transfer.ratio > 0))
                throw parameter_error(
                    "TrBdf2 takes a Flip with a ratio above 0: PIC alone has no velocities of particles.");
        if (of.fixed_time_step < 0 || !std::isfinite(of.fixed_time_step))
            throw parameter_error(sentence("The fixed time step is ", of.fixed_time_step,
                                           " s; it must be positive, or 0 for steps by motion."));
        of.prepare();
        if constexpr (!Time::has_inertia) of.for_materials([](auto& set, std::size_t) { require_stiffness(set); });
        double dt = of.fixed_time_step > 0 ? of.fixed_time_step : Time::unlimited;
        if constexpr (Time::has_inertia)
            if (of.fixed_time_step == 0) dt = time_to_move(of, acceleration);
        if (!std::isfinite(dt) && !std::isfinite(duration))
            throw parameter_error(
                "Nothing says how long a step is: set fixed_time_step, or call advance() in place of step().");
        for (const SetOf<S, D>& set : of.sets())
            if (const double burst = set.next_burst() - of.time(); burst > 0) dt = std::min(dt, burst);
        return dt;
    }

private:
    /// Refuses matter that shear meets with no stress: the shape of its equilibrium is not determined.
    /// \throws parameter_error  if a particle is of such matter
    template <class Set>
    static void require_stiffness(const Set& set) {
        // Sand and the like bear shear under pressure.
        Mat<S, D> gradient = Mat<S, D>::diagonal(S(-0.01));
        gradient(0, 1) = S(0.001);
        const auto bears_shear = [&](const auto& state) {
            return after_displacement(set.material, state, gradient, S(1)).stress(0, 1) != S(0);
        };
        if (bears_shear(initial_state<D>(set.material))) return;
        for (std::size_t slot = 0; slot < set.particles.slots(); ++slot)
            if (set.particles.is_particle(slot) && !bears_shear(set.particles.state(slot)))
                throw parameter_error(sentence(
                    "Particle ", set.particles.id(slot), " at ", point_text(set.particles.exact_position(slot).v, D),
                    " m has no stiffness against shear, as a fluid without viscosity. Quasi-static steps find no "
                    "equilibrium of such matter. Take Implicit or TrBdf2, in which it has inertia."));
    }
    /// Returns the time [s] in which matter would move by half a cell, were there no forces but the acceleration.
    template <class Acceleration>
    static double time_to_move(Simulation& of, const Acceleration& acceleration) {
        double fastest = speed_of_boundary<S>(of.boundary, of.domain()), largest = 0;
        of.for_materials([&](auto& set, std::size_t) { fastest = std::max(fastest, largest_speed_of(set.particles)); });
        if constexpr (is_uniform<Acceleration>)
            largest = size_of_uniform(acceleration, false);
        else
            largest = acceleration_at_particles(of.sets_, of.domain(), acceleration, of.workers());
        const double way = std::min(of.integration.largest_motion, 0.5) * of.domain().cell_size;
        // The positive root of v t + a t²/2 = way, in the form that does not cancel.
        return 2 * way / (fastest + std::sqrt(fastest * fastest + 2 * largest * way));
    }

    static void loads(Simulation& of, Now& now) {
        loads_of_nodes<Kernel>(of.grid_, now.threads, layer::of_loads, of.sets_, now.dt, [&] {
            // Loads are those at the end of the step.
            const Moment begin = of.now_;
            of.now_.time += Time::has_inertia ? now.dt : now.left;
            const ScopeEnd put_back{[&] { of.now_ = begin; }};
            of.push(now.dt, false, now.ranks, now.threads);
        });
    }
    static void p2g(Simulation& of, Now& now) {
        Base::with_sets(of, [&](Sets sets) {
            p2g_with_velocities<Kernel, Moves, NoForceFor<Moves>>(of.execution, of.grid_, now.mirrors, now.dt, sets);
        });
    }
    static void solve(Simulation& of, Now& now) {
        Base::with_sets(of, [&](Sets sets) {
            NodalStep<Time, Kernel, S, D> step(of.grid_, now.threads, of.integration, of.boundary, now.mirrors, sets);
            const double first = now.dt;
            of.solution = step.take(first, now.asked, [&](double dt) {
                now.dt = dt;
                auto potential = potential_of(of, now, std::make_index_sequence<Simulation::material_count>{});
                step.solve(potential, dt / now.left, now.is_uniform,
                           [&] { now.largest_acceleration = now.update_grid(); });
            });
            if (!of.solution.has_converged)
                throw_not_converged(of.solution, of.now_, first, of.integration.largest_motion, inverted_particle(of));
            if (of.reactions) {
                auto potential = potential_of(of, now, std::make_index_sequence<Simulation::material_count>{});
                step.react(potential, now, of.boundary, *of.reactions);
                for (LoadReaction<D>& one : of.reactions->loads)
                    for_impulses(one.reaction, [&](double& impulse) { impulse *= now.dt / first; });
            }
            step.leave_velocities(now.dt);
            if constexpr (in_two_stages) step.leave_velocities_before(now.dt, double(of.transfer.ratio));
        });
    }
    /// Returns a sentence about the first particle that the last displacement turns inside out, if there is one.
    static std::string inverted_particle(Simulation& of) {
        const DisplacementReport& last = of.solution.newton.last;
        if (last.is_regular()) return {};
        const ParticleStore<S, D>& store = of.sets_[last.set].store();
        const Vec<double, D> x = store.exact_position(last.first);
        return sentence("Particle ", store.id(last.first), " at ", point_text(x.v, D), " m is the first of ",
                        last.inverted, " that would be turned inside out. ");
    }
    template <std::size_t... I>
    static auto potential_of(Simulation& of, const Now& now, std::index_sequence<I...>) {
        return IncrementalPotential(of.grid_, now.dt, now.threads, displaced(of.template set_at<I>(), now)...);
    }
    template <class Set>
    static auto displaced(Set& set, const Now& now) {
        using View = decltype(set.particles.view());
        return DisplacedSet<Kernel, Force, View, std::remove_cvref_t<decltype(set.material)>, VolumeOfStep>(
            ParticleSet<View>{set.particles.view(), set.partition}, set.material, now.mirrors, set.particles.domain(),
            now.start);
    }
    static void g2p(Simulation& of, Now& now) {
        Base::gather_set(of, now, [&](auto& set) {
            Moves moves{};
            if constexpr (Time::has_inertia) moves = of.transfer;
            const PassReport pass = g2p_pass<Kernel, Moves, Force, VolumeOfStep>(
                now.threads, set.particles.view(), set.partition, of.grid_, set.material, now.time_step(), moves);
            if constexpr (!Time::has_inertia) stop(set.particles);
            return pass;
        });
    }
};

}  // namespace firn::inline FIRN_BUILD::detail
