/// \file Bodies of simulation_state.hpp. A program that links firn::compiled_hdf5 does not include them.
#pragma once

#include <firn/data/curve.hpp>
#include <firn/data/read_particles.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/sort/radix_sort.hpp>

#include <algorithm>
#include <bit>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

[[gnu::cold]] FIRN_BODY void PolicyFacts::add(const char* group, const std::string& name, const char* unit,
                                              std::vector<double> values) {
    parameters.push_back({group, name, unit, std::move(values)});
}

/// Returns the fields of a state: first the positions [m], then all fields of the particle store, the remainders, and
/// what the material computes for states.
/// \param slots   slots of the particles in the particle store; the i-th value of each field belongs to the particle in
///                the slot slots[i]
/// \param before  fields of an older state; the memory of these fields is reused
/// \param time    the present time [s]
template <class S, int D>
std::vector<StateField<S>> fields_of(const SetOf<S, D>& set, const std::vector<std::uint32_t>& slots,
                                     std::vector<StateField<S>> before, double time, int threads) {
    const ParticleStore<S, D>& particles = set.store();
    const FieldTable& table = particles.table();
    std::size_t less_one = 0;
    for (const FieldInfo& info : table) less_one += info.less_one;
    before.resize(1 + table.size() + less_one + set.outputs().size());
    // read(slots, to) reads some of the particles.
    const auto fill_with = [&](StateField<S>& field, const std::string& name, const char* unit, int components,
                               const auto& read) {
        field.name = name;
        field.unit = unit;
        field.components = components;
        field.values.resize(slots.size() * std::size_t(components));
        for_chunks(slots.size(), threads, [&](std::size_t first, std::size_t last) {
            read(std::span(slots).subspan(first, last - first), field.values.data() + first * std::size_t(components));
        });
    };
    using Slots = std::span<const std::uint32_t>;
    fill_with(before[0], "position", "m", D, [&](Slots of, S* to) { read_positions(particles, of, to); });
    for (std::size_t f = 0; f < table.size(); ++f)
        fill_with(before[f + 1], table[f].name, table[f].unit, table[f].components_in_state(D),
                  [&](Slots of, S* to) { read_field(particles, f, of, to); });
    const auto fill = [&](StateField<S>& field, const std::string& name, const char* unit, int components,
                          const auto& get) {
        fill_with(field, name, unit, components, [&](Slots of, S* to) {
            for (std::size_t i = 0; i < of.size(); ++i) get(of[i], to + i * std::size_t(components));
        });
    };
    std::size_t next = 1 + table.size();
    for (std::size_t f = 0; f < table.size(); ++f)
        if (table[f].less_one)
            fill(before[next++], table[f].remainder_name(), table[f].unit, table[f].components_less_one(D),
                 [&](std::size_t slot, S* to) { particles.get_remainders(f, slot, to); });
    for (std::size_t k = 0; k < set.outputs().size(); ++k)
        fill(before[next++], set.outputs()[k].name, set.outputs()[k].unit, 1, [&](std::size_t slot, S* to) {
            std::array<S, most_outputs> numbers;
            set.output(slot, time, numbers.data());
            *to = numbers[k];
        });
    return before;
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

    state.fields = fields_of(set, slot_of, std::move(before.fields), run.time(), threads);

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
    if (set.material_edited) parameter("run", "material_edited", "1", {1});
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

}  // namespace firn::inline FIRN_BUILD
