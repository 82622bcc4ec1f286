/// \file Writes the graph of a recorded function as the statements of a WGSL function.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/wgsl/arithmetic.hpp>
#include <firn/wgsl/graph.hpp>

#include <algorithm>
#include <charconv>

namespace firn::inline FIRN_BUILD::wgsl {

/// Returns an f32 literal of WGSL that has exactly the bits of `value`.
///
/// The literal ends in f: with a literal without an f, WGSL would compute in higher precision. WGSL does not allow
/// infinities and NaN as constants; for these values, the result is a call of the program's function `from_bits`.
inline std::string literal(float value) {
    if (!std::isfinite(value)) {
        return "from_bits(" + std::to_string(std::bit_cast<std::uint32_t>(value)) + "u)";
    }
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    std::string text(digits, end);
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    return text + "f";
}

/// The WGSL statements that compute the outputs of a graph. (The outputs are the nodes whose values are needed as
/// results.)
///
/// If only one operation uses the value of a node, the node is written inside the expression of this operation. Any
/// other node becomes a named value. Nodes whose values are needed only if a mask of Graph::guards is true are written
/// inside an `if`. A loop of the graph becomes a loop in WGSL.
class Body {
public:
    /// Writes the statements that compute `outputs`.
    /// \param graph    the recorded operations; the graph must exist as long as this object
    /// \param outputs  indices (in Graph::nodes) of the nodes to compute
    /// \param taken    names that are already in use in the WGSL function, such as those of its parameters
    Body(const Graph& graph, const std::vector<int>& outputs, std::vector<std::string> taken = {},
         Arithmetic arithmetic = Arithmetic::plain)
        : graph_(graph), is_exact_(arithmetic == Arithmetic::exact), taken_(std::move(taken)) {
        const std::size_t count = graph.nodes.size();
        live_.resize(count);
        users_.resize(count);
        run_.assign(count, nothing);
        written_.resize(count);
        loop_node_.resize(graph.loops.size());
        for (std::size_t i = 0; i < count; ++i)
            if (graph.nodes[i].op == Op::loop) loop_node_[std::size_t(graph.nodes[i].a)] = int(i);
        find_live(outputs);
        find_users(outputs);
        find_runs();
        write_block(nothing, nothing, 1);
    }

    /// Returns the statements, one per line, indented by one level.
    const std::string& statements() const { return out_; }
    /// Returns the WGSL expression of the output that node `node` computes. The expression uses names that statements()
    /// defines.
    std::string text(int node) const { return expression(node).text; }

private:
    static constexpr std::size_t longest_expression = 72;
    // Stands for a use of a node's value outside of the loop that contains the node: at the end of a pass of this loop,
    // or as an output.
    static constexpr int outside = -2;

    const Node& node(int i) const { return graph_.nodes[std::size_t(i)]; }
    int region(int i) const { return graph_.region[std::size_t(i)]; }

    void find_live(const std::vector<int>& outputs) {
        std::vector<int> pending = outputs;
        while (!pending.empty()) {
            const int i = pending.back();
            pending.pop_back();
            if (live_[std::size_t(i)]) continue;
            live_[std::size_t(i)] = true;
            graph_.for_operands(i, [&](int k) { pending.push_back(k); });
        }
    }

    /// Returns the node of the graph that uses node k within the region of k, the innermost loop around k. `user` is
    /// any node that uses k. If `user` is in the region of k, the result is `user`; if `user` is in a loop inside this
    /// region, the result is the node of that loop; otherwise the result is `outside`.
    int user_in_region(int user, int k) const {
        while (region(user) != region(k)) {
            if (region(user) == nothing) return outside;  // `user` is not in the loop that contains k
            user = loop_node_[std::size_t(region(user))];
        }
        return user;
    }
    void find_users(const std::vector<int>& outputs) {
        for (int i = 0; i < int(live_.size()); ++i)
            if (live_[std::size_t(i)])
                graph_.for_operands(i, [&](int k) {
                    const bool own_body = node(i).op == Op::loop && region(k) == node(i).a;
                    users_[std::size_t(k)].push_back(own_body ? outside : user_in_region(i, k));
                });
        for (const int k : outputs) users_[std::size_t(k)].push_back(outside);
    }

