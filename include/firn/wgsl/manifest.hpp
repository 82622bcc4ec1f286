/// \file How a host runs a program: its manifest in JSON.
#pragma once

#include <firn/core/json.hpp>
#include <firn/version.hpp>
#include <firn/wgsl/layout.hpp>

namespace firn::wgsl {

/// The order of a program's entry points in a step; the second with P2G through workgroup memory.
inline const std::vector<std::string> step_order{"clear",       "measure", "measure_counts", "choose_scale", "p2g",
                                                 "grid_update", "g2p"};
inline const std::vector<std::string> sorted_step_order{
    "clear",       "measure",         "measure_counts", "choose_scale", "clear_blocks", "count_blocks",
    "scan_blocks", "order_particles", "p2g_blocks",     "grid_update",  "g2p"};

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

/// How to run the program, for hosts in any language. All bindings are in group 0; two variables of the program may
/// share a binding (the same buffer as atomics and as vectors), never within one entry point.
///
///     uniforms   binding, bytes, fields: name, type, offset [bytes], unit, default
///     buffers    name, binding, type, per, count: so many 32-bit numbers for each particle, node, cell (as many as
///                nodes), block (of 4^D nodes), axis_node (nodes along x, then y, then z) or once (program).
///                Of particles, number c of particle i lies at [c * capacity + i]; `components` names the numbers, and
///                of a state has the default: that of a body at rest.
///     kernels    entry, workgroup_size, bindings (number, access), per: one invocation each "particle" or "node"; one
///                workgroup for each block ("block_workgroup"), or one. x = min(groups, 65535), y = ceil(groups / x).
///     initialise, step, step_sorted   entry points in their order; the last has P2G through workgroup memory
///     status     which 32-bit word of the buffer "status" is what; f32 bits, but for error and particle
///     errors     what an error says; after one nothing is changed any more
///
/// Nodes along an axis: four times (blocks that hold the cells, and two more). Lattice coordinate k lies at index k +
/// 4, the last axis fastest. A particle's position is lower + h (corner + place) [m].
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
                        json.object([&] {
                            json.field("name", c.name).field("count", c.count).field("unit", c.unit);
                            if (!c.start.empty()) json.key("default").array(c.start, [&](double x) { json.value(x); });
                        });
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
            for (const char* name : {"error", "particle", "signal_speed", "largest_momentum", "largest_gradient",
                                     "largest_mass", "most_particles", "momentum_scale", "mass_scale"})
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
