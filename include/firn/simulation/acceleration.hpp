/// \file The largest acceleration that acts on matter, which limits the time step.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/field/gravity.hpp>
#include <firn/loops/grid_update.hpp>
#include <firn/simulation/set_of.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Returns the size of an acceleration that is the same everywhere [m/s²].
/// \param in_float  whether it is computed as a WGSL program computes that of the field Gravity
template <class S, int D>
double size_of_uniform(const Vec<S, D>& acceleration, bool in_float) {
    if (!in_float) return norm(cast<double>(acceleration));
    constexpr Vec<float, D> zero{};
    return double(sqrt(squared_acceleration(Gravity<float, D>{cast<float>(acceleration)}, zero, zero, 0.0F)));
}

/// Returns the largest acceleration of a field at the particles [m/s²], as far as it is finite. For the first step:
/// later, the grid update tells the largest at the nodes. \see squared_acceleration
template <std::floating_point S, int D, class Acceleration>
[[gnu::cold]] double acceleration_at_particles(const SetList<S, D>& sets, const Domain<D>& domain,
                                               const Acceleration& acceleration, int threads) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    const auto field = lifted_acceleration<P>(acceleration, domain.lower);
    double squared = 0;
    for (const SetOf<S, D>& set : sets) {
        const ParticleStore<S, D>& particles = set.store();
        std::vector<double> largest(std::size_t(threads), 0.0);
        const auto see = [&](std::size_t pack, int thread) {
            for (std::size_t first = pack * pack_size; first < (pack + 1) * pack_size; first += lanes) {
                S x[D][lanes] = {}, v[D][lanes] = {}, matter[lanes] = {};
                for (int lane = 0; lane < lanes; ++lane) {
                    const std::size_t slot = first + std::size_t(lane);
                    if (!particles.is_particle(slot)) continue;
                    const Vec<S, D> position = cast<S>(particles.exact_position(slot) - domain.lower),
                                    velocity = particles.velocity(slot);
                    for (int a = 0; a < D; ++a) x[a][lane] = position[a], v[a][lane] = velocity[a];
                    matter[lane] = 1;
                }
                Vec<P, D> at, moving;
                unroll<D>([&](auto a) FIRN_LAMBDA { at.v[a] = P::load(x[a]), moving.v[a] = P::load(v[a]); });
                const P all = squared_acceleration(field, at, moving, P(0));
                const double most = double(reduce_max(select(P(0) < P::load(matter), all, P(0))));
                if (std::isfinite(most)) largest[std::size_t(thread)] = std::max(largest[std::size_t(thread)], most);
            }
        };
        parallel_for(particles.slots() / pack_size, threads, see, 64);
        squared = std::max(squared, *std::max_element(largest.begin(), largest.end()));
    }
    return std::sqrt(squared);
}

}  // namespace firn::inline FIRN_BUILD::detail
