/// \file Particles, points, meshes and a program's own arrays as Eigen's matrices, one column each.
///
/// as_… gives a map of existing memory. copy_of_… gives a new matrix, because firn's particles lie in packs of sixteen,
/// which no strides describe. For a vector of points (samples, nets, PointMasses, meshes), use as_eigen(vector).
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/eigen.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/particles.hpp>

#include <vector>

namespace firn {

/// Collects f(slot) of every particle, in the order of slots: one column for each Vec or Mat (column after column), one
/// row for each number. All copy_of_… use the same order until particles are added, removed or sorted;
/// a step may do that.
template <std::floating_point S, int D, class State, class F>
auto copy_of(const Particles<S, D, State>& particles, const F& f) {
    std::vector<decltype(f(std::size_t(0)))> all;
    all.reserve(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) all.push_back(f(slot));
    return as_eigen(std::move(all));
}

/// Positions x [m] as precise as they are stored, one per particle: D × n.
template <std::floating_point S, int D, class State>
Eigen::Matrix<double, D, Eigen::Dynamic> copy_of_positions(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.exact_position(slot); });
}
/// Velocities v [m/s], one per particle: D × n.
template <std::floating_point S, int D, class State>
Eigen::Matrix<S, D, Eigen::Dynamic> copy_of_velocities(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.velocity(slot); });
}
/// Masses m [kg], one per particle: n.
template <std::floating_point S, int D, class State>
Eigen::Matrix<S, Eigen::Dynamic, 1> copy_of_masses(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.mass(slot); });
}
/// Deformation gradients F [1], if particles have them: D² × n, column after column.
/// `.col(i).reshaped(D, D)` is the matrix of a particle.
template <std::floating_point S, int D, class State>
Eigen::Matrix<S, D * D, Eigen::Dynamic> copy_of_deformation_gradients(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.state(slot).F; });
}
/// Kirchhoff stresses τ [Pa], one per particle: D² × n.
template <std::floating_point S, int D, class State>
Eigen::Matrix<S, D * D, Eigen::Dynamic> copy_of_stresses(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.stress(slot); });
}
/// Ids, one per particle: n.
template <std::floating_point S, int D, class State>
Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 1> copy_of_ids(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.id(slot); });
}

/// The columns of a matrix as a vector of points, for Samples, Net and others.
/// \tparam Rows  D; must be given if the matrix does not know its number of rows at compile time
/// \throws parameter_error  if the matrix has not D rows
template <int Rows = Eigen::Dynamic, class E>
auto points_of(const Eigen::MatrixBase<E>& columns) {
    constexpr int D = Rows == Eigen::Dynamic ? int(E::RowsAtCompileTime) : Rows;
    static_assert(D > 0, "firn: the number of rows is not known at compile time. Give it: points_of<3>(matrix).");
    std::vector<Vec<double, D>> points;
    points.reserve(std::size_t(columns.cols()));
    for (Eigen::Index i = 0; i < columns.cols(); ++i) points.emplace_back(columns.col(i));
    return points;
}

/// A mesh from 3 × n vertices [m] and 3 × m indices, one column each.
/// \throws parameter_error  if one of the matrices has not 3 rows
template <class V, class T>
TriangleMesh triangle_mesh(const Eigen::MatrixBase<V>& vertices, const Eigen::MatrixBase<T>& triangles) {
    if (triangles.rows() != 3)
        throw parameter_error(sentence("Triangles are given as ", triangles.rows(), " × ", triangles.cols(),
                                       " indices; give a column of 3 for each."));
    TriangleMesh mesh{.vertices = points_of<3>(vertices), .triangles = {}};
    for (Eigen::Index t = 0; t < triangles.cols(); ++t)
        mesh.triangles.push_back(
            {std::int32_t(triangles(0, t)), std::int32_t(triangles(1, t)), std::int32_t(triangles(2, t))});
    return mesh;
}

namespace detail {
template <class E>
concept eigen_memory =
    eigen_dense<std::remove_cvref_t<E>> && bool(std::remove_cvref_t<E>::Flags & Eigen::DirectAccessBit) &&
    (std::is_lvalue_reference_v<E> || !eigen_owning<std::remove_cvref_t<E>>);
}  // namespace detail

/// A program's own columns as a field of ForeignParticles. Each column is a scalar, a vector, or a matrix column after
/// column. Takes a matrix that has a name, or a map, block or transpose of one.
/// \throws parameter_error  if a column has more than nine numbers
template <detail::eigen_memory E>
auto as_span(E&& columns) {
    using S = std::remove_pointer_t<decltype(columns.data())>;
    StridedSpan<S> span{columns.data(), columns.colStride(), {}};
    if (std::size_t(columns.rows()) > span.offset.size())
        throw parameter_error(sentence("A column of ", columns.rows(), " numbers is given for each particle; at most ",
                                       span.offset.size(), " are taken."));
    for (Eigen::Index k = 0; k < columns.rows(); ++k) span.offset[std::size_t(k)] = k * columns.rowStride();
    return span;
}

}  // namespace firn
