/// \file What the texts of programs are put together from: replacements of placeholders, and WGSL expressions that
/// depend on the dimension.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/wgsl/declarations.hpp>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::wgsl::detail {

/// A list of replacements: pairs of a NAME and the text that replaces ${NAME}.
using Names = std::vector<std::pair<std::string, std::string>>;

/// Returns a copy of `text` in which every ${NAME} is replaced by the text that `names` has for NAME. The replacements
/// are not searched for further ${…}.
/// \throws usage_error  if `names` has no text for a NAME, or if the closing brace of a ${NAME} is missing
inline std::string replaced(std::string_view text, const Names& names) {
    std::string out;
    for (std::size_t at = 0, next; at < text.size(); at = next) {
        const std::size_t begin = std::min(text.find("${", at), text.size());
        out += text.substr(at, begin - at);
        if ((next = begin) == text.size()) break;
        const std::size_t end = std::min(text.find('}', begin), text.size());
        const std::string_view name = text.substr(begin + 2, end - begin - 2);
        const auto found = std::find_if(names.begin(), names.end(), [&](const auto& one) { return one.first == name; });
        if (end == text.size() || found == names.end())
            throw usage_error(sentence("A program's text contains ${", name, "}, for which there is no replacement."));
        out += found->second;
        next = end + 1;
    }
    return out;
}

/// WGSL expressions for a program.
class TextParts {
public:
    explicit TextParts(const Facts& facts) : facts_(facts), D_(facts.dimension) {}

protected:
    bool is_exact() const { return facts_.options.arithmetic == Arithmetic::exact; }
    /// Returns the WGSL expression of the k-th of the blocks that start 0 or 1 blocks further along each axis.
    std::string further_block() const {
        return stored_block("block + " + vec("i32") + "(" +
                            entry_at("k", vec("u32"), [](int) { return std::string("2u"); }) + ")");
    }
    /// Returns the WGSL expression of a block: where it is stored, in a periodic domain.
    std::string stored_block(const std::string& block) const {
        return facts_.options.periodic ? "into_domain(4 * (" + block + ") - 4) / 4 + 1" : block;
    }
    std::string node_in_grid() const { return "node_index(" + node_from("first") + ")"; }
    static std::string axis(int a) { return std::string(1, "xyz"[a]); }
    // Returns the name of the counter of a loop along axis a. For the last axis, P2G and G2P use the name k instead.
    static std::string counter(int a) { return std::string(1, "abc"[a]); }
    std::string vec(const char* of) const { return "vec" + std::to_string(D_) + "<" + of + ">"; }
    static std::string indented(int depth) { return "\n" + std::string(std::size_t(4 * depth), ' '); }
    static std::string from_zero(const std::string& name, int count) {
        return "for (var " + name + " = 0; " + name + " < " + std::to_string(count) + "; " + name + "++) {";
    }

    // flat() and entry_at() are for a D-dimensional array with n(a) entries along axis a, in which the index along the
    // last axis varies fastest. flat() returns the WGSL expression of the index of the entry with coordinates `at`.
    // entry_at() returns the WGSL expression of the coordinates of the entry with index i.
    template <class Along>
    std::string flat(const std::string& at, const Along& n) const {
        std::string text = at + ".x";
        for (int a = 1; a < D_; ++a)
            text = (a > 1 ? "(" + text + ")" : text) + " * " + n(a) + " + " + at + "." + axis(a);
        return text;
    }
    template <class Along>
    std::string entry_at(const std::string& i, const std::string& type, const Along& n) const {
        if (D_ == 2) return type + "(" + i + " / " + n(1) + ", " + i + " % " + n(1) + ")";
        return type + "(" + i + " / (" + n(1) + " * " + n(2) + "), " + i + " / " + n(2) + " % " + n(1) + ", " + i +
               " % " + n(2) + ")";
    }
    static std::string nodes_along(int a) { return "params.nodes." + axis(a); }
    static std::string signed_nodes_along(int a) { return "i32(" + nodes_along(a) + ")"; }
    static std::string blocks_along(int a) { return "i32(" + nodes_along(a) + " / 4u)"; }
    int arena_size() const { return block_size + facts_.support - 1; }
    std::string arena_along(int) const { return std::to_string(arena_size()); }
    int power(int x) const { return D_ == 2 ? x * x : x * x * x; }

    /// Returns the WGSL expression of the coordinates of a node in the loops over nodes: the variable named `first`
    /// plus the counters of the loops.
    std::string node_from(const char* first) const {
        return first + (" + " + vec("i32")) + "(" + listed(D_ - 1, counter) + ", k)";
    }
    /// Returns the WGSL expression of a vector with one component for each axis except the last: a vec2 of f(0) and
    /// f(1) in 3D, the scalar f(0) in 2D.
    template <class F>
    std::string leading(const F& f) const {
        return D_ == 2 ? f(0) : "vec2<f32>(" + listed(D_ - 1, f) + ")";
    }
    static std::string of_axis(const char* table, int a) {
        return table + ("[" + std::to_string(a) + "][" + counter(a) + "]");
    }
    /// Returns the WGSL expression of the product of the weights along all axes except the last. The factors have the
    /// same order as on the CPU.
    std::string weight() const { return product(of_axis("w", 0), D_ == 3 ? of_axis("w", 1) : ""); }
    /// Returns the WGSL expression of the product of two scalars; of the first one if the second is empty.
    std::string product(const std::string& a, const std::string& b) const {
        if (b.empty()) return a;
        return is_exact() ? "product(" + a + ", " + b + ")" : a + " * " + b;
    }
    /// Returns the WGSL expression of the product of the weights along all axes except the last, but with the gradient
    /// along axis a in place of the weight along axis a.
    std::string weight_with_gradient(int a) const {
        return product(of_axis("g", a), D_ == 3 ? of_axis("w", 1 - a) : "");
    }

    /// Returns the last argument of functions of a material that asks for the surroundings of particles; no text for
    /// another material.
    std::string here() const { return facts_.asks ? ", here" : ""; }
    /// Returns the WGSL statement that computes this argument for particle i, and the beginning of the next line; no
    /// text if the material does not ask.
    /// \param word  the status word with the time
    std::string ask(const char* place, const char* corner, const char* velocity, int word, int depth) const {
        if (!facts_.asks) return "";
        return sentence("let here = surroundings_of(", place, ", ", corner, ", ", velocity,
                        ", load_mass(i), load_volume(i), status_number(", word, "u));", indented(depth));
    }
    /// Returns the same statement for a particle outside of G2P: the velocity is its own.
    std::string ask_outside(int word, int depth) const {
        return ask("load_place(i)", "load_corner(i)", "load_velocity(i)", word, depth);
    }
    /// Returns the WGSL statements that add the chosen step to the time.
    std::string keep_time() const {
        const auto store = [&](int word, const char* number) {
            return sentence("atomicStore(&status[", word, "], bitcast<u32>(", number, "));");
        };
        if (!facts_.keeps_time()) return store(time_word, "status_number(11u) + chosen.time_step");
        return sentence("let start = TimeReached(status_number(", time_word, "u), status_number(", time_low_word,
                        "u));") +
               indented(1) + "let reached = time_after(start, chosen.time_step);" + indented(1) +
               store(start_word, "start.high") + indented(1) + store(time_word, "reached.high") + indented(1) +
               store(time_low_word, "reached.low");
    }

    Facts facts_;
    int D_;
};

}  // namespace firn::inline FIRN_BUILD::wgsl::detail
