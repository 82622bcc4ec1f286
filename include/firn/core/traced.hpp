/// \file Traced numbers: a number that remembers how it was computed, so that the derivatives of one result with
/// respect to all inputs cost a few times the computation (reverse mode).
///
/// Every operation writes a node to the tape of its thread: the nodes that it came from, and its partial derivatives.
/// Tape::back() goes through the nodes from the last to the first and adds up adjoints: the adjoint of a node is the
/// derivative of the result with respect to it.
///
/// An adjoint of zero stays zero, also times a partial that is infinite or NaN. So what select() has not chosen gives
/// nothing, as √0 where matter is at rest. A partial of zero gives nothing, too, so that the norm of a zero vector has
/// the derivative 0, as with dual numbers.
#pragma once

#include <firn/core/dual.hpp>

#include <cstdint>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The nodes of the traced numbers of one thread.
/// \tparam T  type of the values and adjoints: float, double, a pack
template <scalar T>
class Tape {
public:
    using Node = std::uint32_t;         ///< The name of a node.
    static constexpr Node no_node = 0;  ///< The node of constants.

    /// Returns the tape of this thread.
    FIRN_INLINE static Tape& mine() {
        static thread_local Tape tape;
        return tape;
    }

    /// Returns the number of nodes: the name that the next one gets.
    std::size_t size() const { return nodes_.size(); }
    /// Forgets all nodes from `size` on; all, if it is 1.
    void cut(std::size_t size) {
        partials_.resize(size < nodes_.size() ? nodes_[size].partial : partials_.size());
        nodes_.resize(size);
    }

    /// Makes the node of an input.
    FIRN_INLINE Node input() { return made(Kind::input, no_node, no_node); }
    /// Makes the node of a + b, a − b, or −a.
    /// @{
    FIRN_INLINE Node sum(Node a, Node b) { return made(Kind::sum, a, b); }
    FIRN_INLINE Node difference(Node a, Node b) { return made(Kind::difference, a, b); }
    FIRN_INLINE Node negative(Node a) { return made(Kind::difference, no_node, a); }
    /// @}
    /// Makes a node with its partial derivatives with respect to the nodes a and b.
    [[gnu::noinline]] Node general(Node a, const T& by_a, Node b, const T& by_b) {
        if (b == no_node) return general(a, by_a);
        if (a == no_node) return general(b, by_b);
        const Node node = made(Kind::two, a, b);
        partials_.push_back(by_a);
        partials_.push_back(by_b);
        return node;
    }
    /// Makes a node with its partial derivative with respect to the node a.
    [[gnu::noinline]] Node general(Node a, const T& by_a) {
        const Node node = made(Kind::one, a, no_node);
        partials_.push_back(by_a);
        return node;
    }
    /// Makes the node of a choice: of the node a where `chosen` is 1, of b where it is 0.
    [[gnu::noinline]] Node choice(const T& chosen, Node a, Node b) {
        const Node node = made(Kind::choice, a, b);
        partials_.push_back(chosen);
        return node;
    }

    /// Sets the adjoints of all nodes to zero. Call it after the last operation.
    void begin() { adjoints_.assign(nodes_.size(), T(0)); }
    /// Adds to the adjoint of a node.
    FIRN_INLINE void seed(Node node, const T& adjoint) { adjoints_[node] = adjoints_[node] + adjoint; }
    /// Adds up the adjoints of all nodes, back to the node `first`.
    void back(std::size_t first = 1);
    /// Returns the adjoint of a node, after back().
    FIRN_INLINE const T& adjoint(Node node) const { return adjoints_[node]; }

private:
    enum class Kind : std::uint32_t { input, sum, difference, one, two, choice };
    struct Entry {
        Node a, b;
        std::uint32_t partial;  // index of the first partial
        Kind kind;
    };

    Tape() : nodes_(1, Entry{no_node, no_node, 0, Kind::input}) {}
    [[gnu::noinline]] Node made(Kind kind, Node a, Node b) {
        nodes_.push_back({a, b, std::uint32_t(partials_.size()), kind});
        return Node(nodes_.size() - 1);
    }
    /// Returns adjoint × partial; 0 where one of them is 0.
    FIRN_INLINE static T times(const T& adjoint, const T& partial) {
        return select((adjoint == T(0)) | (partial == T(0)), T(0), adjoint * partial);
    }

    std::vector<Entry> nodes_;
    std::vector<T> partials_, adjoints_;
};

template <scalar T>
void Tape<T>::back(std::size_t first) {
    const T* const partials = partials_.data();
    T* const adjoints = adjoints_.data();
    for (std::size_t i = nodes_.size() - 1; i >= first; --i) {
        const Entry& entry = nodes_[i];
        const T adjoint = adjoints[i];
        T &a = adjoints[entry.a], &b = adjoints[entry.b];
        const T* const partial = partials + entry.partial;
        switch (entry.kind) {
            case Kind::input:
                break;
            case Kind::sum:
                a = a + adjoint;
                b = b + adjoint;
                break;
            case Kind::difference:
                a = a + adjoint;
                b = b - adjoint;
                break;
            case Kind::two:
                b = b + times(adjoint, partial[1]);
                [[fallthrough]];
            case Kind::one:
                a = a + times(adjoint, partial[0]);
                break;
            case Kind::choice: {
                const auto chosen = partial[0] == T(1);
                a = a + select(chosen, adjoint, T(0));
                b = b + select(chosen, T(0), adjoint);
                break;
            }
        }
    }
}

/// A number that remembers how it was computed.
/// \tparam T  type of the value: float, double, a pack
template <scalar T>
struct traced {
    using Node = typename Tape<T>::Node;  ///< The name of a node of the tape.

