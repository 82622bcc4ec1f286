/// \file What a boundary is: from a node's position [m] and velocity [m/s] to its velocity. A pure function.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>

namespace firn {

template <class B, class S, int D>
concept changes_velocity = requires(const B b, const Vec<S, D> v) {
    { b.velocity(v, v) } -> std::same_as<Vec<S, D>>;  ///< velocity(position, velocity)
};
/// May nodes of the box [lower, upper] be changed? Whole blocks of nodes are skipped by it.
template <class B, int D>
concept says_where = requires(const B b, const Vec<double, D> x) {
    { b.reaches(x, x) } -> std::same_as<bool>;
};

/// B is given with the scalar S.
template <class B, class S, int D>
concept boundary = changes_velocity<B, S, D> && says_where<B, D>;

}  // namespace firn
