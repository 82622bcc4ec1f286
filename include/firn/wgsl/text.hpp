/// \file Writes the helper functions and entry points of a WGSL program, which call the recorded functions.
#pragma once

#include <firn/stage/fixed_point.hpp>
#include <firn/wgsl/blend_kernels.hpp>
#include <firn/wgsl/declarations.hpp>
#include <firn/wgsl/kernels.hpp>
#include <firn/wgsl/load_kernels.hpp>
#include <firn/wgsl/reaction_kernels.hpp>
#include <firn/wgsl/refine_kernels.hpp>
#include <firn/wgsl/sparse_kernels.hpp>
#include <firn/wgsl/text_parts.hpp>
#include <firn/wgsl/volume_kernels.hpp>

#include <functional>

namespace firn::inline FIRN_BUILD::wgsl {

namespace detail {

/// Completes the texts in kernels.hpp for one program: replaces every ${NAME} by WGSL text that depends on the
/// dimension and the policies.
class KernelText : TextParts {
public:
    using TextParts::TextParts;

    std::string helpers() const {
        const bool gradients = facts_.sum_gradients || facts_.shifts_particles;
        return (is_exact() ? text::exact_arithmetic : text::plain_arithmetic) + filled(text::helpers) +
               filled(facts_.sparse ? text::sparse_nodes : text::dense_nodes) +
               (facts_.options.periodic ? filled(text::periods) : "") +
               (gradients ? filled(text::gradient_helpers) : "") +
               (facts_.blends
                    ? filled(text::before_forces,
                             {{"GATHER", gather([&](int) { return "array<" + vec("f32") + ", " + support() + ">"; },
                                                [](int) { return "sum_velocities"; },
                                                "velocity_at(before_forces(" + node_in_grid() + "))", false)}})
                    : "");
    }
    std::string entry_points(const Program& program) const {
        return find_blocks(program) + filled(text::time_step) + filled(text::acceleration) + filled(text::clear) +
               filled(text::sort, {{"NAME", "sort"}, {"WORD", "1"}}) +
               (facts_.options.loads > 0
                    ? filled(text::push, {{"LOADS", statements_of_loads(facts_.options.loads, facts_.loads_react())}})
                    : "") +
               filled(text::measure, {{"NAME", "measure"}, {"COUNT", count_base_node()}}) +
               filled(text::measure, {{"NAME", "measure_loads"}, {"COUNT", ""}}) + filled(text::choose_scale) +
               scatter({.name = "scatter",
                        .target = in_nodes("node_sums", "node"),
                        .before = in_nodes("node_sums", "before_forces(node)")}) +
               filled(text::p2g) + filled(text::p2g_sorted, {{"SCATTER", scatter_in_arena()}}) +
               p2g_blocks("p2g_blocks", "scatter_in_arena", "chosen_scale()", "node_index(origin + ${ARENA_NODE})") +
               series() + reactions() + filled(text::grid_update) + mirrors(program) + volume(program) +
               filled(text::g2p,
                      {{"GRADIENTS", facts_.sum_gradients ? "var g = kernel_gradients_of(f);" : ""},
                       {"SEE_SINKS", see_sinks()},
                       {"GATHER", gather(structs("Sums"), numbered("sum_axis"),
                                         "Sums0(velocity_at(" + node_in_grid() + "))", facts_.sum_gradients)}});
    }

private:
    using OfAxis = std::function<std::string(int)>;

