/// \file How distance constraints move the ends of their links: SHAKE with the compliance of XPBD, in SIMD lanes.
///
/// Let r = x_b − x_a be the vector between the ends a and b, l = |r| their distance and l₀ the length at rest. Under
/// the impulse λ [kg m], negative under tension, the distance in equilibrium is l₀ − α̃ λ, where α̃ = α/dt², α is the
/// compliance and dt the time step. A correction brings the ends nearer to it:
///
///     x_a −= w_a Δλ d,  x_b += w_b Δλ d,  Δλ = (l₀ − l − α̃ λ) / (w d·r/l + α̃),  w = w_a + w_b
///
/// Here w_a and w_b are inverse masses, λ is the sum of all Δλ earlier in the same step, and d is a unit vector.
///
/// d is the direction e₀ of the link at the beginning of the step (SHAKE: Ryckaert, Ciccotti, Berendsen 1977). The
/// impulse is then that of a force between the points where they are when the step begins. So angular momentum is
/// conserved, and the motion is of second order. Position-based dynamics (Macklin, Müller, Chentanez 2016, eq. 18)
/// takes the present direction r/l instead, which slows rotation.
///
/// A force along e₀ does not follow its points across the link. For a link under the tension T = −λ/dt², motion across
/// it is integrated explicitly with the stiffness T/l₀, which is stable for k = n w dt² T/l₀ < 4, where n is the larger
/// number of links at one of the two points. So d turns towards r/l where k is above 2: d is the direction of
/// (1 − β) e₀ + β r/l with β = 1 − 2/k. This is stable for any step, and damps motion across the link. If the link has
/// turned by more than 60° in the step, β is 1.
#pragma once

#include <firn/core/pack.hpp>
#include <firn/core/tensor.hpp>
#include <firn/data/aligned.hpp>
#include <firn/lagrangian/constraint_errors.hpp>
#include <firn/simd/transpose.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A constraint on the distance of two points.
template <std::floating_point S>
struct DistanceConstraint {
    std::array<std::uint32_t, 2> ends{};  ///< The indices of the two points.
    S rest = 1;                           ///< l₀, length at rest [m].
};

namespace detail {

/// Corrects links. begin() takes the points of a step, correct() moves them, and end() gives them back.
template <std::floating_point S, int D>
class LinkSolver {
public:
    using Place = Vec<double, D>;  ///< A position [m].
    using V = Vec<S, D>;           ///< A vector in space.
    using Link = DistanceConstraint<S>;
    using P = native_pack<S>;
    static constexpr std::size_t lanes = std::size_t(scalar_traits<P>::lanes);

    /// Adds a link.
    void add(S rest, S compliance, S relaxation) {
        rest_.push_back(rest);
        compliance_.push_back(compliance);
        relaxation_.push_back(relaxation);
        links_.push_back(1);
        is_soft_ = is_soft_ || compliance > 0 || relaxation < 1;
    }
    std::size_t size() const { return rest_.size(); }
    /// Gives the numbers of link `from` to link `to`.
    void move(std::size_t from, std::size_t to) {
        for_numbers([&](auto& numbers) { numbers[to] = numbers[from]; });
    }
    /// Removes all links but the first `count`.
    void shrink(std::size_t count) {
        for_numbers([&](auto& numbers) { numbers.resize(count); });
    }
    /// Sorts the links: the new link k is the former link order[k].
    void permute(std::span<const std::uint32_t> order) {
        for_numbers([&](auto& numbers) {
            const auto before = numbers;
            for (std::size_t k = 0; k < order.size(); ++k) numbers[k] = before[order[k]];
        });
    }
    /// Counts the links at the points. Call count() after links are added, removed or sorted.
    void count(std::span<const Link> all, std::size_t points) {
        std::vector<std::uint32_t> at(points, 0);
        for (const Link& each : all)
            for (const std::uint32_t end : each.ends) ++at[end];
        S most = 1;
        for (std::size_t k = 0; k < size(); ++k) {
            const auto [a, b] = all[k].ends;
            links_[k] = S(std::max(at[a], at[b]));
            most = std::max(most, links_[k]);
        }
        calm_ = S(2) / most;
    }
    /// Returns n: the larger number of links at one of the ends of link k.
    S links(std::size_t k) const { return links_[k]; }