    T value;                       ///< the number
    Node node = Tape<T>::no_node;  ///< its node; no_node: a constant

    traced() = default;  ///< Leaves the value uninitialised.
    /// Makes a number with a node.
    FIRN_INLINE traced(const T& v, Node n) : value(v), node(n) {}
    /// Makes a constant.
    /// @{
    template <class U>
        requires std::is_arithmetic_v<U>
    FIRN_INLINE traced(U v) : value(T(v)) {}
    FIRN_INLINE explicit traced(const T& v)
        requires(!std::is_arithmetic_v<T>)
        : value(v) {}
    FIRN_INLINE static traced load(const value_type_t<T>* from)
        requires(!std::is_arithmetic_v<T>)
    {
        return traced(T::load(from));
    }
    /// @}
    /// Makes an input: a number with a node of its own.
    FIRN_INLINE static traced input(const T& v) { return {v, tape().input()}; }

    /// Arithmetic operators.
    /// @{
    friend traced operator+(const traced& a, const traced& b) {
        const T result = a.value + b.value;
        return is_constant(a, b) ? traced(result, none) : traced(result, tape().sum(a.node, b.node));
    }
    friend traced operator-(const traced& a, const traced& b) {
        const T result = a.value - b.value;
        return is_constant(a, b) ? traced(result, none) : traced(result, tape().difference(a.node, b.node));
    }
    friend traced operator*(const traced& a, const traced& b) {
        const T result = a.value * b.value;
        return is_constant(a, b) ? traced(result, none)
                                 : traced(result, tape().general(a.node, b.value, b.node, a.value));
    }
    friend traced operator/(const traced& a, const traced& b) {
        const T result = a.value / b.value;
        if (is_constant(a, b)) return {result, none};
        const T inverse = T(1) / b.value;
        return {result, tape().general(a.node, inverse, b.node, -(result * inverse))};
    }
    friend traced operator-(const traced& a) { return {-a.value, a.node == none ? none : tape().negative(a.node)}; }
    FIRN_INLINE traced& operator+=(const traced& b) { return *this = *this + b; }
    FIRN_INLINE traced& operator-=(const traced& b) { return *this = *this - b; }
    FIRN_INLINE traced& operator*=(const traced& b) { return *this = *this * b; }
    /// @}

    /// Compares the values.
    /// @{
    FIRN_INLINE friend auto operator<(const traced& a, const traced& b) { return a.value < b.value; }
    FIRN_INLINE friend auto operator<=(const traced& a, const traced& b) { return a.value <= b.value; }
    FIRN_INLINE friend auto operator>(const traced& a, const traced& b) { return a.value > b.value; }
    FIRN_INLINE friend auto operator>=(const traced& a, const traced& b) { return a.value >= b.value; }
    FIRN_INLINE friend auto operator==(const traced& a, const traced& b) { return a.value == b.value; }
    /// @}

    /// Returns `a` in the lanes where the mask is on, and `b` in the other lanes.
    friend traced select(mask_t<T> m, const traced& a, const traced& b) {
        const T result = select(m, a.value, b.value);
        if (is_constant(a, b)) return {result, none};
        return {result, tape().choice(select(m, T(1), T(0)), a.node, b.node)};
    }
    /// Returns √a.
    friend traced sqrt(const traced& a) {
        using firn::sqrt;
        const T root = sqrt(a.value);
        return a.node == none ? traced(root, none) : traced(root, tape().general(a.node, T(0.5) / root));
    }
    /// Returns |a|.
    friend traced abs(const traced& a) { return select(a.value < T(0), -a, a); }
    /// Returns the largest whole number ≤ a, a constant.
    FIRN_INLINE friend traced floor(const traced& a) {
        using firn::floor;
        return {floor(a.value), none};
    }

private:
    static constexpr Node none = Tape<T>::no_node;
    FIRN_INLINE static Tape<T>& tape() { return Tape<T>::mine(); }
    FIRN_INLINE static bool is_constant(const traced& a, const traced& b) { return a.node == none && b.node == none; }
};

/// Traits of a traced number: those of its value.
template <class T>
struct scalar_traits<traced<T>> {
    using value_type = value_type_t<T>;                    ///< type of the numbers: float or double
    static constexpr int lanes = scalar_traits<T>::lanes;  ///< number of lanes of T
    static constexpr bool has_friends = true;              ///< makes `firn::has_friends<S>` true for traced numbers
};
/// Returns the number that a traced number holds in the given lane.
template <class T>
FIRN_INLINE auto lane_value(const traced<T>& a, int lane) {
    return lane_value(a.value, lane);
}

/// \name What every number with derivatives has
/// As of dual numbers, see core/dual.hpp.
/// @{
template <class T>
FIRN_INLINE const T& plain(const traced<T>& x) {
    return x.value;
}
template <class T>
FIRN_INLINE traced<T> with_value(const traced<T>& x, const T& value) {
    return {value, x.node};
}
template <class T, class Function>
FIRN_INLINE ValueAndSlope<T> value_and_slope(std::type_identity<traced<T>>, const Function& f, const T& x) {
    Tape<T>& tape = Tape<T>::mine();
    const std::size_t before = tape.size();
    const traced<T> at = traced<T>::input(x), y = f(at);
    tape.begin();
    if (y.node >= before) tape.seed(y.node, T(1));
    tape.back(before);
    const T slope = tape.adjoint(at.node);
    tape.cut(before);
    return {y.value, slope};
}
/// @}

}  // namespace firn::inline FIRN_BUILD
