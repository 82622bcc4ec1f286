/// \file From a simulation's policies to a complete WGSL program and the manifest that says how to run it.
#pragma once

#include <firn/field/gravity.hpp>
#include <firn/version.hpp>
#include <firn/wgsl/definitions.hpp>
#include <firn/wgsl/json.hpp>
#include <firn/wgsl/kernels.hpp>

#include <algorithm>
#include <optional>

namespace firn::wgsl {

/// A number or vector that the host sets for all kernels.
struct Uniform {
    std::string name, type, unit, what;
    std::size_t offset;          ///< [bytes]
    std::vector<double> values;  ///< what it is unless the host says otherwise
};

struct Component {
    std::string name;
    int count;
    std::string unit;
};

/// A storage buffer of 32-bit numbers.
struct Buffer {
    std::string name, type;
    int binding;
    std::string per;  ///< "particle", "node", "cell", "block", "axis_node" or "program"
    int count;        ///< numbers for each of these
    std::vector<Component> components;
};

struct EntryPoint {
    std::string name;
    std::string
        per;  ///< one invocation each: "particle", "node"; one workgroup each: "block_workgroup", "one_workgroup"
    int workgroup_size;
    std::vector<std::pair<int, bool>> bindings;  ///< number; whether it is written to
};

/// What the host runs.
struct Program {
    std::string name;
    int dimension;
    std::string kernel, transfer, force, material, boundary, field;
    int workgroup_size;
    std::vector<Uniform> uniforms;
    std::size_t uniform_bytes = 0;
    std::vector<Buffer> buffers;
    std::vector<EntryPoint> entry_points;
    std::string code;

    const Buffer& buffer(const std::string& of_name) const {
        for (const Buffer& b : buffers)
            if (b.name == of_name) return b;
        throw usage_error("The program " + name + " has no buffer " + of_name + ".");
    }
    const Uniform& uniform(const std::string& of_name) const {
        for (const Uniform& u : uniforms)
            if (u.name == of_name) return u;
        throw usage_error("The program " + name + " has no uniform " + of_name + ".");
    }
};

/// The order of a program's entry points in a step; the second with P2G through workgroup memory.
inline const std::vector<std::string> step_order{"clear",       "measure", "measure_cells", "choose_scale", "p2g",
                                                 "grid_update", "g2p"};
inline const std::vector<std::string> sorted_step_order{
    "clear",       "measure",         "measure_cells", "choose_scale", "clear_blocks", "count_blocks",
    "scan_blocks", "order_particles", "p2g_blocks",    "grid_update",  "g2p"};

/// What status word 0 means, from 1 on.
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
    "too large."};

namespace detail {

inline std::string replaced(std::string text, const std::vector<std::pair<std::string, std::string>>& names) {
    for (const auto& [name, by] : names) {
        std::size_t at = 0;
        while ((at = text.find("$" + name, at)) != std::string::npos) {
            text.replace(at, name.size() + 1, by);
            at += by.size();
        }
    }
    return text;
}

/// f(0), f(1), …, joined.
template <class F>
std::string listed(int count, const F& f, const char* between = ", ") {
    std::vector<std::string> parts;
    for (int i = 0; i < count; ++i) parts.push_back(f(i));
    return joined(parts, between);
}

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
    template <int D>
    void add_vector(std::string name, const char* of, std::string unit, std::string what,
                    const Vec<double, D>& values) {
        add(std::move(name), "vec" + std::to_string(D) + "<" + of + ">", std::move(unit), std::move(what),
            std::vector<double>(values.v, values.v + D));
    }
    template <class Policy>
    void add_policy(const Policy& policy, const std::string& prefix) {
        if constexpr (has_parameters<Policy>)
            std::apply([&](const auto&... p) { (add_parameter(prefix + "_" + p.name, p.unit, policy.*p.member), ...); },
                       Policy::parameters());
    }

private:
    template <class S>
    void add_parameter(const std::string& name, const char* unit, const S& value) {
        add(name, "f32", unit, "", {double(value)});
    }
    template <class S, int D>
    void add_parameter(const std::string& name, const char* unit, const Vec<S, D>& value) {
        add_vector(name, "f32", unit, "", cast<double>(value));
    }
    Program& program_;
};