    /// Begins a step.
    /// \param all           the links, which must exist until end() is called
    /// \param start         position of each point at the beginning of the step [m]
    /// \param moved         displacement of each point in the step [m]
    /// \param inverse_mass  inverse mass of each point [1/kg]
    /// \param dt            time step [s]
    void begin(std::span<const Link> all, std::span<const Place> start, std::span<const V> moved,
               std::span<const S> inverse_mass, double dt, int threads) {
        per_dt2_ = S(1 / (dt * dt));
        all_ = all.data();
        renew(points_, 4 * start.size(), threads);
        for (auto& axis : along_) renew(axis, size() + lanes, threads);
        for (auto* numbers : {&unit_, &multiplier_}) renew(*numbers, size() + lanes, threads);
        for_chunks(start.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                S* const quad = points_.data() + 4 * i;
                quad[3] = 0;
                unroll<D>([&](auto a) FIRN_LAMBDA { quad[a] = moved[i].v[a]; });
                quad[D] = inverse_mass[i];
            }
        });
        for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t k = first; k < last; ++k) {
                const auto [a, b] = all_[k].ends;
                const V s = cast<S>(start[b] - start[a]);
                unroll<D>([&](auto axis) FIRN_LAMBDA { along_[axis][k] = s.v[axis]; });
                multiplier_[k] = 0;
                if (!is_soft_) continue;
                const S length = norm(s);
                unit_[k] = length > S(detail::least_size) ? length : rest_[k];
            }
        });
    }
    /// Ends a step: writes the displacements of the points.
    void end(std::span<V> moved, int threads) const {
        for_chunks(moved.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                unroll<D>([&](auto a) FIRN_LAMBDA { moved[i].v[a] = points_[4 * i + a]; });
        });
    }

    /// Corrects links one after another.
    void correct(std::size_t first, std::size_t last) {
        with_softness([&](auto soft) FIRN_LAMBDA {
            for (std::size_t k = first; k < last; ++k) correct_one<soft>(k);
        });
    }
    /// Corrects links that have no point in common.
    void correct_apart(std::size_t first, std::size_t last) {
        with_softness([&](auto soft) FIRN_LAMBDA {
            std::size_t k = first;
            for (; k + lanes <= last; k += lanes) correct_lanes<soft>(k);
            for (; k < last; ++k) correct_one<soft>(k);
        });
    }
    /// Changes the displacement of a point.
    void move_point(std::size_t point, const V& by) {
        unroll<D>([&](auto a) FIRN_LAMBDA { points_[4 * point + a] += by.v[a]; });
    }
    /// Returns the impulse on end b of link k that a fraction of its correction would give [kg m], and adds this
    /// fraction to what has been applied. The points do not move.
    V impulse_of(std::size_t k, S share) {
        return with_softness([&](auto soft) FIRN_LAMBDA { return impulse_of_one<soft>(k, share); });
    }

    /// Returns the errors of links after their corrections.
    /// \param all  the links that begin() got
    ConstraintErrors errors_of(std::span<const Link> all, std::size_t first, std::size_t last) const {
        ConstraintErrors sum;
        for (std::size_t k = first; k < last; ++k) {
            const auto [a, b] = all[k].ends;
            const S *const qa = points_.data() + 4 * std::size_t(a), *const qb = points_.data() + 4 * std::size_t(b);
            if (!(qa[D] + qb[D] > 0)) continue;
            V r;
            unroll<D>([&](auto axis) FIRN_LAMBDA { r.v[axis] = along_[axis][k] + (qb[axis] - qa[axis]); });
            const double rest = double(rest_[k]), longer = double(norm(r)) - rest;
            double error = longer;
            if (compliance_[k] > 0) {
                const double stretch = -double(compliance_[k] * per_dt2_ * unit_[k] * multiplier_[k]);
                error = longer - stretch;
                ++sum.compliant_count;
                sum.compliant_squares += error * error;
                sum.stretch_squares += stretch * stretch;
                sum.length_squares += rest * rest;
            } else {
                ++sum.rigid_count;
                sum.rigid_squares += longer * longer / (rest * rest);
            }
            if (!(std::abs(error) > sum.worst * rest)) continue;
            sum.worst = std::abs(error) / rest;
            sum.ends = {a, b};
        }
        return sum;
    }

