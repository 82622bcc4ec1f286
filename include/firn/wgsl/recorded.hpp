/// \file The scalar type `recorded`, which records operations instead of computing them. Calling a C++ function with
/// such scalars produces the graph of the operations that the function does.
///
/// Drivers multiply constants of a product (x · c₁) · c₂ before x, which rounds differently from the CPU. Write x · c,
/// with c = c₁ c₂.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/dual.hpp>
#include <firn/core/scalar.hpp>
#include <firn/math/elementary.hpp>
#include <firn/wgsl/graph.hpp>
#include <firn/wgsl/shape.hpp>

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::wgsl {

// Definitions (the C++ functions to record) call these functions without firn::. The using-declaration makes
// argument-dependent lookup find the functions for arguments of type `recorded`.
using firn::cos, firn::exp, firn::log, firn::max, firn::min, firn::pow, firn::sin;

/// An object that records operations. While a Recording exists, the operations on scalars of type `recorded` in the
/// thread that constructed this Recording are added to the member `graph`.
class Recording {
public:
    /// Starts recording the operations of the calling thread.
    /// \throws usage_error  if another Recording of this thread exists
    Recording() {
        if (current_) throw usage_error("This thread is recording a definition already: finish that first.");
        current_ = &graph;
    }
    ~Recording() { current_ = nullptr; }
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

    /// Returns the graph of the calling thread's Recording.
    /// \throws usage_error  if no Recording of this thread exists
    static Graph& current() {
        if (!current_) throw usage_error("A recorded number was made outside of a firn::wgsl::Recording.");
        return *current_;
    }
    Graph graph;  ///< the operations recorded so far

    /// While this object exists, another Recording of the thread can be made: that of a function that is called.
    class Pause {
    public:
        Pause() : paused_(std::exchange(current_, nullptr)) {}
        ~Pause() { current_ = paused_; }
        Pause(const Pause&) = delete;
        Pause& operator=(const Pause&) = delete;

    private:
        Graph* paused_;
    };

private:
    static inline thread_local Graph* current_ = nullptr;
};

/// A scalar that stands for an f32 value of a WGSL program. Each operation on such scalars adds a node (one operation)
/// to the graph of this thread's Recording. The operation throws usage_error if an operand has no value yet, or if this
/// thread has no Recording.
struct recorded {
    /// The result of a comparison. It stands for a bool value of a WGSL program.
    struct mask {
        int node;  ///< index of the graph's node (operation) that computes the mask

        /// \name Logic
        /// @{

        /// Adds the logic operation to the graph and returns its result.
        friend mask operator&(mask a, mask b) { return {Recording::current().binary(Op::both, a.node, b.node)}; }
        friend mask operator|(mask a, mask b) { return {Recording::current().binary(Op::either, a.node, b.node)}; }
        friend mask operator!(mask a) { return {Recording::current().unary(Op::inverse, a.node)}; }
        /// @}

        /// Returns false if m is the constant false. Otherwise returns true, because the value of m is not known while
        /// recording. Operations whose results are used only in calls of select(m, …) become a branch, `if (m)`, of the
        /// WGSL program.
        friend bool any(mask m) { return !Recording::current().is_false(m.node); }

        /// Does not compile: a definition (a C++ function to record) cannot use a mask in `if`, because the value of
        /// the mask is not known while recording.
        template <class M = mask>
        explicit constexpr operator bool() const {
            return firn::detail::refuse_to_branch<M>();
        }
    };

    int node =
        nothing;  ///< index of the graph's node that computes the scalar; `nothing` before the scalar has a value

    /// Makes a scalar that has no value yet.
    constexpr recorded() = default;
    /// Makes a scalar that stands for a constant, `value` rounded to float. Adds the constant to the graph.
    template <class U>
        requires std::is_arithmetic_v<U>
    recorded(U value) : node(constant(float(value))) {}
    /// Returns the scalar that stands for the result of the graph's node with the index `number`.
    static recorded of(int number) {
        recorded r;
        r.node = number;
        return r;
    }

    /// \name Arithmetic
    /// @{

    /// Adds the arithmetic operation to the graph and returns its result.
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

    /// Adds the comparison to the graph and returns its result.
    friend mask operator<(recorded a, recorded b) { return {binary(Op::less, a, b).node}; }
    friend mask operator<=(recorded a, recorded b) { return {binary(Op::less_equal, a, b).node}; }
    friend mask operator>(recorded a, recorded b) { return b < a; }
    friend mask operator>=(recorded a, recorded b) { return b <= a; }
    friend mask operator==(recorded a, recorded b) { return {binary(Op::equal, a, b).node}; }
    /// @}

    /// Adds the choice m ? a : b to the graph and returns its result.
    [[gnu::noinline]] friend recorded select(mask m, recorded a, recorded b) {
        return of(Recording::current().select(m.node, checked(a), checked(b)));
    }
    /// Returns `a`. In the WGSL program the value of `a` gets the given name, unless this value already has a name.
    friend recorded named(const char* name, recorded a) {
        Recording::current().names.try_emplace(checked(a), name);
        return a;
    }

    /// \name Functions
    /// @{

    /// Adds a call of the function to the graph and returns its result.
    friend recorded sqrt(recorded a) { return unary(Op::square_root, a); }
    friend recorded abs(recorded a) { return unary(Op::magnitude, a); }
    friend recorded floor(recorded a) { return unary(Op::round_down, a); }
    /// Returns `a`, and keeps GPU drivers from simplifying `a`. Call settled() for a sum whose rounding matters:
    /// drivers replace (x + c) − c by x, but not settled(x + c) − c. In WGSL the call becomes max(a, −3e38), which
    /// equals `a` because `a` must be larger than −3e38.
    friend recorded settled(recorded a) { return unary(Op::settled, a); }
    /// Returns the integer nearest to `a`, ties to even. In WGSL the call becomes the built-in function round(). On the
    /// CPU, firn rounds x by (x + c) − c with a large constant c, but GPU compilers would replace this by x.
    friend recorded nearest_whole(recorded a) { return unary(Op::round_to_even, a); }
    friend recorded power_of_two(recorded a) { return unary(Op::power_of_two, a); }
    friend recorded exponent_of(recorded a) { return unary(Op::exponent_of, a); }
    friend recorded significand_of(recorded a) { return unary(Op::significand_of, a); }
    friend recorded leading_half(recorded a) { return unary(Op::leading_half, a); }
    /// Adds the index a + b c of a number in a buffer, and returns it. It can be used in calls of index_after() and
    /// distance_at() only. `a` and `c` are such indices, inputs of the type u32 or the constant 1; `b` is an integer
    /// from 0 on.
    friend recorded index_after(recorded a, recorded b, recorded c) {
        return of(Recording::current().index_after(checked(a), checked(b), checked(c)));
    }
    /// Adds the number of the program's buffer "distances" at an index, and returns it.
    friend recorded distance_at(recorded index) { return unary(Op::distance_at, index); }
    /// @}

    /// Returns `excess` if the recorded number is 1 + excess, without an operation if that is known. \see
    /// deformation.hpp
    friend recorded excess_of(recorded number, recorded excess);

private:
    [[gnu::noinline]] static int constant(float value) { return Recording::current().constant(value); }
    // The following functions are not inlined, although definitions are: one compiled copy of each function is enough.
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

/// Translates a scalar of type `recorded` to the WGSL type f32.
template <>
struct shape<recorded> : detail::plain_shape<recorded> {
    /// \name Interface of shape
    /// @{

    /// type(), visit() and build() are described at the template shape.
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

/// Records a loop and returns the state after the last pass. (A pass is one run of the loop's body.) repeat() and
/// repeat_while() of core/repeat.hpp call record_repeat() if the state consists of scalars of type `recorded`;
/// argument-dependent lookup finds record_repeat().
/// \tparam N      the largest number of passes
/// \tparam State  a type for which there is a specialisation of wgsl::shape; the variables of the loop are the recorded
///                scalars in a State
/// \param state   the state before the loop
/// \param body    the loop's body, a function that is called once, to record a single pass. Either the function returns
///                the next state; or it takes the state by reference, changes the state and returns a mask. In the
///                second case the loop ends after the first pass whose mask is false.
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

/// Returns definition(arguments…), as the result of a WGSL function of its own, which the module of the function that
/// is being recorded has once, and which is called here. Without a module, the definition is recorded here.
/// Argument-dependent lookup finds record_call() for arguments that consist of scalars of type `recorded`. It is
/// defined in module.hpp.
/// \param name        name of the WGSL function
/// \param comment     what is written above it, as by Module::function
/// \param names       names of its parameters
/// \param definition  a function object whose result depends on nothing but its arguments
/// \throws usage_error  if the module has a function of this name from a definition of another type; or if an argument
///                      has no value
template <class Definition, has_shape... Arguments>
std::invoke_result_t<const Definition&, const Arguments&...> record_call(const std::string& name,
                                                                         const std::string& comment,
                                                                         const std::vector<std::string>& names,
                                                                         const Definition& definition,
                                                                         const Arguments&... arguments);

}  // namespace firn::inline FIRN_BUILD::wgsl

namespace firn::inline FIRN_BUILD {

/// Describes the scalar type `recorded` to firn's templates: a `recorded` stands for one float.
template <>
struct scalar_traits<wgsl::recorded> {
    using value_type = float;                  ///< type of the value for which a `recorded` stands
    static constexpr int lanes = 1;            ///< number of particles whose values a `recorded` contains
    static constexpr bool has_friends = true;  ///< its functions (sqrt, …) are friends, see firn::has_friends
};

/// Returns an index or a distance as a dual number, whose derivative is zero. \see wgsl::recorded
/// @{
inline dual<wgsl::recorded> index_after(const dual<wgsl::recorded>& a, const dual<wgsl::recorded>& b,
                                        const dual<wgsl::recorded>& c) {
    return dual<wgsl::recorded>(index_after(a.value, b.value, c.value));
}
inline dual<wgsl::recorded> distance_at(const dual<wgsl::recorded>& index) {
    return dual<wgsl::recorded>(distance_at(index.value));
}
/// @}

namespace wgsl {
inline recorded excess_of(recorded number, recorded excess) {
    const recorded whole = recorded(1) + excess;
    return whole.node == number.node ? excess : select(number == whole, excess, number - recorded(1));
}
}  // namespace wgsl

}  // namespace firn::inline FIRN_BUILD
