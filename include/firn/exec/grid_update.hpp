/// \file The grid update over all active nodes: momentum becomes velocity, forces per mass act, boundaries apply.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/exec/execution.hpp>
#include <firn/exec/parallel.hpp>
#include <firn/exec/transpose.hpp>
#include <firn/stage/grid_update.hpp>

#include <type_traits>

namespace firn {

namespace detail {

/// The acceleration at a node: a constant vector, or a field f(position) written for any scalar.
template <class P, int D, class Acceleration>
FIRN_INLINE Vec<P, D> acceleration_at(const Acceleration& acceleration, const Vec<P, D>& x) {
    if constexpr (requires { acceleration(x); })
        return acceleration(x);
    else
        return cast<P>(acceleration);
}

/// For a register of nodes: a policy is lifted, anything else serves as it is.
template <class P, class Acceleration>
FIRN_INLINE auto lifted_acceleration(const Acceleration& acceleration) {
    if constexpr (has_parameters<Acceleration>)
        return lift<P>(acceleration);
    else
        return acceleration;
}

/// One block of nodes, a register of nodes at a time.
template <std::floating_point S, int D, class Acceleration, class Boundary>
FIRN_INLINE void update_block(S* nodes, const Vec<S, D>& first, S h, S dt, const Acceleration& acceleration,
                              const Boundary& boundary) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    for (int from = 0; from < block_nodes<D>; from += lanes) {
        P r[4];
        load_quads(nodes + from * node_width, r);
        if (!any(r[node_mass] > P(0))) continue;

        Vec<P, D> x;
        unroll<D>([&](auto a) FIRN_LAMBDA {
            S index[lanes];
            for (int l = 0; l < lanes; ++l)
                index[l] = S((from + quad_of_lane<P>(l)) >> (2 * (D - 1 - a)) & (block_size - 1));
            x.v[a] = P(first.v[a]) + P::load(index) * P(h);
        });
        Vec<P, D> momentum;
        unroll<D>([&](auto a) FIRN_LAMBDA { momentum.v[a] = r[a]; });
        const Vec<P, D> v =
            node_velocity(momentum, r[node_mass], x, acceleration_at<P, D>(acceleration, x), P(dt), boundary);
        unroll<D>([&](auto a) FIRN_LAMBDA { r[a] = v.v[a]; });
        store_quads(r, nodes + from * node_width);
    }
}

}  // namespace detail

/// Turns the momentum of every node into its velocity after dt.
/// \param acceleration  Vec<S, D> [m/s²]; or a callable of the node's position, Vec<P, D> → Vec<P, D> for any scalar P;
///                      or a policy of field/ in S
/// \param boundary      a boundary policy in S; node position and velocity → velocity
template <class Execution, std::floating_point S, int D, class Acceleration, class Boundary>
void grid_update(const Execution& execution, SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                 const Boundary& boundary) {
    static_assert(firn::boundary<Boundary, S, D>,
                  "firn: the boundary must offer velocity(x, v) and reaches(lower, upper)");
    const double h = grid.domain().cell_size;
    const auto lifted = lift<native_pack<S>>(boundary);
    const auto field = detail::lifted_acceleration<native_pack<S>>(acceleration);
    const auto update = [&](std::size_t b, int) {
        Vec<double, D> low, high;
        for (int a = 0; a < D; ++a) {
            low[a] = position_of_place(grid.domain(), grid.block(b), a, 0);
            high[a] = low[a] + h * (block_size - 1);
        }
        const Vec<S, D> first = cast<S>(low);
        if (boundary.reaches(low, high))
            detail::update_block(grid.nodes(b), first, S(h), S(dt), field, lifted);
        else
            detail::update_block(grid.nodes(b), first, S(h), S(dt), field, NoBoundary{});
    };
    parallel_for(grid.block_count(), thread_count(requested_threads(execution)), update, 16);
}

}  // namespace firn
