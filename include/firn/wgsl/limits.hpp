/// \file The limits of a WebGPU device (sizes of buffers, number of workgroups, …), and functions that check whether a
/// program exceeds these limits.
#pragma once

#include <firn/wgsl/layout.hpp>

#include <cstdint>

namespace firn::inline FIRN_BUILD::wgsl {

/// The limits of a WebGPU device that matter to a program. Every device guarantees at least the default values.
struct Limits {
    /// Largest part of a storage buffer that an entry point can access through one binding [bytes]. WebGPU calls this
    /// limit maxStorageBufferBindingSize.
    std::uint64_t storage_binding_bytes = 128ULL << 20;
    /// Largest size of a buffer [bytes]. WebGPU calls this limit maxBufferSize.
    std::uint64_t buffer_bytes = 256ULL << 20;
    /// Largest number of workgroups along one axis of a dispatch. WebGPU calls this limit
    /// maxComputeWorkgroupsPerDimension.
    std::uint32_t groups_per_dimension = 65535;
    /// Largest number of storage buffers that one entry point can use. WebGPU calls this limit
    /// maxStorageBuffersPerShaderStage.
    int storage_buffers_per_stage = 8;

    /// Returns the largest size of a buffer that an entry point can access as a whole [bytes].
    std::uint64_t largest_buffer() const { return std::min(storage_binding_bytes, buffer_bytes); }
};

/// The size of a dispatch (one launch of an entry point on the device): the number of workgroups along x and along y.
struct Dispatch {
    std::uint32_t x,  ///< number of workgroups along x
        y;            ///< number of workgroups along y; more than 1 only if x is the device's limit
};

/// Returns the size (x, y) of a dispatch that has at least `invocations` invocations. As long as the device's limit
/// along one axis allows it, all workgroups lie along x, and y is 1. For more workgroups, x is this limit, and y is as
/// small as possible.
/// \param invocations     number of invocations that are needed
/// \param workgroup_size  number of invocations per workgroup
/// \throws parameter_error  if y would exceed the device's limit along one axis
inline Dispatch dispatch(std::uint64_t invocations, int workgroup_size, const Limits& limits = {}) {
    const std::uint64_t groups =
        std::max<std::uint64_t>(1, (invocations + std::uint64_t(workgroup_size) - 1) / std::uint64_t(workgroup_size));
    const std::uint64_t x = std::min<std::uint64_t>(groups, limits.groups_per_dimension), y = (groups + x - 1) / x;
    if (y > limits.groups_per_dimension)
        throw parameter_error(sentence("A dispatch of ", groups, " workgroups exceeds the device's ",
                                       limits.groups_per_dimension, " along each of two dimensions."));
    return {std::uint32_t(x), std::uint32_t(y)};
}

/// Returns the number of nodes along one axis of a program's grid, a multiple of 4. The grid stores all nodes of the
/// domain, four ghost nodes (one block) below the domain, and at least three ghost nodes above the domain.
/// \param cells  number of cells of the domain along the axis
inline std::uint32_t grid_nodes(int cells) { return std::uint32_t(block_size) * std::uint32_t(blocks_for(cells) + 2); }

/// Returns the number of nodes that a program stores.
/// \param nodes   number of nodes along each axis of the grid
/// \param blocks  for a sparse grid: number of blocks of nodes for which the buffers have memory
inline std::uint64_t stored_nodes(const Program& program, const std::vector<std::uint32_t>& nodes,
                                  std::uint64_t blocks) {
    const bool sparse = program.options.grid == GridStorage::sparse;
    std::uint64_t all = sparse ? blocks : 1;
    for (const std::uint32_t along : nodes) all *= sparse ? std::uint32_t(block_size) : along;
    return all;
}

namespace detail {
/// Returns the number of words of the buffer "bins".
/// \param particles  capacity of the buffers
/// \param nodes      number of stored nodes
inline std::uint64_t words_of_bins(const Program& program, std::uint64_t particles, std::uint64_t nodes) {
    return particles + (nodes >> 2 * program.dimension) * std::uint64_t(bin_words(program.dimension));
}
}  // namespace detail

/// Returns how many particles a program can have on a device. For more, use several Hosts on one grid.
inline std::uint64_t most_particles(const Program& program, const Limits& limits = {}) {
    const std::uint64_t groups = limits.groups_per_dimension;
    std::uint64_t most = groups * groups * std::uint64_t(program.options.workgroup_size);
    for (const Buffer& b : program.buffers)
        if (b.per == "particle") most = std::min(most, limits.largest_buffer() / (4 * std::uint64_t(b.count)));
    return most;
}

/// Throws if the buffers or the entry points of a program exceed a limit of a device.
/// \param particles  capacity of the buffers: number of particles for which the buffers have memory
/// \param nodes      number of nodes along each axis of the grid
/// \param blocks     for a sparse grid: number of blocks of nodes for which the buffers have memory
/// \throws parameter_error  if a buffer would be too large (the message says how many particles or nodes would fit), or
///                          if an entry point uses too many storage buffers; the message names the limit that is
///                          exceeded
inline void check_fits(const Program& program, std::uint64_t particles, const std::vector<std::uint32_t>& nodes,
                       const Limits& limits = {}, std::uint64_t blocks = 0) {
    const std::uint64_t all_nodes = stored_nodes(program, nodes, blocks);
    const std::uint64_t most = limits.largest_buffer();
    const char* name =
        limits.storage_binding_bytes <= limits.buffer_bytes ? "maxStorageBufferBindingSize" : "maxBufferSize";
    for (const Buffer& b : program.buffers) {
        const std::uint64_t each = 4 * std::uint64_t(b.count);
        if (b.per == "particle" && particles > most / each)
            throw parameter_error(sentence("The buffer '", b.name, "' needs ", each,
                                           " bytes per particle and can have at most ", most, " bytes (", name,
                                           "): ", most / each, " particles fit, ", particles, " were given."));
        if (b.per == "particle_and_bin" && detail::words_of_bins(program, particles, all_nodes) > most / each)
            throw parameter_error(sentence("The buffer '", b.name, "' needs ",
                                           4 * detail::words_of_bins(program, particles, all_nodes), " bytes for ",
                                           particles, " particles and ", all_nodes, " nodes, and can have at most ",
                                           most, " bytes (", name, "). Use larger cells or a smaller domain."));
        if (b.per == "distance" && program.distances.size() > most / each)
            throw parameter_error(sentence("The buffer '", b.name, "' needs ", each * program.distances.size(),
                                           " bytes for the grids of distances, and can have at most ", most, " bytes (",
                                           name, "). Take a wider spacing or a narrower band."));
        if (b.per == "node" && all_nodes > most / each)
            throw parameter_error(sentence("The buffer '", b.name, "' needs ", each,
                                           " bytes per node and can have at most ", most, " bytes (", name,
                                           "): ", most / each, " nodes fit, the grid has ", all_nodes,
                                           ". Use larger cells or a smaller domain."));
    }
    for (const EntryPoint& e : program.entry_points)
        if (int(e.bindings.size()) - 1 > limits.storage_buffers_per_stage)
            throw parameter_error(sentence("The kernel '", e.name, "' needs ", e.bindings.size() - 1,
                                           " storage buffers; the device allows ", limits.storage_buffers_per_stage,
                                           " (maxStorageBuffersPerShaderStage)."));
}

}  // namespace firn::inline FIRN_BUILD::wgsl
