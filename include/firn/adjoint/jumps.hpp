/// \file Which policies make a step jump, which a gradient does not see.
#pragma once

#include <firn/kernel/linear.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/transfer/aflip.hpp>

#include <concepts>

namespace firn::inline FIRN_BUILD::detail {

/// Whether a transfer chooses by the sign of the divergence.
template <class Transfer>
inline constexpr bool chooses_by_divergence = false;
template <class S>
inline constexpr bool chooses_by_divergence<Asflip<S>> = true;

/// Returns at which places a step of these policies jumps; nullptr if it is continuous, as far as these policies go.
template <class Kernel, class Transfer, class Force>
constexpr const char* jump_of_policies() {
    if (std::same_as<Kernel, Linear>) return "with the kernel Linear, wherever a particle comes to another cell";
    if (Force::weight_gradients && std::same_as<Kernel, QuadraticBSpline>)
        return "with WeightGradientForce and the quadratic B-spline, where a particle is the first that reaches a node";
    if (chooses_by_divergence<Transfer>) return "with ASFLIP, where the divergence of the velocity changes its sign";
    return nullptr;
}

}  // namespace firn::inline FIRN_BUILD::detail