    /// Finds the runs. A run is a sequence of Op::select nodes that have the same mask, one of Graph::guards, together
    /// with the nodes whose values are used only if this mask is true. A run is written as one `if`. A run may lie in
    /// another one; run_ of its Op::select nodes is then the outer run.
    void find_runs() {
        std::vector<std::vector<int>> sequences;
        for (int i = 0; i < int(live_.size()); ++i) {
            const Node& n = node(i);
            if (!live_[std::size_t(i)] || n.op != Op::select ||
                std::find(graph_.guards.begin(), graph_.guards.end(), n.a) == graph_.guards.end())
                continue;
            const auto fits = [&](const std::vector<int>& run) {
                const int first = run.front();
                return node(first).a == n.a && region(first) == region(i) && n.b < first && n.c < first;
            };
            if (sequences.empty() || !fits(sequences.back())) sequences.push_back({});
            sequences.back().push_back(i);
            selection_of_run_.push_back(i);
        }
        // An outer run ends after the runs inside, so the last sequence comes first.
        for (auto sequence = sequences.rbegin(); sequence != sequences.rend(); ++sequence)
            while (!sequence->empty()) {
                // A sequence that lies in an outer run only in part becomes several runs.
                const int outer = run_[std::size_t(sequence->front())];
                std::vector<int> selections, others;
                for (const int i : *sequence) (run_[std::size_t(i)] == outer ? selections : others).push_back(i);
                *sequence = others;
                add_run(selections);
            }
    }
    /// Adds a run with these Op::select nodes, and finds the other nodes of it.
    void add_run(const std::vector<int>& selections) {
        const int r = int(runs_.size());
        for (int i = selections.front() - 1; i >= 0; --i) {
            const std::vector<int>& users = users_[std::size_t(i)];
            if (!live_[std::size_t(i)] || region(i) != region(selections.front()) || is_atom(i)) continue;
            const bool only_here = std::all_of(users.begin(), users.end(), [&](int user) {
                if (user == outside) return false;
                if (run_[std::size_t(user)] == r) return true;
                return std::find(selections.begin(), selections.end(), user) != selections.end() && node(user).b == i &&
                       node(user).c != i && node(user).a != i;
            });
            if (only_here) run_[std::size_t(i)] = r;
        }
        runs_.push_back(selections);
    }
    bool is_selection_of_run(int i) const {
        return std::binary_search(selection_of_run_.begin(), selection_of_run_.end(), i);
    }

    /// Returns whether node i of the graph is written without a statement. This is so for a constant, an input and a
    /// variable of a loop: their short expressions are repeated wherever their values are used.
    bool is_atom(int i) const {
        const Op op = node(i).op;
        return op == Op::constant || op == Op::truth || op == Op::input || op == Op::loop_value;
    }
    /// Returns whether node i is a part of what another node has computed, and is written without a statement.
    bool is_part(int i) const { return node(i).op == Op::loop_result || node(i).op == Op::call_result; }
    /// Returns whether node i of the graph is used by only one operation and is written inside the expression of that
    /// operation.
    bool is_inlined(int i) const {
        const std::vector<int>& users = users_[std::size_t(i)];
        if (users.size() != 1 || graph_.names.count(i) || is_selection_of_run(i) || is_part(i)) return false;
        const int user = users.front();
        return user != outside && node(user).op != Op::loop && !is_selection_of_run(user) &&
               run_[std::size_t(user)] == run_[std::size_t(i)];
    }

