/// \file Writes the manifest of a WGSL program: a JSON text that tells a host (the software that starts the program on
/// a GPU) how to run the program.
#pragma once

#include <firn/core/json.hpp>
#include <firn/version.hpp>
#include <firn/wgsl/layout.hpp>

namespace firn::inline FIRN_BUILD::wgsl {

/// The messages of all errors that a program can report. Word 0 of the buffer "status" is the error code e: 0 means
/// that there is no error, otherwise error_sentences[e − 1] is the message.
inline const std::vector<std::string> error_sentences{
    "The momentum that a node may receive is not finite: the simulation has blown up. Reduce the time step, or look at "
    "the initial state.",
    "So many particles may add to one node that 32-bit integers cannot hold the sum. Use smaller cells or fewer "
    "particles a cell.",
    "With the given fixed-point scale a sum could exceed the range of the integers. Give a smaller one, or 0 to have "
    "it chosen.",
    "A particle is not finite any more. Compare the time step with its bound, and look for a force or a stiffness that "
    "is too large.",
    "A particle has left the domain. Compare the time step with its bound, and look for a force or a stiffness that is "
    "too large.",
    "A mirrored wall lies on no plane of nodes, or less than 3 cells from another one. Move the wall, or choose cells "
    "that divide the domain.",
    "The particles reach more blocks of nodes than the sparse grid has memory for. Give its uniform 'blocks' a larger "
    "value.",
    "A particle may have met a sink in the step before: look whether it is to be removed, and clear the status.",
    "The boundary changes the velocity of a node by more than 65536 times the fastest signal: surfaces close on each "
    "other, or the simulation has blown up."};
static_assert(detail::mirror_error == 6 && detail::blocks_error == 7 && detail::sink_error == 8 &&
                  detail::reaction_error == 9,
              "numbers of sentences, counted from 1");

namespace detail {

/// Returns the entry points that measure numbers of particles: `measure`, and what belongs to it.
inline std::vector<std::string> measuring_of(const Program& program, const char* measure) {
    std::vector<std::string> points{measure};
    if (program.options.several_sets) points.insert(points.begin(), "clear_rates");
    if (program.has("measure_rate_counts")) points.push_back("measure_rate_counts");
    return points;
}
/// Returns the entry points that average numbers of particles at nodes.
inline std::vector<std::string> averaging_of(const Program& program) {
    std::vector<std::string> points{"choose_rate_scale", "scatter_rates"};
    if (!program.mirrors.empty()) points.push_back("convert_rates");
    for_mirror_passes(program, [&](int k, std::size_t, std::size_t) { points.push_back(fold_pass(k)); });
    return points;
}
/// Returns the entry points of the pass of a filter of volume ratios.
inline std::vector<std::string> filtering_of(const Program& program) {
    std::vector<std::string> average = averaging_of(program), points = measuring_of(program, "measure_volumes");
    average.push_back("average_volumes");
    const auto add = [&](const std::vector<std::string>& more) {
        points.insert(points.end(), more.begin(), more.end());
    };
    add(average), add({"measure_averages"}), add(average), add({"filter_volumes"});
    if (program.has("shift_particles"))
        add({"measure_present", "choose_rate_scale", "scatter_rates", "find_excess", "shift_particles",
             "sort_shifted"});
    return points;
}

/// Returns the entry points of the pass that refines velocities.
/// \param sorted  \see entry_points_of
inline std::vector<std::string> refining_of(const Program& program, bool sorted) {
    std::vector<std::string> points{"begin_series"};
    const auto mirror = [&] {
        for_mirror_passes(program, [&](int k, std::size_t, std::size_t) { points.push_back(term_mirror_pass(k)); });
    };
    mirror();
    if (program.has("keep_first")) points.push_back("keep_first");
    for (int left = program.refinements; left > 0; --left) {
        points.insert(points.end(), {"measure_term", "choose_term_scale", sorted ? "term_blocks" : "scatter_term"});
        if (program.has("convert_term")) points.push_back("convert_term");
        mirror();
        points.push_back(left > 1 ? "next_term" : "last_term");
    }
    return points;
}

}  // namespace detail

/// The passes of a simulation's step that programs do, in their order. \see entry_points_of
inline const std::vector<std::string> passes_of_programs{
    "sort", "push", "filter volumes", "p2g", "refine velocities", "grid update", "average volumes", "g2p"};

/// Returns the names of the entry points that do the work of a pass of a simulation (see RunOf::passes), in the order
/// to run them; none if the program has no such pass.
/// \param pass    name of the pass, one of passes_of_programs
/// \param sorted  whether P2G sorts the particles by block and adds them up in workgroup memory, instead of adding them
///                directly to the grid. Both ways give the same bits.
inline std::vector<std::string> entry_points_of(const Program& program, std::string_view pass, bool sorted = false) {
    if (pass == "sort" && program.options.grid == GridStorage::sparse)
        return {"clear_table", "find_blocks", "activate_blocks", "link_blocks", "begin_step", "clear", "sort"};
    if (pass == "sort") return {"begin_step", "clear", "sort"};
    if (pass == "filter volumes" && program.has("filter_volumes")) return detail::filtering_of(program);
    if (pass == "p2g" && sorted)
        return {"clear_bins",   "count_cells",     "place_cells", "measure_loads",
                "choose_scale", "order_particles", "p2g_blocks"};
    if (pass == "p2g") return {"measure", "measure_counts", "choose_scale", "p2g"};
    if (pass == "refine velocities" && program.refinements > 0) return detail::refining_of(program, sorted);
    std::vector<std::string> points;
    if (pass == "grid update") {
        points = {"grid_update"};
        detail::for_mirror_passes(program,
                                  [&](int k, std::size_t, std::size_t) { points.push_back(detail::mirror_pass(k)); });
    } else if (pass == "average volumes" && program.has("average_rates")) {
        points = detail::measuring_of(program, "measure_rates");
        const std::vector<std::string> average = detail::averaging_of(program);
        points.insert(points.end(), average.begin(), average.end());
        points.push_back("average_rates");
    } else if (pass == "push" && program.has("begin_push")) {
        points = {"begin_push", "push"};
    } else if (pass == "g2p" || (pass == "push" && program.has("push"))) {
        points = {std::string(pass)};
    }
    return points;
}

/// Returns whether the entry points of a pass run for one set of particles after the other. Of several such passes on
/// end, all run for one set, then all for the next.
inline bool runs_by_set(const Program& program, std::string_view pass) {
    return pass == "push" || pass == "filter volumes" || pass == "average volumes" ||
           (pass == "g2p" && program.has("average_rates"));
}

/// Returns the names of the entry points of one step of a program, in the order to run them: those of all passes.
/// \param sorted  whether P2G sorts the particles. \see entry_points_of
inline std::vector<std::string> step_order_of(const Program& program, bool sorted = false) {
    std::vector<std::string> order;
    for (const std::string& pass : passes_of_programs) {
        const std::vector<std::string> points = entry_points_of(program, pass, sorted);
        order.insert(order.end(), points.begin(), points.end());
    }
    return order;
}

namespace detail {

/// Writes the entry of a uniform, a buffer or a kernel in the manifest.
/// @{
inline void write(Json& json, const Uniform& u) {
    json.object([&] {
        json.field("name", u.name).field("type", u.type).field("offset", u.offset).field("unit", u.unit);
        if (!u.what.empty()) json.field("what", u.what);
        json.key("default");
        if (u.values.size() == 1)
            json.value(u.values[0]);
        else
            json.array(u.values, [&](double x) { json.value(x); });
    });
}
inline void write(Json& json, const Component& c) {
    json.object([&] {
        json.field("name", c.name).field("count", c.count).field("unit", c.unit);
        if (c.less_one) json.field("less_one", true);
        if (!c.start.empty()) json.key("default").array(c.start, [&](double x) { json.value(x); });
    });
}
inline void write(Json& json, const Buffer& b) {
    json.object([&] {
        json.field("name", b.name).field("binding", b.binding).field("per", b.per).field("type", b.type);
        json.field("count", b.count);
        if (!b.components.empty())
            json.key("components").array(b.components, [&](const Component& c) { write(json, c); });
    });
}
inline void write(Json& json, const EntryPoint& e) {
    json.object([&] {
        json.field("entry", e.name).field("per", e.per).field("workgroup_size", e.workgroup_size);
        json.key("bindings").array(e.bindings, [&](const auto& b) {
            json.object([&] {
                json.field("binding", b.first);
                json.field("access", b.first == 0 ? "uniform" : b.second ? "read_write" : "read");
            });
        });
    });
}
/// @}

/// Writes the names of the words of the status, each with its number.
inline void write_status_words(Json& json, const Program& program) {
    int word = 0;
    for (const char* name :
         {"error", "particle", "signal_speed", "largest_momentum", "largest_gradient", "largest_mass", "most_particles",
          "momentum_scale", "mass_scale", "time_step", "place_per_velocity", "time"})
        json.field(name, word++);
    if (!program.volume.empty())
        for (const char* name : {"largest_rate", "largest_volume", "rate_scale", "volume_scale"})
            json.field(name, word++);
    if (program.has("filter_volumes")) json.field("filter_share", word++);
    if (program.refinements > 0)
        json.field("momentum_scale_of_term", 29);
    else if (program.buffer("nodes").count > node_width)
        json.field("largest_momentum_before_forces", 28).field("momentum_scale_before_forces", 29);
    json.field("largest_acceleration", 19);
    json.field("time_left", time_left_word).field("time_left_low", time_left_word + 1).field("steps", steps_word);
    json.field("set", 27);
    if (program.keeps_time) json.field("time_low", time_low_word).field("time_at_start", start_word);
    json.field("first_time_step", first_logged_step);
    json.field("sort_needed", first_set_word);
}

}  // namespace detail

/// Returns the manifest of a program: a JSON text that tells hosts in any language how to run the program.
///
/// All bindings are in group 0. Two WGSL variables may have the same binding: one accesses the buffer as atomic
/// integers, the other as vectors. Each entry point uses at most one of the two. Besides the names of the policies
/// (kernel, transfer, material, …), the manifest has these entries:
///
///     time_step_safety, acceleration_safety  f and g: the bound of the time step is the smaller one of f h / (the
///                  largest signal speed of the particles) and g √(h / the largest acceleration), where h is the cell
///                  size; the uniform boundary_speed counts as a signal speed. If the uniform bound_time_step is 1,
///                  a step takes the bound if that is shorter than the uniform time_step. If it is 2, a step takes
///                  the time left if that is not longer; when no time is left, further steps change nothing.
///     grid         "sparse" if the buffers have nodes for as many blocks of 4^D nodes as the uniform blocks says; else
///                  they have all nodes
///     uniforms     binding: the binding number; bytes: size of the buffer; fields: for each uniform its name, type,
///                  offset [bytes], unit, meaning (`what`) and default value
///     buffers      for each buffer its name, binding, type, per, count and components. The buffer has `count` 32-bit
///                  values for each item of the kind `per`: "particle", "node", "block" (of 4^D nodes),
///                  "particle_and_bin" (each particle, and 4^D + 2 for each block), "axis_node"
///                  (a node along one axis: first all along x, then all along y, then all along z), "distance" (a
///                  number of a grid of distances), "particle_set" (one item, of a set of particles) or "program" (only
///                  one item). If `per` is "particle", the c-th value (from 0) of particle i is at index
///                  c * capacity + i; `components` lists the fields that consist of these values, with the name, count
///                  of values and unit of each. A field of a material's state also has a default: its value in a body
///                  at rest. If `less_one` is true, the buffer has F − I of a matrix F, or J − 1 of a number J; the
///                  default is F or J.
///     distances    only if shapes have grids of distances: the number of all their distances with the default
///                  uniforms. A host writes them to the buffer "distances", one grid after another, as make_inputs()
///                  returns them. Of each shape, the uniforms that end in grid_first, grid_strides, grid_nodes,
///                  grid_lower and grid_spacing tell at which number its grid begins, how far neighbours along an axis
///                  are apart, and what nodes it has.
///     kernels      for each entry point its name (`entry`); workgroup_size; bindings: the binding number and access
///                  of each buffer; per: how much to dispatch. This is one invocation for each "particle", "node" or
///                  "block", one invocation for each line of nodes along an axis ("x_line", "y_line", "z_line"), one
///                  workgroup for each block ("block_workgroup"), or a single workgroup ("one_workgroup"). A
///                  dispatch of n workgroups has x = min(n, 65535) workgroups along x and y = ceil(n / x) along y.
///     initialise   the entry points to run once, after the buffers were written
///     step         the entry points of a step, in the order to run them
///     step_sorted  the entry points of a step with P2G through workgroup memory, in the order to run them
///     status       for each status word its index in the buffer "status". The words error, particle, set and steps are
///                  of type u32, the others of type f32. The word set is the set_number of the particles that have the
///                  error, time_step the step that was taken [s], and time the sum of all steps since the host set it
///                  to 0 [s]; largest_acceleration is that of the field at the nodes of the last step [m/s²]. The
///                  words time_left and time_left_low are the time left [s], as two numbers whose sum it is, which the
///                  host sets for bound_time_step 2; steps is the number of steps since the host set it to 0. The time
///                  step of step k of these [s], from k = 0, is in word first_time_step + k % 256. If the host sets
///                  word sort_needed + 5 s to 1, the next step counts the places of the particles with set_number s
///                  anew, as the CPU does where particles were added. Only if there is an entry `volume`, the name of a
///                  volumetric policy: largest_rate, the largest V0 |θ| of a particle with the volume V0 and the rate
///                  of volume change θ [m^D/s], and the scales of the sums of V0 θ and V0. Only if the transfer blends
///                  velocities: largest_momentum_before_forces and momentum_scale_before_forces. The buffer "nodes"
///                  then has two numbers where else it has one: first those of all nodes with forces, then those before
///                  forces act. Only if it refines velocities, in more than one term: momentum_scale_of_term, the scale
///                  of the sums of the last term. The buffer "nodes" then has three or four numbers where else it has
///                  one, and `step` has the entry points of a term as often as there are terms after the first. Only
///                  if a material asks for the surroundings of particles: time is the first of two numbers whose sum
///                  is the time, time_low the other one; the host may set both, before it runs `initialise`.
///                  time_at_start is the time at which the last step began, which the material was told [s].
///     errors       for each value e > 0 of the word error its message; after an error, steps change nothing
///
/// The number of nodes along an axis is 4 (b + 2), where b = ceil(cells / 4). Let the node at the domain's lower corner
/// have the lattice coordinates 0. The node with lattice coordinate k along an axis has the index k + 4 along this
/// axis; in buffers, the index along the last axis varies fastest. A particle's position is lower + h (corner + place)
/// [m], where lower is the domain's lower corner, h the cell size, and corner and place are two fields of the particle.
inline std::string manifest(const Program& program) {
    Json json;
    json.object([&] {
        json.field("format", 1).field("firn", version()).field("name", program.name).field("code", "program.wgsl");
        json.field("dimension", program.dimension).field("kernel", program.kernel).field("transfer", program.transfer);
        json.field("force", program.force).field("material", program.material).field("boundary", program.boundary);
        json.key("field").value(program.field);
        if (!program.volume.empty()) json.field("volume", program.volume);
        if (program.options.grid == GridStorage::sparse) json.field("grid", "sparse");
        json.field("workgroup_size", program.options.workgroup_size);
        json.field("time_step_safety", program.time_step_safety);
        json.field("acceleration_safety", program.acceleration_safety);
        json.key("uniforms").object([&] {
            json.field("binding", 0).field("bytes", program.uniform_bytes);
            json.key("fields").array(program.uniforms, [&](const Uniform& u) { detail::write(json, u); });
        });
        if (program.distances.size() > 0) json.field("distances", std::uint64_t(program.distances.size()));
        json.key("buffers").array(program.buffers, [&](const Buffer& b) { detail::write(json, b); });
        json.key("kernels").array(program.entry_points, [&](const EntryPoint& e) { detail::write(json, e); });
        const auto text = [&](const std::string& s) { json.value(s); };
        json.key("initialise").array(std::vector<std::string>{"initialise"}, text);
        json.key("step").array(step_order_of(program), text);
        json.key("step_sorted").array(step_order_of(program, true), text);
        json.key("status").object([&] { detail::write_status_words(json, program); });
        json.key("errors").object([&] {
            for (int e = 1; e <= int(error_sentences.size()); ++e)
                if ((e != detail::mirror_error || !program.mirrors.empty()) &&
                    (e != detail::blocks_error || program.options.grid == GridStorage::sparse) &&
                    (e != detail::sink_error || program.options.sinks > 0) &&
                    (e != detail::reaction_error || program.options.reactions))
                    json.field(std::to_string(e).c_str(), error_sentences[std::size_t(e) - 1]);
        });
    });
    return json.text();
}

}  // namespace firn::inline FIRN_BUILD::wgsl
