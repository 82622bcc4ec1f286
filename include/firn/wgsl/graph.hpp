/// \file The graph of a recorded C++ function (a definition): the operations that the function does, and the operands
/// of each operation.
///
/// An operation that equals an earlier one is not recorded again. A loop is recorded as a loop, with a single pass as
/// its body. The graph also contains a list of its guards, the masks (bool values) that decide whether work can be
/// skipped.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace firn::inline FIRN_BUILD::wgsl {

/// The kind of operation that a node of the graph does. The operands are the values of the nodes with the indices `a`,
/// `b` and `c`. For the kinds loop, loop_value and loop_result, `a` is the index of a loop and `b` the index of a
/// variable of this loop; for call and call_result, `a` is the index of a call and `b` that of a number of its result.
/// Values are f32, of comparisons and logic bool, and of index_after u32.
enum class Op : std::uint8_t {
    constant,        ///< a constant
    truth,           ///< a constant mask: true or false
    input,           ///< a parameter of the WGSL function, or a uniform of the program
    add,             ///< a + b
    subtract,        ///< a − b
    multiply,        ///< a b
    divide,          ///< a / b
    negate,          ///< −a
    less,            ///< a \< b
    less_equal,      ///< a ≤ b
    equal,           ///< a = b
    both,            ///< true if `a` and `b` are true
    either,          ///< true if `a` or `b` is true
    inverse,         ///< true if `a` is false
    select,          ///< `b` if `a` is true, otherwise `c`
    square_root,     ///< √a
    magnitude,       ///< |a|
    round_down,      ///< ⌊a⌋
    round_to_even,   ///< the integer nearest to `a`, ties to even
    settled,         ///< `a`, a sum that compilers must not simplify
    power_of_two,    ///< 2ᵃ, where `a` is an integer, see firn::power_of_two()
    exponent_of,     ///< the exponent e of a = m 2ᵉ with 1 ≤ m \< 2
    significand_of,  ///< the factor m of a = m 2ᵉ with 1 ≤ m \< 2
    leading_half,    ///< `a` with all binary digits after the leading 12 set to zero
    index_after,     ///< a + b c, where `a` and `c` count numbers of a buffer, and the f32 `b` is an integer
    distance_at,     ///< the number of the buffer "distances" at the index `a`
    loop,            ///< all passes of the loop Graph::loops[a]
    loop_value,      ///< value of variable `b` of loop `a` at the start of a pass
    loop_result,     ///< value of variable `b` of loop `a` after the last pass
    call,            ///< the call Graph::calls[a] of another function
    call_result,     ///< number `b` of the result of call `a`
};

/// The index −1, which means that there is no node, no loop or no run (see Body).
inline constexpr int nothing = -1;

/// A node of the graph: one operation. The nodes that compute the operands have smaller indices than the node that uses
/// the operands.
struct Node {
    Op op;            ///< kind of the operation
    int a = nothing,  ///< node index of the first operand; for Op::loop, loop_value and loop_result: index of the
                      ///< loop; for Op::call and call_result: index of the call
        b = nothing,  ///< node index of the second operand; for Op::loop_value and loop_result: index of the variable;
                      ///< for Op::call_result: index of the number
        c = nothing;  ///< node index of the third operand
    float value = 0;  ///< for Op::constant: its value; for Op::truth: 1 if true, 0 if false
    std::string text{};  ///< for Op::input: the WGSL expression of the input

    /// Returns whether this node comes before `other` in a fixed order of nodes. The order depends on all members, so a
    /// std::map with nodes as keys finds a node that equals a given node. Constants are compared by bits: 0 and −0
    /// differ.
    bool operator<(const Node& other) const {
        return std::tuple(op, a, b, c, std::bit_cast<std::uint32_t>(value), std::string_view(text)) <
               std::tuple(other.op, other.a, other.b, other.c, std::bit_cast<std::uint32_t>(other.value),
                          std::string_view(other.text));
    }
};

/// A loop of the graph, which repeats variables = body(variables). One repetition is called a pass. The loop ends after
/// `passes` passes, or earlier, after the first pass in which the mask `go_on` is false.
struct Loop {
    int passes;                ///< the largest number of passes
    int parent;                ///< index of the loop that contains this loop, or `nothing`
    std::vector<int> initial;  ///< for each variable, index of the node that computes its value before the loop
    std::vector<int> inside;   ///< for each variable, index of its node Op::loop_value
    std::vector<int> next;     ///< for each variable, index of the node that computes its value after a pass
    int go_on = nothing;       ///< node index of the mask that must be true for another pass, or `nothing`
};

/// A call of another WGSL function, which was recorded, too.
struct Call {
    std::string function;            ///< name of the function
    std::vector<int> arguments;      ///< for each number of the arguments, index of the node that computes it
    std::vector<std::string> parts;  ///< for each number of the result, what selects it: "" or for example ".x"
    /// Writes the arguments: text(k) must return the WGSL expression of the k-th number.
    std::function<std::string(const std::function<std::string(std::size_t)>& text)> written;
    int node = nothing;  ///< index of its node Op::call, which Graph::call() sets
};

