/// \file The fields of a state as maps of Eigen's: a column for each particle.
#pragma once

#include <firn/core/eigen.hpp>
#include <firn/io/state.hpp>

namespace firn {

namespace detail {
/// Particles in a field; none where it says that each has no components.
template <state_scalar S>
std::size_t particles_in(const StateField<S>& field) {
    return field.components > 0 ? field.values.size() / std::size_t(field.components) : 0;
}
}  // namespace detail

/// A field's numbers: `components` × n. A matrix lies in its column row by row: `matrix_of<D>(field, i)`.
template <state_scalar S>
Eigen::Map<const Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>> as_eigen(const StateField<S>& field) {
    return {field.values.data(), field.components, Eigen::Index(detail::particles_in(field))};
}
template <state_scalar S>
Eigen::Map<Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>> as_eigen(StateField<S>& field) {
    return {field.values.data(), field.components, Eigen::Index(detail::particles_in(field))};
}
/// Of a temporary: a copy.
template <state_scalar S>
Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic> as_eigen(const StateField<S>&& field) {
    return as_eigen(field);
}

/// The matrix of particle i (from 0) in a field of D × D components.
/// \throws parameter_error  if the field has another number of components, or there is no such particle
template <int D, state_scalar S>
Eigen::Matrix<S, D, D> matrix_of(const StateField<S>& field, std::size_t i) {
    if (field.components != D * D || i >= detail::particles_in(field))
        throw parameter_error(sentence("Matrix ", i, " of ", D, " × ", D, " numbers is asked of the field '",
                                       field.name, "', which has ", field.components, " components for each of ",
                                       detail::particles_in(field), "."));
    return Eigen::Map<const Eigen::Matrix<S, D, D, Eigen::RowMajor>>(field.values.data() + i * D * D);
}

}  // namespace firn
