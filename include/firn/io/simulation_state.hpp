/// \file Makes a state from a simulation. The state has everything that is needed to continue the run.
#pragma once

#include <firn/core/names.hpp>
#include <firn/data/curve.hpp>
#include <firn/io/settings.hpp>
#include <firn/io/state_parts.hpp>
#include <firn/lagrangian/any_force.hpp>
#include <firn/simulation.hpp>
#include <firn/sort/radix_sort.hpp>
#include <firn/version.hpp>

#include <algorithm>
#include <bit>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the fields of a state: first the positions [m], then all fields of the particle store.
/// \param slots   slots of the particles in the particle store; the i-th value of each field belongs to the particle in
///                the slot slots[i]
/// \param before  fields of an older state; the memory of these fields is reused
template <class S, int D>
std::vector<StateField<S>> fields_of(const ParticleStore<S, D>& particles, const std::vector<std::uint32_t>& slots,
                                     std::vector<StateField<S>> before, int threads) {
    const FieldTable& table = particles.table();
    std::size_t less_one = 0;
    for (const FieldInfo& info : table) less_one += info.less_one;
    before.resize(1 + table.size() + less_one);
    const auto fill = [&](StateField<S>& field, const std::string& name, const char* unit, int components,
                          const auto& get) {
        field.name = name;
        field.unit = unit;
        field.components = components;
        field.values.resize(slots.size() * std::size_t(components));
        for_chunks(slots.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) get(slots[i], field.values.data() + i * std::size_t(components));
        });
    };
    fill(before[0], "position", "m", D,
         [&](std::size_t slot, S* to) { std::copy_n(particles.position(slot).v, D, to); });
    for (std::size_t f = 0; f < table.size(); ++f)
        fill(before[f + 1], table[f].name, table[f].unit, table[f].components_in_state(D),
             [&](std::size_t slot, S* to) { particles.get(f, slot, to); });
    std::size_t next = 1 + table.size();
    for (std::size_t f = 0; f < table.size(); ++f)
        if (table[f].less_one)
            fill(before[next++], table[f].remainder_name(), table[f].unit, table[f].components_less_one(D),
                 [&](std::size_t slot, S* to) { particles.get_remainders(f, slot, to); });
    return before;
}

/// Returns attributes of a run: the names of the policies, the precision, and the index I of the material in the
/// simulation. The run can be continued from a state only if the state has the same values of these attributes.
template <std::size_t I, int D, class Materials, class Transfer, class Force, class Kernel, class Execution,
          class Boundary, class Volume, class Law>
std::vector<StateAttribute> policies_of(
    const Simulation<D, Materials, Transfer, Force, Kernel, Execution, Boundary, Volume, Law>& simulation) {
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
    if constexpr (Law::between_groups) {
        policies.push_back({"contact", std::string(name_of<Law>())});
        if constexpr (requires { simulation.contact.description(); })
            policies.push_back({"contact_law", simulation.contact.description()});
    }
    return policies;
}

/// Returns what shapes a run besides the parameters in its states, for the material I. \see Settings
template <std::size_t I, class Simulation>
Settings settings_of(const Simulation& simulation) {
    Settings settings;
    settings.add("material", simulation.template set<I>().material());
    settings.add("transfer", simulation.transfer);
    settings.add("volumetric", simulation.volume);
    settings.add("boundary", simulation.boundary);
    settings.add("contact", simulation.contact);
    return settings;
}

/// What states say of the material and the policies of a run.
struct PolicyFacts {
    std::vector<StateAttribute> attributes;  ///< \see policies_of
    Settings settings;                       ///< \see settings_of
    std::vector<StateParameter> parameters;  ///< the parameters of the material and of the policies
    bool has_contact_groups;
};
/// Returns the facts for the material I.
template <std::size_t I, class Simulation>
PolicyFacts policy_facts_of(const Simulation& simulation) {
    PolicyFacts facts{policies_of<I>(simulation), settings_of<I>(simulation), {}, Simulation::has_contact_groups};
    const auto add = [&](const char* group, const auto& policy) {
        for_parameters(policy, [&](const std::string& name, const char* unit, const auto& value) {
            facts.parameters.push_back({group, name, unit, as_doubles(value)});
        });
    };
    add("material", simulation.template set<I>().material());
    add("transfer", simulation.transfer);
    add("volumetric", simulation.volume);
    add("boundary", simulation.boundary);
    return facts;
}

/// Returns the indices of a partition's ranges (of the particles of one block each) in the order of their blocks along
/// the curve. \see before_on_curve
template <int D>
std::vector<std::uint32_t> ranges_on_curve(const BlockPartition<D>& partition) {
    RadixSort<std::uint64_t> by_cube;  // stable, so the blocks of a cube stay in the order of their keys
    for (const std::uint32_t r : partition.by_block)
        by_cube.items.push_back({curve_key<D>(cube_of<D>(partition.ranges[r].block)), r});
    by_cube.sort();
    std::vector<std::uint32_t> ranges;
    ranges.reserve(by_cube.items.size());
    for (const auto& item : by_cube.items) ranges.push_back(item.number);
    return ranges;
}