/// The operations of a recorded definition (a C++ function). Each operation is a node. The index of a node is its index
/// in `nodes`.
class Graph {
public:
    std::vector<Node> nodes;  ///< all operations, in the order in which they were added
    /// For each node: index of the innermost loop on whose variables the node depends, or `nothing`.
    std::vector<int> region;
    std::vector<Loop> loops;           ///< all loops, in the order of the calls of open_loop()
    std::vector<Call> calls;           ///< all calls of other functions
    std::map<int, std::string> names;  ///< names that the definition gives to nodes; the key is the node's index
    /// Indices of the nodes of all masks that were passed to any(). Operations whose results are used only if such a
    /// mask is true become a branch of the WGSL program.
    std::vector<int> guards;

    /// \name Operations
    /// Each function returns the index of the node that has the operation's result. A new node is added only if the
    /// graph has no equal node, and if the operation cannot be simplified. Simplifications are: most operations on
    /// constants become a constant; x · 1, x / 1, x + 0 and x − 0 become x; x · 0 becomes 0. (A simplification may
    /// change the sign of a zero; NaN · 0 and ∞ · 0 become 0, too.)
    /// @{

    /// Adds a constant.
    int constant(float value) { return push({Op::constant, nothing, nothing, nothing, value}); }
    /// Adds a mask whose value is always `value`.
    int truth(bool value) { return push({Op::truth, nothing, nothing, nothing, value ? 1.0F : 0.0F}); }
    /// Adds an input: a parameter of the WGSL function or a uniform, whose WGSL expression is `text`.
    int input(std::string text) { return push({Op::input, nothing, nothing, nothing, 0, std::move(text)}); }

    /// Adds an operation with one operand, the value of the node with index `a`.
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

    /// Adds an operation with two operands, the values of the nodes with the indices `a` and `b`.
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
        // Operations whose result equals one of the operands.
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

    /// Adds a choice: its result is the value of node `if_true` if the mask computed by node `mask` is true, otherwise
    /// the value of node `if_false`.
    int select(int mask, int if_true, int if_false) {
        if (if_true == if_false) return if_true;
        if (nodes[mask].op == Op::truth) return nodes[mask].value != 0 ? if_true : if_false;
        return push({Op::select, mask, if_true, if_false});
    }
    /// Adds an index of a buffer, a + b c, from indices that nodes `a` and `c` compute and an integer of node `b`.
    int index_after(int a, int b, int c) { return push({Op::index_after, a, b, c}); }
    /// @}

    /// Returns whether node `mask` is the constant false. A node that is not a constant is added to `guards`.
    bool is_false(int mask) {
        if (nodes[mask].op == Op::truth) return nodes[mask].value == 0;
        guards.push_back(mask);
        return false;
    }

    /// Starts a loop and returns the loop's index in `loops`. The operations that are added before the matching call of
    /// close_loop() are the loop's body.
    /// \param passes   the largest number of passes
    /// \param initial  for each variable of the loop, index of the node that computes its value before the loop
    int open_loop(int passes, std::vector<int> initial) {
        const int loop = int(loops.size());
        loops.push_back({passes, open_.empty() ? nothing : open_.back(), std::move(initial), {}, {}});
        open_.push_back(loop);
        for (std::size_t k = 0; k < loops.back().initial.size(); ++k)
            loops.back().inside.push_back(push({Op::loop_value, loop, int(k)}));
        return loop;
    }
    /// Ends the loop that was started last and has not ended yet. Returns, for each variable of the loop, the index of
    /// the node that has the variable's value after the last pass.
    /// \param next   for each variable, index of the node that computes its value after a pass
    /// \param go_on  index of the node of the mask that must be true for another pass; `nothing` if there is no mask
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

    /// Adds a call of another function. Returns, for each number of its result, the index of the node that has it. The
    /// same function with the same arguments is called once.
    std::vector<int> call(Call call) {
        int number = 0;
        while (number < int(calls.size()) &&
               (calls[number].function != call.function || calls[number].arguments != call.arguments))
            ++number;
        if (number == int(calls.size())) calls.push_back(std::move(call));
        calls[number].node = push({Op::call, number});
        std::vector<int> results;
        for (std::size_t k = 0; k < calls[number].parts.size(); ++k)
            results.push_back(push({Op::call_result, number, int(k)}));
        return results;
    }

    /// Calls f(k) for the index k of every node whose value node i uses directly. If node i is a loop (Op::loop), these
    /// are the nodes in Loop::initial, Loop::next and Loop::go_on.
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
            case Op::call:
                for (const int k : calls[node.a].arguments) f(k);
                break;
            case Op::call_result:
                f(calls[node.a].node);
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
        switch (node.op) {  // exchanging the operands does not change the bits: a + b = b + a
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

}  // namespace firn::inline FIRN_BUILD::wgsl