/// load_NAME(i) and store_NAME(i, value) for a value that begins at number `first` of a particle in a buffer.
/// \param number  number(k): which number the value's k-th component is
template <class T, class Number>
std::string accessors(const std::string& name, const std::string& buffer, int first, const Number& number) {
    const auto at = [&](int k) {
        const int c = first + number(k);
        const std::string offset = c == 0   ? ""
                                   : c == 1 ? "params.capacity + "
                                            : std::to_string(c) + "u * params.capacity + ";
        return buffer + "[" + offset + "i]";
    };
    Recording recording;  // the value's numbers are not used, but made
    T value{};
    int k = 0, s = 0;
    std::string text = "fn load_" + name + "(i: u32) -> " + shape<T>::type() + " {\n    return " +
                       shape<T>::build(value, [&](const recorded&) { return at(k++); }) + ";\n}\n";
    text += "fn store_" + name + "(i: u32, value: " + shape<T>::type() + ") {\n";
    shape<T>::visit(value, "value",
                    [&](recorded&, const std::string& part) { text += "    " + at(s++) + " = " + part + ";\n"; });
    return text + "}\n";
}

}  // namespace detail

/// A program for these policies. What a boundary holds besides its parameters (the kind of contact) becomes part of it.
/// \throws parameter_error from the boundary's check
template <class Kernel, class Transfer, class Force, int D, class Material, class Boundary,
          class Field = Gravity<float, D>>
