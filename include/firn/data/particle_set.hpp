/// \file One of the sets of particles that meet on a grid: each material has its own.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/particle_view.hpp>

namespace firn {

/// The arrays of a set of particles, and the blocks that they are sorted into.
template <class View>
struct ParticleSet {
    View view;
    const BlockPartition<View::dimension>& partition;
};

}  // namespace firn
