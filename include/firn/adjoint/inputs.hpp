/// \file The parameters of a policy as inputs of a derivative.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/parameters.hpp>
#include <firn/math/traced.hpp>

#include <limits>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Returns the sum of the numbers in all lanes.
template <class P>
double sum_of_lanes(const P& a) {
    if constexpr (std::floating_point<P>) {
        return double(a);
    } else {
        double sum = 0;
        for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) sum += double(lane_value(a, lane));
        return sum;
    }
}

/// Returns the unit in which masses, or volumes, of nodes are traced: the number itself, or 1 where there is no matter.
/// Such numbers range down to the smallest ones, whose inverse squares are infinite.
template <class P>
FIRN_INLINE P own_unit(const P& mass) {
    return select(mass >= P(std::numeric_limits<value_type_t<P>>::min()), mass, P(1));
}

/// Calls f(one) for each policy of which a policy consists; a policy without parts is the only one.
template <class P, class F>
void for_policies(P& policy, const F& f) {
    if constexpr (requires { std::tuple_size<decltype(policy.parts)>::value; })
        std::apply([&](auto&... part) { (for_policies(part, f), ...); }, policy.parts);
    else if constexpr (is_list<P>)
        for (auto& one : policy.all) for_policies(one, f);
    else
        f(policy);
}
/// Calls f(number) for each number among the parameters of a policy, and for the frictions of walls. Numbers that are
/// not of the type S are left out; void: all floating-point numbers are told.
template <class S, class P, class F>
void for_numbers(P& policy, const F& f) {
    const auto tell = [&]<class Number>(Number& number) {
        using Plain = std::remove_const_t<Number>;
        if constexpr (std::same_as<Plain, S> || (std::is_void_v<S> && std::floating_point<Plain>)) f(number);
    };
    for_policies(policy, [&]<class One>(One& one) {
        for_parameters(one, [&](const std::string&, const char*, auto& value) {
            if constexpr (is_vector<std::remove_cvref_t<decltype(value)>>)
                for (auto& number : value.v) tell(number);
            else
                tell(value);
        });
        if constexpr (requires { One::for_frictions(one, tell); }) One::for_frictions(one, tell);
    });
}
/// Calls f(number) for each number among the parameters of a policy, of any precision, in the order of for_numbers() of
/// the policy that was lifted to another scalar.
template <class P, class F>
void for_reals(P& policy, const F& f) {
    for_numbers<void>(policy, f);
}
/// Returns the numbers of a policy. \see for_reals
template <class P>
std::vector<double> numbers_of(const P& policy) {
    std::vector<double> all;
    for_reals(policy, [&](const auto& number) { all.push_back(double(number)); });
    return all;
}
/// Returns the names of a policy's numbers, in the order of for_reals(), as far as they are among the parameters. Those
/// of a vector's components are "name[0]", "name[1]", …
template <class P>
std::vector<std::string> names_of(const P& policy) {
    std::vector<std::string> all;
    for_parameters(policy, [&]<class Value>(const std::string& name, const char*, const Value& value) {
        if constexpr (is_vector<Value>)
            for (std::size_t a = 0; a < std::size(value.v); ++a) all.push_back(sentence(name, "[", a, "]"));
        else if constexpr (std::floating_point<Value>)
            all.push_back(name);
    });
    return all;
}
/// Adds t times the numbers of `direction`, a policy of the same kind with doubles, to those of a policy.
template <class P, class Direction>
void shift_numbers(P& policy, const Direction& direction, double t) {
    const std::vector<double> by = numbers_of(direction);
    std::size_t next = 0;
    for_reals(policy,
              [&](auto& number) { number = std::remove_cvref_t<decltype(number)>(double(number) + t * by[next++]); });
}

/// The parameters of a policy as inputs on the tape of this thread.
template <class T, class Lifted>
class TracedPolicy {
public:
    /// Makes a node for each parameter.
    explicit TracedPolicy(const Lifted& lifted) : policy_(lifted) {
        Tape<T>& tape = Tape<T>::mine();
        first_ = tape.size();
        for_numbers<traced<T>>(policy_, [&](traced<T>& number) { number = traced<T>::input(number.value); });
        count_ = tape.size() - first_;
    }
    const Lifted& operator*() const { return policy_; }  ///< Returns the policy.
    std::size_t count() const { return count_; }         ///< Returns the number of parameters.
    /// Adds the derivatives with respect to the parameters to `sums`.
    void add_to(std::span<double> sums) const {
        const Tape<T>& tape = Tape<T>::mine();
        for (std::size_t k = 0; k < count_; ++k) sums[k] += sum_of_lanes(tape.adjoint(std::uint32_t(first_ + k)));
    }

private:
    Lifted policy_;
    std::size_t first_, count_;
};

