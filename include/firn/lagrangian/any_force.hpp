/// \file The concept of a force on points, and a class that stores a force of any type.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/lagrangian/point_masses.hpp>
#include <firn/lagrangian/tearing.hpp>

#include <array>
#include <memory>
#include <utility>

namespace firn::inline FIRN_BUILD {

/// A type of forces on the points of a system. The member function add_forces(points, force, threads) adds the force
/// [N] on each point to the array `force`, which has one entry per point.
///
/// By default, the system calls add_forces outside of any parallel region, so add_forces may open a parallel region
/// itself. A type whose add_forces never opens one should declare `static constexpr bool opens_no_region = true`; the
/// system may then call add_forces inside its own parallel region, which is faster.
///
/// More member functions are optional: `add_stiffness(points, stiffness, damping, threads)` adds the stiffness and
/// damping at each point to two arrays, from which the largest stable time step is computed (without it, the force does
/// not bound the step); `renumber(new_place)` is called after points are removed, and `tear(torn)` after links tear;
/// `digest()` returns a std::uint64_t by which a restart tells whether the force was made in the same way.
/// ElementForces has all of them.
template <class F, class S, int D>
concept point_force =
    requires(F f, const PointView<S, D>& points, std::span<Vec<S, D>> force) { f.add_forces(points, force, 1); };

namespace detail {

/// Stores a force of any type. The stored force keeps its address if the AnyForce is moved. A copy of an AnyForce has a
/// copy of the force.
template <class S, int D>
class AnyForce {
public:
    template <point_force<S, D> Force>
    explicit AnyForce(Force force) : held_(std::make_unique<Held<Force>>(std::move(force))) {}
    AnyForce(const AnyForce& other) : held_(other.held_->copy()) {}
    AnyForce(AnyForce&&) noexcept = default;
    AnyForce& operator=(AnyForce other) noexcept {
        held_ = std::move(other.held_);
        return *this;
    }

    template <class Force>
    Force& as() {
        return static_cast<Held<Force>&>(*held_).force;
    }
    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) {
        held_->add_forces(points, force, threads);
    }
    /// Adds the force's stiffness [N/m] and damping [N s/m] at each point to `stiffness` and `damping`, which have one
    /// entry per point. A force without add_stiffness() adds nothing.
    void add_stiffness(const PointView<S, D>& points, std::span<double> stiffness, std::span<double> damping,
                       int threads) {
        held_->add_stiffness(points, stiffness, damping, threads);
    }
    bool may_open_regions() const { return held_->may_open_regions(); }
    /// Updates the point indices in the force. Call renumber() after points are removed, with the list that
    /// PointMasses::remove_if returned: the new index for each old one.
    void renumber(std::span<const std::uint32_t> new_place) { held_->renumber(new_place); }
    void tear(std::span<const Torn> torn) { held_->tear(torn); }
    /// Returns whether some element may tear by itself. Only springs do.
    bool may_tear() const { return held_->may_tear(); }
    /// Returns whether some element is longer than its tear factor allows.
    bool is_overlong(const PointView<S, D>& points, int threads) const { return held_->is_overlong(points, threads); }
    /// Adds the elements to a list if they are springs.
    void list_links(std::vector<TearingLink<S>>& links) const { held_->list_links(links); }
    /// Returns the force's digest(), or 0 if the force has none.
    std::uint64_t digest() const { return held_->digest(); }

private:
    struct Base {
        virtual ~Base() = default;
        virtual std::unique_ptr<Base> copy() const = 0;
        virtual void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) = 0;
        virtual void add_stiffness(const PointView<S, D>& points, std::span<double> stiffness,
                                   std::span<double> damping, int threads) = 0;
        virtual bool may_open_regions() const = 0;
        virtual void renumber(std::span<const std::uint32_t> new_place) = 0;
        virtual void tear(std::span<const Torn> torn) = 0;
        virtual bool may_tear() const = 0;
        virtual bool is_overlong(const PointView<S, D>& points, int threads) const = 0;
        virtual void list_links(std::vector<TearingLink<S>>& links) const = 0;
        virtual std::uint64_t digest() const = 0;
    };
    template <class Force>
    struct Held final : Base {
        explicit Held(Force f) : force(std::move(f)) {}
        Force force;

        std::unique_ptr<Base> copy() const override { return std::make_unique<Held>(force); }
        void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> to, int threads) override {
            force.add_forces(points, to, threads);
        }
        void add_stiffness(const PointView<S, D>& points, std::span<double> stiffness, std::span<double> damping,
                           int threads) override {
            if constexpr (requires { force.add_stiffness(points, stiffness, damping, threads); })
                force.add_stiffness(points, stiffness, damping, threads);
        }
        bool may_open_regions() const override {
            if constexpr (requires { Force::opens_no_region; }) return !Force::opens_no_region;
            return true;
        }
        void renumber(std::span<const std::uint32_t> new_place) override {
            if constexpr (requires { force.renumber(new_place); }) force.renumber(new_place);
        }
        void tear(std::span<const Torn> torn) override {
            if constexpr (requires { force.tear(torn); }) force.tear(torn);
        }
        bool may_tear() const override {
            if constexpr (requires { force.may_tear(); }) return force.may_tear();
            return false;
        }
        bool is_overlong(const PointView<S, D>& points, int threads) const override {
            if constexpr (requires { force.is_overlong(points, threads); }) return force.is_overlong(points, threads);
            return false;
        }
        void list_links(std::vector<TearingLink<S>>& links) const override {
            if constexpr (requires { force.list_links(links); }) force.list_links(links);
        }
        std::uint64_t digest() const override {
            if constexpr (requires { std::uint64_t(force.digest()); }) return force.digest();
            return 0;
        }
    };

    std::unique_ptr<Base> held_;
};

/// Returns the largest time step [s] for which an explicit integrator is stable, with the stiffness and damping that
/// the forces have at the points' present positions and velocities; infinite if they have none. For a point of
/// stiffness k, damping c and mass m, a stable time step dt satisfies k dt²/m + 2 c dt/m ≤ 4 (Jury's criterion, for
/// steps v ← v + a dt, x ← x + v dt).
template <class S, int D>
double largest_step(std::span<AnyForce<S, D>> forces, const PointView<S, D>& points, int threads) {
    aligned_vector<double> stiffness, damping;
    for (auto* numbers : {&stiffness, &damping}) {
        renew(*numbers, points.size(), thread_count(threads));
        fill_chunks(*numbers, 0.0, threads);
    }
    for (AnyForce<S, D>& force : forces) force.add_stiffness(points, stiffness, damping, threads);
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double k = stiffness[i] / double(points.mass[i]), c = damping[i] / double(points.mass[i]);
        if (k > 0 || c > 0) smallest = std::min(smallest, 4 / (c + std::sqrt(c * c + 4 * k)));
    }
    return smallest;
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
