/// \file From a simulation to a state and back: a run that is restored goes on to the same bits.
#pragma once

#include <firn/core/names.hpp>
#include <firn/io/state.hpp>
#include <firn/lagrangian/any_force.hpp>
#include <firn/simulation.hpp>
#include <firn/version.hpp>

#include <bit>
#include <vector>

namespace firn {

namespace detail {

template <class S>
    requires std::is_arithmetic_v<S>
std::vector<double> as_doubles(S value) {
    return {double(value)};
}
template <class S, int D>
std::vector<double> as_doubles(const Vec<S, D>& value) {
    return {value.v, value.v + D};
}

inline std::string compiler_name() {
#if defined(__clang__)
    return sentence("clang ", __clang_major__, ".", __clang_minor__, ".", __clang_patchlevel__);
#else
    return sentence("g++ ", __GNUC__, ".", __GNUC_MINOR__, ".", __GNUC_PATCHLEVEL__);
#endif
}

/// What must be the same for a run to go on: names of the policies and the precision.
template <class S, class Material, class Transfer, class Force, class Kernel, class Boundary>
std::vector<StateAttribute> policy_attributes() {
    return {{"kernel", std::string(name_of<Kernel>())},     {"transfer", std::string(name_of<Transfer>())},
            {"force", std::string(name_of<Force>())},       {"material", std::string(name_of<Material>())},
            {"boundary", std::string(name_of<Boundary>())}, {"precision", sizeof(S) == 4 ? "float" : "double"}};
}

}  // namespace detail

/// The state of a simulation as it is: positions [m] and places [cells from the lower corner of the particle's block:
/// what positions are rounded from], velocities [m/s], C [1/s], the material's state (F), τ [Pa],
/// mass [kg], volume [m^D], in the order of ids; the facets of nets; the order of the slots and blocks beside them, so
/// that sums go on in the same order; parameters with units; names of policies.
/// \tparam I  of which of the simulation's materials
/// \param into  whose memory is used anew: what a series gives back (BackgroundSeries::spare), or nothing yet
template <std::size_t I = 0, int D, class Materials, class Transfer, class Force, class Kernel, class Execution,
          class Boundary>
void state_of(Simulation<D, Materials, Transfer, Force, Kernel, Execution, Boundary>& simulation,
              State<detail::precision_of_t<Materials>>& into) {
    using S = detail::precision_of_t<Materials>;
    using Material = std::remove_cvref_t<decltype(simulation.template material<I>())>;
    const BlockPartition<D>& partition = simulation.template partition<I>();
    const auto& particles = simulation.template particles<I>();
    const std::vector<Body>& all_bodies = simulation.template bodies<I>();
    const std::size_t n = particles.size();

    const int threads = requested_threads(simulation.execution);
    State<S> before = std::move(into), state;
    state.dimension = D;
    state.step = simulation.steps();
    state.time = simulation.time();
    state.dt = simulation.last_time_step();
    std::vector<std::size_t> slot_of(particles.next_id(), no_particle);  // of each id; then, of those that there are
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) slot_of[particles.id(slot)] = slot;
    std::erase(slot_of, std::size_t(no_particle));
    state.id = std::move(before.id);
    state.id.clear();
    state.id.reserve(n);
    for (const std::size_t slot : slot_of) state.id.push_back(std::int64_t(particles.id(slot)));
    state.material.resize(n);
    for (std::size_t b = 0; b < all_bodies.size(); ++b) {
        const auto place_of = [&](std::int64_t id) {
            return state.material.begin() + (std::lower_bound(state.id.begin(), state.id.end(), id) - state.id.begin());
        };
        const std::int64_t first = all_bodies[b].first;
        std::fill(place_of(first), place_of(first + all_bodies[b].count), std::int32_t(b));
    }

    for (const Facet<D>& facet : simulation.template facets<I>()) {
        std::array<std::int64_t, D> rows{};
        bool whole = true;
        for (std::size_t k = 0; k < std::size_t(D); ++k) {
            const auto found = std::lower_bound(state.id.begin(), state.id.end(), std::int64_t(facet[k]));
            whole = whole && found != state.id.end() && *found == std::int64_t(facet[k]);
            rows[k] = found - state.id.begin();
        }
        if (whole) state.facets.insert(state.facets.end(), rows.begin(), rows.end());
    }

