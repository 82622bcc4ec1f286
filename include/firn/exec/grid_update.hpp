/// \file The grid update of all nodes: momentum becomes velocity, accelerations act, boundaries apply.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/measured_from.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/exec/execution.hpp>
#include <firn/exec/mirror.hpp>
#include <firn/exec/reactions.hpp>
#include <firn/simd/transpose.hpp>
#include <firn/stage/grid_update.hpp>
#include <firn/stage/time_step.hpp>

#include <type_traits>
#include <vector>

namespace firn {

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

/// Updates the nodes of one block, one SIMD register of nodes at a time. The function is not inlined, so that the
/// compiler can use all registers in each instance of it.
/// Positions are measured from a corner of the grid, as by `acceleration` and `boundary`.
/// \param first      position of the first node [m];  \param h  cell size [m];  \param dt  time step [s]
/// \param reactions  array with one Reaction for each part of the boundary; nullptr if reactions are not wanted. The
///                   impulse of each part on matter is added to the Reaction of this part.
/// \param corner     the corner [m]
template <std::floating_point S, int D, class Acceleration, class Boundary, class OfParts>
[[gnu::noinline]] void update_block(S* nodes, const Vec<S, D>& first, S h, S dt, const Acceleration& acceleration,
                                    const Boundary& boundary, OfParts reactions, const Vec<double, D>& corner) {
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
        const auto update = [&](const auto& applied) FIRN_LAMBDA {
            return node_velocity(momentum, r[node_mass], x, acceleration, P(dt), applied);
        };
        Vec<P, D> v;
        if constexpr (std::same_as<OfParts, std::nullptr_t>)
            v = update(boundary);
        else
            v = update(Watched<P, D, Boundary>{boundary, r[node_mass], reactions, corner});
        unroll<D>([&](auto a) FIRN_LAMBDA { r[a] = v.v[a]; });
        store_quads(r, nodes + from * node_width);
    }
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
template <class Execution, std::floating_point S, int D, class Acceleration, class Boundary>
void update_grid(const Execution& execution, SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                 const Boundary& boundary, Reactions<D>* reactions) {
    static_assert(firn::boundary<Boundary, S, D>,
                  "firn: the boundary must offer velocity(x, v) and reaches(lower, upper)");
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

    const auto update = [&](std::size_t b, int) {
        Vec<double, D> low, high;
        for (int a = 0; a < D; ++a) {
            low[a] = h * double(block_size * grid.block_along(b, a));
            high[a] = low[a] + h * (block_size - 1);
        }
        const Vec<S, D> first = cast<S>(low);
        if (!here.reaches(low, high)) {
            update_block(grid.nodes(b), first, S(h), S(dt), field, NoBoundary{}, nullptr, corner);
        } else if (reactions && ranks_of(execution).template counts<D>(b)) {
            Reaction<D>* const of_block = of_blocks.data() + b * parts;
            for (std::size_t k = 0; k < parts; ++k) of_block[k].about = reactions->parts[k].about;
            update_block(grid.nodes(b), first, S(h), S(dt), field, lifted, of_block, corner);
        } else {
            update_block(grid.nodes(b), first, S(h), S(dt), field, lifted, nullptr, corner);
        }
    };
    parallel_for(grid.block_count(), thread_count(requested_threads(execution)), update, 16);

    if (reactions) sum_reactions<Execution, D>(execution, of_blocks, reactions->parts);
}

}  // namespace detail

/// Computes the velocity of every node after a step: divides the momentum by the mass, adds acceleration × dt, and
/// applies the boundary. The velocity replaces the momentum in the grid.
/// \param dt            time step [s]
/// \param acceleration  a constant vector, of type Vec<S, D> or of Eigen [m/s²]; or a callable field(position) or
///                      field(position, velocity, dt) that takes and returns Vec<P, D> for any scalar type P; or an
///                      acceleration field from the folder field/, with scalar type S
/// \param boundary      a boundary policy with scalar type S
/// \throws parameter_error  if `dt` is negative or not finite, or if a parameter of a policy is out of range
/// \throws usage_error      if the boundary has mirrored walls
template <class Execution, std::floating_point S, int D, class Acceleration, class Boundary>
void grid_update(const Execution& execution, SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                 const Boundary& boundary) {
    if constexpr (detail::require_fitting_boundary<Boundary, S, D>()) {
        detail::refuse_mirrors(boundary);
        detail::update_grid(execution, grid, dt, detail::own_acceleration<D>(acceleration), boundary,
                            static_cast<Reactions<D>*>(nullptr));
    }
}

/// Computes the velocity of every node after a step, and sums the impulses that the boundary exerts on matter. The
/// velocities have the same bits as those of the grid_update() without reactions.
/// \param reactions  receives the impulse and the angular impulse of each part of the boundary. \see Reactions
template <class Execution, std::floating_point S, int D, class Acceleration, class Boundary>
void grid_update(const Execution& execution, SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                 const Boundary& boundary, Reactions<D>& reactions) {
    if constexpr (detail::require_fitting_boundary<Boundary, S, D>()) {
        detail::refuse_mirrors(boundary);
        detail::update_grid(execution, grid, dt, detail::own_acceleration<D>(acceleration), boundary, &reactions);
    }
}

/// Computes the velocity of every node after a step, as the grid_update() without a kernel, and lets mirrored walls
/// act.
/// \param mirrors    mirrors_of<Kernel>(boundary, grid.domain())
/// \param reactions  receives the impulses of the boundary on matter; nullptr if they are not wanted
template <class Execution, std::floating_point S, int D, class Acceleration, class Boundary>
void grid_update(const Execution& execution, SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                 const Boundary& boundary, const Mirrors& mirrors, Reactions<D>* reactions = nullptr) {
    if constexpr (detail::require_fitting_boundary<Boundary, S, D>()) {
        detail::update_grid(execution, grid, dt, detail::own_acceleration<D>(acceleration), boundary, reactions);
        if constexpr (has_mirrors<Boundary>) detail::mirror_nodes(execution, grid, mirrors, true, reactions);
    }
}

}  // namespace firn
