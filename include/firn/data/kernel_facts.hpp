/// \file What a run must know of its kernel outside of the loops over particles and nodes.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/kernel/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// Facts about a kernel, for functions that are compiled once for all kernels. \see kernel/concept.hpp
struct KernelFacts {
    int support;                       ///< Number of nodes along an axis.
    int colours;                       ///< Number of colours of blocks along an axis. \see colours_along_axis
    double base_shift;                 ///< \see base_node
    double courant_limit;              ///< \see time_step_safety
    double (*joined_stretch)(double);  ///< \see firn::joined_stretch
};
/// Returns the facts about a kernel.
template <class Kernel>
constexpr KernelFacts facts_of() {
    return {Kernel::support, colours_along_axis<Kernel>, Kernel::base_shift, Kernel::courant_limit,
            joined_stretch<Kernel>};
}

}  // namespace firn::inline FIRN_BUILD