    struct Expression {
        std::string text;
        int level;  // precedence: 0 comparison or logic, 1 sum, 2 product, 3 anything that binds more strongly
    };
    /// Returns the text of e, in brackets if the precedence of e is lower than `level`.
    static std::string within(const Expression& e, int level) { return e.level >= level ? e.text : "(" + e.text + ")"; }
    Expression expression(int i) const {
        if (!written_[std::size_t(i)].text.empty()) return written_[std::size_t(i)];
        const Node& n = node(i);
        const auto call = [&](const char* name, const char* open = "(", const char* close = ")") {
            return Expression{name + (open + expression(n.a).text + close), 3};
        };
        const auto exact = [&](const char* name) {
            return Expression{name + ("(" + expression(n.a).text + ", " + expression(n.b).text + ")"), 3};
        };
        const auto kept = [&](int operand, int other) {
            const bool is_kept =
                joins_constants(n.op, operand, other) || (is_exact_ && is_sum(i) && shares_term(operand, other));
            return is_kept ? settled(expression(operand)) : expression(operand);
        };
        const auto two = [&](const char* sign, int level) {  // b needs brackets in a − (b − c)
            return Expression{within(kept(n.a, n.b), level) + sign + within(kept(n.b, n.a), level + 1), level};
        };
        const auto relation = [&](const char* sign) {
            return Expression{within(expression(n.a), 1) + sign + within(expression(n.b), 1), 0};
        };
        // && and || are branches for some drivers: SwiftShader takes minutes for a function with hundreds of them.
        const auto logic = [&](const char* sign) {
            return Expression{within(expression(n.a), 3) + sign + within(expression(n.b), 3), 0};
        };
        switch (n.op) {
            case Op::constant:
                return {literal(n.value), n.value < 0 ? 1 : 3};
            case Op::truth:
                return {n.value != 0 ? "true" : "false", 3};
            case Op::input:
                return {n.text, 3};
            case Op::add:
                if (!is_exact_ && share_factor(n.a, n.b))
                    return {"fma(" + expression(node(n.b).a).text + ", " + expression(node(n.b).b).text + ", " +
                                expression(n.a).text + ")",
                            3};
                return two(" + ", 1);
            case Op::subtract:
                return two(" - ", 1);
            case Op::multiply:
                return is_exact_ ? exact("product") : two(" * ", 2);
            case Op::divide:
                return is_exact_ ? exact("quotient") : two(" / ", 2);
            case Op::negate:
                return {"-" + within(expression(n.a), 3), 1};
            case Op::less:
                return relation(" < ");
            case Op::less_equal:
                return relation(" <= ");
            case Op::equal:
                return relation(" == ");
            case Op::both:
                return logic(" & ");
            case Op::either:
                return logic(" | ");
            case Op::inverse:
                return {"!" + within(expression(n.a), 3), 3};
            case Op::select:
                return {
                    "select(" + expression(n.c).text + ", " + expression(n.b).text + ", " + expression(n.a).text + ")",
                    3};
            case Op::square_root:
                return call(is_exact_ ? "root" : "sqrt");
            case Op::magnitude:
                return call("abs");
            case Op::round_down:
                return call("floor");
            case Op::settled:
                return settled(expression(n.a));
            case Op::round_to_even:
                return call("round");
            case Op::power_of_two:
                return call("power_of_two");
            case Op::exponent_of:
                return call("exponent_of");
            case Op::significand_of:
                return call("significand_of");
            case Op::leading_half:
                return call("leading_half");
            case Op::index_after: {
                const bool is_next = is_one(n.b), is_beside = is_one(n.c);
                const std::string count = "u32(" + expression(n.b).text + ")";
                return {within(expression(n.a), 1) + " + " +
                            (is_next ? within(is_beside ? Expression{"1u", 3} : expression(n.c), 3)
                                     : count + (is_beside ? "" : " * " + within(expression(n.c), 3))),
                        1};
            }
            case Op::distance_at:
                return call("distances", "[", "]");
            case Op::loop_value:
            case Op::loop_result:
                return {variable(n.a, n.b), 3};
            case Op::call: {
                const Call& of = graph_.calls[std::size_t(n.a)];
                return {of.function + "(" +
                            of.written([&](std::size_t k) { return expression(of.arguments[k]).text; }) + ")",
                        3};
            }
            case Op::call_result: {
                const Call& of = graph_.calls[std::size_t(n.a)];
                return {expression(of.node).text + of.parts[std::size_t(n.b)], 3};
            }
            case Op::loop:
                break;
        }
        return {"", 3};
    }

