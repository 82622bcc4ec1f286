/// \file The programs of a simulation's sets of particles.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/webgpu/from_corner.hpp>
#include <firn/webgpu/set_on_device.hpp>
#include <firn/wgsl/program.hpp>

#include <cstddef>
#include <type_traits>
#include <utility>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// Calls f(material, k) for the material of each set, k = 0, 1, …
template <class Simulation, class F>
void for_materials_of(const Simulation& simulation, const F& f) {
    [&]<std::size_t... I>(std::index_sequence<I...>) {
        (f(simulation.template set<I>().material(), I), ...);
    }(std::make_index_sequence<Simulation::material_count>{});
}

/// Returns whether the programs of all sets can have a sparse grid. \see wgsl::can_be_sparse
template <class Simulation>
bool can_be_sparse(const Simulation& simulation) {
    bool can_be = true;
    for_materials_of(simulation, [&](const auto& material, std::size_t) {
        using Material = std::remove_cvref_t<decltype(material)>;
        can_be = can_be && wgsl::can_be_sparse<Material, Simulation::dimension>(simulation.volume);
    });
    return can_be;
}

/// Returns whether a dense grid does not fit into a device, or has more than twice as many blocks as particles need.
/// \param needed  number of blocks that particles need
template <class Simulation>
bool has_many_empty_blocks(const Simulation& simulation, std::size_t needed, const wgsl::Limits& limits) {
    constexpr int D = Simulation::dimension;
    using Transfer = std::remove_cvref_t<decltype(simulation.transfer)>;
    double blocks = 1;
    for (int a = 0; a < D; ++a) blocks *= wgsl::grid_nodes(simulation.domain().cells(a)) / std::uint32_t(block_size);
    const int records =
        wgsl::detail::records_of_node(blends_velocities<Transfer>, wgsl::detail::refinements_of(simulation.transfer),
                                      wgsl::detail::has_mirrored_walls(simulation.boundary));
    const double bytes = blocks * block_nodes<D> * records * node_width * sizeof(std::int32_t);
    return blocks > 2.0 * double(needed) || bytes > double(limits.largest_buffer());
}

/// Returns the options of the program of set k.
template <class Simulation>
wgsl::ProgramOptions options_of_set(const Simulation& simulation, std::size_t k, wgsl::GridStorage grid,
                                    wgsl::Arithmetic arithmetic) {
    const auto& set = simulation.sets()[k];
    bool asks = false;
    for_materials_of(simulation, [&](const auto& material, std::size_t) {
        asks = asks || wgsl::program_asks<std::remove_cvref_t<decltype(material)>, Simulation::dimension>;
    });
    return {.grid = grid,
            .sinks = int(set.sinks.size()),
            .loads = int(list_of_loads(set.loads).size()),
            .several_sets = Simulation::material_count > 1,
            .periodic = is_periodic(simulation.domain()),
            .arithmetic = arithmetic,
            .reactions = simulation.reactions.has_value(),
            .keeps_time = asks};
}

/// Returns the program of a set of particles of a simulation.
/// \param k      number of the set
/// \param field  the acceleration field, as the program has it. \see field_from_corner
template <class Simulation, class Field>
wgsl::Program program_of_set(const Simulation& of, std::size_t k, const Field& field,
                             const wgsl::ProgramOptions& options) {
    constexpr int D = Simulation::dimension;
    using Transfer = std::remove_cvref_t<decltype(of.transfer)>;
    wgsl::Program program;
    for_materials_of(of, [&](const auto& material, std::size_t i) {
        if (i != k) return;
        program = wgsl::make_program<typename Simulation::kernel_type, Transfer, typename Simulation::force_type, D>(
            material, boundary_from_corner(of.boundary, of.domain()), field, of.volume, options, of.transfer);
    });
    return program;
}

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
