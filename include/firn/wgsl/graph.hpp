/// \file The graph of a recorded definition: every operation once (equal ones are merged as they are recorded), loops
/// of a fixed number of passes kept as loops, and a note of what is only needed where a mask holds.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace firn::wgsl {

enum class Op : std::uint8_t {
    constant,  ///< a number
    truth,     ///< true or false
    input,     ///< a parameter of the function, or a uniform
    add,
    subtract,
    multiply,
    divide,
    negate,
    less,
    less_equal,
    equal,
    both,     ///< a & b
    either,   ///< a | b
    inverse,  ///< !a
    select,   ///< a ? b : c
    square_root,
    magnitude,  ///< |a|
    round_down,
    round_to_even,
    settled,  ///< a, which must not be merged with what is added to it
    power_of_two,
    exponent_of,
    significand_of,
    leading_half,
    loop,         ///< of loops[number]
    loop_value,   ///< inside: what has been carried over from the pass before
    loop_result,  ///< after it
};

inline constexpr int nothing = -1;

/// An operation. Its operands have smaller numbers than itself.
struct Node {
    Op op;
    int a = nothing, b = nothing, c = nothing;  ///< operands; of loops and what belongs to them: loop, and which value
    float value = 0;                            ///< of a constant
    std::string text{};                         ///< of an input, as it is written in WGSL

    bool operator<(const Node& other) const {  // digits, not values: 0 and −0 are different constants
        return std::tuple(op, a, b, c, std::bit_cast<std::uint32_t>(value), std::string_view(text)) <
               std::tuple(other.op, other.a, other.b, other.c, std::bit_cast<std::uint32_t>(other.value),
                          std::string_view(other.text));
    }
};

/// values → body(values), `passes` times, or until `go_on` is false after a pass.
struct Loop {
    int passes;
    int parent;                ///< the loop around this one
    std::vector<int> initial;  ///< nodes
    std::vector<int> inside;   ///< loop_value of each
    std::vector<int> next;     ///< what the body makes of each
    int go_on = nothing;       ///< a mask, or nothing
};

class Graph {
public:
    std::vector<Node> nodes;
    std::vector<int> region;  ///< of each node: the innermost loop that it depends on, or nothing
    std::vector<Loop> loops;
    std::map<int, std::string> names;  ///< of some nodes, as definitions call them
    std::vector<int> guards;           ///< masks that any() was asked about: what is selected by them is worth a branch

    int constant(float value) { return push({Op::constant, nothing, nothing, nothing, value}); }
    int truth(bool value) { return push({Op::truth, nothing, nothing, nothing, value ? 1.0F : 0.0F}); }
    int input(std::string text) { return push({Op::input, nothing, nothing, nothing, 0, std::move(text)}); }

    int unary(Op op, int a) {
        if (is_constant(a)) {
            const float x = nodes[a].value;
            switch (op) {
                case Op::negate:
                    return constant(-x);
                case Op::square_root:
                    return constant(std::sqrt(x));
                case Op::magnitude:
                    return constant(std::abs(x));
                case Op::round_down:
                    return constant(std::floor(x));
                case Op::round_to_even:
                    return constant(std::nearbyint(x));
                default:
                    break;
            }
        }
        if (op == Op::inverse && nodes[a].op == Op::truth) return truth(nodes[a].value == 0);
        if ((op == Op::negate || op == Op::inverse) && nodes[a].op == op) return nodes[a].a;
        return push({op, a});
    }

    int binary(Op op, int a, int b) {
        if (is_constant(a) && is_constant(b)) {
            const float x = nodes[a].value, y = nodes[b].value;
            switch (op) {
                case Op::add:
                    return constant(x + y);
                case Op::subtract:
                    return constant(x - y);
                case Op::multiply:
                    return constant(x * y);
                case Op::divide:
                    return constant(x / y);
                case Op::less:
                    return truth(x < y);
                case Op::less_equal:
                    return truth(x <= y);
                case Op::equal:
                    return truth(x == y);
                default:
                    break;
            }
        }
        // What changes no number (but the sign of a zero, and what was not a number and would not reach the result).
        if (op == Op::multiply && (is(a, 0) || is(b, 1))) return a;
        if (op == Op::multiply && (is(b, 0) || is(a, 1))) return b;
        if (op == Op::divide && is(b, 1)) return a;
        if ((op == Op::add || op == Op::subtract) && is(b, 0)) return a;
        if (op == Op::add && is(a, 0)) return b;
        if (op == Op::both || op == Op::either) {
            for (const auto& [known, other] : {std::pair(a, b), std::pair(b, a)})
                if (nodes[known].op == Op::truth) return (nodes[known].value != 0) == (op == Op::both) ? other : known;
            if (a == b) return a;
        }
        if (op == Op::multiply && (is(a, -1) || is(b, -1))) return unary(Op::negate, is(a, -1) ? b : a);
        return push({op, a, b});
    }

