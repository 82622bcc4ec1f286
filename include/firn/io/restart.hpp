/// \file Restores a simulation from a state, so that the run can be continued. The continued run gives the same bits as
/// an uninterrupted run. Optionally, restore() also accepts states that were written with another build, precision or
/// policy (see Restart).
#pragma once

#include <firn/io/simulation_state.hpp>

#include <algorithm>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

[[noreturn]] inline void throw_damaged(const std::string& what) {
    throw io_error(sentence("The state's ", what, " is inconsistent; the file is damaged. Go on from another state."));
}

/// Checks that the run that wrote the state had the same policies, precision, domain, cells and material parameters as
/// the simulation, and with Restart::same_bits also the same build.
/// \throws io_error  if one of these differs
template <std::floating_point S, int D, class T>
void check_same_run(const PolicyFacts& facts, const Domain<D>& domain, const SetOf<S, D>& set, const State<T>& state,
                    Restart how);

/// Sets the parameters of a volumetric policy to the values in a state. A state of an earlier firn does not say how
/// fast particles are shifted: they were not.
template <class Volume, class T>
[[gnu::cold]] void restore_volume(Volume& volume, const State<T>& state) {
    State<T> said;
    said.parameters = state.parameters;
    const auto is_shifting = [](const StateParameter& p) { return p.group == "volumetric" && p.name == "shifting"; };
    if constexpr (shifts_particles<Volume>)
        if (std::none_of(said.parameters.begin(), said.parameters.end(), is_shifting))
            said.parameters.push_back({"volumetric", "shifting", "1", {0}});
    restore_parameters(volume, said, "volumetric");
}

/// What restore() takes from a state for one set of particles, besides the set and the policies.
struct RestoredRun {
    Moment moment;
    bool converted;  ///< if so, only the two members above count
    std::vector<double> gravity{};
    double fixed_time_step = 0, most_steps_between_sorts = 0;
    double largest_acceleration = -1;  ///< \see RunOf::largest_acceleration
};
/// Everything that restore() takes from a state for one set of particles.
template <class Simulation, std::size_t I>
struct RestoredSet {
    typename Simulation::template SetAt<I> stored;
    decltype(Simulation::boundary) boundary;
    decltype(Simulation::transfer) transfer;
    decltype(Simulation::volume) volume;
    RestoredRun run;
};

/// Reads and checks the particles of a state and what else restore() takes, except the policies.
/// \param stored  receives the particles; a set without particles
/// \throws io_error, particle_error  as restore()
template <std::floating_point S, int D, class T>
RestoredRun read_particles(const State<T>& state, Restart how, const KernelFacts& kernel, int threads,
                           SetOf<S, D>& stored);

/// Reads and checks what restore() takes from a state. The simulation is not changed.
/// \throws io_error, particle_error  as restore()
template <class Simulation, std::size_t I, class T>
[[gnu::cold]] RestoredSet<Simulation, I> read_set(SetHandle<Simulation, I> set, const State<T>& state, Restart how) {
    const Simulation& simulation = set.simulation();
    check_dimension(state, Simulation::dimension);
    PolicyFacts facts = policy_facts_of<I>(simulation);
    const bool takes_material = how != Restart::converted && has_parameter(state, "run", "material_edited");
    if (takes_material) std::erase_if(facts.parameters, [](const auto& p) { return p.group == "material"; });
    if (how != Restart::converted) check_same_run(facts, simulation.domain(), simulation.sets()[I], state, how);
    if (how == Restart::same_bits && ranks_of(simulation.execution).speaks())
        warn_of_unseen(facts.settings, simulation.warn);

    RestoredSet<Simulation, I> made{
        {set.material(), simulation.domain()}, simulation.boundary, simulation.transfer, simulation.volume, {}};
    if (takes_material) {
        restore_parameters(made.stored.material, state, "material");
        try {
            check_material<Simulation::dimension>(made.stored.material);
        } catch (const parameter_error& wrong) {
            throw io_error(sentence("The state's material, which the run had edited, is damaged: ", wrong.what(),
                                    " Go on from another state."));
        }
        made.stored.material_edited = true;
    }
    const int threads = thread_count(requested_threads(simulation.execution));
    made.run = read_particles(state, how, simulation.kernel(), threads, made.stored);
    if (made.run.converted) return made;
    restore_parameters(made.boundary, state, "boundary");
    restore_parameters(made.transfer, state, "transfer");
    restore_volume(made.volume, state);
    return made;
}

