/// \file Views a state's fields as Eigen maps, one column per particle.
#pragma once

#include <firn/core/eigen.hpp>
#include <firn/io/state.hpp>

namespace firn {

namespace detail {
/// Number of particles in a field; 0 if it has no components.
template <state_scalar S>
std::size_t particles_in(const StateField<S>& field) {
    return field.components > 0 ? field.values.size() / std::size_t(field.components) : 0;
}
}  // namespace detail

/// \name A field as an Eigen matrix
/// @{

/// Returns a field's numbers as a matrix of `components` rows and one column per particle. A lasting field gives a map
/// of its memory, a temporary gives a copy. A column holds a particle's matrix row by row; `matrix_of<D>(field, i)`
/// returns it as a matrix.
template <state_scalar S>
Eigen::Map<const Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>> as_eigen(const StateField<S>& field) {
    return {field.values.data(), field.components, Eigen::Index(detail::particles_in(field))};
}
template <state_scalar S>
Eigen::Map<Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>> as_eigen(StateField<S>& field) {
    return {field.values.data(), field.components, Eigen::Index(detail::particles_in(field))};
}
template <state_scalar S>
Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic> as_eigen(const StateField<S>&& field) {
    return as_eigen(field);
}
/// @}

/// Returns the matrix of particle `i` (from 0) in a field of D × D components.
/// \throws parameter_error  if the field has another number of components, or if there is no particle `i`
template <int D, state_scalar S>
Eigen::Matrix<S, D, D> matrix_of(const StateField<S>& field, std::size_t i) {
    if (field.components != D * D || i >= detail::particles_in(field))
        throw parameter_error(sentence("The field '", field.name, "' has no matrix ", i, " of ", D, " × ", D,
                                       " numbers; it has ", field.components, " components for each of ",
                                       detail::particles_in(field), " particles."));
    return Eigen::Map<const Eigen::Matrix<S, D, D, Eigen::RowMajor>>(field.values.data() + i * D * D);
}

}  // namespace firn
