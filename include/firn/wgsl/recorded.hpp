/// \file A scalar that records: evaluating a definition with it builds the graph of the definition.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/scalar.hpp>
#include <firn/math/elementary.hpp>
#include <firn/wgsl/graph.hpp>
#include <firn/wgsl/shape.hpp>

namespace firn::wgsl {

// What definitions call unqualified, to be found beside `recorded`.
using firn::cos, firn::exp, firn::log, firn::max, firn::min, firn::pow, firn::sin;

/// The graph that this thread records into, while it lives. \throws usage_error if there already is one
class Recording {
public:
    Recording() {
        if (current_) throw usage_error("A definition is being recorded already: finish that first.");
        current_ = &graph;
    }
    ~Recording() { current_ = nullptr; }
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

    /// \throws usage_error outside of any recording
    static Graph& current() {
        if (!current_) throw usage_error("A recorded number was made outside of a firn::wgsl::Recording.");
        return *current_;
    }
    Graph graph;

private:
    static inline thread_local Graph* current_ = nullptr;
};

/// An f32 of the program to be.
struct recorded {
    struct mask {
        int node;
        friend mask operator&(mask a, mask b) { return {Recording::current().binary(Op::both, a.node, b.node)}; }
        friend mask operator|(mask a, mask b) { return {Recording::current().binary(Op::either, a.node, b.node)}; }
        friend mask operator!(mask a) { return {Recording::current().unary(Op::inverse, a.node)}; }
        /// True unless it is known to be false: what is guarded is recorded, and becomes a branch.
        friend bool any(mask m) { return !Recording::current().is_false(m.node); }

        template <class M = mask>
        explicit constexpr operator bool() const {
            return firn::detail::refuse_to_branch<M>();
        }
    };

    int node = nothing;  ///< nothing: has no value yet

    constexpr recorded() = default;
    template <class U>
        requires std::is_arithmetic_v<U>
    recorded(U value) : node(constant(float(value))) {}
    static recorded of(int number) {
        recorded r;
        r.node = number;
        return r;
    }

    friend recorded operator+(recorded a, recorded b) { return binary(Op::add, a, b); }
    friend recorded operator-(recorded a, recorded b) { return binary(Op::subtract, a, b); }
    friend recorded operator*(recorded a, recorded b) { return binary(Op::multiply, a, b); }
    friend recorded operator/(recorded a, recorded b) { return binary(Op::divide, a, b); }
    friend recorded operator-(recorded a) { return unary(Op::negate, a); }
    recorded& operator+=(recorded b) { return *this = *this + b; }
    recorded& operator-=(recorded b) { return *this = *this - b; }
    recorded& operator*=(recorded b) { return *this = *this * b; }

    friend mask operator<(recorded a, recorded b) { return {binary(Op::less, a, b).node}; }
    friend mask operator<=(recorded a, recorded b) { return {binary(Op::less_equal, a, b).node}; }
    friend mask operator>(recorded a, recorded b) { return b < a; }
    friend mask operator>=(recorded a, recorded b) { return b <= a; }
    friend mask operator==(recorded a, recorded b) { return {binary(Op::equal, a, b).node}; }

    [[gnu::noinline]] friend recorded select(mask m, recorded a, recorded b) {
        return of(Recording::current().select(m.node, checked(a), checked(b)));
    }
    friend recorded named(const char* name, recorded a) {
        Recording::current().names.try_emplace(checked(a), name);
        return a;
    }
    friend recorded sqrt(recorded a) { return unary(Op::square_root, a); }
    friend recorded abs(recorded a) { return unary(Op::magnitude, a); }
    friend recorded floor(recorded a) { return unary(Op::round_down, a); }
    /// By a maximum with −3e38, which is below all that definitions meet: drivers take (x + c) − c for x, but none
    /// looks through that.
    friend recorded settled(recorded a) { return unary(Op::settled, a); }
    /// The builtin: compilers take (x + c) − c for x.
    friend recorded nearest_whole(recorded a) { return unary(Op::round_to_even, a); }
    friend recorded power_of_two(recorded a) { return unary(Op::power_of_two, a); }
    friend recorded exponent_of(recorded a) { return unary(Op::exponent_of, a); }
    friend recorded significand_of(recorded a) { return unary(Op::significand_of, a); }
    friend recorded leading_half(recorded a) { return unary(Op::leading_half, a); }

private:
    [[gnu::noinline]] static int constant(float value) { return Recording::current().constant(value); }
    // One copy each: definitions are forced to dissolve into their callers, this shall not.
    [[gnu::noinline]] static int checked(recorded a) {
        if (a.node == nothing) throw usage_error("A definition reads a number before it has given it a value.");
        return a.node;
    }
    [[gnu::noinline]] static recorded unary(Op op, recorded a) {
        return of(Recording::current().unary(op, checked(a)));
    }
    [[gnu::noinline]] static recorded binary(Op op, recorded a, recorded b) {
        return of(Recording::current().binary(op, checked(a), checked(b)));
    }
};

template <>
struct shape<recorded> : detail::plain_shape<recorded> {
    static std::string type() { return "f32"; }
    template <class F>
    static void visit(recorded& value, const std::string& text, const F& f) {
        f(value, text);
    }
    template <class F>
    static std::string build(const recorded& value, const F& f) {
        return f(value);
    }
};

/// The loops of core/repeat.hpp are found here by argument-dependent lookup. State: whatever has components of recorded
/// numbers. Where `body` returns a mask, the loop ends after a pass that returns false.
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

template <>
struct scalar_traits<wgsl::recorded> {
    using value_type = float;
    static constexpr int lanes = 1;
    static constexpr bool has_friends = true;
};

}  // namespace firn
