/// \file The graph of operations that recording a definition produces.
///
/// Equal operations are merged as they are recorded. Loops of a fixed number of passes stay loops. The graph also notes
/// the masks that decide whether work can be skipped.
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

/// The operation of a node. a, b and c are its operands.
enum class Op : std::uint8_t {
    constant,        ///< a number
    truth,           ///< true or false
    input,           ///< a parameter of the function, or a uniform
    add,             ///< a + b
    subtract,        ///< a − b
    multiply,        ///< a b
    divide,          ///< a / b
    negate,          ///< −a
    less,            ///< a \< b
    less_equal,      ///< a ≤ b
    equal,           ///< a = b
    both,            ///< a & b
    either,          ///< a | b
    inverse,         ///< !a
    select,          ///< a ? b : c
    square_root,     ///< √a
    magnitude,       ///< |a|
    round_down,      ///< ⌊a⌋
    round_to_even,   ///< the integer nearest to a, ties to even
    settled,         ///< a, written so that compilers do not simplify sums with it
    power_of_two,    ///< 2ᵃ, see firn::power_of_two()
    exponent_of,     ///< see firn::exponent_of()
    significand_of,  ///< see firn::significand_of()
    leading_half,    ///< see firn::leading_half()
    loop,            ///< all passes of Graph::loops[a]
    loop_value,      ///< value b of loop a at the start of a pass
    loop_result,     ///< value b of loop a after its last pass
};

/// Stands for no node, no loop or no run.
inline constexpr int nothing = -1;

/// An operation of the graph. Its operands have smaller numbers than the node itself.
struct Node {
    Op op;               ///< what it computes
    int a = nothing,     ///< first operand; of Op::loop, Op::loop_value and Op::loop_result: the number of the loop
        b = nothing,     ///< second operand; of Op::loop_value and Op::loop_result: the number of the value
        c = nothing;     ///< third operand
    float value = 0;     ///< of a constant
    std::string text{};  ///< of an input: its WGSL text

    /// An order in which equal operations are equivalent. Constants are compared by their bits: 0 and −0 differ.
    bool operator<(const Node& other) const {
        return std::tuple(op, a, b, c, std::bit_cast<std::uint32_t>(value), std::string_view(text)) <
               std::tuple(other.op, other.a, other.b, other.c, std::bit_cast<std::uint32_t>(other.value),
                          std::string_view(other.text));
    }
};

/// A loop: values → body(values), `passes` times, or until `go_on` is false after a pass.
struct Loop {
    int passes;                ///< the most passes
    int parent;                ///< the loop around this one, or nothing
    std::vector<int> initial;  ///< nodes of the values before the loop
    std::vector<int> inside;   ///< nodes of the values at the start of a pass (Op::loop_value)
    std::vector<int> next;     ///< nodes of the values after a pass
    int go_on = nothing;       ///< the mask that a further pass needs, or nothing
};

/// The operations of a recorded definition. Operations are numbered in the order of their recording.
class Graph {
public:
    std::vector<Node> nodes;           ///< all operations
    std::vector<int> region;           ///< of each node: the innermost loop that it depends on, or nothing
    std::vector<Loop> loops;           ///< all loops, in the order in which they were opened
    std::map<int, std::string> names;  ///< names that definitions give to some nodes
    std::vector<int> guards;           ///< masks passed to any(): work that only they select becomes a branch

    /// \name Operations
    /// Each adds a node and returns its number. It returns the number of an existing node if that is equal, or if the
    /// result is known: operations on constants are evaluated, and x + 0, x − 0, x · 1, x / 1, x · 0 are simplified.
    /// (A simplification may change the sign of a zero, and loses a NaN or ∞ that is multiplied by 0.)
    /// @{

    /// A number.
    int constant(float value) { return push({Op::constant, nothing, nothing, nothing, value}); }
    /// A mask that is known.
    int truth(bool value) { return push({Op::truth, nothing, nothing, nothing, value ? 1.0F : 0.0F}); }
    /// An input with its WGSL text.
    int input(std::string text) { return push({Op::input, nothing, nothing, nothing, 0, std::move(text)}); }

    /// An operation with one operand.
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

    /// An operation with two operands.
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
        // Operations that leave a number as it is.
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

    /// mask ? if_true : if_false.
    int select(int mask, int if_true, int if_false) {
        if (if_true == if_false) return if_true;
        if (nodes[mask].op == Op::truth) return nodes[mask].value != 0 ? if_true : if_false;
        return push({Op::select, mask, if_true, if_false});
    }
    /// @}

    /// Returns whether the mask is known to be false. If it is not known, the mask becomes a guard.
    bool is_false(int mask) {
        if (nodes[mask].op == Op::truth) return nodes[mask].value == 0;
        guards.push_back(mask);
        return false;
    }

    /// Opens a loop and returns its number. Operations recorded until close_loop() are its body.
    /// \param passes   the most passes
    /// \param initial  nodes of the values before the loop
    int open_loop(int passes, std::vector<int> initial) {
        const int loop = int(loops.size());
        loops.push_back({passes, open_.empty() ? nothing : open_.back(), std::move(initial), {}, {}});
        open_.push_back(loop);
        for (std::size_t k = 0; k < loops.back().initial.size(); ++k)
            loops.back().inside.push_back(push({Op::loop_value, loop, int(k)}));
        return loop;
    }
    /// Closes the loop opened last. Returns the nodes of its values after the last pass.
    /// \param next   nodes of the values after a pass
    /// \param go_on  the mask that a further pass needs, or nothing
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

    /// Calls f(number) for every node that node i needs. A loop needs its initial values and the results of its body.
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
        switch (node.op) {  // a + b and b + a are equal to the bit
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