    const auto add = [&](const char* name, const char* unit, int components, const auto& get) {
        StateField<S> field{name, unit, components, {}};
        if (const std::size_t k = state.fields.size(); k < before.fields.size())
            field.values = std::move(before.fields[k].values);
        field.values.resize(n * std::size_t(components));
        detail::for_chunks(n, threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                get(slot_of[i], field.values.data() + i * std::size_t(components));
        });
        state.fields.push_back(std::move(field));
    };
    const auto put = [](const auto& value, S* to) {
        using Value = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_arithmetic_v<Value>)
            *to = value;
        else if constexpr (component_count<Value> == D)
            std::copy_n(value.v, D, to);
        else
            for (int k = 0; k < D * D; ++k) to[k] = value(k / D, k % D);
    };
    add("position", "m", D, [&](std::size_t slot, S* to) { put(particles.position(slot), to); });
    add("place", "1", D, [&](std::size_t slot, S* to) { put(particles.place(slot), to); });
    add("velocity", "m/s", D, [&](std::size_t slot, S* to) { put(particles.velocity(slot), to); });
    add("affine_velocity", "1/s", D * D, [&](std::size_t slot, S* to) { put(particles.affine(slot), to); });
    add("kirchhoff_stress", "Pa", D * D, [&](std::size_t slot, S* to) { put(particles.stress(slot), to); });
    add("mass", "kg", 1, [&](std::size_t slot, S* to) { put(particles.mass(slot), to); });
    add("volume", D == 3 ? "m^3" : "m^2", 1, [&](std::size_t slot, S* to) { put(particles.volume(slot), to); });
    std::apply(
        [&](const auto&... member) {
            [[maybe_unused]] const auto add_member = [&](const auto& m) {
                using Value = std::remove_cvref_t<decltype(particles.state(0).*(m.member))>;
                add(m.name, m.unit, component_count<Value>,
                    [&](std::size_t slot, S* to) { put(particles.state(slot).*(m.member), to); });
            };
            (add_member(member), ...);
        },
        material_state_t<Material, D>::fields());

    state.attributes = detail::policy_attributes<S, Material, Transfer, Force, Kernel, Boundary>();
    if constexpr (requires { simulation.boundary.description(); })
        state.attributes.push_back({"boundary_conditions", simulation.boundary.description()});
    state.attributes.push_back({"execution", Execution::name});
    state.attributes.push_back({"library_version", version()});
    state.attributes.push_back({"compiler", detail::compiler_name()});

    const auto parameter = [&](const char* group, std::string name, const char* unit, std::vector<double> values) {
        state.parameters.push_back({group, std::move(name), unit, std::move(values)});
    };
    for_parameters(simulation.template material<I>(),
                   [&](const std::string& name, const char* unit, const auto& value) {
                       parameter("material", name, unit, detail::as_doubles(value));
                   });
    for_parameters(simulation.transfer, [&](const std::string& name, const char* unit, const auto& value) {
        parameter("transfer", name, unit, detail::as_doubles(value));
    });
    for_parameters(simulation.boundary, [&](const std::string& name, const char* unit, const auto& value) {
        parameter("boundary", name, unit, detail::as_doubles(value));
    });
    parameter("grid", "lower", "m", detail::as_doubles(simulation.domain().lower));
    parameter("grid", "upper", "m", detail::as_doubles(simulation.domain().upper));
    parameter("grid", "cell_size", "m", {simulation.domain().cell_size});
    parameter("grid", "periodic", "1", {simulation.domain().periodic.begin(), simulation.domain().periodic.end()});
    parameter("run", "gravity", "m/s^2", detail::as_doubles(simulation.gravity));
    parameter("run", "fixed_time_step", "s", {simulation.fixed_time_step});
    parameter("run", "signal_speed", "m/s", {simulation.template report<I>().signal_speed});
    parameter("run", "sort_needed", "1", {double(simulation.template report<I>().sort_needed)});
    parameter("run", "next_id", "1", {double(particles.next_id())});

    StateTable slots{"slot", 1, {slot_of.begin(), slot_of.end()}};
    StateTable blocks{"blocks", D + 2, {}};
    for (const std::uint32_t r : partition.by_block) {
        const BlockRange<D>& range = partition.ranges[r];
        for (const int coordinate : range.block) blocks.values.push_back(coordinate);
        blocks.values.push_back(std::int64_t(range.first_slot));
        blocks.values.push_back(std::int64_t(range.particles));
    }
    StateTable bodies{"bodies", 3, {}};  // first id, count, the bits of the end of their time
    for (const Body& body : all_bodies)
        bodies.values.insert(bodies.values.end(), {body.first, body.count, std::bit_cast<std::int64_t>(body.end)});
    state.tables = {std::move(slots), std::move(blocks), std::move(bodies)};
    into = std::move(state);
}
/// The same, in memory of its own.
template <std::size_t I = 0, int D, class Materials, class... Policies>
State<detail::precision_of_t<Materials>> state_of(Simulation<D, Materials, Policies...>& simulation) {
    State<detail::precision_of_t<Materials>> state;
    state_of<I>(simulation, state);
    return state;
}