    /// Returns whether nodes i and k of the graph are products a b and a c with a common factor a. Some GPU compilers
    /// turn a b + a c into a (b + c), which rounds differently from the CPU. They do not change fma(a, c, a b), so the
    /// sum is written in this form. A device may compute the fma with one rounding less than the CPU computes the sum.
    bool share_factor(int i, int k) const {
        const Node &a = node(i), &b = node(k);
        return a.op == Op::multiply && b.op == Op::multiply && (a.a == b.a || a.a == b.b || a.b == b.a || a.b == b.b);
    }

    /// Returns whether an operation has a constant operand, `other`, and its operand i is the result of such an
    /// operation, too. Some GPU compilers turn (a + 3) + 2 into a + 5, which rounds differently from the CPU.
    bool joins_constants(Op op, int i, int other) const {
        const Node& inner = node(i);
        const bool of_sums = op == Op::add || op == Op::subtract;
        return node(other).op == Op::constant && (of_sums ? is_sum(i) : op == inner.op) &&
               (node(inner.a).op == Op::constant || node(inner.b).op == Op::constant);
    }
    bool is_one(int i) const { return node(i).op == Op::constant && node(i).value == 1; }
    bool is_sum(int i) const { return node(i).op == Op::add || node(i).op == Op::subtract; }
    /// Returns whether node i is a sum that has a term in common with node k. Some GPU compilers turn (a + b) − a into
    /// b, and (a + b) + (c − a) into b + c.
    bool shares_term(int i, int k) const {
        if (!is_sum(i)) return false;
        const std::vector<int> of_i = terms(i), of_k = terms(k);
        return std::any_of(of_i.begin(), of_i.end(),
                           [&](int t) { return std::find(of_k.begin(), of_k.end(), t) != of_k.end(); });
    }
    /// Returns the terms of a sum of sums.
    std::vector<int> terms(int i) const {
        std::vector<int> found, pending{i};
        for (std::size_t next = 0; next < pending.size(); ++next) {
            const Node& n = node(pending[next]);
            const auto add = [&](int k) {
                if (std::find(pending.begin(), pending.end(), k) == pending.end()) pending.push_back(k);
            };
            if (is_sum(pending[next]))
                add(n.a), add(n.b);
            else if (n.op == Op::negate)
                add(n.a);
            else
                found.push_back(pending[next]);
        }
        return found;
    }
    /// Returns the expression in a form that GPU compilers do not look through. \see recorded::settled
    static Expression settled(const Expression& e) { return {"max(" + e.text + ", " + literal(-3e38F) + ")", 3}; }

    static std::string variable(int loop, int value) {
        return "loop" + std::to_string(loop) + "_" + std::to_string(value);
    }
    void line(int depth, const std::string& text) { out_ += std::string(std::size_t(4 * depth), ' ') + text + "\n"; }
    /// Returns a name for node i of the graph that is not yet in use. If the definition gives a name to the node, the
    /// result is this name, followed by a number if the name is already in use. Otherwise the result is t1, t2, …
    std::string new_name(int i) {
        const auto found = graph_.names.find(i);
        if (found == graph_.names.end()) return "t" + std::to_string(++names_);
        std::string name = found->second;
        for (int k = 2; std::find(taken_.begin(), taken_.end(), name) != taken_.end(); ++k)
            name = found->second + std::to_string(k);
        taken_.push_back(name);
        return name;
    }

