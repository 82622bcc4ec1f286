/// \file The fields of a state as maps of Eigen's: a column for each particle.
#pragma once

#include <firn/core/eigen.hpp>
#include <firn/io/state.hpp>

namespace firn {

/// A field's numbers: `components` × n. A matrix lies in its column row by row: `matrix_of<D>(field, i)`.
template <state_scalar S>
Eigen::Map<const Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>> as_eigen(const StateField<S>& field) {
    return {field.values.data(), field.components, Eigen::Index(field.values.size() / std::size_t(field.components))};
}
template <state_scalar S>
Eigen::Map<Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>> as_eigen(StateField<S>& field) {
    return {field.values.data(), field.components, Eigen::Index(field.values.size() / std::size_t(field.components))};
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
    if (field.components != D * D || i >= field.values.size() / (D * D))
        throw parameter_error(sentence("Matrix ", i, " of ", D, " × ", D, " numbers is asked of the field '",
                                       field.name, "', which has ", field.components, " components for each of ",
                                       field.values.size() / std::size_t(std::max(field.components, 1)), "."));
    return Eigen::Map<const Eigen::Matrix<S, D, D, Eigen::RowMajor>>(field.values.data() + i * D * D);
}

}  // namespace firn
