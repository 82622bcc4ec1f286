/// \file What moves points: the concept, and forces of any type side by side.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/lagrangian/point_masses.hpp>

#include <array>
#include <memory>
#include <utility>

namespace firn {

/// What moves a system's points: adds to the force [N] on each, given where they are. It is called outside any parallel
/// region, so that it may open its own; one that says `static constexpr bool opens_no_region = true` is called within
/// that of the step.
template <class F, class S, int D>
concept point_force =
    requires(F f, const PointView<S, D>& points, std::span<Vec<S, D>> force) { f.add_forces(points, force, 1); };

/// Two points that are joined no longer; in any order.
using Torn = std::array<std::uint32_t, 2>;

namespace detail {

/// A force of any type, which stays where it is; a copy has one of its own.
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
    /// Adds to each point's stiffness [N/m] and damping [N s/m], where the force knows them.
    void add_stiffness(const PointView<S, D>& points, std::span<double> stiffness, std::span<double> damping,
                       int threads) {
        held_->add_stiffness(points, stiffness, damping, threads);
    }
    bool may_open_regions() const { return held_->may_open_regions(); }
    /// When points were taken out. \see PointMasses::remove_if
    void renumber(std::span<const std::uint32_t> new_place) { held_->renumber(new_place); }
    void tear(std::span<const Torn> torn) { held_->tear(torn); }

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
    };

    std::unique_ptr<Base> held_;
};

/// The largest stable step [s] of an explicit scheme under these forces, as they are now; infinite without springs.
/// Points with stiffness k and damping c each: k dt²/m + 2 c dt/m ≤ 4 (Jury's criterion for v ← v + a dt,
/// x ← x + v dt).
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

}  // namespace firn