private:
    template <class T>
    struct Ask {
        T weights;     // w [1/kg]
        T rest;        // l₀ [m]
        T unit;        // |s| [m]; without softness, any length near it
        T yield;       // α̃ times `unit` [m/kg]
        T part;        // fraction of the correction that is applied [1]
        Vec<T, D> s;   // from a to b at the beginning of the step
        T multiplier;  // λ / `unit` [kg]
    };
    template <class T>
    struct Correction {
        Vec<T, D> impulse;  // Δλ d [kg m]
        T multiplier;       // λ / `unit` after the correction [kg]
    };

    template <class F>
    void for_numbers(const F& f) {
        f(rest_), f(compliance_), f(relaxation_), f(links_);
    }
    template <class F>
    FIRN_INLINE decltype(auto) with_softness(const F& f) {
        if (is_soft_) return f(std::true_type{});
        return f(std::false_type{});
    }

    template <class T>
    FIRN_INLINE static T at(const auto& numbers, std::size_t k) {
        if constexpr (std::same_as<T, S>)
            return numbers[k];
        else
            return T::load(numbers.data() + k);
    }
    template <bool Soft, class T>
    FIRN_INLINE Ask<T> ask(std::size_t k, const T& weights, S share) const {
        Ask<T> r{weights, at<T>(rest_, k), {}, T(0), T(share), {}, at<T>(multiplier_, k)};
        unroll<D>([&](auto axis) FIRN_LAMBDA { r.s.v[axis] = at<T>(along_[axis], k); });
        r.unit = r.rest;
        if constexpr (Soft) {
            r.unit = at<T>(unit_, k);
            r.yield = at<T>(compliance_, k) * T(per_dt2_) * r.unit;
            r.part = r.part * at<T>(relaxation_, k);
        }
        return r;
    }
    /// Returns the correction along e₀, and whether it may be along e₀.
    template <bool Soft, class T>
    FIRN_INLINE auto straight(const Ask<T>& link, const Vec<T, D>& r) const {
        const T length = sqrt(dot(r, r)), ahead = dot(r, link.s);
        T missing = link.rest - length, divisor = link.weights * ahead;
        if constexpr (Soft) {
            missing = missing - link.yield * link.multiplier;
            divisor = divisor + link.yield * length;
        }
        const T change = missing * length / divisor * link.part, multiplier = link.multiplier + change;
        // If both ends are pinned, the multiplier is not a number, and the correction is not straight.
        const auto is_ahead = link.unit * max(T(S(0.5)) * length, T(S(detail::least_size))) < ahead,
                   is_calm = pull(link, multiplier) <= link.rest * T(calm_);
        return std::pair(Correction<T>{link.s * change, multiplier}, is_ahead & is_calm);
    }
    /// Returns l₀ k/n [m].
    template <class T>
    FIRN_INLINE static T pull(const Ask<T>& link, const T& multiplier) {
        return -multiplier * link.weights * link.unit;
    }
    /// Returns the correction along any d.
    [[gnu::noinline]] static Correction<S> turned(const Ask<S>& link, const V& r, S k) {
        if (!(link.weights > 0)) return {V::zero(), link.multiplier};
        const auto has_direction = [](S l) { return l > S(detail::least_size); };
        const S length = norm(r), before = norm(link.s);
        V now = V::zero();
        if (has_direction(length))
            now = r * (1 / length);
        else
            now[1] = 1;
        const V then = has_direction(before) ? link.s * (1 / before) : now;
        const S beta = dot(then, now) < S(0.5) ? S(1) : k > 2 ? 1 - 2 / k : S(0);
        V d = then * (1 - beta) + now * beta;
        d = d * (1 / norm(d));
        const S missing = link.rest - length - link.yield * link.multiplier;
        const S lambda = missing / (link.weights * dot(d, now) + link.yield / link.unit) * link.part;
        return {d * lambda, link.multiplier + lambda / link.unit};
    }

    template <bool Soft>
    FIRN_INLINE V impulse_of_one(std::size_t k, S share) {
        const auto [a, b] = all_[k].ends;
        const S *const qa = points_.data() + 4 * std::size_t(a), *const qb = points_.data() + 4 * std::size_t(b);
        const Ask<S> link = ask<Soft, S>(k, qa[D] + qb[D], share);
        V r;
        unroll<D>([&](auto axis) FIRN_LAMBDA { r.v[axis] = link.s.v[axis] + (qb[axis] - qa[axis]); });
        auto [by, is_straight] = straight<Soft>(link, r);
        if (!is_straight) [[unlikely]]
            by = turned(link, r, pull(link, by.multiplier) / link.rest * links_[k]);
        multiplier_[k] = by.multiplier;
        return by.impulse;
    }
    template <bool Soft>
    FIRN_INLINE void correct_one(std::size_t k) {
        const V impulse = impulse_of_one<Soft>(k, 1);
        const auto [a, b] = all_[k].ends;
        S *const qa = points_.data() + 4 * std::size_t(a), *const qb = points_.data() + 4 * std::size_t(b);
        const S wa = qa[D], wb = qb[D];
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            qa[axis] -= impulse.v[axis] * wa;
            qb[axis] += impulse.v[axis] * wb;
        });
    }

    /// Corrects `lanes` links, the first of which is k.
    template <bool Soft>
    FIRN_INLINE void correct_lanes(std::size_t k) {
        const Link* const links = all_ + k;
        const auto end = [links](std::size_t which)
                             FIRN_LAMBDA { return [=](int l) FIRN_LAMBDA { return links[l].ends[which]; }; };
        P a[4], b[4];
        load_quads_of(points_.data(), end(0), a);
        load_quads_of(points_.data(), end(1), b);
        const P wa = a[D], wb = b[D];
        const Ask<P> link = ask<Soft, P>(k, wa + wb, 1);
        Vec<P, D> r;
        unroll<D>([&](auto axis) FIRN_LAMBDA { r.v[axis] = link.s.v[axis] + (b[axis] - a[axis]); });
        auto [by, is_straight] = straight<Soft>(link, r);
        const auto others = lane_bits(!is_straight);
        if (others != 0) [[unlikely]] {
            by.impulse = select(is_straight, by.impulse, Vec<P, D>::zero());
            by.multiplier = select(is_straight, by.multiplier, link.multiplier);
        }
        by.multiplier.store(multiplier_.data() + k);
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            a[axis] -= by.impulse.v[axis] * wa;
            b[axis] += by.impulse.v[axis] * wb;
        });
        store_quads_of(a, points_.data(), end(0));
        store_quads_of(b, points_.data(), end(1));
        if (others != 0) [[unlikely]]
            for (std::size_t l = 0; l < lanes; ++l)
                if (others >> l & 1) correct_one<Soft>(k + l);
    }

    std::vector<S> rest_, compliance_, relaxation_;  // of each link: l₀ [m], α [m/N], fraction of a correction
    std::vector<S> links_;                           // of each link: n
    S calm_ = 0;                                     // a lower bound of 2/n
    bool is_soft_ = false;                           // whether a compliance is above 0, or a relaxation below 1
    // Of a step:
    S per_dt2_ = 0;
    const Link* all_ = nullptr;
    aligned_vector<S> points_;                             // a quad per point: displacement, inverse mass
    std::array<aligned_vector<S>, std::size_t(D)> along_;  // s of each link
    aligned_vector<S> unit_, multiplier_;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