    /// Returns the WGSL text of the entry points that find the blocks of a sparse grid; no text for a dense grid.
    std::string find_blocks(const Program& program) const {
        if (!facts_.sparse) return "";
        if (program.mirrors.empty()) return filled(text::find_blocks, {{"ENTER_FURTHER", filled(text::enter_reached)}});
        // How many blocks further the mirror image of a node can be that a particle with a first node in a block
        // reaches.
        const int farthest = (block_size + facts_.support) / block_size;
        const auto beside = [&](const std::string& block) {  // of a wall at the end of a periodic axis, either may be
            const std::string is = "are_beside_walls(" + block + ")";
            return facts_.options.periodic ? is + " | are_beside_walls(" + stored_block(block) + ")" : is;
        };
        const std::string one = vec("i32") + "(1)", all = vec("i32") + "(" + std::to_string(farthest) + ")",
                          below = beside("block - " + one), above = beside("block + " + all);
        const auto along = [](int a) {
            const std::string k = counter(a);
            return "for (var " + k + " = low." + axis(a) + "; " + k + " <= high." + axis(a) + "; " + k + "++) {";
        };
        const Names names{{"IS_BELOW", below},
                          {"HIGH", farthest == 1 ? one : "select(" + one + ", " + all + ", " + above + ")"},
                          {"LOOPS", listed(D_, along, " ")},
                          {"COUNTERS", listed(D_, counter)},
                          {"BLOCK_AT_K", stored_block("block + k")},
                          {"END", std::string(std::size_t(D_), '}')}};
        return filled(text::find_blocks, {{"ENTER_FURTHER", filled(text::enter_reached_and_mirrored, names)}});
    }
    /// Returns the WGSL expressions that tell, for each axis, whether a block has nodes beside a mirrored wall across
    /// it.
    std::string beside_walls(const Program& program) const {
        std::vector<std::string> all(std::size_t(D_), "false");
        for (std::size_t n = 0; n < program.mirrors.size(); ++n) {
            const int across = program.mirrors[n].plane.axis;
            const std::string is = "is_beside(block." + axis(across) + ", node_of_wall(position_of_wall_" +
                                   std::to_string(n) + "(), coordinates[" + first_coordinate(across) + "]))";
            std::string& so_far = all[std::size_t(across)];
            so_far = so_far == "false" ? is : so_far + " | " + is;
        }
        return joined(all, ", ");
    }
    /// Returns the WGSL expression of the place in the buffer "coordinates" of the domain's lower end along an axis.
    static std::string first_coordinate(int of) {
        std::string place;
        for (int a = 0; a < of; ++a) place += nodes_along(a) + " + ";
        return place + "4u";
    }
    /// Returns the WGSL text of the sums of impulses; no text if there are none.
    std::string reactions() const {
        const int loads = facts_.options.loads;
        const auto sums = [&](const char* text, const char* add, const char* buffer, int first, int words) {
            return filled(text::add_wide, {{"ADD_WIDE", add},
                                           {"SUMS", buffer},
                                           {"FIRST_SUM", std::to_string(first)},
                                           {"REACTION_ERROR", std::to_string(reaction_error)}}) +
                   filled(text, {{"CHOOSE_SCALES", scales_of_loads(loads)},
                                 {"LARGEST", largest_component(D_)},
                                 {"LOADS", std::to_string(loads)},
                                 {"WORDS", std::to_string(words)},
                                 {"INTO_DOMAIN", facts_.options.periodic ? filled(text::corner_into_domain) : ""},
                                 {"IMPULSES", std::to_string(impulses_of_part(D_))},
                                 {"ADD_ANGULAR", add_angular(D_, add)}});
        };
        const int words = reaction_words(D_, facts_.reacting_parts);
        return (facts_.reacting_parts > 0 ? filled(text::begin_reactions, {{"WORDS", std::to_string(words)}}) +
                                                sums(text::add_reaction, "add_wide", "reactions", 1, words)
                                          : "") +
               (facts_.loads_react() ? sums(text::load_reactions, "add_wide_of_load", "load_reactions", loads,
                                            load_reaction_words(D_, loads))
                                     : "");
    }
    /// Returns the WGSL statements in which the grid update adds the impulses at a node.
    std::string react() const {
        std::string text;
        for (int k = 0; k < facts_.reacting_parts; ++k) {
            const std::string n = std::to_string(k);
            text += indented(1) + "add_reaction(" + n + "u, f32(sums.w), after[" + std::to_string(k + 1) +
                    "], position - params.about_" + n + ");";
        }
        return text + keep_mass("bitcast<u32>(sums.w)");
    }
    /// Returns the WGSL statement in which the grid update keeps a node's mass [quanta] for the reactions of mirrored
    /// walls. The particles at nodes were counted before, and their counts are not needed any more.
    std::string keep_mass(const std::string& mass) const {
        return facts_.reacting_parts > 0 && facts_.mirrors
                   ? indented(mass == "0u" ? 2 : 1) + "atomicStore(&counts[i], " + mass + ");"
                   : "";
    }
    /// Returns the WGSL statement in which `measure` counts a particle.
    std::string count_base_node() const {
        return indented(2) + "atomicAdd(&counts[node_index(nodes_from(base + load_corner(i)))], 1u);";
    }
    /// Returns the WGSL expression of integer c of a node in a buffer.
    static std::string in_nodes(const std::string& buffer, const std::string& node) {
        return buffer + "[4u * " + node + " + c]";
    }
    /// Returns a text of blend_kernels.hpp, filled in; no text if the transfer does not blend velocities.
    std::string blended(const char* text, const Names& names = {}) const {
        return facts_.blends ? filled(text, names) : "";
    }
    /// Returns the WGSL statement, on a line of its own; no text if the transfer does not blend velocities.
    std::string blended(int depth, const char* statement) const {
        return facts_.blends ? indented(depth) + statement : "";
    }

