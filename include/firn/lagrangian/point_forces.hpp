/// \file Forces on single points: drag and a user's own force.
#pragma once

#include <firn/lagrangian/any_force.hpp>
#include <firn/lagrangian/drag.hpp>

namespace firn {

/// The drag of air on every point, as on a ball of the point's radius.
template <std::floating_point S, int D>
struct DragOnPoints {
    static constexpr bool opens_no_region = true;  ///< \see point_force
    Drag<S, D> law;                                ///< The drag on one ball.

    /// Adds the drag [N] on each point to `force`, which has one entry per point.
    /// \throws parameter_error  as Drag::check
    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) const {
        law.check();
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) force[i] += law.force(points.velocity[i], points.radius[i]);
        });
    }
    /// Adds a bound of the damping [N s/m] at each point: the derivative of the drag by the velocity is at most twice
    /// the force divided by the speed.
    void add_stiffness(const PointView<S, D>& points, std::span<double>, std::span<double> damping, int threads) const {
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                const S speed = norm(points.velocity[i] - law.wind);
                if (speed > 0) damping[i] += 2 * double(norm(law.force(points.velocity[i], points.radius[i])) / speed);
            }
        });
    }
};

/// A user's force on every point. of_point(points, i) returns the force on point i [N]; several threads call it.
/// \tparam OfPoint  callable as of_point(const PointView<S, D>&, std::size_t), returns Vec<S, D>
template <class OfPoint>
struct ForceOnEach {
    static constexpr bool opens_no_region = true;  ///< \see point_force
    OfPoint of_point;                              ///< Returns the force on one point [N].

    /// Adds the force [N] on each point to `force`, which has one entry per point.
    template <class S, int D>
    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) const {
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) force[i] += of_point(points, i);
        });
    }
};
/// Deduces the type from a function.
template <class OfPoint>
ForceOnEach(OfPoint) -> ForceOnEach<OfPoint>;

}  // namespace firn
