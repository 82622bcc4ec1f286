/// \file What a device allows, and how many particles fit.
#pragma once

#include <firn/wgsl/layout.hpp>

#include <cstdint>

namespace firn::wgsl {

/// The limits of WebGPU that a program can meet; by default those that every device has.
struct Limits {
    std::uint64_t storage_binding_bytes = 128ULL << 20;  ///< maxStorageBufferBindingSize
    std::uint64_t buffer_bytes = 256ULL << 20;           ///< maxBufferSize
    std::uint32_t groups_per_dimension = 65535;          ///< maxComputeWorkgroupsPerDimension
    int storage_buffers_per_stage = 8;                   ///< maxStorageBuffersPerShaderStage
};

/// How many a dispatch has along x and y: any number of groups fits.
struct Dispatch {
    std::uint32_t x, y;
};

/// \param invocations  at least that many
/// \throws parameter_error if even two dimensions are not enough
inline Dispatch dispatch(std::uint64_t invocations, int workgroup_size, const Limits& limits = {}) {
    const std::uint64_t groups =
        std::max<std::uint64_t>(1, (invocations + std::uint64_t(workgroup_size) - 1) / std::uint64_t(workgroup_size));
    const std::uint64_t x = std::min<std::uint64_t>(groups, limits.groups_per_dimension), y = (groups + x - 1) / x;
    if (y > limits.groups_per_dimension)
        throw parameter_error(sentence("A dispatch of ", groups, " workgroups exceeds the device's ",
                                       limits.groups_per_dimension, " along each of two dimensions."));
    return {std::uint32_t(x), std::uint32_t(y)};
}

/// Nodes along an axis of the dense grid: the domain's, one block of ghosts below and one or more rows above, in whole
/// blocks.
inline std::uint32_t grid_nodes(int cells) {
    return std::uint32_t(block_size) * std::uint32_t((cells + block_size - 1) / block_size + 2);
}

/// \param nodes  along each axis
/// \throws parameter_error that names the limit, and how many particles or nodes fit
inline void check_fits(const Program& program, std::uint64_t particles, const std::vector<std::uint32_t>& nodes,
                       const Limits& limits = {}) {
    std::uint64_t all_nodes = 1;
    for (const std::uint32_t n : nodes) all_nodes *= n;
    const std::uint64_t most = std::min(limits.storage_binding_bytes, limits.buffer_bytes);
    const char* name =
        limits.storage_binding_bytes <= limits.buffer_bytes ? "maxStorageBufferBindingSize" : "maxBufferSize";
    for (const Buffer& b : program.buffers) {
        const std::uint64_t each = 4 * std::uint64_t(b.count);
        if (b.per == "particle" && particles > most / each)
            throw parameter_error(sentence("The buffer '", b.name, "' takes ", each, " bytes a particle and may have ",
                                           most, " bytes (", name, "): ", most / each, " particles fit, ", particles,
                                           " were given."));
        if (b.per == "node" && all_nodes > most / each)
            throw parameter_error(sentence("The buffer '", b.name, "' takes ", each, " bytes a node and may have ",
                                           most, " bytes (", name, "): ", most / each, " nodes fit, the grid has ",
                                           all_nodes, ". Use larger cells or a smaller domain."));
    }
    for (const EntryPoint& e : program.entry_points)
        if (int(e.bindings.size()) - 1 > limits.storage_buffers_per_stage)
            throw parameter_error(sentence("The kernel '", e.name, "' needs ", e.bindings.size() - 1,
                                           " storage buffers; the device allows ", limits.storage_buffers_per_stage,
                                           " (maxStorageBuffersPerShaderStage)."));
}

}  // namespace firn::wgsl