namespace detail {

/// The values of a parameter that state_of() writes.
template <class S>
std::vector<double> parameter_values(const State<S>& state, const char* group, const char* name) {
    for (const StateParameter& p : state.parameters)
        if (p.group == group && p.name == name && !p.values.empty()) return p.values;
    throw io_error(sentence("The state does not say ", group, "/", name, "; it was not written by state_of()."));
}

/// The first id that no particle has had, at most 2³² − 1.
template <class S>
std::int64_t next_id(const State<S>& state) {
    const double next = parameter_values(state, "run", "next_id")[0];
    if (!(next >= 0 && next <= double(no_particle)) || next != std::floor(next))
        throw io_error(sentence("The state says ", next, " for run/next_id; the file is damaged."));
    return std::int64_t(next);
}

/// \throws io_error if the state was made by other policies, in another precision or dimension, or another domain
template <class S, int D>
void check_same_run(const State<S>& state, const std::vector<StateAttribute>& ours, const Domain<D>& domain) {
    if (state.dimension != D)
        throw io_error(sentence("The state has ", state.dimension, " dimensions, the simulation ", D, "."));
    for (const StateAttribute& mine : ours) {
        const auto same = [&](const StateAttribute& a) { return a.name == mine.name; };
        const auto theirs = std::find_if(state.attributes.begin(), state.attributes.end(), same);
        const std::string found = theirs == state.attributes.end() ? "nothing" : "'" + theirs->value + "'";
        if (found != "'" + mine.value + "'")
            throw io_error(sentence("The state says ", found, " for ", mine.name, ", the simulation uses '", mine.value,
                                    "'. Go on with a simulation of the same policies and precision."));
    }
    if (parameter_values(state, "grid", "lower") != as_doubles(domain.lower) ||
        parameter_values(state, "grid", "upper") != as_doubles(domain.upper) ||
        parameter_values(state, "grid", "cell_size") != as_doubles(domain.cell_size) ||
        parameter_values(state, "grid", "periodic") !=
            std::vector<double>(domain.periodic.begin(), domain.periodic.end()))
        throw io_error(
            "The state was made in another domain or with other cells than the simulation's. Give the same.");
}

inline const StateTable& table(const std::vector<StateTable>& tables, const char* name, int columns) {
    for (const StateTable& t : tables)
        if (t.name == name && t.columns == columns) return t;
    throw io_error(sentence("The state has no table '", name, "' of ", columns,
                            " columns; it was not written by state_of() and cannot be continued."));
}

}  // namespace detail

