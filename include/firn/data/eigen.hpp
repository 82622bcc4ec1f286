/// \file Conversions between Eigen's matrices and firn's particles, points and meshes: each particle, point, vertex or
/// triangle is one column.
///
/// Functions named as_… return a map of existing memory and copy nothing. Functions named copy_of_… return a new
/// matrix. They cannot return a map, because firn stores particles in packs of sixteen, a layout that strides cannot
/// describe. For a std::vector of points (such as those of Samples, Net, PointMasses and TriangleMesh), use
/// as_eigen(vector).
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/eigen.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/particles.hpp>

#include <vector>

namespace firn::inline FIRN_BUILD {

/// Returns f(slot) for all particles, in the order of slots. If f returns a Vec or a Mat: a matrix with one column per
/// particle (a Mat is stored column after column). If f returns a number: a vector with one row per particle. All
/// functions copy_of_… use this order of particles. The order changes when particles are added, removed or sorted; a
/// step may sort them.
template <std::floating_point S, int D, class State, class F>
auto copy_of(const Particles<S, D, State>& particles, const F& f) {
    std::vector<decltype(f(std::size_t(0)))> all;
    all.reserve(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) all.push_back(f(slot));
    return as_eigen(std::move(all));
}

/// Returns the positions x [m] in the precision in which they are stored: a D × n matrix with one column per particle,
/// in the order of copy_of().
template <std::floating_point S, int D, class State>
Eigen::Matrix<double, D, Eigen::Dynamic> copy_of_positions(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.exact_position(slot); });
}
/// Returns the velocities v [m/s]: a D × n matrix with one column per particle, in the order of copy_of().
template <std::floating_point S, int D, class State>
Eigen::Matrix<S, D, Eigen::Dynamic> copy_of_velocities(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.velocity(slot); });
}
/// Returns the masses m [kg]: a vector with one row per particle, in the order of copy_of().
template <std::floating_point S, int D, class State>
Eigen::Matrix<S, Eigen::Dynamic, 1> copy_of_masses(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.mass(slot); });
}
/// Returns the deformation gradients F [1]: a D² × n matrix with one column per particle, in the order of copy_of().
/// Each F is stored column after column; `.col(i).reshaped(D, D)` is one F. The material's state must have a member F.
/// In plane strain F is 3 × 3, so there are 9 rows.
template <std::floating_point S, int D, class State>
auto copy_of_deformation_gradients(const Particles<S, D, State>& particles) {
    using F = matrix_of_t<decltype(State::F)>;
    return copy_of(particles, [&](std::size_t slot) { return F(particles.state(slot).F); });
}
/// Returns the Kirchhoff stresses τ [Pa]: a D² × n matrix with one column per particle, in the order of copy_of(). Each
/// τ is stored column after column.
template <std::floating_point S, int D, class State>
Eigen::Matrix<S, D * D, Eigen::Dynamic> copy_of_stresses(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.stress(slot); });
}
/// Returns the particles' ids: a vector with one row per particle, in the order of copy_of().
template <std::floating_point S, int D, class State>
Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 1> copy_of_ids(const Particles<S, D, State>& particles) {
    return copy_of(particles, [&](std::size_t slot) { return particles.id(slot); });
}

/// Returns the columns of a matrix as a vector of points, for example for Samples or Net.
/// \tparam Rows  the dimension D; must be given if the number of the matrix's rows is not known at compile time
/// \throws parameter_error  if the matrix does not have D rows
template <int Rows = Eigen::Dynamic, class E>
auto points_of(const Eigen::MatrixBase<E>& columns) {
    constexpr int D = Rows == Eigen::Dynamic ? int(E::RowsAtCompileTime) : Rows;
    static_assert(D > 0, "firn: the number of rows is not known at compile time. Give it: points_of<3>(matrix).");
    std::vector<Vec<double, D>> points;
    points.reserve(std::size_t(columns.cols()));
    for (Eigen::Index i = 0; i < columns.cols(); ++i) points.emplace_back(columns.col(i));
    return points;
}

/// Makes a mesh from two matrices with three rows each. A column of `vertices` is the position of one vertex [m]. A
/// column of `triangles` has the three vertex indices (counted from 0) of one triangle.
/// \throws parameter_error  if one of the matrices does not have 3 rows
template <class V, class T>
[[nodiscard]] TriangleMesh triangle_mesh(const Eigen::MatrixBase<V>& vertices, const Eigen::MatrixBase<T>& triangles) {
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

/// Returns a span of the columns of a matrix, without a copy. The span can be a field of ForeignParticles. Column i
/// belongs to particle i and has one number, the components of a vector, or the elements of a matrix (column after
/// column).
/// \param columns  a matrix that is no temporary object, or a map, block or transpose of such a matrix; the span is
///                 valid as long as the memory of that matrix
/// \throws parameter_error  if a column has more than nine elements
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

}  // namespace firn::inline FIRN_BUILD
