/// \file A scalar that records operations: a definition evaluated with it builds the graph of the definition.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/scalar.hpp>
#include <firn/math/elementary.hpp>
#include <firn/wgsl/graph.hpp>
#include <firn/wgsl/shape.hpp>

namespace firn::wgsl {

// Functions that definitions call by unqualified names, so that argument-dependent lookup finds them for `recorded`.
using firn::cos, firn::exp, firn::log, firn::max, firn::min, firn::pow, firn::sin;

/// While it exists, its thread records operations on `recorded` into its graph.
class Recording {
public:
    /// Starts recording.
    /// \throws usage_error  if this thread is recording already
    Recording() {
        if (current_) throw usage_error("This thread is recording a definition already: finish that first.");
        current_ = &graph;
    }
    ~Recording() { current_ = nullptr; }
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

    /// Returns the graph that this thread records into.
    /// \throws usage_error  if this thread is not recording
    static Graph& current() {
        if (!current_) throw usage_error("A recorded number was made outside of a firn::wgsl::Recording.");
        return *current_;
    }
    Graph graph;  ///< the operations recorded so far

private:
    static inline thread_local Graph* current_ = nullptr;
};

/// An f32 of a WGSL program. Operations on it add nodes to the graph that this thread records into. They throw
/// usage_error if an operand has no value yet, or if no Recording exists.
struct recorded {
    /// A bool of a WGSL program, the result of a comparison.
    struct mask {
        int node;  ///< its node in the graph

        /// \name Logic
        /// @{

        /// Records the operation.
        friend mask operator&(mask a, mask b) { return {Recording::current().binary(Op::both, a.node, b.node)}; }
        friend mask operator|(mask a, mask b) { return {Recording::current().binary(Op::either, a.node, b.node)}; }
        friend mask operator!(mask a) { return {Recording::current().unary(Op::inverse, a.node)}; }
        /// @}

        /// Returns true unless the mask is known to be false. The caller then records the guarded work, which becomes a
        /// branch of the program.
        friend bool any(mask m) { return !Recording::current().is_false(m.node); }

        /// Fails to compile: a definition cannot branch on a mask with `if`.
        template <class M = mask>
        explicit constexpr operator bool() const {
            return firn::detail::refuse_to_branch<M>();
        }
    };

    int node = nothing;  ///< its node in the graph; `nothing` before it has a value

    /// A number without a value.
    constexpr recorded() = default;
    /// Records a constant, rounded to float.
    template <class U>
        requires std::is_arithmetic_v<U>
    recorded(U value) : node(constant(float(value))) {}
    /// Returns the number computed by node `number` of the graph.
    static recorded of(int number) {
        recorded r;
        r.node = number;
        return r;
    }

    /// \name Arithmetic
    /// @{

    /// Records the operation.
    friend recorded operator+(recorded a, recorded b) { return binary(Op::add, a, b); }
    friend recorded operator-(recorded a, recorded b) { return binary(Op::subtract, a, b); }
    friend recorded operator*(recorded a, recorded b) { return binary(Op::multiply, a, b); }
    friend recorded operator/(recorded a, recorded b) { return binary(Op::divide, a, b); }
    friend recorded operator-(recorded a) { return unary(Op::negate, a); }
    recorded& operator+=(recorded b) { return *this = *this + b; }
    recorded& operator-=(recorded b) { return *this = *this - b; }
    recorded& operator*=(recorded b) { return *this = *this * b; }
    /// @}

    /// \name Comparisons
    /// @{

    /// Records the comparison.
    friend mask operator<(recorded a, recorded b) { return {binary(Op::less, a, b).node}; }
    friend mask operator<=(recorded a, recorded b) { return {binary(Op::less_equal, a, b).node}; }
    friend mask operator>(recorded a, recorded b) { return b < a; }
    friend mask operator>=(recorded a, recorded b) { return b <= a; }
    friend mask operator==(recorded a, recorded b) { return {binary(Op::equal, a, b).node}; }
    /// @}