/// Numbers the particles of a partition block by block along the curve, and in a block in the order of their slots.
/// \param blocks  gets, for each block along the curve, its coordinates, the number of its first particle, and how many
///                particles it has
/// \return  for each slot, the number of its particle; of a slot of padding, any number
template <int D>
std::vector<std::uint32_t> numbers_on_curve(const BlockPartition<D>& partition, std::vector<std::int64_t>& blocks) {
    std::vector<std::uint32_t> number_of(partition.slots());
    std::uint32_t next = 0;
    for (const std::uint32_t r : ranges_on_curve(partition)) {
        const BlockRange<D>& range = partition.ranges[r];
        for (const int coordinate : range.block) blocks.push_back(coordinate);
        blocks.push_back(next);
        blocks.push_back(std::int64_t(range.particles));
        for (std::size_t k = 0; k < range.particles; ++k) number_of[range.first_slot + k] = next++;
    }
    return number_of;
}

/// Writes the current state of a prepared set of particles to `into`. Call this function in a parallel region: the
/// loops of this function run on the threads of the region.
template <std::floating_point S, int D>
void fill_state_of(const RunOf<S, D>& run, const SetOf<S, D>& set, PolicyFacts policies, int threads, State<S>& into) {
    const ParticleStore<S, D>& particles = set.store();
    const std::size_t n = particles.size();
    State<S> before = std::move(into), state;
    state.dimension = D;
    state.step = run.steps();
    state.time = run.time();
    state.last_time_step = run.last_time_step();
    const std::vector<std::uint32_t> slot_of = slots_by_id(particles, threads);
    StateTable blocks{"blocks", D + 2, {}};
    const std::vector<std::uint32_t> number_of = numbers_on_curve(set.partition, blocks.values);
    StateTable slots{"slot", 1, {}};
    if (!before.tables.empty()) slots.values = std::move(before.tables[0].values);
    slots.values.resize(n);
    state.id = std::move(before.id);
    state.id.resize(n);
    state.body = std::move(before.body);
    const auto for_rows = [&](const auto& row) {
        for_chunks(n, threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) row(i);
        });
    };
    for_rows([&](std::size_t i) {
        state.id[i] = std::int64_t(particles.id(slot_of[i]));
        slots.values[i] = number_of[slot_of[i]];
    });
    state.body.resize(n);
    for (std::size_t b = 0; b < set.bodies.size(); ++b) {
        const auto place_of = [&](std::int64_t id) {
            return state.body.begin() + (std::lower_bound(state.id.begin(), state.id.end(), id) - state.id.begin());
        };
        const std::int64_t first = set.bodies[b].first;
        std::fill(place_of(first), place_of(first + set.bodies[b].count), std::int32_t(b));
    }

    for (const Facet<D>& facet : set.facets) {
        std::array<std::int64_t, D> rows{};
        bool whole = true;
        for (std::size_t k = 0; k < std::size_t(D); ++k) {
            const auto found = std::lower_bound(state.id.begin(), state.id.end(), std::int64_t(facet[k]));
            whole = whole && found != state.id.end() && *found == std::int64_t(facet[k]);
            rows[k] = found - state.id.begin();
        }
        if (whole) state.facets.insert(state.facets.end(), rows.begin(), rows.end());
    }

    state.fields = fields_of(particles, slot_of, std::move(before.fields), threads);

    state.attributes = std::move(policies.attributes);
    for (StateAttribute& attribute : build_attributes()) state.attributes.push_back(std::move(attribute));
    state.attributes.push_back(policies.settings.attribute(settings_name));
    state.attributes.push_back(settings_of(set.sources, set.sinks).attribute(sources_name));

    state.parameters = std::move(policies.parameters);
    const auto parameter = [&](const char* group, std::string name, const char* unit, std::vector<double> values) {
        state.parameters.push_back({group, std::move(name), unit, std::move(values)});
    };
    parameter("grid", "lower", "m", as_doubles(run.domain().lower));
    parameter("grid", "upper", "m", as_doubles(run.domain().upper));
    parameter("grid", "cell_size", "m", {run.domain().cell_size});
    parameter("grid", "periodic", "1", {run.domain().periodic.begin(), run.domain().periodic.end()});
    parameter("run", "gravity", "m/s^2", as_doubles(run.gravity));
    parameter("run", "fixed_time_step", "s", {run.fixed_time_step});
    parameter("run", "most_steps_between_sorts", "1", {double(run.most_steps_between_sorts)});
    parameter("run", "signal_speed", "m/s", {set.report.signal_speed});
    parameter("run", "sort_needed", "1", {double(set.report.sort_needed)});
    parameter("run", "next_id", "1", {double(particles.next_id())});
    if (run.largest_acceleration() >= 0)  // the last step had an acceleration field
        parameter("run", "largest_acceleration", "m/s^2", {run.largest_acceleration()});

    StateTable bodies{"bodies", 3, {}};  // columns: Body::first, Body::count, bits of Body::end
    for (const Body& body : set.bodies)
        bodies.values.insert(bodies.values.end(), {body.first, body.count, std::bit_cast<std::int64_t>(body.end)});
    state.tables = {std::move(slots), std::move(blocks), std::move(bodies)};
    if (policies.has_contact_groups) {
        StateTable groups{"contact_group", 1, {}};  // Body::contact_group
        for (const Body& body : set.bodies) groups.values.push_back(body.contact_group);
        state.tables.push_back(std::move(groups));
    }
    into = std::move(state);
}

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
