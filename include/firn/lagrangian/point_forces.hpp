/// \file Forces on each point alone: drag, and whatever a user thinks of.
#pragma once

#include <firn/lagrangian/drag.hpp>
#include <firn/lagrangian/element_forces.hpp>

#include <utility>

namespace firn {

/// Air against every point, as a ball of its radius.
template <std::floating_point S, int D>
struct DragOnPoints {
    Drag<S, D> law;

    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) const {
        law.check();
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) force[i] += law.force(points.velocity[i], points.radius[i]);
        });
    }
    /// The drag's derivative by the velocity is at most twice the force over the speed.
    void add_stiffness(const PointView<S, D>& points, std::span<double>, std::span<double> damping) const {
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Vec<S, D> v = points.velocity[i] - law.wind;
            const S speed = norm(v);
            if (speed > 0) damping[i] += 2 * double(norm(law.force(points.velocity[i], points.radius[i])) / speed);
        }
    }
};

/// A user's force on every point: of_point(points, i) → force on point i [N], called from several threads.
template <class OfPoint>
struct ForceOnEach {
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

namespace detail {

/// A force of whatever type, kept where it is.
template <class S, int D>
struct AnyForce {
    virtual ~AnyForce() = default;
    virtual void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) = 0;
    virtual void add_stiffness(const PointView<S, D>&, std::span<double> stiffness, std::span<double> damping) = 0;
    virtual void renumber(std::span<const std::uint32_t> new_place) = 0;
    virtual void tear(std::span<const Torn> torn) = 0;
};

template <class F, class S, int D>
struct HeldForce final : AnyForce<S, D> {
    explicit HeldForce(F f) : force(std::move(f)) {}
    F force;

    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> to, int threads) override {
        force.add_forces(points, to, threads);
    }
    void add_stiffness(const PointView<S, D>& points, std::span<double> stiffness, std::span<double> damping) override {
        if constexpr (requires { force.add_stiffness(points, stiffness, damping); })
            force.add_stiffness(points, stiffness, damping);
    }
    void renumber(std::span<const std::uint32_t> new_place) override {
        if constexpr (requires { force.renumber(new_place); }) force.renumber(new_place);
    }
    void tear(std::span<const Torn> torn) override {
        if constexpr (requires { force.tear(torn); }) force.tear(torn);
    }
};

/// The largest stable step [s] of an explicit scheme for points with so much stiffness k and damping c each:
/// k dt²/m + 2 c dt/m ≤ 4 (Jury's criterion for v ← v + a dt, x ← x + v dt).
template <class S, int D>
double largest_step(const PointView<S, D>& points, std::span<const double> stiffness, std::span<const double> damping) {
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double k = stiffness[i] / double(points.mass[i]), c = damping[i] / double(points.mass[i]);
        if (k > 0 || c > 0) smallest = std::min(smallest, 4 / (c + std::sqrt(c * c + 4 * k)));
    }
    return smallest;
}

}  // namespace detail

}  // namespace firn