    /// A function that adds a particle to the sums at the nodes. Its text: text::scatter
    struct Scatter {
        const char* name;
        std::string target, before{};  // integer c of a node, and of its momentum before forces act; empty: none
        std::string record = "record_of(load_particle(i), fraction)";
        bool in_arena = false;  // or in the grid
    };
    std::string scatter(const Scatter& of) const {
        const auto with_before = [&](const char* text) {
            return of.before.empty() ? "" : blended(text, {{"TARGET_BEFORE", of.before}});
        };
        std::string loops = listed(D_ - 1, [&](int a) { return from_zero(counter(a), facts_.support); }, " ");
        return filled(text::scatter,
                      {{"NAME", of.name},
                       {"TARGET", of.target},
                       {"RECORD", of.record},
                       {"ORIGIN", of.in_arena ? ", origin: " + vec("i32") : ""},
                       {"FIRST", of.in_arena ? "lattice_from(base + load_corner(i)) - origin"
                                             : "nodes_from(base + load_corner(i))"},
                       {"RECORD_BEFORE", with_before(text::record_before_forces)},
                       {"LINE_BEFORE", with_before(text::line_before_forces)},
                       {"ADD_BEFORE", with_before(text::add_before_forces)},
                       {"GRADIENTS", facts_.weight_gradients ? "var g = kernel_gradients_of(fraction);" : ""},
                       {"NODE", of.in_arena ? "arena_node(" + node_from("first") + ")" : node_in_grid()},
                       {"LOOPS", loops},
                       {"END", std::string(std::size_t(D_ - 1), '}')}});
    }
    std::string scatter_in_arena() const {
        const auto along = [&](int a) { return arena_along(a); };
        return "fn arena_node(at: " + vec("i32") + ") -> u32 { return u32(" + flat("at", along) + "); }\n" +
               "fn arena_number(node: u32, c: u32) -> u32 { return " + std::to_string(power(arena_size())) +
               "u * c + node; }\n" + blended("var<workgroup> arena_before: array<atomic<i32>, ${ARENA_NUMBERS}>;") +
               scatter({.name = "scatter_in_arena",
                        .target = "arena[arena_number(node, c)]",
                        .before = "arena_before[arena_number(node, c)]",
                        .in_arena = true});
    }

    /// Returns the WGSL text of an entry point that adds up particles in workgroup memory, the text p2g_blocks.
    /// \param node  the place in the grid of the node ${ARENA_NODE} of the arena
    std::string p2g_blocks(const char* name, const char* scatter, const char* scale, const char* node) const {
        return filled(text::p2g_blocks, {{"NAME", name},
                                         {"SCATTER", scatter},
                                         {"SCALE", scale},
                                         {"TARGET", filled(sentence("node_sums[4u * ", node, " + k % 4u]").c_str())},
                                         {"ADD_BEFORE", blended(text::arena_before_forces)}});
    }
    /// Returns the WGSL text of the passes of a series; no text if no velocities are refined.
    std::string series() const {
        if (facts_.refinements == 0) return "";
        const std::string record = "record_in_term(i, fraction)";
        const Names names{
            {"GATHER",
             gather([&](int) { return "array<" + vec("f32") + ", " + support() + ">"; },
                    [](int) { return "sum_velocities"; }, "velocity_at(last_at(" + node_in_grid() + "))", false)},
            {"AFFINE", facts_.affine ? "load_affine_velocity(i)" : no_matrix(D_)},
            {"NO_STRESS", no_matrix(D_)},
            {"SCATTER",
             scatter({.name = "scatter_in_term", .target = in_nodes("node_sums", "back_at(node)"), .record = record})}};
        return filled(text::series, names) + filled(facts_.mirrors ? text::begin_mirrored_series : text::begin_series) +
               filled(text::next_terms, {{"BEFORE_WALLS", facts_.mirrors ? "first_before_walls(i), " : ""}}) +
               scatter({.name = "scatter_term_in_arena",
                        .target = "arena[arena_number(node, c)]",
                        .record = record,
                        .in_arena = true}) +
               p2g_blocks("term_blocks", "scatter_term_in_arena", "term_scale()",
                          "back_at(node_index(origin + ${ARENA_NODE}))");
    }