/// Gives a simulation what read_set() has read.
/// \throws io_error  if another material was restored to a different moment; the simulation is unchanged
template <class Simulation, std::size_t I>
[[gnu::cold]] void give_set(Simulation& simulation, RestoredSet<Simulation, I>&& made) {
    const RestoredRun& run = made.run;
    simulation.template restore<I>(std::move(made.stored), run.moment, run.largest_acceleration);
    if (run.converted) return;
    simulation.boundary = made.boundary;
    simulation.transfer = made.transfer;
    simulation.volume = made.volume;
    std::copy(run.gravity.begin(), run.gravity.end(), simulation.gravity.v);
    simulation.fixed_time_step = run.fixed_time_step;
    simulation.most_steps_between_sorts = std::uint64_t(run.most_steps_between_sorts);
}

}  // namespace detail

/// Restores a set of particles (all particles of one material) from a state, so that the run can be continued.
///
/// First make the simulation in the same way as for the run that wrote the state: with the same policies, domain,
/// material, loads, forces between particles, sources and sinks. Loads and forces refer to bodies, so add loads and
/// forces after the particles were added or restored. Sources and sinks that were added before are compared with those
/// of the state, see Restart::same_bits. The particles of the state replace all particles of the set.
///
/// restore() takes from the state: particles, bodies, time, number of steps, all parameters of the transfer, of the
/// volumetric policy and of the boundary (including the position of a moving boundary), gravity, fixed_time_step and
/// most_steps_between_sorts; and the parameters of the material, if the program had changed them during the run (see
/// SetAccess::edit_material). To change one of these, call restore() first, and then set the new value. The number of
/// threads is not taken from the state.
///
/// In a simulation with several materials, call restore() once for each material, with states of the same time.
///
/// With Restart::converted, restore() takes less from the state: only the particles (ids, positions, velocities,
/// masses, volumes and material states), bodies, time and number of steps. Everything else in the simulation (domain,
/// boundary, gravity, …) is not changed. If the state has no field affine_velocity, the affine velocities are 0.
/// \param set    the set; in a simulation with several materials for example `simulation.set<Snow<float>>()`
/// \param state  the state, such as read_state() returns
/// \param how    which states are accepted
/// \throws io_error        if the state was written by a run that `how` does not accept (see Restart), or if a part of
///                         the state is missing or damaged (the message names this part); the simulation is unchanged
/// \throws particle_error  if particles are outside the domain; the simulation is unchanged
template <class Simulation, std::size_t I, state_scalar T>
    requires has_one_rank<decltype(Simulation::execution)>  // on many ranks: firn::mpi::restore()
void restore(SetHandle<Simulation, I> set, const State<T>& state, Restart how = Restart::same_bits) {
    detail::give_set<Simulation, I>(set.simulation(), detail::read_set(set, state, how));
}
/// Restores a simulation with one material from a state, so that the run can be continued. The documentation of
/// restore() for a set of particles lists what is taken from the state.
/// \param how  which states are accepted
/// \throws io_error        if the state was written by a run that `how` does not accept (see Restart), or if a part of
///                         the state is missing or damaged; the simulation is unchanged
/// \throws particle_error  if particles are outside the domain; the simulation is unchanged
template <int D, class Material, class... Policies, state_scalar T>
    requires has_one_rank<decltype(Simulation<D, Material, Policies...>::execution)>
void restore(Simulation<D, Material, Policies...>& simulation, const State<T>& state,
             Restart how = Restart::same_bits) {
    restore(simulation.set(), state, how);
}

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES_OF_STATES
#include <firn/io/restart-inl.hpp>
#endif