/// Sets a policy's parameters to those of a state's group: boundaries that moved go back to where they were.
///
///     restore_parameters(simulation.boundary, state, "boundary");
///
/// \throws io_error if the state lacks one, or has another number of values for it; the policy is then as it was
template <class Policy, class S>
void restore_parameters(Policy& policy, const State<S>& state, const char* group) {
    Policy restored = policy;
    for_parameters(restored, [&](const std::string& name, const char*, auto& value) {
        const std::vector<double> values = detail::parameter_values(state, group, name.c_str());
        if (values.size() != detail::as_doubles(value).size())
            throw io_error(sentence("The state has ", values.size(), " values for ", group, "/", name,
                                    "; the simulation's policy needs ", detail::as_doubles(value).size(), "."));
        using Value = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_arithmetic_v<Value>)
            value = Value(values[0]);
        else
            for (std::size_t i = 0; i < values.size(); ++i)
                value[int(i)] = std::remove_cvref_t<decltype(value[0])>(values[i]);
    });
    policy = restored;
}

/// Goes on from a state: `simulation` must have been made with the same policies, domain and material; it takes over
/// particles, time and steps (not gravity, boundary, forces or the time step, which are the program's;
/// restore_parameters() puts a boundary that moved back), and every further step gives the bits of the run that wrote
/// the state. With several materials: once for each, with the states of one moment.
/// \tparam I  of which of the simulation's materials
/// \throws io_error naming what differs or is missing; the simulation is then as it was
template <std::size_t I = 0, int D, class Materials, class Transfer, class Force, class Kernel, class Execution,
          class Boundary>
