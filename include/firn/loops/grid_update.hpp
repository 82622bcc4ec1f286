/// \file The grid update of all nodes: momentum becomes velocity, accelerations act, boundaries apply.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/measured_from.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/loops/execution.hpp>
#include <firn/loops/mirror.hpp>
#include <firn/loops/reactions.hpp>
#include <firn/simd/transpose.hpp>
#include <firn/stage/grid_update.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the acceleration in a form that can be evaluated for a register of nodes, at positions that are measured
/// from `corner` [m]. An acceleration field with parameters is converted by lift().
template <class P, int D, class Acceleration>
FIRN_INLINE auto lifted_acceleration(const Acceleration& acceleration, const Vec<double, D>& corner) {
    using V = Vec<P, D>;
    if constexpr (requires { acceleration.measured_from(corner); }) {
        return lift<P>(acceleration.measured_from(corner));
    } else if constexpr (has_parameters<Acceleration>) {
        return FieldInMetres<with_scalar_t<Acceleration, P>, D>{lift<P>(acceleration), corner};
    } else if constexpr (takes<Acceleration, V> || takes<Acceleration, V, V, P>) {
        return FieldInMetres<Acceleration, D>{acceleration, corner};
    } else {
        return acceleration;  // a vector
    }
}

/// Whether an acceleration is the same vector everywhere, so that its size is known before it acts.
template <class Acceleration>
inline constexpr bool is_uniform = false;
template <class S, int D>
inline constexpr bool is_uniform<Vec<S, D>> = true;

/// Returns the acceleration at some nodes, if it is a field of the position alone: it is then computed once, for the
/// nodes and for its largest value. Any other acceleration is returned unchanged.
template <class P, int D, class Acceleration>
FIRN_INLINE decltype(auto) acceleration_of_nodes(const Acceleration& acceleration, const Vec<P, D>& x, const P& dt) {
    if constexpr (is_uniform<Acceleration> || takes<Acceleration, Vec<P, D>, Vec<P, D>, P>)
        return (acceleration);
    else
        return acceleration_at(acceleration, x, Vec<P, D>::zero(), dt);
}

/// The first and the last node of a block.
template <int D>
struct CornersOfBlock {
    Vec<double, D> low, high;  // positions, measured from the domain's lower corner [m]

    template <std::floating_point S>
    CornersOfBlock(const SparseGrid<S, D>& grid, std::size_t b) {
        const double h = grid.domain().cell_size;
        for (int a = 0; a < D; ++a) {
            low[a] = h * double(block_size * grid.block_along(b, a));
            high[a] = low[a] + h * (block_size - 1);
        }
    }
};

/// Returns the positions of a register of a block's nodes [m].
/// \param first  position of the block's first node [m];  \param from  index of the register's first node in the block
template <class P, int D>
FIRN_INLINE Vec<P, D> places_of_nodes(const Vec<value_type_t<P>, D>& first, value_type_t<P> h, int from) {
    using S = value_type_t<P>;
    constexpr int lanes = scalar_traits<P>::lanes;
    Vec<P, D> x;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        S index[lanes];
        for (int l = 0; l < lanes; ++l)
            index[l] = S((from + quad_of_lane<P>(l)) >> (2 * (D - 1 - a)) & (block_size - 1));
        x.v[a] = P(first.v[a]) + P::load(index) * P(h);
    });
    return x;
}

/// Updates the nodes of one block, one SIMD register of nodes at a time. The function is not inlined, so that the
/// compiler can use all registers in each instance of it.
/// Positions are measured from a corner of the grid, as by `acceleration` and `boundary`.
/// \param first      position of the first node [m];  \param h  cell size [m];  \param dt  time step [s]
/// \param reactions  array with one Reaction for each part of the boundary; nullptr if reactions are not wanted. The
///                   impulse of each part on matter is added to the Reaction of this part.
/// \param corner     the corner [m]
/// \return  the square of the largest acceleration [m²/s⁴] of a field at the nodes with matter; 0 for a vector
template <std::floating_point S, int D, class Acceleration, class Boundary>
[[gnu::noinline]] S update_block(S* nodes, const Vec<S, D>& first, S h, S dt, const Acceleration& acceleration,
                                 const Boundary& boundary, Reaction<D>* reactions, const Vec<double, D>& corner) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    [[maybe_unused]] P largest = P(0);
    for (int from = 0; from < block_nodes<D>; from += lanes) {
        P r[4];
        load_quads(nodes + from * node_width, r);
        if (!any(r[node_mass] > P(0))) continue;

        const Vec<P, D> x = places_of_nodes<P, D>(first, h, from);
        Vec<P, D> momentum;
        unroll<D>([&](auto a) FIRN_LAMBDA { momentum.v[a] = r[a]; });
        const auto& at_nodes = acceleration_of_nodes(acceleration, x, P(dt));
        const auto update = [&](const auto& applied) FIRN_LAMBDA {
            return node_velocity(momentum, r[node_mass], x, at_nodes, P(dt), applied);
        };
        Vec<P, D> v;
        if constexpr (std::same_as<Boundary, NoBoundary>)
            v = update(boundary);
        else
            v = update(Watched<P, D, Boundary>{boundary, r[node_mass], reactions, corner});
        if constexpr (!is_uniform<Acceleration>) {
            const auto filled = r[node_mass] > P(0);
            const Vec<P, D> before = momentum * (P(1) / select(filled, r[node_mass], P(1)));
            largest = max(largest, select(filled, squared_acceleration(at_nodes, x, before, P(dt)), P(0)));
        }
        unroll<D>([&](auto a) FIRN_LAMBDA { r[a] = v.v[a]; });
        store_quads(r, nodes + from * node_width);
    }
    if constexpr (is_uniform<Acceleration>)
        return 0;
    else
        return reduce_max(largest);
}

