/// \file The description of a WGSL program: its uniforms, buffers and entry points.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/parameters.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/particle_view.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/stage/mirror_planes.hpp>
#include <firn/transfer/concept.hpp>
#include <firn/wgsl/arithmetic.hpp>
#include <firn/wgsl/grids.hpp>

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::wgsl {

/// A uniform of a program: a scalar or vector that the host (the software that runs the program) sets, and that all
/// entry points can read.
struct Uniform {
    std::string name,            ///< name of the uniform's member in the WGSL struct Params
        type,                    ///< type in WGSL: "f32", "u32", "vec3<f32>", …
        unit,                    ///< unit such as "m/s"; "1" if the uniform has no unit
        what;                    ///< meaning of the uniform; empty if it is a parameter of a policy
    std::size_t offset;          ///< position of the uniform in the buffer at binding 0 [bytes]
    std::vector<double> values;  ///< components of the uniform's default value
};

/// A field of the particles, such as their velocity, that is stored in a buffer.
struct Component {
    std::string name;  ///< name of the field, such as "velocity"
    int count;         ///< number of values that the field has for each particle
    std::string unit;  ///< unit such as "m/s"
    /// If the field belongs to a material's state: the values of the field in a body at rest. Otherwise empty.
    std::vector<double> start{};
    bool less_one = false;  ///< whether the buffer has F − I or J − 1 of a field F or J. \see FieldInfo::less_one

    /// Returns what the buffer lacks of the c-th value of the field: 1 or 0.
    int lacking(int c) const {
        const int step = count == 9 ? 4 : count == 4 ? 3 : 1;
        return less_one && c % step == 0 ? 1 : 0;
    }
};

/// A storage buffer of 32-bit values.
struct Buffer {
    std::string name,  ///< name of the buffer in the program
        type;          ///< type of the values: "f32", "i32" or "u32"
    int binding;       ///< binding number of the buffer in group 0
    /// The kind of item for which the buffer has `count` values: "particle", "node", "block" (of 4^D nodes),
    /// "particle_and_bin" (each particle, and 4^D + 2 for each block), "axis_node" (a node along one axis; first all
    /// nodes along x, then all along y, then all along z), "distance" (a node of a grid of distances),
    /// "particle_set" (a single item, of a set of particles) or "program" (a single item).
    std::string per;
    int count;                          ///< number of values that the buffer has for each item
    std::vector<Component> components;  ///< fields in the buffer, in their order; empty if `per` is not "particle"
};

/// An entry point of a program (a function that the host can start on the GPU), and how to dispatch (start) it.
struct EntryPoint {
    std::string name;  ///< name of the function in the program
    /// How much to dispatch. "particle", "node", "block": one invocation for each particle, node or block of 4^D nodes.
    /// "block_workgroup": one workgroup for each block. "x_line", "y_line", "z_line": one invocation for each line of
    /// nodes along this axis. "one_workgroup": a single workgroup.
    std::string per;
    int workgroup_size;  ///< number of invocations per workgroup
    /// For each buffer that the entry point uses: the binding number of the buffer, and whether the entry point may
    /// write to the buffer.
    std::vector<std::pair<int, bool>> bindings;
};

/// Which nodes a program stores: all nodes of the domain, or the blocks of 4^D nodes that particles reach.
enum class GridStorage { dense, sparse };

/// The largest number of parts of a boundary whose impulses a program sums. \see ProgramOptions::reactions
inline constexpr int most_reacting_parts = 8;

/// Options of a program, besides its policies.
struct ProgramOptions {
    int workgroup_size = 64;                ///< number of invocations per workgroup in most entry points
    GridStorage grid = GridStorage::dense;  ///< which nodes are stored
    /// Number of sinks that G2P looks for, whose corners are uniforms. After a step in which a particle may have met
    /// one, no step is taken: the host removes the particle, and clears the status. The component "place_before" of a
    /// particle is its place before the step.
    int sinks = 0;
    /// Number of loads, whose forces are uniforms. The component "loads" of a particle says which of them act on it:
    /// the sum of 2^k over the numbers k of these loads.
    int loads = 0;
    /// Whether its set of particles is one of several on one grid, which matters to FBar and VolumeFilter.
    bool several_sets = false;
    bool periodic = false;                      ///< whether axes of the domain may be periodic; needs a sparse grid
    Arithmetic arithmetic = Arithmetic::plain;  ///< how products, quotients, roots and sums are written
    /// Whether each step sums the impulses of each part of the boundary on matter: in the buffer "reactions", which
    /// wgsl/reaction_kernels.hpp describes. A host sets the uniforms "per_arm" and "about_0", "about_1", … With loads,
    /// it sums their impulses, too: in the buffer "load_reactions", see wgsl/load_kernels.hpp. \see set_load_reactions
    bool reactions = false;
    /// Whether steps keep the time for materials that ask for it, though this program's does not: one of another set of
    /// particles on the grid does. \see asks_surroundings
    bool keeps_time = false;
};

/// A mirrored wall of a program's boundary. \see NodesBehind::mirrored
struct MirroredWall {
    double position;    ///< position of the wall along plane.axis [m], when the program was made
    MirrorPlane plane;  ///< the wall; plane.node is not set, because the program does not know its domain
};

/// A WGSL program, with everything that a host (the software that starts the program on a GPU) needs to run the
/// program.
struct Program {
    std::string name;            ///< the dimension and the names of the policies, joined by _
    int dimension;               ///< dimension of space: 2 or 3
    std::string kernel,          ///< name of the kernel
        transfer,                ///< name of the transfer
        force,                   ///< name of the force form: MLS or weight gradients
        material,                ///< name of the material
        boundary,                ///< name of the boundary
        field,                   ///< name of the acceleration field
        volume{};                ///< name of the volumetric policy; empty if it is OwnVolume
    ProgramOptions options{};    ///< with which the program was made
    double time_step_safety;     ///< firn::time_step_safety of the kernel
    double acceleration_safety;  ///< firn::acceleration_safety
    /// Lower corner of the room between walls [m], if the program shifts particles; −∞ along an axis without a wall.
    std::vector<double> room_lower{};
    /// Upper corner of the room between walls [m], if the program shifts particles; ∞ along an axis without a wall.
    std::vector<double> room_upper{};
    std::vector<Uniform> uniforms;         ///< members of the WGSL struct at binding 0
    std::size_t uniform_bytes = 0;         ///< size of the struct of uniforms, a multiple of 16 [bytes]
    std::vector<Buffer> buffers;           ///< the storage buffers, at the bindings from 1 on
    std::vector<EntryPoint> entry_points;  ///< all entry points, not in the order of a step (see step_order_of())
    std::vector<MirroredWall> mirrors{};   ///< mirrored walls, in the order in which they act
    bool keeps_time = false;               ///< whether steps keep the time in two numbers. \see Facts::keeps_time
    int refinements = 0;                   ///< how often a step refines the velocities of nodes. \see Facts
    Distances distances{};                 ///< of the shapes that have grids, when the program was made
    std::string code;                      ///< the WGSL text of the program

    /// Returns the buffer of a given name.
    /// \throws usage_error  if no buffer has this name
    const Buffer& buffer(const std::string& of_name) const {
        for (const Buffer& b : buffers)
            if (b.name == of_name) return b;
        throw usage_error("The program " + name + " has no buffer " + of_name + ".");
    }
    /// Returns the entry point of a given name.
    /// \throws usage_error  if the program has no such entry point
    const EntryPoint& entry_point(const std::string& of_name) const {
        for (const EntryPoint& e : entry_points)
            if (e.name == of_name) return e;
        throw usage_error("The program " + name + " has no entry point " + of_name + ".");
    }
    /// Returns whether the program has an entry point of a given name.
    bool has(const std::string& entry_point) const {
        return std::any_of(entry_points.begin(), entry_points.end(),
                           [&](const EntryPoint& e) { return e.name == entry_point; });
    }
    /// Returns whether the program has a uniform of a given name.
    bool has_uniform(const std::string& of_name) const {
        return std::any_of(uniforms.begin(), uniforms.end(), [&](const Uniform& u) { return u.name == of_name; });
    }
    /// Returns the uniform of a given name.
    /// \throws usage_error  if no uniform has this name
    const Uniform& uniform(const std::string& of_name) const {
        for (const Uniform& u : uniforms)
            if (u.name == of_name) return u;
        throw usage_error("The program " + name + " has no uniform " + of_name + ".");
    }
};

/// Returns whether a buffer is of one set of particles, even if several sets have one grid.
inline bool is_of_particles(const Buffer& buffer) { return buffer.per.rfind("particle", 0) == 0; }
/// Returns whether an entry point of a program uses buffers of particles: it runs for each set of those on one grid.
/// \throws usage_error  if the program has no such entry point
inline bool has_own_buffers(const Program& program, const std::string& entry_point) {
    const auto& bindings = program.entry_point(entry_point).bindings;
    return std::any_of(program.buffers.begin(), program.buffers.end(), [&](const Buffer& b) {
        return is_of_particles(b) && std::any_of(bindings.begin(), bindings.end(),
                                                 [&](const auto& bound) { return bound.first == b.binding; });
    });
}

/// Properties of the policies. The text of a program depends on these properties.
struct Facts {
    int dimension,           ///< dimension of space: 2 or 3
        support,             ///< support of the kernel: number of nodes along an axis that a particle touches
        centre;              ///< index of the kernel's centre node along an axis, see firn::centre_node
    bool affine,             ///< whether particles carry the affine velocity field C
        weight_gradients;    ///< whether P2G needs gradients of the weights
    bool sum_gradients;      ///< whether G2P needs gradients of the weights; always true if weight_gradients is true
    bool blends;             ///< whether the transfer blends velocities, see firn::blends_velocities
    int refinements;         ///< how often velocities are refined: the order of FMPM minus 1, otherwise 0
    bool rate_dependent;     ///< whether the material's stress depends on the velocity gradient
    bool stress_with_state;  ///< whether the material returns its new state and its stress together
    bool averages_volume;    ///< whether rates of volume change are averaged, see firn::volumetric
    bool filters_volume;     ///< whether volume ratios are filtered, see firn::filters_volume
    int filters_every;       ///< number of steps from one pass of this filter to the next
    bool shifts_particles;   ///< whether a pass of this filter also shifts particles, see firn::shifts_particles
    bool sparse;             ///< whether the grid is sparse, see GridStorage
    int reacting_parts;      ///< number of parts of the boundary whose impulses are summed
    bool mirrors;            ///< whether the boundary has mirrored walls
    bool asks;               ///< whether the material asks for the surroundings of particles
    ProgramOptions options;  ///< options of the program

    /// Returns whether steps keep the time at which they start.
    bool keeps_time() const { return asks || options.keeps_time; }

    /// Returns whether the impulses of loads are summed.
    bool loads_react() const { return options.loads > 0 && options.reactions; }
};

namespace detail {

/// A helper that adds uniforms to a program, at the offsets that the layout rules of WGSL prescribe.
class UniformLayout {
public:
    UniformLayout(Program& program) : program_(program) {}
    void add(std::string name, std::string type, std::string unit, std::string what, std::vector<double> values) {
        const std::size_t n = values.size(), align = n == 1 ? 4 : n == 2 ? 8 : 16;
        std::size_t& end = program_.uniform_bytes;
        end = (end + align - 1) / align * align;
        program_.uniforms.push_back(
            {std::move(name), std::move(type), std::move(unit), std::move(what), end, std::move(values)});
        end += 4 * n;
    }
    template <class Policy>
    void add_policy(const Policy& policy, const std::string& prefix) {
        add_parameters(policy, prefix + "_");
        for_grids(
            policy,
            [&](const auto& shape, const std::string& name) { add_parameters(program_.distances.add(shape), name); },
            prefix + "_");
    }

private:
    template <class Policy>
    void add_parameters(const Policy& policy, const std::string& before) {
        for_parameters(
            policy,
            [&](const std::string& name, const char* unit, const auto& value) {
                std::vector<double> values = firn::detail::as_doubles(value);
                const std::string number = counts(value) ? "u32" : "f32";
                std::string type = values.size() == 1 ? number : sentence("vec", values.size(), "<", number, ">");
                add(name, std::move(type), unit, "", std::move(values));
            },
            before);
    }
    /// Whether a parameter counts numbers of a buffer.
    /// @{
    template <class T>
    static constexpr bool counts(const T&) {
        return std::same_as<T, std::uint32_t>;
    }
    template <class T, int D>
    static constexpr bool counts(const Vec<T, D>&) {
        return std::same_as<T, std::uint32_t>;
    }
    /// @}

    Program& program_;
};

/// The binding numbers of a program: 0 for the uniforms (params), then those of the storage buffers.
enum Binding {
    params,
    motion,
    affine,
    stress,
    state,
    constants,
    nodes,
    status,
    counts,
    coordinates,
    bins,
    rates,
    rate_sums,
    block_table,
    loads,
    distances,
    reactions,
    term,
    load_reactions
};

/// Returns the binding number of the buffer that contains the fields with the given role.
inline Binding buffer_of(FieldRole role) {
    switch (role) {
        case FieldRole::motion:
            return motion;
        case FieldRole::affine:
            return affine;
        case FieldRole::stress:
            return stress;
        case FieldRole::state:
            return state;
        case FieldRole::given:
        case FieldRole::constant:
            break;
    }
    return constants;
}

/// Calls f(name, field) for every component (stored field) of the buffer with the binding number `buffer`. `name` is
/// the name of the component, `field` its description. The position of a particle consists of two components [cells]:
/// `corner`, the lower corner of the particle's block, and `place`, the position relative to this corner.
template <class F>
void for_fields_in(int buffer, const FieldTable& table, const F& f) {
    for (const FieldInfo& field : table) {
        if (buffer_of(field.role) != buffer) continue;
        f(field.name, field);
        if (std::string_view(field.name) == "place") f("corner", field);
    }
}

/// The words of the buffer "status" from which on, and in how many of which, a program logs its time steps: step k, as
/// the word "steps" counts, in word first_logged_step + k % logged_steps.
/// @{
inline constexpr int first_logged_step = 32, logged_steps = 256;
/// @}
/// The words of the buffer "status" from which on there are some for each set of particles: whether a particle has left
/// the reach of its block in this step, in the last one, and by shifting; and the largest signal speed of the set.
/// @{
inline constexpr int first_set_word = first_logged_step + logged_steps, words_of_set = 5, most_sets = 8;
/// @}
/// Returns the number of components of the impulse and of the angular impulse of a part of a boundary.
inline int impulses_of_part(int dimension) { return dimension == 2 ? 3 : 6; }
/// Returns the number of words of the buffer "reactions". \see reaction_kernels.hpp
inline int reaction_words(int dimension, int parts) { return 1 + 3 * impulses_of_part(dimension) * parts; }
/// Returns the number of words of the buffer "load_reactions". \see load_kernels.hpp
inline int load_reaction_words(int dimension, int loads) { return loads * (1 + 3 * impulses_of_part(dimension)); }
/// Returns the number of words that the buffer "bins" has of a block: one for each of its cells, where its particles
/// begin, and where they end.
inline int bin_words(int dimension) { return (1 << (2 * dimension)) + 2; }
/// The name of the component of "motion" that has the place before the last step, for programs with sinks.
inline constexpr const char* place_before = "place_before";
/// The word of the buffer "status" that tells whether a particle may have met a sink in the last step.
inline constexpr int sink_word = 26;
/// The largest number of loads on a set of particles: sums of so many powers of two are exact in float.
inline constexpr int most_loads = 24;
/// The words of the buffer "status" that have the time left in two f32, and the number of steps taken.
/// @{
inline constexpr int time_left_word = 21, steps_word = 23;
/// @}
/// The words of the buffer "status" that have the time; and, of programs that keep it, what its rounding lacks, and the
/// time at which the step starts.
/// @{
inline constexpr int time_word = 11, time_low_word = 30, start_word = 31;
/// @}
/// The uniform that a program with a material that asks has of the domain: its lower corner [m].
inline constexpr const char* corner_uniform = "lower_corner";

/// Returns how often a step with this transfer refines velocities.
template <class Transfer>
int refinements_of([[maybe_unused]] const Transfer& transfer) {
    if constexpr (refines_velocities<Transfer>)
        return transfer.order - 1;
    else
        return 0;
}
/// Returns how many times four numbers the buffer "nodes" has of a node. \see blend_kernels.hpp, refine_kernels.hpp
inline int records_of_node(bool blends, int refinements, bool mirrors) {
    if (refinements > 0) return mirrors ? 4 : 3;
    return blends ? 2 : 1;
}

/// Adds the descriptions of all storage buffers to the program.
/// \param table  descriptions of all fields of the particles
inline void add_buffers(Program& program, const Facts& facts, const FieldTable& table) {
    const auto add = [&](const char* name, const char* type, Binding binding, const char* per, int count,
                         std::vector<Component> components = {}) {
        program.buffers.push_back({name, type, binding, per, count, std::move(components)});
    };
    const auto add_fields = [&](const char* name, Binding binding) {
        std::vector<Component> fields;
        int numbers = 0;
        for_fields_in(binding, table, [&](const char* of_field, const FieldInfo& field) {
            const int count = field.components(facts.dimension);
            fields.push_back({of_field, count, field.unit, {}, field.less_one});
            numbers += count;
        });
        if (binding == motion && facts.options.sinks > 0) {
            fields.push_back({place_before, facts.dimension, "cells"});
            numbers += facts.dimension;
        }
        add(name, "f32", binding, "particle", numbers, std::move(fields));
    };
    add_fields("motion", motion);
    if (facts.affine) add_fields("affine", affine);
    add_fields("stress", stress);
    add_fields("state", state);
    add_fields("constants", constants);
    add("nodes", "i32", nodes, "node", node_width * records_of_node(facts.blends, facts.refinements, facts.mirrors));
    add("status", "u32", status, "program", first_set_word + most_sets * words_of_set);
    add("counts", "u32", counts, "node", 1);
    add("coordinates", "f32", coordinates, "axis_node", 1);
    add("bins", "u32", bins, "particle_and_bin", 1);
    if (facts.options.loads > 0) add("loads", "f32", loads, "particle", 1, {{"loads", 1, "1"}});
    if (facts.refinements > 0)
        add("term", "f32", term, "particle", facts.dimension, {{"term_velocity", facts.dimension, "m/s"}});
    if (facts.sparse) add("block_table", "u32", block_table, "block", 8 + 1 + (1 << facts.dimension));
    if (program.distances.size() > 0) add("distances", "f32", distances, "distance", 1);
    if (facts.reacting_parts > 0)
        add("reactions", "u32", reactions, "program", reaction_words(facts.dimension, facts.reacting_parts));
    if (facts.loads_react())
        add("load_reactions", "u32", load_reactions, "particle_set",
            load_reaction_words(facts.dimension, facts.options.loads));
    if (facts.averages_volume) {
        add("rates", "f32", rates, "particle", 1, {{"rate_of_volume_change", 1, "1/s"}});
        add("rate_sums", "i32", rate_sums, "node", node_width);
    }
    if (facts.filters_volume) {
        add("rates", "f32", rates, "particle", 2, {{"volume_change", 1, "1"}, {"filtered_volume", 1, "m^D"}});
        add("rate_sums", "i32", rate_sums, "node", node_width);
    }
}

/// Sets the default values of the state's components: those of a body at rest, which may depend on the material.
/// \param start  the state of a particle at rest
template <class State>
void set_start(Program& program, State start) {
    const auto set = [&](const auto& field) {
        const auto& member = start.*(field.member);
        const auto stored = firn::detail::Stored<std::remove_cvref_t<decltype(member)>>::numbers(member);
        for (Buffer& buffer : program.buffers)
            for (Component& component : buffer.components) {
                if (buffer.binding != state || component.name != field.name) continue;
                component.start.assign(stored.begin(), stored.end());
                for (int c = 0; c < component.count; ++c) component.start[std::size_t(c)] += component.lacking(c);
            }
    };
    std::apply([&](const auto&... field) { (set(field), ...); }, State::fields());
}

/// Calls f(k, first, last) for each pass of mirrored walls: the k-th pass (from 0) lets the walls with the indices
/// first to last − 1 act. These are all walls of one part of the boundary across one axis.
template <class F>
void for_mirror_passes(const Program& program, const F& f) {
    const std::vector<MirroredWall>& walls = program.mirrors;
    std::size_t first = 0, last = 0;
    for (int k = 0; first < walls.size(); ++k, first = last) {
        const MirrorPlane& of = walls[first].plane;
        while (last < walls.size() && walls[last].plane.axis == of.axis && walls[last].plane.part == of.part) ++last;
        f(k, first, last);
    }
}

/// The error codes of a program whose mirrored walls do not fit the grid, of a sparse grid that has too few blocks, and
/// of a step after one in which a particle may have met a sink; and of an impulse too large for reactions.
/// @{
inline constexpr int mirror_error = 6, blocks_error = 7, sink_error = 8, reaction_error = 9;
/// @}

/// Returns the name of the entry point of the k-th pass of mirrored walls.
inline std::string mirror_pass(int k) { return "mirror_" + std::to_string(k); }
/// Returns the name of the entry point in which the walls of the k-th pass act on a term of a series.
inline std::string term_mirror_pass(int k) { return "term_mirror_" + std::to_string(k); }
/// Returns the name of the entry point that folds the rates of volume change at the walls of the k-th pass.
inline std::string fold_pass(int k) { return "fold_rates_" + std::to_string(k); }

/// Adds the descriptions of the entry points in kernels.hpp to the program. Each description lists the bindings that
/// the entry point uses.
inline void add_entry_points(Program& program, const Facts& facts) {
    using Bindings = std::vector<std::pair<int, bool>>;
    const auto add = [&](const std::string& name, const std::string& per, int size, Bindings bindings) {
        bindings.emplace_back(params, false);
        const bool acts_across =
            name.starts_with("mirror_") || name.starts_with("term_mirror_") || name.starts_with("fold_rates_");
        const bool finds_nodes = (per == "particle" && name != "initialise" && name != "sort" && name != "push") ||
                                 per == "block_workgroup" || name == "grid_update" || acts_across;
        if (facts.sparse && (finds_nodes || per == "block")) bindings.emplace_back(block_table, true);
        const bool finds_solids = name == "grid_update" || name == "find_excess" || name == "shift_particles";
        if (program.distances.size() > 0 && finds_solids) bindings.emplace_back(distances, false);
        const bool reacts = name == "grid_update" || name.starts_with("mirror_");
        if (facts.reacting_parts > 0 && (reacts || name == "begin_step")) bindings.emplace_back(reactions, true);
        if (facts.reacting_parts > 0 && facts.mirrors && reacts) bindings.emplace_back(counts, true);
        std::erase_if(bindings, [&](const auto& b) { return b.first == affine && !facts.affine; });
        std::sort(bindings.begin(), bindings.end());
        program.entry_points.push_back({name, per, size, std::move(bindings)});
    };
    const auto with = [](Bindings some, const Bindings& more) {
        some.insert(some.end(), more.begin(), more.end());
        return some;
    };
    const auto per_line = [&](std::size_t wall) {
        return facts.sparse ? "node" : std::string(1, "xyz"[program.mirrors[wall].plane.axis]) + "_line";
    };
    const Bindings particle{{motion, true}, {affine, true}, {stress, true}, {constants, false}, {status, true}};
    const int size = facts.options.workgroup_size;
    Bindings first{{motion, true},     {stress, true}, {state, true},
                   {constants, false}, {status, true}, {coordinates, false}};
    if (facts.rate_dependent) first.emplace_back(affine, true);
    add("initialise", "particle", size, first);
    const bool sums_rates = facts.averages_volume || facts.filters_volume;
    const Bindings cleared{{nodes, true}, {counts, true}, {status, true}};
    if (facts.sparse) {
        add("clear_table", "block", size, {{status, true}});
        add("find_blocks", "particle", size, {{motion, true}, {status, true}});
        add("activate_blocks", "block", size,
            facts.mirrors ? Bindings{{status, true}, {coordinates, false}} : Bindings{{status, true}});
        add("link_blocks", "block", size, {{status, true}});
    }
    add("begin_step", "one_workgroup", 1, {{status, true}});
    add("clear", "node", size, sums_rates ? with(cleared, {{rate_sums, true}}) : cleared);
    add("sort", "particle", size, {{motion, true}, {status, true}});
    const Bindings pushed{{motion, true}, {constants, false}, {status, true}, {loads, false}};
    if (facts.loads_react()) add("begin_push", "one_workgroup", 1, {{status, true}, {load_reactions, true}});
    if (facts.options.loads > 0)
        add("push", "particle", size, facts.loads_react() ? with(pushed, {{load_reactions, true}}) : pushed);
    add("measure", "particle", size, with(particle, {{counts, true}}));
    add("measure_counts", "node", size, {{counts, true}, {status, true}});
    add("choose_scale", "one_workgroup", 1, {{status, true}});
    add("p2g", "particle", size, with(particle, {{nodes, true}}));
    add("measure_loads", "particle", size, particle);
    add("clear_bins", "node", size, {{status, true}, {bins, true}});
    add("count_cells", "particle", size, {{motion, true}, {status, true}, {bins, true}});
    add("place_cells", "block_workgroup", 1 << (2 * facts.dimension), {{status, true}, {bins, true}, {counts, true}});
    add("order_particles", "particle", size, {{motion, true}, {status, true}, {bins, true}});
    add("p2g_blocks", "block_workgroup", size, with(particle, {{nodes, true}, {bins, true}}));
    if (facts.refinements > 0) {
        const Bindings particle_term{{motion, true}, {affine, true}, {constants, false},
                                     {status, true}, {nodes, true},  {term, true}};
        add("measure_term", "particle", size, particle_term);
        add("choose_term_scale", "one_workgroup", 1, {{status, true}});
        add("scatter_term", "particle", size, particle_term);
        add("term_blocks", "block_workgroup", size, with(particle_term, {{bins, true}}));
        for (const char* name : {"begin_series", "next_term", "last_term"})
            add(name, "node", size, {{nodes, true}, {status, true}});
        if (facts.mirrors)
            for (const char* name : {"keep_first", "convert_term"})
                add(name, "node", size, {{nodes, true}, {status, true}});
    }
    add("grid_update", "node", size, {{nodes, true}, {coordinates, false}, {status, true}});
    for_mirror_passes(program, [&](int k, std::size_t wall, std::size_t) {
        const Bindings line{{nodes, true}, {coordinates, false}, {status, true}};
        add(mirror_pass(k), per_line(wall), size, line);
        if (facts.refinements > 0) add(term_mirror_pass(k), per_line(wall), size, line);
    });
    if (sums_rates) {
        const Bindings particle_sums{
            {motion, true}, {constants, false}, {status, true}, {rates, true}, {rate_sums, true}},
            sums{{status, true}, {rate_sums, true}};
        if (facts.options.several_sets) add("clear_rates", "node", size, sums);
        if (facts.options.several_sets || facts.filters_volume) add("measure_rate_counts", "node", size, sums);
        add("choose_rate_scale", "one_workgroup", 1, {{status, true}});
        add("scatter_rates", "particle", size, particle_sums);
        if (!program.mirrors.empty()) add("convert_rates", "node", size, sums);
        for_mirror_passes(program, [&](int k, std::size_t wall, std::size_t) {
            add(fold_pass(k), per_line(wall), size, with(sums, {{coordinates, false}}));
        });
        if (facts.averages_volume) {
            Bindings measured{{motion, true}, {constants, false}, {nodes, true}, {status, true}, {rates, true}};
            if (facts.options.several_sets) measured.emplace_back(rate_sums, true);
            add("measure_rates", "particle", size, measured);
            add("average_rates", "node", size, with(sums, {{nodes, true}}));
        } else {
            add("measure_volumes", "particle", size, with(particle_sums, {{state, true}}));
            add("average_volumes", "node", size, sums);
            add("measure_averages", "particle", size,
                {{motion, true}, {status, true}, {rates, true}, {rate_sums, true}});
            const Bindings filtered{{motion, true}, {stress, true}, {state, true},
                                    {status, true}, {rates, true},  {rate_sums, true}};
            add("filter_volumes", "particle", size, facts.asks ? with(filtered, {{constants, false}}) : filtered);
        }
        if (facts.shifts_particles) {
            add("measure_present", "particle", size,
                {{state, true}, {constants, false}, {status, true}, {rates, true}});
            add("find_excess", "node", size, with(sums, {{coordinates, false}}));
            add("shift_particles", "particle", size, {{motion, true}, {status, true}, {rate_sums, true}});
            add("sort_shifted", "particle", size, {{motion, true}, {status, true}});
        }
    }
    add("g2p", "particle", size, with(particle, {{state, true}, {nodes, true}}));
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD::wgsl
