/// \file A set of particles on a grid: each material has its own set.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/particle_view.hpp>

namespace firn {

/// A set of particles, sorted into blocks.
template <class View>
struct ParticleSet {
    View view;                                         ///< the particles' arrays
    const BlockPartition<View::dimension>& partition;  ///< their blocks
};
/// Before version 17, clang deduces nothing for aggregates.
template <class View>
ParticleSet(const View&, const BlockPartition<View::dimension>&) -> ParticleSet<View>;

}  // namespace firn