Program make_program(const Material& material, const Boundary& boundary, const Field& field = {},
                     int workgroup_size = 64) {
    static_assert(require_material<Material, D>() && require_kernel<Kernel>());
    using R = recorded;
    using State = material_state_t<with_scalar_t<Material, R>, D>;
    constexpr int K = Kernel::support;
    constexpr bool weight_gradients = Force::weight_gradients, sum_gradients = g2p_needs_gradient<Transfer, Force>;
    static_assert(K <= block_size, "one block of ghost nodes holds what a particle at a face reaches");

    Program program;
    program.dimension = D;
    program.kernel = Kernel::name;
    program.transfer = Transfer::name;
    program.force = Force::name;
    program.material = Material::name;
    program.boundary = Boundary::name;
    program.field = Field::name;
    program.name = std::to_string(D) + "d";
    for (const std::string* policy :
         {&program.kernel, &program.transfer, &program.force, &program.material, &program.boundary, &program.field})
        program.name += "_" + *policy;
    program.workgroup_size = workgroup_size;

    detail::UniformLayout uniforms(program);
    const auto zero = Vec<double, D>::zero();
    uniforms.add_vector("nodes", "u32", "1", "nodes along each axis, a multiple of 4", zero);
    uniforms.add("particles", "u32", "1", "number of particles", {0});
    uniforms.add_vector("cells", "f32", "cells", "extent of the domain", zero);
    uniforms.add("capacity", "u32", "1", "distance between two numbers of a particle", {0});
    uniforms.add("time_step", "f32", "s", "dt", {0});
    uniforms.add("cell_size", "f32", "m", "h", {0});
    uniforms.add("place_per_velocity", "f32", "s/m", "dt / h, rounded once", {0});
    uniforms.add("mass_quanta", "f32", "1/kg", "a power of two; the largest mass of a particle becomes 2^20 to 2^21",
                 {0});
    uniforms.add("momentum_scale", "f32", "s/(kg m)", "quanta per momentum, a power of two; 0: chosen", {0});
    uniforms.add("mass_scale", "f32", "1/kg", "quanta per mass, a power of two; 0: chosen", {0});
    uniforms.add_policy(material, "material");
    uniforms.add_policy(boundary, "boundary");
    uniforms.add_policy(field, "field");
    program.uniform_bytes = (program.uniform_bytes + 15) / 16 * 16;

    std::vector<Component> state;
    int state_numbers = 0;
    std::apply(
        [&](const auto&... each) {
            const auto add = [&](const auto& f) {
                using Member = std::remove_cvref_t<decltype(std::declval<State>().*f.member)>;
                state.push_back({f.name, component_count<Member>, f.unit});
                state_numbers += component_count<Member>;
            };
            (add(each), ...);
        },
        State::fields());
    enum Binding {
        params,
        motion,
        affine,
        stress,
        of_state,
        constants,
        nodes,
        status,
        cells,
        coordinates,
        blocks,
        order
    };
    program.buffers = {
        {"motion",
         "f32",
         motion,
         "particle",
         3 * D,
         {{"place", D, "cells"}, {"corner", D, "cells"}, {"velocity", D, "m/s"}}},
        {"stress", "f32", stress, "particle", symmetric_size<D>, {{"stress", symmetric_size<D>, "Pa"}}},
        {"state", "f32", of_state, "particle", state_numbers, state},
        {"constants", "f32", constants, "particle", 2, {{"mass", 1, "kg"}, {"volume", 1, D == 3 ? "m^3" : "m^2"}}},
        {"nodes", "i32", nodes, "node", node_width, {}},
        {"status", "u32", status, "program", 16, {}},
        {"cells", "u32", cells, "cell", 3, {}},
        {"coordinates", "f32", coordinates, "axis_node", 1, {}},
        {"blocks", "u32", blocks, "block", 2, {}},
        {"order", "u32", order, "particle", 1, {{"order", 1, "1"}}}};
    if (Transfer::affine)
        program.buffers.insert(program.buffers.begin() + 1,
                               {"affine", "f32", affine, "particle", D * D, {{"affine", D * D, "1/s"}}});

    // Entry points and what they touch.
    const auto entry = [&](std::string name, std::string per, int size, std::vector<std::pair<int, bool>> bindings) {
        std::erase_if(bindings, [](const auto& b) { return b.first == affine && !Transfer::affine; });
        std::sort(bindings.begin(), bindings.end());
        program.entry_points.push_back({std::move(name), std::move(per), size, std::move(bindings)});
    };
    const std::pair<int, bool> uniform{params, false}, state_word{status, true}, any_nodes{nodes, true};
    const int size = workgroup_size;
    entry("initialise", "particle", size,
          {uniform, {motion, true}, {stress, true}, {of_state, true}, {constants, false}, state_word});
    entry("clear", "node", size, {uniform, any_nodes, {cells, true}, state_word});
    const std::vector<std::pair<int, bool>> reads_particles{uniform,        {motion, true},     {affine, true},
                                                            {stress, true}, {constants, false}, state_word};
    const auto reading_particles = [&](std::vector<std::pair<int, bool>> more) {
        more.insert(more.end(), reads_particles.begin(), reads_particles.end());
        return more;
    };
    entry("measure", "particle", size, reading_particles({{cells, true}}));
    entry("measure_cells", "node", size, {uniform, {cells, true}, state_word});
    entry("choose_scale", "one_workgroup", 1, {uniform, state_word});
    entry("p2g", "particle", size, reading_particles({any_nodes}));
    entry("clear_blocks", "node", size, {uniform, {blocks, true}});
    entry("count_blocks", "particle", size, {uniform, {motion, true}, {blocks, true}});
    entry("scan_blocks", "one_workgroup", 256, {uniform, {blocks, true}});
    entry("order_particles", "particle", size, {uniform, {motion, true}, {blocks, true}, {order, true}});
    entry("p2g_blocks", "block_workgroup", size, reading_particles({any_nodes, {blocks, true}, {order, true}}));
    entry("grid_update", "node", size, {uniform, any_nodes, {coordinates, false}, state_word});
    entry("g2p", "particle", size, reading_particles({{of_state, true}, any_nodes}));

    // Text.
    const std::string d = std::to_string(D), vec = "vec" + d + "<f32>", ivec = "vec" + d + "<i32>";
    const char* axes = "xyz";
    const auto axis = [&](int a) { return std::string(1, axes[a]); };
    // Of a D-dimensional array with n(a) entries along axis a, the last axis fastest: where entry `at` lies, and back.
    const auto flat = [&](const std::string& at, const auto& n) {
        std::string text = at + ".x";
        for (int a = 1; a < D; ++a)
            text = (a > 1 ? "(" + text + ")" : text) + " * " + n(a) + " + " + at + "." + axis(a);
        return text;
    };
    const auto entry_at = [&](const std::string& i, const std::string& type, const auto& n) {
        if (D == 2) return type + "(" + i + " / " + n(1) + ", " + i + " % " + n(1) + ")";
        return type + "(" + i + " / (" + n(1) + " * " + n(2) + "), " + i + " / " + n(2) + " % " + n(1) + ", " + i +
               " % " + n(2) + ")";
    };
    const auto nodes_along = [&](int a) { return "params.nodes." + axis(a); };
    const auto signed_nodes_along = [&](int a) { return "i32(" + nodes_along(a) + ")"; };
    const auto blocks_along = [&](int a) { return "i32(" + nodes_along(a) + " / 4u)"; };
    constexpr int arena = block_size + K - 1;
    int arena_nodes = 1, nodes_of_block = 1;
    for (int a = 0; a < D; ++a) arena_nodes *= arena, nodes_of_block *= block_size;
    const auto arena_along = [&](int) { return std::to_string(arena); };
    std::string of_axes = detail::listed(D, [&](int a) { return "$1(f." + axis(a) + ")"; });
    const auto per_axis = [&](const char* function) { return detail::replaced(of_axes, {{"1", function}}); };
    const std::string loop_names = "abc";
    const auto counter = [&](int a) { return std::string(1, loop_names[std::size_t(a)]); };
    std::string loops, gather;
    for (int a = 0; a < D - 1; ++a)
        loops +=
            detail::replaced("for (var $1 = 0; $1 < $2; $1++) {", {{"1", counter(a)}, {"2", std::to_string(K)}}) + " ";
    std::string ends(std::size_t(D - 1), '}');
    const std::string centre = std::to_string(centre_node<Kernel>);
    const auto offset = [&](int a) { return "f32(" + counter(a) + " - " + centre + ")"; };
    const auto product = [&](int with_gradient) {  // of the leading weights, in the order of P2G's lane loop
        if (with_gradient < 0)
            return detail::listed(
                D - 1, [&](int a) { return "w[" + std::to_string(a) + "][" + counter(a) + "]"; }, " * ");
        std::string text = "g[" + std::to_string(with_gradient) + "][" + counter(with_gradient) + "]";
        if (D == 3) text += " * w[" + std::to_string(1 - with_gradient) + "][" + counter(1 - with_gradient) + "]";
        return text;
    };
    const auto leading = [&](const auto& f) { return D == 2 ? f(0) : "vec2<f32>(" + detail::listed(D - 1, f) + ")"; };
    const std::string in_first = "first + " + ivec + "(" + detail::listed(D - 1, counter) + ", k)";
    // G2P: axis 0 innermost, the last axis outermost.
    const auto indented = [](int depth) { return "\n" + std::string(std::size_t(4 * depth), ' '); };
    for (int a = D - 1, depth = 1; a >= 0; --a, ++depth) {
        const std::string part = "part" + std::to_string(a), c = a == D - 1 ? "k" : counter(a);
        gather += (a == D - 1 ? "" : indented(depth)) + "var " + part + ": array<Sums" + std::to_string(a) + ", " +
                  std::to_string(K) + ">;" + indented(depth) + "for (var " + c + " = 0; " + c + " < " +
                  std::to_string(K) + "; " + c + "++) {";
    }
    gather += " part0[" + counter(0) + "] = Sums0(velocity_at(node_index(" + in_first + "))); }";
    for (int a = 0; a < D; ++a) {
        const std::string n = std::to_string(a), gradient = sum_gradients ? ", g[" + n + "]" : "",
                          sum = "sum_axis" + n + "(part" + n + ", w[" + n + "]" + gradient + ");";
        const int depth = D - a;
        if (a == D - 1)
            gather += indented(depth) + "return " + sum;
        else
            gather += indented(depth) + "part" + std::to_string(a + 1) + "[" + (a + 2 == D ? "k" : counter(a + 1)) +
                      "] = " + sum + indented(depth - 1) + "}";
    }

    std::vector<std::pair<std::string, std::string>> names{
        {"INVOCATION",
         "@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, "
         "@builtin(local_invocation_index) local: u32"},
        {"NODE_COUNT", detail::listed(
                           D, [&](int a) { return "params.nodes." + axis(a); }, " * ")},
        {"NODE_INDEX", "u32(" + flat("at", signed_nodes_along) + ")"},
        {"NODE_AT", entry_at("i", "vec" + d + "<u32>", nodes_along)},
        {"COORDINATES", "coordinates[at.x], coordinates[params.nodes.x + at.y]" +
                            std::string(D == 3 ? ", coordinates[params.nodes.x + params.nodes.y + at.z]" : "")},
        {"BLOCK_INDEX", "u32(" + flat("at", blocks_along) + ")"},
        {"BLOCK_NODES", std::to_string(nodes_of_block)},
        {"BLOCK_ORIGIN", "4 * " + entry_at("i32(block)", ivec, blocks_along)},
        {"ARENA_NUMBERS", std::to_string(arena_nodes * node_width)},
        {"ARENA_NODE", entry_at("node", ivec, arena_along)},
        {"IVEC", ivec},
        {"SUPPORT", std::to_string(K)},
        {"WEIGHTS", "vec" + std::to_string(K) + "<f32>"},
        {"OF_AXES(kernel_weights)", per_axis("kernel_weights")},
        {"OF_AXES(kernel_gradients)", per_axis("kernel_gradients")},
        {"OFFSETS", leading(offset)},
        {"GROUP", std::to_string(size)},
        {"LAST_GRADIENT", weight_gradients ? ", g[" + std::to_string(D - 1) + "][k]" : ""},
        {"LAST", std::to_string(D - 1)},
        {"CENTRE", centre},
        {"LOOPS", loops},
        {"END", ends},
        {"GRADIENT_WEIGHTS", weight_gradients ? ", " + leading(product) : ""},
        {"WEIGHT", product(-1)},
        {"FEWEST", std::to_string(fewest_mass_quanta)},
        {"V_AXES", detail::listed(D, [&](int a) { return "v." + axis(a); }) + (D == 2 ? ", 0.0f" : "")},
        {"AXES", D == 2 ? "xy" : "xyz"},
        {"GATHER", gather},
        {"STRESS_SUM", detail::listed(
                           D, [&](int a) { return "stress[" + std::to_string(a) + "]." + axis(a); }, " + ")},
        {"STORE_AFFINE", Transfer::affine ? "store_affine(i, taken.affine);" : ""},
        {"VEC", vec},
        {"D", d}};
    const auto filled = [&](const char* text, std::vector<std::pair<std::string, std::string>> first = {}) {
        first.insert(first.end(), names.begin(), names.end());
        return detail::replaced(text, first);
    };
    const std::string gradients_of_fraction = weight_gradients ? "var g = kernel_gradients_of(fraction);" : "";
    const std::string scatter = filled(text::scatter, {{"NAME", "scatter"},
                                                       {"TARGET", "node_sums"},
                                                       {"GRADIENTS", gradients_of_fraction},
                                                       {"NODE", "node_index(" + in_first + ")"}});
    const std::string arena_node = "u32(" + flat("at", arena_along) + ")";
    const std::string scatter_in_arena = filled(text::scatter, {{"NAME", "scatter_in_arena"},
                                                                {"TARGET", "arena"},
                                                                {"GRADIENTS", gradients_of_fraction},
                                                                {"let node = $NODE;", ""},
                                                                {"NODE;", "arena_node(" + in_first + ");"}}) +
                                         "fn arena_node(at: " + ivec + ") -> u32 { return " + arena_node + "; }\n";

    Module module;
    add_definitions<Kernel, Transfer, Force, D>(module, material, boundary, field);
    module.declare<P2GParticle<R, D>>();

    std::string& code = program.code;
    code = "// " + program.name + ", written by firn " + version() +
           " from the definitions that run on the CPU: change those, not this.\n\nstruct Params {\n";
    for (const Uniform& u : program.uniforms)
        code += "    " + u.name + ": " + u.type + ", // [" + u.unit + "]" + (u.what.empty() ? "" : " " + u.what) + "\n";
    code += "}\n@group(0) @binding(0) var<uniform> params: Params;\n";
    const auto declare = [&](const std::string& name, const Buffer& b, const std::string& type, const char* access) {
        code += "@group(0) @binding(" + std::to_string(b.binding) + ") var<storage, " + access + "> " + name +
                ": array<" + type + ">;";
        if (!b.components.empty())
            code += " // " + detail::listed(int(b.components.size()), [&](int c) {
                        const Component& component = b.components[std::size_t(c)];
                        return component.name + " " + std::to_string(component.count) + " [" + component.unit + "]";
                    });
        code += "\n";
    };
    for (const Buffer& b : program.buffers) {
        const bool is_read_only = b.binding == constants || b.binding == coordinates;
        const bool is_atomic = b.binding == status || b.binding == cells || b.binding == blocks;
        if (b.binding == nodes) {
            declare("node_sums", b, "atomic<i32>", "read_write");
            declare("nodes", b, "vec4<i32>", "read_write");
        } else {
            declare(b.name, b, is_atomic ? "atomic<" + b.type + ">" : b.type, is_read_only ? "read" : "read_write");
        }
    }
    code += "\n" + module.text();
    code += filled(text::helpers);
    if (weight_gradients || sum_gradients) code += filled(text::gradient_helpers);
    const auto in_order = [](int k) { return k; };
    code +=
        "\n" + detail::accessors<Vec<R, D>>("place", "motion", 0, in_order) +
        detail::accessors<Vec<R, D>>("corner", "motion", D, in_order) +
        detail::accessors<Vec<R, D>>("velocity", "motion", 2 * D, in_order) +
        detail::accessors<Mat<R, D>>("stress", "stress", 0, [](int k) { return symmetric_index<D>(k % D, k / D); }) +
        detail::accessors<State>("state", "state", 0, in_order);
    if (Transfer::affine) code += detail::accessors<Mat<R, D>>("affine", "affine", 0, in_order);
    code +=
        "fn load_mass(i: u32) -> f32 { return constants[i]; }\n"
        "fn load_volume(i: u32) -> f32 { return constants[params.capacity + i]; }\n"
        "fn load_particle(i: u32) -> P2GParticle {\n    return P2GParticle(load_mass(i), load_volume(i), "
        "load_velocity(i), " +
        std::string(Transfer::affine ? "load_affine(i)" : "mat" + d + "x" + d + "<f32>()") + ", load_stress(i));\n}\n";
    code += filled(text::clear) + filled(text::measure) + scatter + filled(text::p2g) +
            filled(text::p2g_sorted, {{"SCATTER", scatter_in_arena}}) + filled(text::grid_update) +
            filled(text::g2p, {{"GRADIENTS", sum_gradients ? "var g = kernel_gradients_of(f);" : ""}});
    return program;
}

