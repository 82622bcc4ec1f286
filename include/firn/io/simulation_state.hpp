/// \file Makes a state from a simulation. The state has everything that is needed to continue the run.
#pragma once

#include <firn/core/names.hpp>
#include <firn/io/settings.hpp>
#include <firn/io/state_parts.hpp>
#include <firn/lagrangian/any_force.hpp>
#include <firn/simulation.hpp>
#include <firn/version.hpp>

#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns attributes of a run: the names of the policies, the precision, and the index I of the material in the
/// simulation. The run can be continued from a state only if the state has the same values of these attributes.
template <std::size_t I, int D, class Materials, class Transfer, class Force, class Kernel, class Execution,
          class Boundary, class Volume, class Law, class Time>
[[gnu::cold]] std::vector<StateAttribute> policies_of(
    const Simulation<D, Materials, Transfer, Force, Kernel, Execution, Boundary, Volume, Law, Time>& simulation) {
    using Material = std::remove_cvref_t<decltype(simulation.template set<I>().material())>;
    std::vector<StateAttribute> policies{{"kernel", std::string(name_of<Kernel>())},
                                         {"transfer", std::string(name_of<Transfer>())},
                                         {"force", std::string(name_of<Force>())},
                                         {"material", std::string(name_of<Material>())},
                                         {"material_number", std::to_string(I)},
                                         {"boundary", std::string(name_of<Boundary>())},
                                         {"execution", Execution::name},
                                         {"precision", precision_name<precision_of_t<Materials>>}};
    if constexpr (requires { simulation.boundary.description(); })
        policies.push_back({"boundary_conditions", simulation.boundary.description()});
    if constexpr (!std::same_as<Volume, OwnVolume>) policies.push_back({"volumetric", std::string(name_of<Volume>())});
    if constexpr (!Time::is_explicit) policies.push_back({"time_integration", Time::name});
    if constexpr (Law::between_groups) {
        policies.push_back({"contact", std::string(name_of<Law>())});
        if constexpr (requires { simulation.contact.description(); })
            policies.push_back({"contact_law", simulation.contact.description()});
    }
    return policies;
}

/// Returns what shapes a run besides the parameters in its states, for the material I. \see Settings
template <std::size_t I, class Simulation>
[[gnu::cold]] Settings settings_of(const Simulation& simulation) {
    Settings settings;
    settings.add("material", simulation.template set<I>().material());
    settings.add("transfer", simulation.transfer);
    settings.add("volumetric", simulation.volume);
    settings.add("boundary", simulation.boundary);
    settings.add("contact", simulation.contact);
    if constexpr (!Simulation::integration_type::is_explicit) settings.add("time_integration", simulation.integration);
    return settings;
}

/// What states say of the material and the policies of a run.
struct PolicyFacts {
    std::vector<StateAttribute> attributes;  ///< \see policies_of
    Settings settings;                       ///< \see settings_of
    std::vector<StateParameter> parameters;  ///< the parameters of the material and of the policies
    bool has_contact_groups;

    /// Adds a parameter.
    void add(const char* group, const std::string& name, const char* unit, std::vector<double> values);
};
/// Returns the facts for the material I.
template <std::size_t I, class Simulation>
[[gnu::cold]] PolicyFacts policy_facts_of(const Simulation& simulation) {
    PolicyFacts facts{policies_of<I>(simulation), settings_of<I>(simulation), {}, Simulation::has_contact_groups};
    const auto add = [&](const char* group, const auto& policy) {
        for_parameters(policy, [&](const std::string& name, const char* unit, const auto& value) {
            facts.add(group, name, unit, as_doubles(value));
        });
    };
    add("material", simulation.template set<I>().material());
    add("transfer", simulation.transfer);
    add("volumetric", simulation.volume);
    add("boundary", simulation.boundary);
    return facts;
}

/// Writes the current state of a prepared set of particles to `into`. Call this function in a parallel region: the
/// loops of this function run on the threads of the region.
template <std::floating_point S, int D>
void fill_state_of(const RunOf<S, D>& run, const SetOf<S, D>& set, PolicyFacts policies, int threads, State<S>& into);

}  // namespace detail

/// Writes the current state of a set of particles (all particles of one material) to `into`.
///
/// The state has, in the order of ids, the positions [m] and all fields of the particles:
/// - `place`: the exact position within the particle's block [cells from the block's lower corner], from which
///   `position` is computed with rounding
/// - velocities [m/s], the affine matrix C of APIC [1/s], the Kirchhoff stress τ [Pa], masses [kg], volumes [m^D]
/// - the state variables of the material, such as the deformation gradient F
/// - `deformation_gradient_remainder` and `volume_ratio_remainder`: what the diagonal of F, and J, lack of the stored
///   numbers F − I and J − 1
///
/// The state also has the facets of nets, the parameters with their units, the names of the policies, and two tables
/// that say in which order a continued run has to add up numbers:
/// - `blocks`: one row for each block of cells that has particles, in the order of the blocks along a curve through all
///   blocks (see before_on_curve()): the block's D coordinates, the number of particles in the blocks before it, and
///   the number of its particles
/// - `slot`: the number of each particle in this order: block by block, and in a block in the order of memory
///
/// If the simulation has contact groups, the table `contact_group` has the group of each body. The blocks of a group
/// lie further along axis 0, see copy_stride().
///
/// The attributes `settings` and `sources_and_sinks` tell what shapes the run and is no parameter. \see Restart
///
/// These tables do not depend on how the particles are spread over memory, threads or processes.
/// \param set   the set; in a simulation with several materials for example `simulation.set<Snow<float>>()`
/// \param into  the state that is overwritten; it may be empty, or an older state whose memory is reused, such as
///              BackgroundSeries::spare() returns
template <class Simulation, std::size_t I>
void state_of(SetHandle<Simulation, I> set, State<typename Simulation::scalar_type>& into) {
    const auto& simulation = set.simulation();
    const int threads = requested_threads(simulation.execution);
    parallel_region(thread_count(threads), [&] {
        static_cast<void>(set.partition());  // prepares the particles
        detail::fill_state_of(simulation, simulation.sets()[I], detail::policy_facts_of<I>(simulation), threads, into);
    });
}
/// Returns the current state of a set of particles (all particles of one material), in newly allocated memory.
template <class Simulation, std::size_t I>
State<typename Simulation::scalar_type> state_of(SetHandle<Simulation, I> set) {
    State<typename Simulation::scalar_type> state;
    state_of(set, state);
    return state;
}
/// Writes the current state of a simulation with one material to `into`.
/// \param into  the state that is overwritten; it may be empty, or an older state whose memory is reused
template <int D, class Material, class... Policies>
void state_of(Simulation<D, Material, Policies...>& simulation, State<detail::precision_of_t<Material>>& into) {
    state_of(simulation.set(), into);
}
/// Returns the current state of a simulation with one material, in newly allocated memory.
template <int D, class Material, class... Policies>
State<detail::precision_of_t<Material>> state_of(Simulation<D, Material, Policies...>& simulation) {
    return state_of(simulation.set());
}

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES_OF_STATES
#include <firn/io/simulation_state-inl.hpp>
#endif
