/// \file One set of particles on a grid. Each material has a set of its own.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/particle_view.hpp>

#include <array>
#include <span>

namespace firn::inline FIRN_BUILD {

/// A set of particles that are sorted into blocks.
template <class View>
struct ParticleSet {
    View view;                                         ///< the particles' arrays
    const BlockPartition<View::dimension>& partition;  ///< the blocks, and the particles in each block
};
/// Deduction guide for clang before version 17, which deduces no template arguments of an aggregate.
template <class View>
ParticleSet(const View&, const BlockPartition<View::dimension>&) -> ParticleSet<View>;

/// All sets of particles on a grid, without the states of their materials. \see MotionView
template <class View>
using ParticleSets = std::span<const ParticleSet<View>>;

namespace detail {
template <class View>
using motion_view_t = decltype(motion_of(std::declval<const View&>()));

/// Returns a set without the state of its material.
template <class View>
ParticleSet<motion_view_t<View>> motion_of_set(const ParticleSet<View>& set) {
    return {motion_of(set.view), set.partition};
}
/// Calls body(sets), where `sets` are the given sets as ParticleSets.
template <class Body, class View, class... Views>
decltype(auto) with_sets(const Body& body, const ParticleSet<View>& first, const ParticleSet<Views>&... others) {
    using Motion = motion_view_t<View>;
    constexpr bool same = (std::same_as<Motion, motion_view_t<Views>> && ...);
    static_assert(same,
                  "firn: all sets on a grid store their particles in one way: as firn's Particles, or in arrays of "
                  "another program.");
    const std::array<ParticleSet<Motion>, 1 + sizeof...(Views)> sets{motion_of_set(first), motion_of_set(others)...};
    return body(ParticleSets<Motion>(sets));
}
}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