/// How to run the program, for hosts in any language; the format is described in README.md.
inline std::string manifest(const Program& program) {
    Json json;
    json.object([&] {
        json.field("format", 1).field("firn", version()).field("name", program.name).field("code", "program.wgsl");
        json.field("dimension", program.dimension).field("kernel", program.kernel).field("transfer", program.transfer);
        json.field("force", program.force).field("material", program.material).field("boundary", program.boundary);
        json.key("field").value(program.field);
        json.field("workgroup_size", program.workgroup_size);
        json.key("uniforms").object([&] {
            json.field("binding", 0)
                .field("bytes", program.uniform_bytes)
                .key("fields")
                .array(program.uniforms, [&](const Uniform& u) {
                    json.object([&] {
                        json.field("name", u.name)
                            .field("type", u.type)
                            .field("offset", u.offset)
                            .field("unit", u.unit);
                        if (!u.what.empty()) json.field("what", u.what);
                        json.key("default");
                        if (u.values.size() == 1)
                            json.value(u.values[0]);
                        else
                            json.array(u.values, [&](double x) { json.value(x); });
                    });
                });
        });
        json.key("buffers").array(program.buffers, [&](const Buffer& b) {
            json.object([&] {
                json.field("name", b.name).field("binding", b.binding).field("per", b.per).field("type", b.type);
                json.field("count", b.count);
                if (!b.components.empty())
                    json.key("components").array(b.components, [&](const Component& c) {
                        json.object([&] { json.field("name", c.name).field("count", c.count).field("unit", c.unit); });
                    });
            });
        });
        json.key("kernels").array(program.entry_points, [&](const EntryPoint& e) {
            json.object([&] {
                json.field("entry", e.name).field("per", e.per).field("workgroup_size", e.workgroup_size);
                json.key("bindings").array(e.bindings, [&](const auto& b) {
                    json.object([&] {
                        json.field("binding", b.first)
                            .field("access", b.first == 0 ? "uniform"
                                             : b.second   ? "read_write"
                                                          : "read");
                    });
                });
            });
        });
        const auto text = [&](const std::string& s) { json.value(s); };
        json.key("initialise").array(std::vector<std::string>{"initialise"}, text);
        json.key("step").array(step_order, text).key("step_sorted").array(sorted_step_order, text);
        json.key("status").object([&] {
            int word = 0;
            for (const char* name : {"error", "particle", "signal_speed", "momentum_per_mass", "gradient_per_mass",
                                     "cell_mass", "cell_particles", "momentum_scale", "mass_scale"})
                json.field(name, word++);
        });
        json.key("errors").object([&] {
            for (std::size_t i = 0; i < error_sentences.size(); ++i)
                json.field(std::to_string(i + 1).c_str(), error_sentences[i]);
        });
    });
    return json.text();
}

}  // namespace firn::wgsl
