/// \file The largest acceleration that acts on matter, which limits the time step.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/exec/grid_update.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <vector>

namespace firn::detail {

/// Returns the largest acceleration [m/s²] that a field gives to matter at rest at the positions of the particles, as
/// far as it is finite. For the first step: later, the grid update tells the largest at the nodes.
/// \param sets  a tuple of MaterialSet
template <class Sets, class Acceleration>
[[gnu::cold]] double acceleration_at_particles(const Sets& sets, const Acceleration& acceleration, int threads) {
    using S = typename std::tuple_element_t<0, Sets>::S;
    using P = native_pack<S>;
    constexpr int D = std::tuple_element_t<0, Sets>::dimension, lanes = scalar_traits<P>::lanes;
    const auto field = lifted_acceleration<P>(acceleration);
    double squared = 0;
    const auto look = [&](const auto& set) {
        const auto& particles = set.particles;
        std::vector<double> largest(std::size_t(threads), 0.0);
        const auto see = [&](std::size_t pack, int thread) {
            for (std::size_t first = pack * pack_size; first < (pack + 1) * pack_size; first += lanes) {
                S x[D][lanes] = {}, matter[lanes] = {};
                for (int lane = 0; lane < lanes; ++lane) {
                    const std::size_t slot = first + std::size_t(lane);
                    if (!particles.is_particle(slot)) continue;
                    const Vec<S, D> position = particles.position(slot);
                    for (int a = 0; a < D; ++a) x[a][lane] = position[a];
                    matter[lane] = 1;
                }
                Vec<P, D> at;
                unroll<D>([&](auto a) FIRN_LAMBDA { at.v[a] = P::load(x[a]); });
                const Vec<P, D> a = acceleration_at(field, at, Vec<P, D>::zero(), P(0));
                const double most = double(reduce_max(select(P(0) < P::load(matter), dot(a, a), P(0))));
                if (std::isfinite(most)) largest[std::size_t(thread)] = std::max(largest[std::size_t(thread)], most);
            }
        };
        parallel_for(particles.slots() / pack_size, threads, see, 64);
        squared = std::max(squared, *std::max_element(largest.begin(), largest.end()));
    };
    std::apply([&](const auto&... set) { (look(set), ...); }, sets);
    return std::sqrt(squared);
}

}  // namespace firn::detail
