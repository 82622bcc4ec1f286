/// \file Mirrored walls backwards: from the adjoints of the nodes beside them after the walls have acted to those
/// before.
#pragma once

#include <firn/adjoint/reaction.hpp>
#include <firn/loops/mirror.hpp>

#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Returns for each mirrored wall, in the order of mirrors_of(), the index of its friction among the numbers of the
/// boundary.
template <class Boundary>
std::vector<std::size_t> frictions_of_mirrors(const Boundary& boundary) {
    using P = native_pack<double>;
    std::vector<std::size_t> all;
    Tape<P>& tape = Tape<P>::mine();
    tape.cut(1);
    const std::size_t first = tape.size();
    const TracedPolicy<P, decltype(lift<traced<P>>(boundary))> traced_boundary(lift<traced<P>>(boundary));
    (*traced_boundary).mirrors([&](auto, const auto&, auto, Contact, const traced<P>& friction, int) {
        all.push_back(friction.node - first);
    });
    return all;
}

/// The way back of mirrored(), for one register of columns.
/// \param at   the columns before the wall acts;  \param bar  the adjoints after; receives those before
/// \return  the derivative by the friction
template <class P, int D>
[[gnu::noinline]] double column_back(const NodeColumn<P, D>& at, NodeColumn<P, D>& bar, const MirrorPlane& plane,
                                     double friction, const SurfaceWeights<traced<P>>& weights) {
    using S = value_type_t<P>;
    using T = traced<P>;
    Tape<P>& tape = Tape<P>::mine();
    tape.cut(1);
    const P unit = own_unit(at.mass_behind + at.mass_on + at.mass_front), per_unit = P(1) / unit;
    const T mu = T::input(P(S(friction)));
    const NodeColumn<T, D> before{inputs(at.behind),
                                  inputs(at.on),
                                  inputs(at.front),
                                  T::input(at.mass_behind * per_unit),
                                  T::input(at.mass_on * per_unit),
                                  T::input(at.mass_front * per_unit)};
    const NodeColumn<T, D> after = mirrored(before, plane.axis, plane.inward, plane.contact, mu, weights);
    tape.begin();
    seed(after.behind, bar.behind), seed(after.on, bar.on), seed(after.front, bar.front);
    seed(after.mass_behind, bar.mass_behind * unit);
    seed(after.mass_on, bar.mass_on * unit);
    seed(after.mass_front, bar.mass_front * unit);
    tape.back();
    bar.behind = adjoint_of(before.behind), bar.on = adjoint_of(before.on), bar.front = adjoint_of(before.front);
    bar.mass_behind = adjoint_of(before.mass_behind) * per_unit;
    bar.mass_on = adjoint_of(before.mass_on) * per_unit;
    bar.mass_front = adjoint_of(before.mass_front) * per_unit;
    return sum_of_lanes(adjoint_of(mu));
}

/// The way back of mirror_nodes(): replaces the adjoints of the nodes after the walls have acted by those before.
/// \param values   velocities and masses of the nodes before the walls act. They are overwritten
/// \param bars     the adjoints of velocities and masses, on the same blocks
/// \param by_wall  for each wall, the derivative by its friction is added
/// \param by_reactions  the derivatives of measures by the reactions of the boundary's parts in this step; empty: none
template <std::floating_point S, int D>
void mirror_nodes_back(int threads, SparseGrid<S, D>& values, SparseGrid<S, D>& bars, const Mirrors& mirrors,
                       bool with_friction, std::vector<double>& by_wall,
                       const std::vector<Reaction<D>>& by_reactions = {}) {
    using P = native_pack<S>;
    using T = traced<P>;
    using Columns = BlockColumns<S, D>;
    const std::size_t blocks = values.block_count(), numbers = blocks * std::size_t(block_nodes<D> * node_width);
    const auto copy = [&](const S* from, S* to) { copy_and_fill(from, numbers, to, numbers, S(0), threads); };
    // The walls across one axis act on what those across the axis before have left.
    struct OfAxis {
        std::size_t first;
        Mirrors walls;
        aligned_vector<S> before;
    };
    std::vector<OfAxis> axes;
    for (std::size_t first = 0, last = 0; first < mirrors.planes.size(); first = last) {
        last = mirrors.end_of_axis(first);
        const auto planes = mirrors.planes.begin();
        OfAxis& of = axes.emplace_back(
            OfAxis{first, {{planes + std::ptrdiff_t(first), planes + std::ptrdiff_t(last)}, mirrors.weights}, {}});
        of.before.resize(numbers);
        copy(values.nodes(0), of.before.data());
        mirror_nodes(threads, one_rank<S, D>(), values, of.walls, with_friction);
    }
    const SurfaceWeights<T> weights{T(P(S(mirrors.weights.on))), T(P(S(mirrors.weights.beside)))};
    // Reactions: impulses are changes of velocities times the masses before any wall has acted.
    std::vector<S> by_mass(by_reactions.empty() ? 0 : numbers / node_width);
    const auto for_impulses_of = [&](const Columns& columns, const MirrorPlane& plane, double sign) {
        if (by_reactions.empty()) return;
        columns.for_nodes([&](const S* node, const S* before, const S* after) {
            const auto index = std::size_t(node - values.nodes(0)) / node_width;
            const std::size_t block = index / std::size_t(block_nodes<D>);
            const Vec<double, D> x = node_position(values, block, int(index % std::size_t(block_nodes<D>)));
            const Vec<double, D> by = by_impulse(by_reactions[std::size_t(plane.part)], x, Vec<double, D>::zero());
            for (int a = 0; a < D; ++a) {
                bars.nodes(0)[index * node_width + a] +=
                    S(sign * by[a] * double(axes[0].before[index * node_width + node_mass]));
                if (sign < 0) by_mass[index] += S(by[a] * (double(after[a]) - double(before[a])));
            }
        });
    };
    for (std::size_t k = axes.size(); k-- > 0;) {
        OfAxis& of = axes[k];
        copy(of.before.data(), values.nodes(0));
        OrderedSums sums(blocks, of.walls.planes.size());
        const auto act = [&](std::size_t b, int) {
            for (std::size_t p = 0; p < of.walls.planes.size(); ++p) {
                const MirrorPlane& plane = of.walls.planes[p];
                if (values.block_along(b, plane.axis) != plane.node >> 2) continue;
                Columns columns(values, plane, b);
                if (!by_reactions.empty())
                    columns.change([&](const NodeColumn<P, D>& column) {
                        return mirrored(column, plane.axis, plane.inward, plane.contact,
                                        P(S(with_friction ? plane.friction : 0)),
                                        SurfaceWeights<P>{weights.on.value, weights.beside.value});
                    });
                for_impulses_of(columns, plane, 1);
                Columns adjoints(bars, plane, b);
                for (int first = 0; first < Columns::padded; first += scalar_traits<P>::lanes) {
                    const NodeColumn<P, D> at = columns.column(first);
                    NodeColumn<P, D> bar = adjoints.column(first);
                    if (Columns::has_matter(at))
                        sums.of(b)[p] += column_back(at, bar, plane, with_friction ? plane.friction : 0, weights);
                    adjoints.set(first, bar);
                }
                adjoints.write();
                for_impulses_of(columns, plane, -1);
            }
        };
        parallel_for(blocks, threads, act, 64);
        sums.add_to(std::span(by_wall).subspan(of.first));
    }
    for (std::size_t index = 0; index < by_mass.size(); ++index)
        bars.nodes(0)[index * node_width + node_mass] += by_mass[index];
}

}  // namespace firn::inline FIRN_BUILD::detail
