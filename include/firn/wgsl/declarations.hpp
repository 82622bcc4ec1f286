/// \file The declarations of a WGSL program: its uniforms and buffers, and the functions that load and store particles.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/wgsl/layout.hpp>
#include <firn/wgsl/module.hpp>

namespace firn::inline FIRN_BUILD::wgsl {

namespace detail {

/// Returns one text: the texts f(0), …, f(count − 1), separated by `between`.
template <class F>
std::string listed(int count, const F& f, const char* between = ", ") {
    std::vector<std::string> parts;
    for (int i = 0; i < count; ++i) parts.push_back(f(i));
    return joined(parts, between);
}

/// Returns the WGSL expression of a D × D matrix of zeros.
inline std::string no_matrix(int D) { return "mat" + std::to_string(D) + "x" + std::to_string(D) + "<f32>()"; }

/// Returns the text of the WGSL function load_NAME(i), which reads a value of particle i from a buffer. NAME is `name`.
/// In such a buffer, the c-th scalar (from 0) of particle i is at index c * capacity + i.
/// \tparam T      type of the value; there is a specialisation of wgsl::shape for T
/// \param stores  whether the result also contains the function store_NAME(i, value), which writes a value
/// \param first   the index c of the value's first component
/// \param number  function that tells which c belongs to component k of the value: c = first + number(k); the
///                components have the order of shape\<T>::visit()
template <class T, class Number>
std::string accessors(const std::string& name, const std::string& buffer, bool stores, int first,
                      const Number& number) {
    const auto at = [&](int k) {
        const int c = first + number(k);
        const std::string offset = c == 0   ? ""
                                   : c == 1 ? "params.capacity + "
                                            : std::to_string(c) + "u * params.capacity + ";
        return buffer + "[" + offset + "i]";
    };
    Recording recording;  // needed only because `value` cannot be made without a Recording
    T value{};
    int k = 0, s = 0;
    std::string text = "fn load_" + name + "(i: u32) -> " + shape<T>::type() + " {\n    return " +
                       shape<T>::build(value, [&](const recorded&) { return at(k++); }) + ";\n}\n";
    if (!stores) return text;
    text += "fn store_" + name + "(i: u32, value: " + shape<T>::type() + ") {\n";
    shape<T>::visit(value, "value",
                    [&](recorded&, const std::string& part) { text += "    " + at(s++) + " = " + part + ";\n"; });
    return text + "}\n";
}

/// Returns the WGSL declarations of a program: the struct Params of the uniforms, and the variables that are bound to
/// the buffers.
inline std::string declarations(const Program& program) {
    std::string text = "struct Params {\n";
    for (const Uniform& u : program.uniforms)
        text += "    " + u.name + ": " + u.type + ", // [" + u.unit + "]" + (u.what.empty() ? "" : " " + u.what) + "\n";
    text += "}\n@group(0) @binding(0) var<uniform> params: Params;\n";
    const auto declare = [&](const std::string& name, const Buffer& b, const std::string& type, const char* access) {
        text += "@group(0) @binding(" + std::to_string(b.binding) + ") var<storage, " + access + "> " + name +
                ": array<" + type + ">;";
        if (!b.components.empty())
            text += " // " + listed(int(b.components.size()), [&](int c) {
                        const Component& component = b.components[std::size_t(c)];
                        return component.name + " " + std::to_string(component.count) + " [" + component.unit + "]";
                    });
        text += "\n";
    };
    for (const Buffer& b : program.buffers) {
        const bool is_read_only =
            b.binding == constants || b.binding == coordinates || b.binding == loads || b.binding == distances;
        const bool is_atomic = b.binding == status || b.binding == counts || b.binding == rate_sums ||
                               b.binding == reactions || b.binding == load_reactions;
        if (b.binding == nodes) {
            declare("node_sums", b, "atomic<i32>", "read_write");
            declare("nodes", b, "vec4<i32>", "read_write");
        } else if (b.binding == bins) {
            declare("bins", b, "atomic<u32>", "read_write");
            declare("bin_words", b, "u32", "read_write");
        } else if (b.binding == block_table) {
            declare("block_table", b, "atomic<u32>", "read_write");
            declare("block_words", b, "u32", "read_write");
        } else {
            declare(b.name, b, is_atomic ? "atomic<" + b.type + ">" : b.type, is_read_only ? "read" : "read_write");
        }
    }
    return text;
}

/// Returns the text of the WGSL functions that load a field of a particle and, if `stores` is true, store the field.
/// `of` tells whether the field's values are scalars, vectors or matrices. The other parameters are those of
/// accessors().
template <int D>
std::string field_accessors(FieldShape of, const std::string& name, const std::string& buffer, bool stores, int first) {
    const auto in_order = [](int k) { return k; };
    const auto of_symmetric = [](int k) { return symmetric_index<D>(k % D, k / D); };
    switch (of) {
        case FieldShape::scalar:
            return accessors<recorded>(name, buffer, stores, first, in_order);
        case FieldShape::vector:
            return accessors<Vec<recorded, D>>(name, buffer, stores, first, in_order);
        case FieldShape::matrix:
            return accessors<Mat<recorded, D>>(name, buffer, stores, first, in_order);
        case FieldShape::vector_3d:
            return accessors<Vec<recorded, 3>>(name, buffer, stores, first, in_order);
        case FieldShape::matrix_3d:
            return accessors<Mat<recorded, 3>>(name, buffer, stores, first, in_order);
        case FieldShape::symmetric_matrix:
            break;
    }
    return accessors<Mat<recorded, D>>(name, buffer, stores, first, of_symmetric);
}

/// Returns the text of the WGSL functions that load and store values of particles. There are a pair of functions for
/// each field in `table` that is not part of the material's state (fields in the buffer `constants` are only loaded), a
/// pair for the whole state of the material, and load_particle(i), which returns the values that P2G reads.
template <int D, class State>
std::string particle_accessors(const Program& program, const FieldTable& table, bool affine_fields) {
    std::string text;
    for (const Buffer& buffer : program.buffers) {
        int first = 0;
        if (buffer.binding == state) continue;
        for_fields_in(buffer.binding, table, [&](const char* name, const FieldInfo& field) {
            text += field_accessors<D>(field.shape, name, buffer.name, buffer.binding != constants, first);
            first += field.components(D);
        });
        if (buffer.binding == motion && program.options.sinks > 0)
            text += field_accessors<D>(FieldShape::vector, place_before, buffer.name, true, first);
    }
    return text + accessors<State>("state", "state", true, 0, [](int k) { return k; }) +
           (program.options.loads > 0 ? accessors<recorded>("loads", "loads", false, 0, [](int k) { return k; }) : "") +
           (program.refinements > 0 ? field_accessors<D>(FieldShape::vector, "term_velocity", "term", true, 0) : "") +
           "fn load_particle(i: u32) -> P2GParticle {\n    return P2GParticle(load_mass(i), load_volume(i), "
           "load_velocity(i), " +
           (affine_fields ? "load_affine_velocity(i)" : no_matrix(D)) + ", load_kirchhoff_stress(i));\n}\n";
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD::wgsl