    /// Writes the statements of some nodes of the graph: the nodes that belong to the run with the index `run`, and
    /// whose innermost loop has the index `in_region` (`nothing`: nodes outside of all loops), with the runs inside. If
    /// `run` is `nothing`, these are the nodes that belong to no run.
    void write_block(int in_region, int run, int depth) {
        for (int i = 0; i < int(live_.size()); ++i) {
            if (!live_[std::size_t(i)] || region(i) != in_region) continue;
            if (run_[std::size_t(i)] != run) continue;
            if (is_selection_of_run(i)) {
                for (int r = 0; r < int(runs_.size()); ++r)
                    if (runs_[std::size_t(r)].front() == i) write_run(r, in_region, depth);
                continue;
            }
            if (node(i).op == Op::loop) {
                write_loop(node(i).a, depth);
            } else if (!is_atom(i) && !is_part(i)) {
                const Expression e = expression(i);
                if (is_inlined(i) && node(i).op != Op::call && e.text.size() <= longest_expression) {
                    written_[std::size_t(i)] = e;
                } else {
                    const std::string name = new_name(i);
                    line(depth, "let " + name + " = " + e.text + ";");
                    written_[std::size_t(i)] = {name, 3};
                }
            }
        }
    }

    void write_run(int r, int in_region, int depth) {
        const std::vector<int>& selections = runs_[std::size_t(r)];
        std::vector<std::string> names;
        for (const int i : selections) {
            names.push_back(new_name(i));
            line(depth, "var " + names.back() + " = " + expression(node(i).c).text + ";");
        }
        line(depth, "if (" + expression(node(selections.front()).a).text + ") {");
        write_block(in_region, r, depth + 1);
        for (std::size_t k = 0; k < selections.size(); ++k)
            line(depth + 1, names[k] + " = " + expression(node(selections[k]).b).text + ";");
        line(depth, "}");
        for (std::size_t k = 0; k < selections.size(); ++k) written_[std::size_t(selections[k])] = {names[k], 3};
    }

    void write_loop(int number, int depth) {
        const Loop& loop = graph_.loops[std::size_t(number)];
        for (std::size_t k = 0; k < loop.initial.size(); ++k)
            line(depth, "var " + variable(number, int(k)) + " = " + expression(loop.initial[k]).text + ";");
        const std::string pass = "pass" + std::to_string(number);
        line(depth, "for (var " + pass + " = 0; " + pass + " < " + std::to_string(loop.passes) + "; " + pass + "++) {");
        write_block(number, nothing, depth + 1);
        // The new values of all variables of the loop are computed before the first variable is assigned.
        std::vector<std::string> next;
        for (std::size_t k = 0; k < loop.next.size(); ++k) {
            next.push_back(expression(loop.next[k]).text);
            if (node(loop.next[k]).op == Op::loop_value && loop.next[k] != loop.inside[k]) {
                const std::string name = new_name(nothing);
                line(depth + 1, "let " + name + " = " + next.back() + ";");
                next.back() = name;
            }
        }
        std::string go_on;
        if (loop.go_on != nothing) go_on = expression(loop.go_on).text;
        for (std::size_t k = 0; k < loop.next.size(); ++k)
            if (loop.next[k] != loop.inside[k]) line(depth + 1, variable(number, int(k)) + " = " + next[k] + ";");
        if (!go_on.empty()) line(depth + 1, "if (!(" + go_on + ")) { break; }");
        line(depth, "}");
    }

    const Graph& graph_;
    bool is_exact_;
    std::vector<bool> live_;
    std::vector<std::vector<int>> users_;
    std::vector<int> run_;                // for each node: index of the run to which the node belongs, or `nothing`
    std::vector<std::vector<int>> runs_;  // for each run: indices of its Op::select nodes
    std::vector<int> selection_of_run_;
    std::vector<int> loop_node_;
    std::vector<Expression> written_;  // for each node: name or expression; no text until the node is written
    std::vector<std::string> taken_;
    int names_ = 0;
    std::string out_;
};

}  // namespace firn::inline FIRN_BUILD::wgsl
