/// \file Forces on each point alone: drag, and whatever a user thinks of.
#pragma once

#include <firn/lagrangian/any_force.hpp>
#include <firn/lagrangian/drag.hpp>

namespace firn {

/// Air against every point, as a ball of its radius.
template <std::floating_point S, int D>
struct DragOnPoints {
    static constexpr bool opens_no_region = true;
    Drag<S, D> law;

    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) const {
        law.check();
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) force[i] += law.force(points.velocity[i], points.radius[i]);
        });
    }
    /// The drag's derivative by the velocity is at most twice the force over the speed.
    void add_stiffness(const PointView<S, D>& points, std::span<double>, std::span<double> damping, int threads) const {
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                const S speed = norm(points.velocity[i] - law.wind);
                if (speed > 0) damping[i] += 2 * double(norm(law.force(points.velocity[i], points.radius[i])) / speed);
            }
        });
    }
};

/// A user's force on every point: of_point(points, i) → force on point i [N], called from several threads.
template <class OfPoint>
struct ForceOnEach {
    static constexpr bool opens_no_region = true;
    OfPoint of_point;

    template <class S, int D>
    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) const {
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) force[i] += of_point(points, i);
        });
    }
};
template <class OfPoint>
ForceOnEach(OfPoint) -> ForceOnEach<OfPoint>;

}  // namespace firn