void restore(Simulation<D, Materials, Transfer, Force, Kernel, Execution, Boundary>& simulation,
             const State<detail::precision_of_t<Materials>>& state) {
    using S = detail::precision_of_t<Materials>;
    using Material = std::remove_cvref_t<decltype(simulation.template material<I>())>;
    using MaterialState = material_state_t<Material, D>;
    detail::check_same_run(state, detail::policy_attributes<S, Material, Transfer, Force, Kernel, Boundary>(),
                           simulation.domain());

    const std::size_t n = state.size();
    const StateTable& slot_of = detail::table(state.tables, "slot", 1);
    const StateTable& blocks = detail::table(state.tables, "blocks", D + 2);
    const StateTable& body_table = detail::table(state.tables, "bodies", 3);
    const auto damaged = [](const char* what) {
        return io_error(
            sentence("The state's ", what, " is inconsistent; the file is damaged. Go on from another state."));
    };

    std::vector<BlockRange<D>> ranges;
    for (std::size_t row = 0; row < blocks.values.size(); row += D + 2) {
        BlockRange<D> range{};
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            if (const auto b = blocks.values[row + a]; b <= -(1 << 20) || b >= 1 << 20)
                throw damaged("table of blocks");
            range.block[a] = int(blocks.values[row + a]);
        }
        if (blocks.values[row + D + 1] < 1 || blocks.values[row + D + 1] > std::int64_t(n))
            throw damaged("table of blocks");
        range.particles = std::size_t(blocks.values[row + D + 1]);
        if (!ranges.empty() && block_key<D>(range.block) <= block_key<D>(ranges.back().block))
            throw damaged("table of blocks");
        ranges.push_back(range);
    }
    BlockPartition<D> partition = arrange<D>(ranges, colours_along_axis<Kernel>);
    const std::size_t slots = partition.slots();
    for (std::size_t i = 0; i < ranges.size(); ++i)
        if (std::size_t(blocks.values[i * (D + 2) + D]) != partition.ranges[partition.by_block[i]].first_slot)
            throw damaged("table of blocks");
    if (partition.particles != n || slot_of.values.size() != n) throw damaged("table of blocks");
    const std::int64_t next_id = detail::next_id(state);
    for (std::size_t i = 0; i < n; ++i) {
        const std::int64_t slot = slot_of.values[i];
        if (slot < 0 || slot >= std::int64_t(slots) || partition.order[std::size_t(slot)] != no_particle ||
            state.id[i] < (i == 0 ? 0 : state.id[i - 1] + 1) || state.id[i] >= next_id)
            throw damaged("order of particles");
        partition.order[std::size_t(slot)] = std::uint32_t(i);
    }
    for (const BlockRange<D>& range : partition.ranges)
        for (std::size_t i = 0; i < range.particles; ++i)
            if (partition.order[range.first_slot + i] == no_particle) throw damaged("order of particles");

    const auto field = [&](const char* name, int components) -> const S* {
        const StateField<S>& f = state.field(name);
        if (f.components != components || f.values.size() != n * std::size_t(components)) throw damaged(name);
        return f.values.data();
    };
    const auto matrix = [](const S* from) {
        Mat<S, D> m{};
        for (int k = 0; k < D * D; ++k) m(k / D, k % D) = from[k];
        return m;
    };
    const S *x = field("position", D), *place = field("place", D), *v = field("velocity", D),
            *C = field("affine_velocity", D * D), *stress = field("kirchhoff_stress", D * D), *mass = field("mass", 1),
            *volume = field("volume", 1);
    std::vector<std::uint32_t> range_of(n);
    for (std::size_t r = 0; r < partition.ranges.size(); ++r)
        for (std::size_t i = 0; i < partition.ranges[r].particles; ++i)
            range_of[partition.order[partition.ranges[r].first_slot + i]] = std::uint32_t(r);

    Particles<S, D, MaterialState> particles(simulation.domain());
    particles.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
        Vec<double, D> position{};
        Vec<S, D> of_block{}, velocity{};
        std::copy_n(x + i * D, D, position.v);
        std::copy_n(place + i * D, D, of_block.v);
        std::copy_n(v + i * D, D, velocity.v);
        if (!(mass[i] > 0) || !(volume[i] >= 0)) throw damaged("mass or volume");
        particles.skip_ids(std::uint32_t(state.id[i]));
        particles.push_back(position, velocity, mass[i], volume[i]);
        particles.set_place(i, partition.ranges[range_of[i]].block, of_block);
        for (int a = 0; a < D; ++a) {
            const double rounding = 4 * double(std::numeric_limits<S>::epsilon()) * std::abs(position[a]);
            if (!(std::abs(particles.exact_position(i)[a] - position[a]) <=
                  rounding + 1e-9 * simulation.domain().cell_size))
                throw damaged("place or position of a particle");
        }
        particles.set_affine(i, matrix(C + i * D * D));
        particles.set_stress(i, matrix(stress + i * D * D));
    }
    particles.skip_ids(std::uint32_t(next_id));
    check_positions<double, D>(n, simulation.domain(),
                               [&](std::size_t i, int a) { return particles.exact_position(i)[a]; });
    std::apply(
        [&](const auto&... member) {
            [[maybe_unused]] const auto read = [&](const auto& m) {
                using Value = std::remove_cvref_t<decltype(particles.state(0).*(m.member))>;
                constexpr int components = component_count<Value>;
                const S* from = field(m.name, components);
                for (std::size_t i = 0; i < n; ++i) {
                    MaterialState one = particles.state(i);
                    auto& value = one.*(m.member);
                    if constexpr (components == D * D)
                        value = matrix(from + i * std::size_t(components));
                    else
                        std::copy_n(from + i * std::size_t(components), components, detail::components(value));
                    particles.set_state(i, one);
                }
            };
            (read(member), ...);
        },
        MaterialState::fields());
    std::vector<Body> bodies;
    for (std::size_t row = 0; row < body_table.values.size(); row += 3)
        bodies.push_back({std::uint32_t(body_table.values[row]), std::uint32_t(body_table.values[row + 1]),
                          std::bit_cast<double>(body_table.values[row + 2])});

    particles.reorder(partition, [](std::size_t count, const auto& body) {
        for (std::size_t i = 0; i < count; ++i) body(i);
    });
    const G2PReport report{detail::parameter_values(state, "run", "signal_speed")[0],
                           detail::parameter_values(state, "run", "sort_needed")[0] != 0};
    MaterialSet<D, Material> set{
        simulation.template material<I>(), std::move(particles), std::move(partition), std::move(bodies), report, true};
    simulation.template restore<I>(std::move(set), state.time, state.step, state.dt);
}

}  // namespace firn
