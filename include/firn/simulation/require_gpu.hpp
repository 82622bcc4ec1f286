/// \file What a simulation must be, so that a GPU can take its steps. \see webgpu::on_gpu
#pragma once

#include <firn/loops/execution.hpp>
#include <firn/wgsl/layout.hpp>

#include <concepts>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace firn::inline FIRN_BUILD::detail {

/// Returns true. If a GPU cannot take the steps of such simulations, the compiler stops with a message.
template <class Simulation>
consteval bool require_gpu() {
    using Execution = decltype(std::declval<Simulation&>().execution);
    static_assert(std::same_as<typename Simulation::scalar_type, float>,
                  "firn: a GPU computes with float: give the simulation a material of float.");
    static_assert(std::same_as<Execution, FixedPoint<std::int32_t, Adding::atomic>> ||
                      std::same_as<Execution, FixedPoint<std::int32_t, Adding::coloured>>,
                  "firn: a GPU adds up integers of 32 bits: give the simulation firn::FixedPoint<std::int32_t>, which "
                  "has the same bits on the CPU.");
    static_assert(Simulation::material_count <= wgsl::detail::most_sets, "firn: at most 8 materials run on a GPU.");
    static_assert(!Simulation::has_contact_groups,
                  "firn: contact between groups of bodies is not yet on a GPU: take the steps on the CPU.");
    return true;
}

}  // namespace firn::inline FIRN_BUILD::detail