    /// Returns the WGSL text of the passes of mirrored walls; no text if the program has no such walls.
    std::string mirrors(const Program& program) const {
        std::string text;
        if (!program.mirrors.empty()) {
            const std::string at = "line.along * k + line.across";
            text = (facts_.sparse
                        ? filled(text::sparse_lines,
                                 {{"IN_DOMAIN", facts_.options.periodic ? "into_domain(" + at + " - 4) + 4" : at},
                                  {"BESIDE_WALLS", beside_walls(program)}})
                        : filled(text::dense_lines)) +
                   filled(text::mirror_helpers);
        }
        if (facts_.mirrors && facts_.reacting_parts > 0) text += filled(text::add_reactions_of_wall);
        for_mirror_passes(program, [&](int k, std::size_t first, std::size_t last) {
            const auto act_on = [](const std::string& line, const std::string& place, const std::string& n) {
                const std::string at = "(" + line + ", " + place;
                return "let column_" + n + " = load_column" + at + ");" + indented(1) + "if (has_matter(column_" + n +
                       ")) { store_column" + at + ", mirrored_" + n + "(column_" + n + ")); }";
            };
            const auto act = [&](const std::string& n, const std::string& place) {
                const std::string before = line_from("before_forces");
                return (facts_.reacting_parts > 0 ? act_and_react(program, place, n) : act_on("line", place, n)) +
                       (facts_.blends ? indented(1) + act_on(before, place, "before_" + n) : "");
            };
            text += filled(text::mirror, mirror_names(program, mirror_pass(k), "stopped()", first, last, act));
            if (facts_.refinements == 0) return;
            const auto act_in_term = [&](const std::string& n, const std::string& place) {
                return act_on(line_from("back_at"), place, "before_" + n);
            };
            text +=
                filled(text::mirror, mirror_names(program, term_mirror_pass(k), "stopped()", first, last, act_in_term));
        });
        return text;
    }
    /// Returns the WGSL expression of a line of other numbers of the same nodes: function(i) tells where those are.
    std::string line_from(const std::string& function) const {
        return "Line(" + function + "(line.first), " +
               (facts_.sparse ? "line.along, line.across)" : "line.stride, line.count)");
    }
    /// Returns the WGSL statements in which mirrored wall n acts on a column, and its impulses are added.
    static std::string act_and_react(const Program& program, const std::string& place, const std::string& n) {
        const std::string at = "(line, " + place, part = std::to_string(program.mirrors[std::stoul(n)].plane.part);
        return "let column_" + n + " = load_column" + at + ");" + indented(1) + "if (has_matter(column_" + n + ")) {" +
               indented(2) + "let after_" + n + " = mirrored_" + n + "(column_" + n + ");" + indented(2) +
               "store_column" + at + ", after_" + n + ");" + indented(2) + "add_reactions_of_wall(" + part +
               "u, line, " + place + ", column_" + n + ", after_" + n + ", params.about_" + part + ");" + indented(1) +
               "}";
    }
    /// Returns the names to replace in text::mirror. act(n, place) returns the statements for wall n; `place` tells
    /// where the column lies on a line, as arguments of a function: the node on the wall and the direction.
    template <class Act>
    Names mirror_names(const Program& program, const std::string& name, const std::string& idle, std::size_t first,
                       std::size_t last, const Act& act) const {
        const int across = program.mirrors[first].plane.axis;
        const auto nodes_along_all = [](std::vector<int> axes) {
            std::vector<std::string> factors;
            for (const int a : axes) factors.push_back(nodes_along(a));
            return factors.empty() ? "1u" : joined(factors, " * ");
        };
        std::vector<int> others, later;
        for (int a = 0; a < D_; ++a) {
            if (a != across) others.push_back(a);
            if (a > across) later.push_back(a);
        }
        std::string walls, wrong;
        for (std::size_t i = first; i < last; ++i) {
            const std::string n = std::to_string(i), node = "wall_" + n;
            walls += "let " + node + " = node_of_wall(position_of_wall_" + n + "(), lower);" + indented(1);
            wrong += (wrong.empty() ? "" : " || ") + node + " == no_plane";
            for (std::size_t other = first; other < i; ++other)
                wrong += " || abs(" + node + " - wall_" + std::to_string(other) + ") < 3";
        }
        walls += "if (" + wrong + ") { fail(" + std::to_string(mirror_error) + "u, 0xffffffffu); return; }";
        for (std::size_t i = first; i < last; ++i) {
            const std::string n = std::to_string(i);
            const std::string place = "wall_" + n + ", " + std::to_string(program.mirrors[i].plane.inward);
            const std::string is_on = "if (at." + axis(across) + " == wall_" + n + ") { ";
            walls += indented(1) + (facts_.sparse ? is_on + act(n, place) + " }" : act(n, place));
        }
        const auto unit = [&](int a) { return std::string(a == across ? "1" : "0"); };
        const std::string line =
            facts_.sparse
                ? "let at = " + vec("i32") + "(node_at(i));" + indented(1) + "let along = " + vec("i32") + "(" +
                      listed(D_, unit) + ");" + indented(1) + "let line = Line(0u, along, at * (1 - along));"
                : "let line = line_of_nodes(i, " + nodes_along_all(later) + ", " + nodes_along(across) + ");";
        return {{"NAME", name},
                {"IDLE", idle},
                {"LINES", facts_.sparse ? "node_count()" : nodes_along_all(others)},
                {"LINE", line},
                {"FIRST_COORDINATE", first_coordinate(across)},
                {"WALLS", walls}};
    }

