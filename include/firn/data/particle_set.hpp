/// \file One set of particles on a grid. Each material has a set of its own.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/particle_view.hpp>

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

}  // namespace firn::inline FIRN_BUILD
