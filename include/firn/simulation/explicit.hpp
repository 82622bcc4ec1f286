/// \file Explicit time integration, the default.
#pragma once

#include <firn/core/config.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {
template <class Simulation, class Kernel, class Transfer, class Force, class Boundary, class Volume, class Law>
struct PassesOf;
/// What a simulation tells of the solution of its last step, where nothing is solved.
struct NothingSolved {};
}  // namespace detail

/// Explicit time integration (symplectic Euler): forces follow from the stresses at the start of a step. The bound of a
/// time step follows from the speed of sound. \see QuasiStatic, Implicit, in firn/implicit.hpp
struct Explicit {
    static constexpr const char* name = "explicit";
    static constexpr bool is_explicit = true;  ///< No step solves equations.

    using Solution = detail::NothingSolved;  ///< What a simulation tells of the solution of its last step.
    /// The passes of a step of a simulation.
    template <class Simulation, class Kernel, class Transfer, class Force, class Boundary, class Volume, class Law>
    using Passes = detail::PassesOf<Simulation, Kernel, Transfer, Force, Boundary, Volume, Law>;
};

}  // namespace firn::inline FIRN_BUILD
