/// \file What boundaries give to matter in a grid update: impulses and torques, for diagnostics and two-way coupling.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/lanes.hpp>
#include <firn/math/rotor.hpp>

#include <optional>
#include <vector>

namespace firn {

/// What one part of a boundary gave to matter: Σ m Δv and Σ (x − about) × m Δv over the nodes. The part received the
/// opposite: over a step of dt, the force −impulse / dt.
template <int D>
struct Reaction {
    Vec<double, D> about = Vec<double, D>::zero();          ///< [m]
    Vec<double, D> impulse = Vec<double, D>::zero();        ///< [N s]
    Axial<double, D> angular_impulse = Axial<double, D>{};  ///< about `about` [N m s]

    Reaction& operator+=(const Reaction& more) {
        impulse += more.impulse;
        angular_impulse += more.angular_impulse;
        return *this;
    }
};

/// Filled by grid_update(): one Reaction for every part of a boundary (a Together or BoundaryList has several), summed
/// in double, block after block: the same bits for any number of threads.
template <int D>
struct Reactions {
    /// What torques are about; not given: the position of each part, or the origin for what has none.
    std::optional<Vec<double, D>> about{};
    std::vector<Reaction<D>> parts{};
};

namespace detail {

/// A boundary whose parts' changes of velocity are added up.
template <scalar P, int D, class Boundary>
struct Watched {
    const Boundary& boundary;
    const P& mass;
    Reaction<D>* parts;

    FIRN_INLINE Vec<P, D> velocity(const Vec<P, D>& x, const Vec<P, D>& v) const {
        const auto add = [&](int part, const Vec<P, D>& before, const Vec<P, D>& after) {
            Reaction<D>& sum = parts[part];
            for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
                Vec<double, D> arm{}, impulse{};
                for (int a = 0; a < D; ++a) {
                    arm[a] = double(lane_value(x[a], lane)) - sum.about[a];
                    impulse[a] = double(lane_value(mass, lane)) *
                                 (double(lane_value(after[a], lane)) - double(lane_value(before[a], lane)));
                }
                sum.impulse += impulse;
                sum.angular_impulse += axial_product(arm, impulse);
            }
        };
        return velocity_among(boundary, x, v, NoOthers{}, add);
    }
};

}  // namespace detail

}  // namespace firn
