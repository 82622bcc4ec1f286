/// \file The concept of a volumetric policy: the policy that decides which rate of volume change updates the material
/// state of a particle.
///
/// The trace of a particle's velocity gradient ∇v is its rate of volume change θ [1/s]. In nearly incompressible matter
/// every particle resists its own θ, although the grid has fewer degrees of freedom than there are particles. So matter
/// locks: it bends and flows far too stiffly, and the pressure scatters. A policy with an average resists only the
/// average of θ over the particles around.
#pragma once

#include <firn/core/tensor.hpp>

#include <concepts>
#include <cstdint>

namespace firn::inline FIRN_BUILD {

/// Whether V has a constant `averages_volume`. This constant is true if the rate of volume change of a particle is
/// averaged over the particles around it.
template <class V>
concept has_averages_volume_flag = requires {
    { V::averages_volume } -> std::convertible_to<bool>;
};
/// Whether V has a function `velocity_gradient(own, average)`. The function returns the velocity gradient that updates
/// the material state [1/s], from the particle's own velocity gradient [1/s] and the average rate of volume change
/// around the particle [1/s].
template <class V, class S, int D>
concept has_averaged_gradient = requires(const Mat<S, D> own, const S average) {
    { V::velocity_gradient(own, average) } -> std::same_as<Mat<S, D>>;
};

/// Whether V averages what a step changes volumes by, in steps of any size: V has functions `rate(own, dt)`, which
/// returns the rate that is averaged [1/s], and `velocity_gradient(own, average, dt)`. \see FBarOfStep
template <class V, class S, int D>
concept has_averaged_step = requires(const Mat<S, D> own, const S number) {
    { V::rate(own, number) } -> std::same_as<S>;
    { V::velocity_gradient(own, number, number) } -> std::same_as<Mat<S, D>>;
};

/// Whether V is a volumetric policy: V has a constant `averages_volume` and, if this constant is true, a function
/// velocity_gradient().
template <class V>
concept volumetric =
    has_averages_volume_flag<V> &&
    (!V::averages_volume || (has_averaged_gradient<V, float, 3> && has_averaged_gradient<V, double, 2>) ||
     (has_averaged_step<V, float, 3> && has_averaged_step<V, double, 2>));

/// Returns the rate of volume change of a particle that the policy V averages [1/s]: the trace of ∇v, or V::rate().
/// \param own  the particle's ∇v [1/s];  \param dt  time of the step [s]
template <class V, scalar S, int D>
FIRN_INLINE S rate_to_average(const Mat<S, D>& own, [[maybe_unused]] const S& dt) {
    if constexpr (has_averaged_step<V, S, D>)
        return V::rate(own, dt);
    else
        return trace(own);
}
/// Returns the velocity gradient that updates a particle's material state [1/s], for a policy V that averages.
/// \param own  the particle's ∇v [1/s];  \param average  the average rate around the particle [1/s]
/// \param dt   time of the step [s]
template <class V, scalar S, int D>
FIRN_INLINE Mat<S, D> averaged_gradient(const Mat<S, D>& own, const S& average, [[maybe_unused]] const S& dt) {
    if constexpr (has_averaged_step<V, S, D>)
        return V::velocity_gradient(own, average, dt);
    else
        return V::velocity_gradient(own, average);
}

/// Whether the volumetric policy V filters the volume ratios of the particles between steps: it has functions
/// `is_due(steps)` and `share(crossed)`. \see VolumeFilter
template <class V>
inline constexpr bool filters_volume = requires(const V v) {
    { v.is_due(std::uint64_t(0)) } -> std::same_as<bool>;
    { v.share(0.0) } -> std::same_as<double>;
};

/// Whether the volumetric policy V also moves particles off overfull nodes: it has a function `shifted_share(crossed)`.
/// \see VolumeFilter
template <class V>
inline constexpr bool shifts_particles = filters_volume<V> && requires(const V v) {
    { v.shifted_share(0.0) } -> std::same_as<double>;
};

/// Returns true if V is a volumetric policy. If V is not, the compilation stops with a message.
template <class V>
consteval bool require_volumetric() {
    static_assert(has_averages_volume_flag<V>,
                  "firn: a volumetric policy says whether it averages: static constexpr bool averages_volume.");
    static_assert(volumetric<V> || !has_averages_volume_flag<V>,
                  "firn: a volumetric policy that averages offers a static function velocity_gradient(own, average), "
                  "which returns a Mat for every scalar; see firn/volumetric/concept.hpp.");
    return volumetric<V>;
}

}  // namespace firn::inline FIRN_BUILD
