/// \file What a force on a particle does in a step.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn::inline FIRN_BUILD {

/// Returns the change of a particle's velocity [m/s] by a force over a step.
/// \param force  force on the particle [N];  \param dt  time step [s];  \param mass  mass of the particle [kg]
template <scalar S, int D>
Vec<S, D> pushed_by(const Vec<S, D>& force, const S& dt, const S& mass) {
    return force * (dt / mass);
}

}  // namespace firn::inline FIRN_BUILD
