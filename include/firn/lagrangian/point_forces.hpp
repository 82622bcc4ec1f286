/// \file Forces on single points: drag of air, and a force that the user defines.
#pragma once

#include <firn/lagrangian/any_force.hpp>
#include <firn/lagrangian/drag.hpp>

namespace firn::inline FIRN_BUILD {

/// The drag of air on every point of a system. Each point is treated as a ball with the radius of the point.
template <std::floating_point S, int D>
struct DragOnPoints {
    static constexpr bool opens_no_region = true;  ///< add_forces() opens no parallel region. \see point_force
    Drag<S, D> law;                                ///< The law of the drag on a ball.

    /// Adds the drag [N] on each point to the array `force`, which has one entry per point.
    /// \throws parameter_error  if Drag::check throws it
    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) const {
        law.check();
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) force[i] += law.force(points.velocity[i], points.radius[i]);
        });
    }
    /// Adds an upper bound for the damping [N s/m] of each point to the array `damping`, which has one entry per point.
    /// The bound is 2 |drag| / |velocity relative to the wind|, the largest derivative of the drag with respect to the
    /// velocity. The stiffness, which is the second parameter, does not change.
    void add_stiffness(const PointView<S, D>& points, std::span<double>, std::span<double> damping, int threads) const {
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                const S speed = norm(points.velocity[i] - law.wind);
                if (speed > 0) damping[i] += 2 * double(norm(law.force(points.velocity[i], points.radius[i])) / speed);
            }
        });
    }
};

/// A force that is defined by a function of the user. The function of_point(points, i) must return the force [N] on the
/// point with index i. Several threads call this function at the same time.
///
/// A function object of_point may also have the members stiffness(points, i) [N/m] and damping(points, i) [N s/m]:
/// upper bounds for the eigenvalues of −∂f/∂x and −∂f/∂v at this point. They bound the time step, see
/// ParticleSystem::stable_time_step. Without them, nothing tells that a step is too large for the force.
/// \tparam OfPoint  callable as of_point(const PointView<S, D>&, std::size_t), returns Vec<S, D>
template <class OfPoint>
struct ForceOnEach {
    static constexpr bool opens_no_region = true;  ///< add_forces() opens no parallel region. \see point_force
    OfPoint of_point;                              ///< The user's function: returns the force on one point [N].

    /// Adds the force [N] on each point to the array `force`, which has one entry per point.
    template <class S, int D>
    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) const {
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) force[i] += of_point(points, i);
        });
    }
    /// Adds the stiffness [N/m] and damping [N s/m] that of_point says to two arrays, which have one entry per point.
    template <class S, int D>
    void add_stiffness(const PointView<S, D>& points, std::span<double> stiffness, std::span<double> damping,
                       int threads) const {
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                if constexpr (requires { of_point.stiffness(points, i); })
                    stiffness[i] += double(of_point.stiffness(points, i));
                if constexpr (requires { of_point.damping(points, i); })
                    damping[i] += double(of_point.damping(points, i));
            }
        });
    }
};
/// Deduces the type OfPoint from a function f, as in ForceOnEach{f}.
template <class OfPoint>
ForceOnEach(OfPoint) -> ForceOnEach<OfPoint>;

}  // namespace firn::inline FIRN_BUILD
