/// \file What a simulation must be, so that a GPU can take its steps. \see webgpu::on_gpu
#pragma once

#include <firn/loops/execution.hpp>
#include <firn/stage/grid_update.hpp>
#include <firn/wgsl/layout.hpp>
#include <firn/wgsl/recorded.hpp>

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

/// Returns true if steps on a GPU can have such an acceleration. If they cannot, the compiler stops with a message.
template <class Acceleration, int D>
consteval bool require_gpu_acceleration() {
    using R = wgsl::recorded;
    using Field = with_scalar_t<Acceleration, R>;
    constexpr bool is_vector = is_vector_acceleration<Acceleration, D>;
    constexpr bool has_numbers = is_vector || has_parameters<Acceleration> || std::is_empty_v<Acceleration>;
    static_assert(has_numbers,
                  "firn: a GPU gets the numbers of an acceleration field from its list parameters(), see "
                  "firn/core/parameters.hpp. A function with captures has no such list: write it as a struct.");
    constexpr bool is_recorded = is_vector || takes<Field, Vec<R, D>> || takes<Field, Vec<R, D>, Vec<R, D>, R>;
    static_assert(is_recorded,
                  "firn: for a GPU, an acceleration field is called with a scalar that records its operations: it is "
                  "to take every scalar type, [](const auto& x) { … } or []<class P>(const firn::Vec<P, 2>& x) { … }, "
                  "or the same with (x, v, dt).");
    return has_numbers && is_recorded;
}

}  // namespace firn::inline FIRN_BUILD::detail