    /// Returns the WGSL text of the passes of a volumetric policy; no text for OwnVolume.
    std::string volume(const Program& program) const {
        if (!sums_rates()) return "";
        const bool filters = facts_.filters_volume, several = facts_.options.several_sets, counts = filters || several,
                   mirrors = !program.mirrors.empty();
        const std::string volume_of = filters ? "rates[params.capacity + i]" : "load_volume(i)",
                          record = "volume_record(rates[i], " + volume_of + ")",
                          average = filters ? "bitcast<f32>(atomicLoad(&rate_sums[4u * " + node_in_grid() + " + 2u]))"
                                            : "bitcast<f32>(nodes[" + node_in_grid() + "].w)";
        const Names names{
            {"IDLE", idle()},
            {"COUNT_WORD", counts ? "18" : "6"},
            {"COUNT_RATE", counts ? indented(2) + "atomicAdd(&rate_sums[4u * node_index(first) + 1u], 1);" : ""},
            {"SCATTER", scatter({.name = "scatter_rate", .target = in_nodes("rate_sums", "node"), .record = record})},
            {"SUMS", mirrors ? "load_sums" : "sums_in_quanta"},
            {"EVERY", std::to_string(facts_.filters_every)},
            {"GATHER", gather([&](int) { return "vec" + support() + "<f32>"; }, [](int) { return "sum_average"; },
                              average, false)}};
        std::string text = filled(text::volume_average, names) + (several ? filled(text::clear_rates, names) : "") +
                           (counts ? filled(text::rate_counts, names) : "") +
                           (mirrors ? filled(text::convert_rates, names) : "");
        for_mirror_passes(program, [&](int k, std::size_t first, std::size_t last) {
            const auto act = [](const std::string&, const std::string& place) {
                return "fold_rates(line, " + place + ");";
            };
            text += filled(text::mirror, mirror_names(program, fold_pass(k), idle(), first, last, act));
        });
        text += filled(filters ? text::filter : text::rates, names);
        if (!facts_.shifts_particles) return text;
        const auto word = [&](const char* number) {
            return "bitcast<f32>(atomicLoad(&rate_sums[4u * node + " + std::string(number) + "u]))";
        };
        const auto room = [](int a) {
            return "room_along(node." + axis(a) + ", params.room_lower." + axis(a) + ", params.room_upper." + axis(a) +
                   ")";
        };
        return text + filled(text::sort, {{"NAME", "sort_shifted"}, {"WORD", "2"}}) +
               filled(text::shift, {{"QUAD", "vec4<f32>(" + word("1") + ", " + word("2") + ", 0.0f, 0.0f)"},
                                    {"IDLE", idle()},
                                    {"ROOM", listed(D_, room, " * ")},
                                    {"GATHER", gather(structs("QuadSums"), numbered("sum_quads"),
                                                      "QuadSums0(quad_at(" + node_in_grid() + "))", true)}});
    }
    /// Returns the WGSL statement that stores the share of particle shifting; no text without shifting.
    std::string choose_shifted_share() const {
        if (!facts_.shifts_particles) return "";
        return indented(1) +
               "atomicStore(&status[20], bitcast<u32>(shifted_share_of(chosen.place_per_velocity * "
               "status_number(2u))));";
    }
    /// Returns the WGSL statements of G2P that keep the place before the step, and tell whether the way from there to
    /// the new place may meet a sink: the CPU decides it in double. No text without sinks.
    std::string see_sinks() const {
        if (facts_.options.sinks == 0) return "";
        std::string text = indented(3) + "store_place_before(i, place);" + indented(3) +
                           "let least = min(place, moved.position) + corner;" + indented(3) +
                           "let most = max(place, moved.position) + corner;";
        const bool periodic = facts_.options.periodic;
        if (periodic)  // a way that leaves the domain may meet any sink at the other end
            text += indented(3) + "let leaves = (params.period > " + vec("u32") + "(0u)) & ((least < " + vec("f32") +
                    "(0.0f)) | (most > params.cells));";
        const auto all = [&](const std::string& most, const std::string& least) {
            return "all(" + (periodic ? "(" + most + " >= " + least + ") | leaves" : most + " >= " + least) + ")";
        };
        for (int k = 0; k < facts_.options.sinks; ++k) {
            const std::string sink = "params.sink_" + std::to_string(k);
            text += indented(3) + "if (" + all("most", sink + "_lower") + " && " + all(sink + "_upper", "least") +
                    ") { atomicStore(&status[" + std::to_string(sink_word) + "], 1u); }";
        }
        return text;
    }
    bool sums_rates() const { return facts_.averages_volume || facts_.filters_volume; }
    /// Returns the WGSL condition under which the passes of the volumetric policy do nothing.
    std::string idle() const { return facts_.filters_volume ? "filter_rests()" : "stopped()"; }
    /// Returns the WGSL statements in which G2P computes `taken` and, if the transfer blends velocities, `v`.
    std::string take() const {
        const std::string first = facts_.blends ? "first" : "nodes_from(base + corner)", nodes = first + ", fraction)",
                          own = " = take_from_grid(gather(" + nodes + ", fraction);";
        std::string text = facts_.blends ? "let first = nodes_from(base + corner);" + indented(2) : "";
        text += facts_.averages_volume
                    ? "let own" + own + indented(2) + "let taken = with_average(own, gather_average(" + nodes + ");"
                    : "let taken" + own;
        return text + blended(2, "let v = blended(taken, gather_before_forces(first, fraction), load_velocity(i));");
    }

