/// \file How far the particles of a material are stretched, for warnings.
#pragma once

#include <firn/core/lanes.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/kernel_facts.hpp>
#include <firn/data/particle_store.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/deformation.hpp>
#include <firn/math/stretch_bound.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// What the warnings need of a particle's deformation gradient F.
template <std::floating_point S, int D>
struct GradientFacts {
    Mat<S, D> F;            ///< F itself [1]
    Mat<S, D> left_strain;  ///< F Fᵀ − I [1]. \see left_cauchy_green_change
    double largest_number;  ///< the largest of the numbers that are stored of F, by its absolute value
};
template <std::floating_point S, int D, class Gradient>
GradientFacts<S, D> gradient_facts(const Gradient& F) {
    double largest = 0;
    for (const S number : Stored<Gradient>::numbers(F)) largest = std::max(largest, std::abs(double(number)));
    if constexpr (firn::dimension_of<Gradient> == D)
        return {F, left_cauchy_green_change(F), largest};
    else
        return {in_plane(Mat<S, 3>(F)), in_plane(left_cauchy_green_change(F)), largest};
}

/// Whether F of a particle of the material M is its whole deformation: M is elastic.
template <class M, int D>
inline constexpr bool is_elastic =
    requires(const material_state_t<M, D> s) { s.F; } && !has_returned<M, D> && !has_updated<M, D>;
/// Whether particles of M are stretched by a known factor while they bear tension: M is elastic, or has
/// stretch_bound().
template <class M, int D>
inline constexpr bool tells_stretch = has_stretch_bound<M, D> || is_elastic<M, D>;

/// Returns an upper bound of how many times as long as at first a particle is, along any direction.
template <class M, class State>
FIRN_INLINE auto stretch_of(const M& model, const State& state) {
    if constexpr (requires { model.stretch_bound(state); })
        return model.stretch_bound(state);
    else
        return sqrt(squared_stretch_bound(state.F));
}

/// A particle that may be stretched too far.
struct Stretched {
    double ratio;  ///< the bound of its stretch, divided by the largest stretch at which neighbours are joined
    std::uint32_t id;
    std::size_t slot;

    bool operator<(const Stretched& other) const { return ratio != other.ratio ? other.ratio < ratio : id < other.id; }
};
/// The particles with the largest ratios; these are the same whatever the order in which particles are added.
struct MostStretched {
    static constexpr std::size_t most = 64;
    std::vector<Stretched> all{};  ///< in descending order

    double least() const { return all.size() < most ? 1 : all.back().ratio; }  ///< smaller ratios are not kept
    void add(const Stretched& one) {
        if (all.size() == most && !(one < all.back())) return;
        all.insert(std::lower_bound(all.begin(), all.end(), one), one);
        if (all.size() > most) all.pop_back();
    }
};

/// The largest stretch at which the kernel joins particles of the volume V0 [m^D] at rest; computed once for particles
/// of equal volumes.
template <int D>
class JoinedStretch {
public:
    JoinedStretch(const KernelFacts& kernel, double cell_size)
        : of_kernel_(kernel.joined_stretch), cell_size_(cell_size) {}
    double of(double volume) {
        if (volume != volume_) {
            volume_ = volume;
            stretch_ = volume > 0 ? of_kernel_(cell_size_ / std::pow(volume, 1.0 / D)) : INFINITY;
        }
        return stretch_;
    }

private:
    double (*of_kernel_)(double);
    double cell_size_, volume_ = -1, stretch_ = 0;
};

/// Returns the particles of a set that are stretched most beyond what the kernel joins, and are not compressed.
template <class Material, std::floating_point S, int D, class View>
std::vector<Stretched> most_stretched(const KernelFacts& kernel, const ParticleStore<S, D>& particles, const View& view,
                                      const Material& material, int threads) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    using LiftedState = material_state_t<with_scalar_t<Material, P>, D>;
    const auto lifted = lift<P>(material);
    std::vector<MostStretched> of_threads(std::size_t(threads), MostStretched{});
    const auto look = [&](std::size_t first, std::size_t last, MostStretched& most) {
        JoinedStretch<D> joined(kernel, particles.domain().cell_size);
        for (std::size_t slot = first; slot < last; slot += std::size_t(lanes)) {
            const Slots slots{slot, nullptr};
            const P stretch = stretch_of(lifted, load_state<LiftedState>(view.state, slots));
            const P volume = view.volume.template load<P>(slots, 0);
            // What is below the least of those that are kept, with a margin for rounding, is not looked at further.
            const auto beyond = P(S(0.99999 * most.least() * joined.of(double(reduce_max(volume))))) < stretch;
            if (!any(beyond)) continue;
            const P pull = trace(load_symmetric<P, D>(view.stress, slots));
            if (!any(beyond & (P(0) < pull))) continue;
            for (int l = 0; l < lanes; ++l) {
                const std::size_t one = slot + std::size_t(l);
                if (!particles.is_particle(one) || !(lane_value(pull, l) > 0)) continue;
                const double ratio = double(lane_value(stretch, l)) / joined.of(double(lane_value(volume, l)));
                if (ratio > 1) most.add({ratio, particles.id(one), one});
            }
        }
    };
    parallel_for(
        particles.slots() / pack_size, threads,
        [&](std::size_t pack, int thread) {
            look(pack * pack_size, (pack + 1) * pack_size, of_threads[std::size_t(thread)]);
        },
        64);
    MostStretched most;
    for (const MostStretched& of_thread : of_threads)
        for (const Stretched& one : of_thread.all) most.add(one);
    return most.all;
}

}  // namespace firn::inline FIRN_BUILD::detail