    int select(int mask, int if_true, int if_false) {
        if (if_true == if_false) return if_true;
        if (nodes[mask].op == Op::truth) return nodes[mask].value != 0 ? if_true : if_false;
        return push({Op::select, mask, if_true, if_false});
    }

    /// Whether the mask is known to be false. Otherwise what is selected by it shall be computed in a branch.
    bool is_false(int mask) {
        if (nodes[mask].op == Op::truth) return nodes[mask].value == 0;
        guards.push_back(mask);
        return false;
    }

    /// Opens a loop; what is recorded until close_loop() is its body. Returns its number.
    int open_loop(int passes, std::vector<int> initial) {
        const int loop = int(loops.size());
        loops.push_back({passes, open_.empty() ? nothing : open_.back(), std::move(initial), {}, {}});
        open_.push_back(loop);
        for (std::size_t k = 0; k < loops.back().initial.size(); ++k)
            loops.back().inside.push_back(push({Op::loop_value, loop, int(k)}));
        return loop;
    }
    /// Returns what the loop's values are in the end.
    std::vector<int> close_loop(std::vector<int> next, int go_on = nothing) {
        const int loop = open_.back();
        open_.pop_back();
        loops[loop].next = std::move(next);
        loops[loop].go_on = go_on;
        push({Op::loop, loop});
        std::vector<int> results;
        for (std::size_t k = 0; k < loops[loop].initial.size(); ++k)
            results.push_back(push({Op::loop_result, loop, int(k)}));
        return results;
    }

    /// Calls f for every node that node i needs. Those of a loop's body count as the loop's own.
    template <class F>
    void for_operands(int i, const F& f) const {
        const Node& node = nodes[i];
        switch (node.op) {
            case Op::constant:
            case Op::truth:
            case Op::input:
                break;
            case Op::loop_value:
                break;
            case Op::loop_result:
                f(number_of({Op::loop, node.a}));
                break;
            case Op::loop: {
                const Loop& loop = loops[node.a];
                for (const int k : loop.initial) f(k);
                for (const int k : loop.next) f(k);
                if (loop.go_on != nothing) f(loop.go_on);
                break;
            }
            default:
                for (const int k : {node.a, node.b, node.c})
                    if (k != nothing) f(k);
        }
    }

private:
    bool is_constant(int i) const { return nodes[i].op == Op::constant; }
    bool is(int i, float value) const { return is_constant(i) && nodes[i].value == value; }
    int number_of(const Node& node) const { return numbers_.at(node); }

    int push(Node node) {
        Node key = node;
        switch (node.op) {  // a + b and b + a are the same to the bit
            case Op::add:
            case Op::multiply:
            case Op::equal:
            case Op::both:
            case Op::either:
                if (key.b < key.a) std::swap(key.a, key.b);
                break;
            default:
                break;
        }
        const auto [place, is_new] = numbers_.try_emplace(std::move(key), int(nodes.size()));
        if (!is_new) return place->second;
        nodes.push_back(std::move(node));
        region.push_back(nothing);
        region.back() = region_of(int(nodes.size()) - 1);
        return int(nodes.size()) - 1;
    }
    int depth(int loop) const { return loop == nothing ? 0 : 1 + depth(loops[loop].parent); }
    int region_of(int i) const {
        const Node& node = nodes[i];
        if (node.op == Op::loop_value) return node.a;
        if (node.op == Op::loop || node.op == Op::loop_result) return loops[node.a].parent;
        int innermost = nothing;
        for_operands(i, [&](int k) {
            if (depth(region[k]) > depth(innermost)) innermost = region[k];
        });
        return innermost;
    }

    std::map<Node, int> numbers_;
    std::vector<int> open_;
};

}  // namespace firn::wgsl