    std::string support() const { return std::to_string(facts_.support); }
    /// Returns the function that returns the type of an array of structs NAMEA, one for each node along axis A.
    OfAxis structs(const std::string& name) const {
        return [=, this](int a) { return "array<" + name + std::to_string(a) + ", " + support() + ">"; };
    }
    /// Returns the function that returns the name NAMEA of axis A.
    static OfAxis numbered(const std::string& name) {
        return [=](int a) { return name + std::to_string(a); };
    }
    /// Returns the WGSL text of the nested loops in which G2P sums over nodes. The innermost loop is along axis 0, the
    /// outermost along the last axis.
    /// \param type       type(a) returns the type of what the nodes along axis a have
    /// \param function   function(a) returns the name of the function that sums over them
    /// \param of_node    what a node has
    /// \param gradients  whether the sums with gradients of the weights are formed, too
    std::string gather(const OfAxis& type, const OfAxis& function, const std::string& of_node, bool gradients) const {
        const auto counter_of = [&](int a) { return a == D_ - 1 ? std::string("k") : counter(a); };
        std::string text;
        for (int a = D_ - 1, depth = 1; a >= 0; --a, ++depth)
            text += (a == D_ - 1 ? "" : indented(depth)) + "var part" + std::to_string(a) + ": " + type(a) + ";" +
                    indented(depth) + from_zero(counter_of(a), facts_.support);
        text += " part0[a] = " + of_node + "; }";
        for (int a = 0; a < D_; ++a) {
            const std::string n = std::to_string(a), gradient = gradients ? ", g[" + n + "]" : "",
                              sum = function(a) + ("(part" + n + ", w[" + n + "]" + gradient + ");");
            const int depth = D_ - a;
            if (a == D_ - 1)
                text += indented(depth) + "return " + sum;
            else
                text += indented(depth) + "part" + std::to_string(a + 1) + "[" + counter_of(a + 1) + "] = " + sum +
                        indented(depth - 1) + "}";
        }
        return text;
    }

