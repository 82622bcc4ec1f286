/// \file The grid update backwards: from the adjoints of node velocities to those of momenta and masses.
#pragma once

#include <firn/adjoint/inputs.hpp>
#include <firn/adjoint/reaction.hpp>
#include <firn/field/gravity.hpp>
#include <firn/loops/grid_update.hpp>

#include <optional>

namespace firn::inline FIRN_BUILD::detail {

/// A boundary whose parts act at once, as in the grid update, for masses in another unit.
/// \tparam Seen  a function: seen(part, before, after) is told what each part does to the velocity
template <class Boundary, class P, class Seen = AnySurface>
struct AllAtOnce {
    const Boundary& boundary;
    const P& unit_of_mass;  // [kg]
    Seen seen{};

    template <class T, int D>
    Vec<T, D> velocity(const Vec<T, D>& x, const Vec<T, D>& v, const T& mass, const T& dt) const {
        return velocity_among(boundary, x, v, NoOthers{}, seen, NodeInertia<T>{mass * T(unit_of_mass), dt});
    }
};

/// The way back of the grid update: replaces the adjoints of the node velocities by those of momenta and masses.
/// \param momenta  the momenta and masses of the nodes before the grid update
/// \param bars     the adjoints of the nodes: of the velocities, and of the masses as far as what follows depends on
/// them
/// \param sums     for each block: the derivatives by the parameters of the acceleration, then of the boundary
/// \param by_reactions  the derivatives of measures by the reactions of the boundary's parts in this step; empty: none
template <std::floating_point S, int D, class Acceleration, class Lifted, class Boundary>
void update_grid_back(int threads, const SparseGrid<S, D>& grid, const S* momenta, S* bars, double dt,
                      const Acceleration& acceleration, const Boundary& here, const Lifted& lifted, OrderedSums& sums,
                      const std::vector<Reaction<D>>& by_reactions = {}) {
    using P = native_pack<S>;
    using T = traced<P>;
    constexpr int lanes = scalar_traits<P>::lanes;
    const double h = grid.domain().cell_size;
    parallel_for(
        grid.block_count(), threads,
        [&](std::size_t b, int) {
            const auto [low, high] = CornersOfBlock<D>(grid, b);
            Tape<P>& tape = Tape<P>::mine();
            tape.cut(1);
            const TracedPolicy<P, Acceleration> field(acceleration);
            const bool reached = here.reaches(low, high);
            std::optional<TracedPolicy<P, Lifted>> walls;
            if (reached) walls.emplace(lifted);
            const std::size_t start = tape.size(), first_node = b * std::size_t(block_nodes<D> * node_width);
            for (int from = 0; from < block_nodes<D>; from += lanes) {
                P r[4], bar[4];
                load_quads(momenta + first_node + from * node_width, r);
                load_quads(bars + first_node + from * node_width, bar);
                if (!any(r[node_mass] > P(0))) continue;
                tape.cut(start);
                const P unit = own_unit(r[node_mass]), per_unit = P(1) / unit;  // of momentum and mass
                const Vec<P, D> place = places_of_nodes<P, D>(cast<S>(low), S(h), from);
                Vec<T, D> momentum, x;
                Vec<P, D> adjoint;
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    momentum.v[a] = T::input(r[a] * per_unit);
                    x.v[a] = T(place.v[a]);
                    adjoint.v[a] = bar[a];
                });
                const T mass = T::input(r[node_mass] * per_unit);
                const auto velocity = [&](const auto& boundary) {
                    return node_velocity(momentum, mass, x, *field, T(P(S(dt))), boundary);
                };
                T by_impulses(0);
                const auto seen = [&](int part, const Vec<T, D>& before, const Vec<T, D>& after) {
                    if (by_reactions.empty()) return;
                    const Vec<P, D> by = by_impulse(by_reactions[std::size_t(part)], place, grid.domain().lower);
                    unroll<D>([&](auto a) FIRN_LAMBDA {
                        by_impulses += (after.v[a] - before.v[a]) * (mass * T(unit * by.v[a]));
                    });
                };
                const Vec<T, D> v = reached ? velocity(AllAtOnce<Lifted, P, decltype(seen)>{**walls, unit, seen})
                                            : velocity(NoBoundary{});
                tape.begin();
                seed(v, adjoint);
                seed(by_impulses, P(1));
                tape.back();
                field.add_to(sums.of(b).first(field.count()));
                if (reached) walls->add_to(sums.of(b).subspan(field.count()));
                unroll<D>([&](auto a) FIRN_LAMBDA { bar[a] = adjoint_of(momentum.v[a]) * per_unit; });
                bar[node_mass] = bar[node_mass] + adjoint_of(mass) * per_unit;
                store_quads(bar, bars + first_node + from * node_width);
            }
        },
        4);
}

/// An acceleration as a field of traced numbers: of a vector, Gravity.
template <class P, int D, class Acceleration>
auto traced_acceleration(const Acceleration& acceleration, const Vec<double, D>& corner) {
    if constexpr (is_uniform<Acceleration>)
        return lift<traced<P>>(Gravity<value_type_t<P>, D>{cast<value_type_t<P>>(acceleration)});
    else
        return lifted_acceleration<traced<P>>(acceleration, corner);
}

/// The way back of divide_by_masses(): replaces the adjoints of velocities by those of momenta, and adds to those of
/// masses.
/// \param momenta  the momenta and masses;  \param bars  the adjoints of the nodes
template <std::floating_point S, int D>
void divide_by_masses_back(int threads, const SparseGrid<S, D>& grid, const S* momenta, S* bars) {
    using P = native_pack<S>;
    const auto none = traced_acceleration<P, D>(Vec<double, D>::zero(), grid.domain().lower);
    OrderedSums sums(grid.block_count(), count_of_inputs<P>(none));
    update_grid_back<S, D>(threads, grid, momenta, bars, 0, none, NoBoundary{}, NoBoundary{}, sums);
}

}  // namespace firn::inline FIRN_BUILD::detail
