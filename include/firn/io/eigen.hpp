/// \file Functions that return a field of a state as an Eigen matrix with one column per particle.
#pragma once

#include <firn/core/eigen.hpp>
#include <firn/io/state.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {
/// Returns the number of particles in a field; 0 if the field has no components.
template <state_scalar S>
std::size_t particles_in(const StateField<S>& field) {
    return field.components > 0 ? field.values.size() / std::size_t(field.components) : 0;
}
}  // namespace detail

/// \name A field as an Eigen matrix
/// @{

/// Returns the values of a field as a matrix with one row per component and one column per particle. If `field` is a
/// variable, the matrix is an Eigen::Map of the field's memory; if `field` is a temporary, the matrix is a copy.
///
/// If each particle has a matrix in this field (such as its deformation gradient), one column contains the matrix of
/// one particle, row by row. To get the matrix of particle i as a D × D matrix, call `matrix_of<D>(field, i)`.
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

/// Returns the matrix of one particle from a field that has a matrix for each particle, such as the deformation
/// gradient.
/// \tparam D  number of rows and of columns of the matrix; the field must have D · D components
/// \param i  index of the particle in the state, from 0
/// \throws parameter_error  if the field does not have D · D components, or if there is no particle `i`
template <int D, state_scalar S>
Eigen::Matrix<S, D, D> matrix_of(const StateField<S>& field, std::size_t i) {
    if (field.components != D * D || i >= detail::particles_in(field))
        throw parameter_error(sentence("The field '", field.name, "' has no matrix ", i, " of ", D, " × ", D,
                                       " numbers; it has ", field.components, " components for each of ",
                                       detail::particles_in(field), " particles."));
    return Eigen::Map<const Eigen::Matrix<S, D, D, Eigen::RowMajor>>(field.values.data() + i * D * D);
}

}  // namespace firn::inline FIRN_BUILD