    /// Returns the WGSL statements in which G2P computes `state` and `stress`, the particle's state and stress after
    /// the step.
    std::string update() const {
        const std::string arguments = "(load_state(i), taken.velocity_gradient" + here() + ");";
        const std::string asked = ask("place", "corner", "taken.velocity", start_word, 2);
        if (facts_.stress_with_state)
            return asked + "let after = updated_with_stress" + arguments + indented(2) + "let state = after.state;" +
                   indented(2) + "let stress = after.stress;";
        const std::string rate = facts_.rate_dependent ? ", taken.velocity_gradient" : "";
        return asked + "let state = updated" + arguments + indented(2) + "let stress = kirchhoff_stress(state" + rate +
               here() + ");";
    }

    std::string filled(const char* text, Names names = {}) const {
        const int D = D_;
        const auto along = [&](int a) { return arena_along(a); };
        const auto per_axis = [&](const std::string& function) {
            return listed(D, [&](int a) { return function + "(f." + axis(a) + ")"; });
        };
        const auto offset = [&](int a) { return "f32(" + counter(a) + " - " + std::to_string(facts_.centre) + ")"; };
        const std::string last = std::to_string(D - 1), axes = D == 2 ? "xy" : "xyz";
        const auto of_block = [](int) { return std::string("4"); };
        const auto of_block_u32 = [](int) { return std::string("4u"); };
        const auto of_pair = [](int) { return std::string("2"); };
        const Names all{
            {"INVOCATION",
             "@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, "
             "@builtin(local_invocation_index) local: u32"},
            {"FIRST_SET_WORD", std::to_string(first_set_word)},
            {"WORDS_OF_SET", std::to_string(words_of_set)},
            {"BIN_WORDS", std::to_string(bin_words(D))},
            {"END_OF_SETS", std::to_string(first_set_word + most_sets * words_of_set)},
            {"NODE_COUNT", listed(D, nodes_along, " * ")},
            {"NODE_INDEX", "u32(" + flat("at", signed_nodes_along) + ")"},
            {"NODE_AT", entry_at("i", vec("u32"), nodes_along)},
            {"BLOCK_OF_LATTICE", flat("block", blocks_along)},
            {"LATTICE_BLOCK", entry_at("i32(number)", vec("i32"), blocks_along)},
            {"FURTHER", flat("further", of_pair)},
            {"IN_BLOCK", flat("in_block", of_block)},
            {"AT_IN_BLOCK", entry_at("in_block", vec("u32"), of_block_u32)},
            {"FURTHER_BLOCK", further_block()},
            {"LATTICE", facts_.options.periodic ? "into_domain(" + vec("i32") + "(k))" : vec("i32") + "(k)"},
            {"NEW_CORNER", facts_.options.periodic
                               ? vec("f32") + "(into_domain(" + vec("i32") + "(load_corner(i) + shift)))"
                               : "load_corner(i) + shift"},
            {"AROUND", std::to_string(power(2))},
            {"SINK_ERROR", std::to_string(sink_error)},
            {"BLOCKS_ERROR", std::to_string(blocks_error)},
            {"UVEC", vec("u32")},
            {"COORDINATES", "coordinates[at.x], coordinates[params.nodes.x + at.y]" +
                                std::string(D == 3 ? ", coordinates[params.nodes.x + params.nodes.y + at.z]" : "")},
            {"BLOCK_INDEX", "u32(" + flat("at", blocks_along) + ")"},
            {"BLOCK_NODES", std::to_string(power(block_size))},
            {"BLOCK_ORIGIN", "4 * " + entry_at("i32(block)", vec("i32"), blocks_along)},
            {"ARENA_NUMBERS", std::to_string(power(arena_size()) * node_width)},
            {"ARENA_NODE", entry_at("node", vec("i32"), along)},
            {"IVEC", vec("i32")},
            {"SUPPORT", std::to_string(facts_.support)},
            {"WEIGHTS", "vec" + std::to_string(facts_.support) + "<f32>"},
            {"KERNEL_WEIGHTS", per_axis("kernel_weights")},
            {"KERNEL_GRADIENTS", per_axis("kernel_gradients")},
            {"OFFSETS", leading(offset)},
            {"GROUP", std::to_string(facts_.options.workgroup_size)},
            {"LAST_GRADIENT", facts_.weight_gradients ? ", g[" + last + "][k]" : ""},
            {"LAST", last},
            {"CENTRE", std::to_string(facts_.centre)},
            {"GRADIENT_WEIGHTS",
             facts_.weight_gradients ? ", " + leading([&](int a) { return weight_with_gradient(a); }) : ""},
            {"WEIGHT", weight()},
            {"FEWEST", std::to_string(fewest_mass_quanta)},
            {"V_AXES", listed(D, [](int a) { return "v." + axis(a); }) + (D == 2 ? ", 0.0f" : "")},
            {"AXES", axes},
            {"STRESS_SUM", listed(
                               D, [](int a) { return "stress[" + std::to_string(a) + "]." + axis(a); }, " + ")},
            {"UPDATE", update()},
            {"HERE", here()},
            {"ASK_AT_FIRST", ask_outside(time_word, 2)},
            {"ASK_VOLUME", ask_outside(start_word, 2)},
            {"ASK_FILTERED", ask_outside(start_word, 1)},
            {"KEEP_TIME", keep_time()},
            {"TAKE", take()},
            {"VELOCITY", facts_.blends ? "v.velocity" : "taken.velocity"},
            {"MOTION", facts_.blends ? "v.motion" : "taken.velocity"},
            {"ALL_NODES", facts_.sparse ? std::to_string(power(block_size)) + "u * params.blocks" : "node_count()"},
            {"CLEAR_BEFORE",
             blended(1, "for (var k = 0u; k < 4u; k++) { atomicStore(&node_sums[4u * before_forces(i) + k], 0); }")},
            {"MEASURE_BEFORE", blended(2, "measure_before_forces(i, place - base);")},
            {"KEEP_BEFORE", blended(1, "if (local == 0u) { raise_status(28u, atomicLoad(&largest_before_forces)); }")},
            {"CHOOSE_BEFORE", blended(1, "choose_scale_before_forces();")},
            {"EMPTY_BEFORE", blended(2, "nodes[before_forces(i)] = vec4<i32>(0);")},
            {"UPDATE_BEFORE", blended(1, "update_before_forces(i, mass);")},
            {"CHOOSE_SHARE", facts_.filters_volume
                                 ? indented(1) +
                                       "atomicStore(&status[16], bitcast<u32>(share_of(chosen.place_per_velocity * "
                                       "status_number(2u))));" +
                                       indented(1) + "atomicAdd(&status[17], 1u);" + indented(1) +
                                       "atomicStore(&status[18], 0u);" + choose_shifted_share()
                                 : ""},
            {"NO_SHARE", facts_.shifts_particles ? "" : " || !(status_number(16u) > 0.0f)"},
            {"MOMENTUM", facts_.refinements > 0 ? "bitcast<" + vec("f32") + ">(sums." + axes + ")"
                                                : vec("f32") + "(sums." + axes + ") * inverse(scale.momentum)"},
            {"CLEAR_LOADS",
             (facts_.blends || facts_.refinements > 0 ? indented(1) + "atomicStore(&status[28], 0u);" : "") +
                 (sums_rates() ? indented(1) + "for (var k = 12u; k < 14u; k++) { atomicStore(&status[k], 0u); }"
                               : "")},
            {"BEGIN_REACTIONS", facts_.reacting_parts == 0 ? "" : indented(1) + "begin_reactions();"},
            {"NO_MASS_BEFORE_WALLS", keep_mass("0u")},
            {"NEW_VELOCITY",
             facts_.reacting_parts == 0
                 ? "let v = velocity_of_node(momentum, mass, position);"
                 : "let after = velocity_and_changes(momentum, mass, position);" + indented(1) + "let v = after[0];"},
            {"REACT", react()},
            {"CLEAR_RATES",
             sums_rates() ? indented(1) + "for (var k = 0u; k < 4u; k++) { atomicStore(&rate_sums[4u * i + k], 0); }"
                          : ""},
            {"AT_FIRST_RATE",
             facts_.rate_dependent ? facts_.affine ? ", load_affine_velocity(i)" : ", " + no_matrix(D) : ""},
            {"STORE_AFFINE", facts_.affine ? "store_affine_velocity(i, taken.affine);" : ""},
            {"VEC", vec("f32")},
            {"D", std::to_string(D)}};
        names.insert(names.end(), all.begin(), all.end());
        return replaced(text, names);
    }
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD::wgsl