/// Checks that a boundary has no mirrored walls.
/// \throws usage_error  if it has one
template <class Boundary>
void refuse_mirrors(const Boundary& boundary) {
    if constexpr (has_mirrors<Boundary>)
        boundary.mirrors([](auto&&...) {
            throw usage_error(
                "The boundary has mirrored walls, which act after the grid update. Give grid_update() what "
                "mirrors_of<Kernel>(boundary, domain) returns, too.");
        });
}

/// Does the work of grid_update(), with or without reactions.
/// \param reactions  receives the impulses of the boundary on matter; nullptr if the impulses are not wanted
/// \return  the largest acceleration [m/s²] of a field at a node with matter, as far as it is finite; 0 for a vector
template <std::floating_point S, int D, class Acceleration, class Boundary>
double update_grid(int threads, const RankSums& ranks, SparseGrid<S, D>& grid, double dt,
                   const Acceleration& acceleration, const Boundary& boundary, Reactions<D>* reactions = nullptr) {
    check_step(dt);
    const Domain<D>& domain = grid.domain();
    const double h = domain.cell_size;
    const Vec<double, D> corner = domain.lower;
    if constexpr (sees_metres<Boundary, D>()) require_digits<S>(domain, "A boundary of your own");
    const auto here = on_grid(measured_from(boundary, corner), h);
    const auto lifted = lift<native_pack<S>>(here);
    const auto field = lifted_acceleration<native_pack<S>>(acceleration, corner);
    if constexpr (is_field_in_metres<std::remove_const_t<decltype(field)>>)
        require_digits<S>(domain, "An acceleration field of your own");

    std::vector<Reaction<D>> of_blocks;
    std::size_t parts = 0;
    if (reactions) {
        begin_reactions(*reactions, boundary);
        parts = reactions->parts.size();
        of_blocks.resize(grid.block_count() * parts);
    }

    constexpr bool measures = !is_uniform<std::remove_cvref_t<decltype(field)>>;
    struct alignas(64) OfThread {
        S squared = 0;
    };
    std::vector<OfThread> largest(measures ? std::size_t(threads) : 0);
    const auto see = [&](S squared, int thread) {
        if constexpr (measures) {
            S& most = largest[std::size_t(thread)].squared;
            most = std::max(most, squared);
        }
    };
    const auto update = [&](std::size_t b, int thread) {
        const auto [low, high] = CornersOfBlock<D>(grid, b);
        const Vec<S, D> first = cast<S>(low);
        Reaction<D>* const no_reactions = nullptr;
        if (!here.reaches(low, high)) {
            see(update_block(grid.nodes(b), first, S(h), S(dt), field, NoBoundary{}, no_reactions, corner), thread);
            return;
        }
        Reaction<D>* of_block = nullptr;
        if (reactions && ranks.counts(b)) {
            of_block = of_blocks.data() + b * parts;
            for (std::size_t k = 0; k < parts; ++k) of_block[k].about = reactions->parts[k].about;
        }
        see(update_block(grid.nodes(b), first, S(h), S(dt), field, lifted, of_block, corner), thread);
    };
    parallel_for(grid.block_count(), threads, update, 16);

    if (reactions) sum_reactions<D>(ranks, of_blocks, reactions->parts);
    double squared = 0;
    for (const OfThread& of_thread : largest) squared = std::max(squared, double(of_thread.squared));
    return std::isfinite(squared) ? std::sqrt(squared) : 0;
}