    /// Records m ? a : b.
    [[gnu::noinline]] friend recorded select(mask m, recorded a, recorded b) {
        return of(Recording::current().select(m.node, checked(a), checked(b)));
    }
    /// Names a in the program, unless it already has a name. Returns a.
    friend recorded named(const char* name, recorded a) {
        Recording::current().names.try_emplace(checked(a), name);
        return a;
    }

    /// \name Functions
    /// @{

    /// Records a call.
    friend recorded sqrt(recorded a) { return unary(Op::square_root, a); }
    friend recorded abs(recorded a) { return unary(Op::magnitude, a); }
    friend recorded floor(recorded a) { return unary(Op::round_down, a); }
    /// Records max(a, −3e38), which equals a: all numbers in definitions are larger than −3e38. Drivers replace
    /// (x + c) − c by x, but not if this maximum is taken of the sum.
    friend recorded settled(recorded a) { return unary(Op::settled, a); }
    /// Records a call of the builtin round(): compilers would replace (x + c) − c by x.
    friend recorded nearest_whole(recorded a) { return unary(Op::round_to_even, a); }
    friend recorded power_of_two(recorded a) { return unary(Op::power_of_two, a); }
    friend recorded exponent_of(recorded a) { return unary(Op::exponent_of, a); }
    friend recorded significand_of(recorded a) { return unary(Op::significand_of, a); }
    friend recorded leading_half(recorded a) { return unary(Op::leading_half, a); }
    /// @}

private:
    [[gnu::noinline]] static int constant(float value) { return Recording::current().constant(value); }
    // Not inlined, as definitions are: one copy of each is enough.
    [[gnu::noinline]] static int checked(recorded a) {
        if (a.node == nothing) throw usage_error("A definition reads a number that has no value yet.");
        return a.node;
    }
    [[gnu::noinline]] static recorded unary(Op op, recorded a) {
        return of(Recording::current().unary(op, checked(a)));
    }
    [[gnu::noinline]] static recorded binary(Op op, recorded a, recorded b) {
        return of(Recording::current().binary(op, checked(a), checked(b)));
    }
};

/// A number: f32.
template <>
struct shape<recorded> : detail::plain_shape<recorded> {
    /// \name Interface of shape
    /// @{

    /// See shape.
    static std::string type() { return "f32"; }
    template <class F>
    static void visit(recorded& value, const std::string& text, const F& f) {
        f(value, text);
    }
    template <class F>
    static std::string build(const recorded& value, const F& f) {
        return f(value);
    }
    /// @}
};

/// Records a loop. repeat() and repeat_while() of core/repeat.hpp find it by argument-dependent lookup.
/// \tparam N      the most passes
/// \tparam State  a type with a shape; its recorded numbers are the values of the loop
/// \param state   the values before the loop
/// \param body    state → next state; or changes the state that it is given and returns a mask, in which case the loop
///                ends after the first pass whose mask is false
/// \returns the values after the last pass
template <int N, class State, class Body>
State record_repeat(State state, const Body& body) {
    Graph& graph = Recording::current();
    const auto numbers = [](State& of) {
        std::vector<int> all;
        for_components(of, [&](recorded& x) { all.push_back(x.node); });
        return all;
    };
    const auto assign = [](State& to, const std::vector<int>& all) {
        std::size_t k = 0;
        for_components(to, [&](recorded& x) { x.node = all[k++]; });
    };
    const int loop = graph.open_loop(N, numbers(state));
    assign(state, std::vector<int>(graph.loops[std::size_t(loop)].inside));
    int go_on = nothing;
    if constexpr (std::same_as<decltype(body(state)), recorded::mask>)
        go_on = body(state).node;
    else
        state = body(std::as_const(state));
    assign(state, graph.close_loop(numbers(state), go_on));
    return state;
}

}  // namespace firn::wgsl

namespace firn {

/// A recorded number stands for one float.
template <>
struct scalar_traits<wgsl::recorded> {
    using value_type = float;                  ///< the machine number that it stands for
    static constexpr int lanes = 1;            ///< particles held by one number
    static constexpr bool has_friends = true;  ///< see firn::has_friends
};

}  // namespace firn