/// Returns the number of inputs among the parameters of a policy that was lifted to traced numbers.
template <class T, class Lifted>
std::size_t count_of_inputs(const Lifted& lifted) {
    std::size_t count = 0;
    Lifted copy = lifted;
    for_numbers<traced<T>>(copy, [&](const traced<T>&) { ++count; });
    return count;
}

/// Sums of derivatives that have the same bits for any number of threads: one for each piece of work, added in order.
class OrderedSums {
public:
    /// \param pieces  number of pieces of work;  \param numbers  number of sums
    OrderedSums(std::size_t pieces, std::size_t numbers) : numbers_(numbers), of_pieces_(pieces * numbers) {}
    /// Returns the sums of one piece.
    std::span<double> of(std::size_t piece) { return std::span(of_pieces_).subspan(piece * numbers_, numbers_); }
    /// Adds the sums of all pieces to `total`.
    void add_to(std::span<double> total) const {
        for (std::size_t i = 0; i < of_pieces_.size(); ++i) total[i % numbers_] += of_pieces_[i];
    }
    /// Adds the sums of all pieces: the first `count` numbers to `first`, the others to `others`. An empty list is one
    /// of zeros.
    void add_to(std::vector<double>& first, std::size_t count, std::vector<double>& others) const {
        std::vector<double> total(numbers_);
        add_to(total);
        first.resize(count), others.resize(numbers_ - count);
        for (std::size_t i = 0; i < numbers_; ++i) (i < count ? first[i] : others[i - count]) += total[i];
    }

private:
    std::size_t numbers_;
    std::vector<double> of_pieces_;
};

/// Returns vectors, or other values, as inputs of a derivative.
/// @{
template <class P, int D>
FIRN_INLINE Vec<traced<P>, D> inputs(const Vec<P, D>& a) {
    Vec<traced<P>, D> r;
    unroll<D>([&](auto k) FIRN_LAMBDA { r.v[k] = traced<P>::input(a.v[k]); });
    return r;
}
template <class P, int D>
FIRN_INLINE Mat<traced<P>, D> inputs(const Mat<P, D>& a) {
    Mat<traced<P>, D> r;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = traced<P>::input(a.m[k]); });
    return r;
}
/// @}
/// Returns the adjoints of inputs or results; 0 for constants.
/// @{
template <class P>
FIRN_INLINE P adjoint_of(const traced<P>& a) {
    return a.node == Tape<P>::no_node ? P(0) : Tape<P>::mine().adjoint(a.node);
}
template <class P, int D>
FIRN_INLINE Vec<P, D> adjoint_of(const Vec<traced<P>, D>& a) {
    Vec<P, D> r;
    unroll<D>([&](auto k) FIRN_LAMBDA { r.v[k] = adjoint_of(a.v[k]); });
    return r;
}
template <class P, int D>
FIRN_INLINE Mat<P, D> adjoint_of(const Mat<traced<P>, D>& a) {
    Mat<P, D> r;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = adjoint_of(a.m[k]); });
    return r;
}
/// @}
/// Sets the adjoint of a result.
/// @{
template <class P>
FIRN_INLINE void seed(const traced<P>& result, const P& adjoint) {
    if (result.node != Tape<P>::no_node) Tape<P>::mine().seed(result.node, adjoint);
}
template <class P, int D>
FIRN_INLINE void seed(const Vec<traced<P>, D>& result, const Vec<P, D>& adjoint) {
    unroll<D>([&](auto k) FIRN_LAMBDA { seed(result.v[k], adjoint.v[k]); });
}
template <class P, int D>
FIRN_INLINE void seed(const Mat<traced<P>, D>& result, const Mat<P, D>& adjoint) {
    unroll<D * D>([&](auto k) FIRN_LAMBDA { seed(result.m[k], adjoint.m[k]); });
}
/// @}

}  // namespace firn::inline FIRN_BUILD::detail
