/// \file Particles, meshes and arrays of particles in Eigen's matrices: one column a particle.
///
/// as_… gives a map of memory that is somebody's, copy_of_… a matrix of its own: firn's particles lie in blocks of
/// sixteen, which no strides describe.
#pragma once

#include <firn/core/eigen.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/samples.hpp>

#include <vector>

namespace firn {

/// A copy of what f(slot) gives for every particle (a number, a Vec or a Mat), in the order of slots: the same for all
/// of these functions until particles are added, taken out or sorted. A column each, of a number one row.
template <std::floating_point S, int D, class State, class F>
auto copy_of(const Particles<S, D, State>& particles, const F& f) {
    using T = decltype(f(std::size_t(0)));
    using Own = std::conditional_t<std::integral<T>, double, T>;
    std::vector<T> all;
    all.reserve(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) all.push_back(f(slot));
    static_cast<void>(sizeof(Own));
    if constexpr (std::integral<T>)
        return Eigen::Matrix<T, Eigen::Dynamic, 1>(Eigen::Map<Eigen::Matrix<T, Eigen::Dynamic, 1>>(
            all.data(), Eigen::Index(all.size())));
    else
        return as_eigen(std::move(all));
}

}  // namespace firn
