/// \file FLIP, the fluid-implicit-particle method, blended with PIC. Brackbill and Ruppel 1986; Zhu and Bridson 2005;
/// for MPM Stomakhin et al. 2013, §4.1, step 8.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

/// A particle keeps its velocity and takes the change that the grid saw,
///     v ← α (v + Σ N (v_i' − v_i)) + (1 − α) Σ N v_i',
/// v_i the nodes' velocities before forces acted, v_i' after the step. It moves with Σ N v_i'. α = 1 loses nothing, but
/// keeps noise that the grid does not see for good; α = 0 is PIC.
template <scalar S = float>
struct Flip {
    static constexpr const char* name = "flip";
    static constexpr bool affine = false;

    S ratio = S(0.95);  ///< α, 0 to 1

    void check() const { check_share(ratio, name, "ratio"); }
    static constexpr auto parameters() { return std::tuple{parameter{"ratio", "1", &Flip::ratio}}; }

    template <class T, int D>
    FIRN_INLINE static Mat<T, D> affine_field(const Mat<T, D>&) {
        return Mat<T, D>::zero();
    }
    template <class T, int D>
    FIRN_INLINE ParticleVelocity<T, D> blended(const Vec<T, D>& taken, const Vec<T, D>& before, const Vec<T, D>& own,
                                               const Mat<T, D>&) const {
        return {taken + (own - before) * ratio, taken};
    }
};

static_assert(transfer<Flip<>> && blends_velocities<Flip<>>);

}  // namespace firn