/// As update_grid(); afterwards mirrored walls act.
template <std::floating_point S, int D, class Acceleration, class Boundary>
double update_grid_and_mirrors(int threads, const RankSums& ranks, SparseGrid<S, D>& grid, double dt,
                               const Acceleration& acceleration, const Boundary& boundary, const Mirrors& mirrors,
                               Reactions<D>* reactions) {
    const double largest = update_grid(threads, ranks, grid, dt, acceleration, boundary, reactions);
    if constexpr (has_mirrors<Boundary>) mirror_nodes(threads, ranks, grid, mirrors, true, reactions);
    return largest;
}

/// Divides the momenta of the nodes by their masses.
template <std::floating_point S, int D>
void divide_by_masses(int threads, SparseGrid<S, D>& grid) {
    update_grid(threads, one_rank<S, D>(), grid, 0.0, Vec<S, D>::zero(), NoBoundary{});
}

/// Divides the momenta of the nodes by their masses. Mirrored walls act without friction.
template <std::floating_point S, int D, std::derived_from<Mirrors> M>
void velocities_of_momenta(int threads, SparseGrid<S, D>& grid, const M& mirrors) {
    divide_by_masses(threads, grid);
    mirror_without_friction(threads, grid, mirrors);
}

}  // namespace detail

/// Computes the velocity of every node after a step: divides the momentum by the mass, adds acceleration × dt, and
/// applies the boundary. The velocity replaces the momentum in the grid.
/// \param dt            time step [s]
/// \param acceleration  a constant vector, of type Vec<S, D> or of Eigen [m/s²]; or a callable field(position) or
///                      field(position, velocity, dt) that takes and returns Vec<P, D> for any scalar type P; or an
///                      acceleration field from the folder field/, with scalar type S
/// \param boundary      a boundary policy with scalar type S
/// \return  the largest acceleration of a field at a node [m/s²], which limits the next time step; 0 if the
///          acceleration is a vector, whose size is known. \see squared_acceleration, acceleration_time_step
/// \throws parameter_error  if `dt` is negative or not finite, or if a parameter of a policy is out of range
/// \throws usage_error      if the boundary has mirrored walls
template <class Execution, std::floating_point S, int D, class Acceleration, class Boundary>
double grid_update(const Execution& execution, SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                   const Boundary& boundary) {
    if constexpr (detail::require_boundary<Boundary, S, D>() &&
                  detail::require_acceleration<Acceleration, native_pack<S>, D>()) {
        detail::refuse_mirrors(boundary);
        return detail::update_grid(detail::threads_of(execution), detail::all_ranks<S, D>(execution), grid, dt,
                                   detail::own_acceleration<D>(acceleration), boundary);
    }
    return 0;
}

/// Computes the velocity of every node after a step, and sums the impulses that the boundary exerts on matter. The
/// velocities have the same bits as those of the grid_update() without reactions.
/// \param reactions  receives the impulse and the angular impulse of each part of the boundary. \see Reactions
/// \return  the largest acceleration of a field [m/s²], as above
template <class Execution, std::floating_point S, int D, class Acceleration, class Boundary>
double grid_update(const Execution& execution, SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                   const Boundary& boundary, Reactions<D>& reactions) {
    if constexpr (detail::require_boundary<Boundary, S, D>() &&
                  detail::require_acceleration<Acceleration, native_pack<S>, D>()) {
        detail::refuse_mirrors(boundary);
        return detail::update_grid(detail::threads_of(execution), detail::all_ranks<S, D>(execution), grid, dt,
                                   detail::own_acceleration<D>(acceleration), boundary, &reactions);
    }
    return 0;
}

/// Computes the velocity of every node after a step, as the grid_update() without a kernel, and lets mirrored walls
/// act.
/// \param mirrors    mirrors_of<Kernel>(boundary, grid.domain())
/// \param reactions  receives the impulses of the boundary on matter; nullptr if they are not wanted
/// \return  the largest acceleration of a field at a node [m/s²], which limits the next time step; 0 if the
///          acceleration is a vector, whose size is known. \see squared_acceleration, acceleration_time_step
template <class Execution, std::floating_point S, int D, class Acceleration, class Boundary>
double grid_update(const Execution& execution, SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                   const Boundary& boundary, const Mirrors& mirrors, Reactions<D>* reactions = nullptr) {
    if constexpr (detail::require_boundary<Boundary, S, D>() &&
                  detail::require_acceleration<Acceleration, native_pack<S>, D>())
        return detail::update_grid_and_mirrors(detail::threads_of(execution), detail::all_ranks<S, D>(execution), grid,
                                               dt, detail::own_acceleration<D>(acceleration), boundary, mirrors,
                                               reactions);
    return 0;
}

}  // namespace firn::inline FIRN_BUILD
