/// \file How the sums over the nodes around a particle change with the particle's position, while the values of the
/// nodes are held.
#pragma once

#include <firn/core/dual.hpp>
#include <firn/loops/gather.hpp>
#include <firn/loops/scatter.hpp>
#include <firn/stage/offset.hpp>

#include <cstddef>
#include <type_traits>

namespace firn::inline FIRN_BUILD::detail {

/// The arena of a group, filled from the grid: contiguous memory for the nodes around the group.
template <class Kernel, std::floating_point S, int D>
struct FilledArena {
    Arena<Kernel, S, D> arena;

    template <class View>
    FilledArena(const S* numbers, const SparseGrid<S, D>& grid, const BlockPartition<D>& partition,
                const BlockGroup& group, const GroupPlaces<View>& places) {
        const BlocksAround<D> around(grid, partition, group);
        fill_arena(arena, numbers, around, group, places.template box<Kernel>(group));
    }
    /// Computes the weights and positions of the particles of one pack.
    /// \param slot  first slot of the pack, counted from the group's first slot
    template <class Pack, class View>
    FIRN_INLINE void locate(Pack& pack, const GroupPlaces<View>& places, std::size_t slot) const {
        using P = native_pack<S>;
        for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
            const std::size_t at = slot + std::size_t(lane);
            pack.locate(lane, places.template position<P>(at), places.template block_in_arena<Kernel, P>(at, arena.n),
                        arena.n);
        }
    }
};

/// The weights of the nodes around a register of particles along each axis, their derivatives, and those of the
/// gradients: of the kernel's own functions, by dual numbers.
template <class Kernel, bool gradients, class P, int D>
struct WeightSlopes {
    static constexpr int K = Kernel::support;
    P weight[D][K], slope[D][K];                                   // N, dN/dx [1/cell]
    P gradient[gradients ? D : 1][K], bend[gradients ? D : 1][K];  // ∂N, d∂N/dx [1/cell²]

    /// \param fraction  positions of the particles relative to their base nodes [cells]
    explicit WeightSlopes(const Vec<P, D>& fraction) {
        unroll<D>([&](auto a) FIRN_LAMBDA {
            const dual<P> at{fraction.v[a], P(1)};
            const auto w = Kernel::weights(at);
            unroll<K>([&](auto k) FIRN_LAMBDA { weight[a][k] = w[k].value, slope[a][k] = w[k].derivative; });
            if constexpr (gradients) {
                const auto g = Kernel::gradients(at);
                unroll<K>([&](auto k) FIRN_LAMBDA { gradient[a][k] = g[k].value, bend[a][k] = g[k].derivative; });
            }
        });
    }
};

/// Sums over the nodes around the particles of a register.
template <class P, int D>
struct SumsAround {
    G2PSums<P, D> of_nodes;  // of the first D numbers u_i of each node
    P fourth;                // Σ N_i U_i

    static SumsAround zero() { return {{Vec<P, D>::zero(), Mat<P, D>::zero(), Mat<P, D>::zero()}, P(0)}; }
};

/// Returns the derivative, with respect to the particles' positions [cells], of
///
///     Σ_i  u_i · (N_i (p + A o_i) + G ∇N_i)  +  m Σ_i N_i U_i
///
/// for a register of particles. u_i are the first D numbers of a node and U_i is the fourth; o_i is the node's offset
/// from the centre node. The record (p, A, G, m) and the nodes are held.
/// \param nodes    the arena;  \param corner  of each particle: the index of the first number of its base node
/// \param sums     a SumsAround receives the sums themselves; nullptr: nobody needs them
template <class Kernel, bool gradients, class P, int D, class Sums = std::nullptr_t>
[[gnu::noinline]] Vec<P, D> slope_of_sums(const P2GRecord<P, D>& record, const WeightSlopes<Kernel, gradients, P, D>& w,
                                          const value_type_t<P>* nodes, int n, const typename P::integer* corner,
                                          [[maybe_unused]] Sums sums = nullptr) {
    constexpr int K = Kernel::support, centre = centre_node<Kernel>;
    constexpr bool has_sums = !std::is_null_pointer_v<Sums>;
    Vec<P, D> total = Vec<P, D>::zero();
    if constexpr (has_sums) *sums = SumsAround<P, D>::zero();
    const value_type_t<P>* base[scalar_traits<P>::lanes];
    for (int l = 0; l < scalar_traits<P>::lanes; ++l) base[l] = nodes + corner[l];
    for (int i = 0; i < (D == 3 ? K : 1); ++i)
        for (int j = 0; j < K; ++j) {
            const int line = D == 3 ? i * K + j : j;
            const std::ptrdiff_t begin = line_begin<Kernel, D>(line, n);
            Vec<P, D> of_line = record.momentum;
            const auto move = [&](int axis, int o)
                                  FIRN_LAMBDA { of_line += record.affine.column(axis) * P(o - centre); };
            if constexpr (D == 3) move(0, i);
            move(D - 2, j);
            // Sums along the line: of s N, s dN, and of t_a = u · G_a times N, dN, and for the last axis ∂N and d∂N.
            P s_n = P(0), s_d = P(0);
            Vec<P, D> t_n = Vec<P, D>::zero(), t_d = t_n, t_g = t_n;  // t_g: of the last axis with its own gradient
            P t_b = P(0);
            // Sums of u times N, o N, and ∂N along the line; and of U N.
            Vec<P, D> u_n = t_n, u_o = t_n, u_g = t_n;
            P of_fourth = P(0);
            unroll<K>([&](auto k) FIRN_LAMBDA {
                P r[4];
                load_quads_at<P>([&](int l) FIRN_LAMBDA { return base[l] + (begin + k) * node_width; }, r);
                constexpr int o = k - centre;
                const Vec<P, D> at = plus_times(of_line, record.affine.column(D - 1), std::integral_constant<int, o>{});
                P s = record.mass * r[node_mass];
                unroll<D>([&](auto a) FIRN_LAMBDA { s = s + at.v[a] * r[a]; });
                s_n = s_n + s * w.weight[D - 1][k];
                s_d = s_d + s * w.slope[D - 1][k];
                if constexpr (has_sums) {
                    const P weight = w.weight[D - 1][k];
                    of_fourth = of_fourth + r[node_mass] * weight;
                    unroll<D>([&](auto a) FIRN_LAMBDA {
                        const P weighted = r[a] * weight;
                        u_n.v[a] = u_n.v[a] + weighted;
                        if constexpr (o != 0) u_o.v[a] = u_o.v[a] + weighted * P(o);
                        if constexpr (gradients) u_g.v[a] = u_g.v[a] + r[a] * w.gradient[D - 1][k];
                    });
                }
                if constexpr (gradients) {
                    unroll<D>([&](auto a) FIRN_LAMBDA {
                        P t = record.gradient(0, a) * r[0];
                        unroll<D - 1>([&](auto b) FIRN_LAMBDA { t = t + record.gradient(b + 1, a) * r[b + 1]; });
                        if constexpr (a == D - 1) {
                            t_g.v[a] = t_g.v[a] + t * w.gradient[D - 1][k];
                            t_b = t_b + t * w.bend[D - 1][k];
                        } else {
                            t_n.v[a] = t_n.v[a] + t * w.weight[D - 1][k];
                            t_d.v[a] = t_d.v[a] + t * w.slope[D - 1][k];
                        }
                    });
                }
            });
            // Products over the leading axes, of which one may have another factor than its weight.
            const int at[2] = {D == 3 ? i : j, j};
            const auto product = [&](const auto& factor) FIRN_LAMBDA {
                P all = factor(0);
                if constexpr (D == 3) all = all * factor(1);
                return all;
            };
            const auto with = [&](int axis, const P& other) FIRN_LAMBDA {
                return product([&](int a) FIRN_LAMBDA { return a == axis ? other : w.weight[a][at[a]]; });
            };
            const P plain_weight = with(-1, P(0));
            if constexpr (has_sums) {
                sums->fourth = sums->fourth + of_fourth * plain_weight;
                const Vec<P, D> weighted = u_n * plain_weight;
                sums->of_nodes.velocity += weighted;
                const auto add_moment = [&](int axis, const Vec<P, D>& column) FIRN_LAMBDA {
                    unroll<D>([&](auto a) FIRN_LAMBDA {
                        sums->of_nodes.moment(a, axis) = sums->of_nodes.moment(a, axis) + column.v[a];
                    });
                };
                add_moment(D - 1, u_o * plain_weight);
                if constexpr (D == 3) add_moment(0, weighted * P(i - centre));
                add_moment(D - 2, weighted * P(j - centre));
                if constexpr (gradients)
                    unroll<D>([&](auto a) FIRN_LAMBDA {
                        P& last = sums->of_nodes.gradient(a, D - 1);
                        last = last + u_g.v[a] * plain_weight;
                        unroll<D - 1>([&](auto b) FIRN_LAMBDA {
                            P& other = sums->of_nodes.gradient(a, b);
                            other = other + u_n.v[a] * with(b, w.gradient[b][at[b]]);
                        });
                    });
            }
            total.v[D - 1] = total.v[D - 1] + s_d * plain_weight;
            unroll<D - 1>([&](auto b) FIRN_LAMBDA { total.v[b] = total.v[b] + s_n * with(b, w.slope[b][at[b]]); });
            if constexpr (gradients) {
                total.v[D - 1] = total.v[D - 1] + t_b * plain_weight;
                unroll<D - 1>([&](auto a) FIRN_LAMBDA {
                    // G of the leading axis a moves along the last axis, along a itself, and along the other one.
                    const P own = w.gradient[a][at[a]];
                    total.v[D - 1] = total.v[D - 1] + t_d.v[a] * with(a, own);
                    total.v[a] = total.v[a] + t_n.v[a] * with(a, w.bend[a][at[a]]);
                    total.v[a] = total.v[a] + t_g.v[D - 1] * with(a, w.slope[a][at[a]]);
                    if constexpr (D == 3) {
                        constexpr int other = 1 - int(a);
                        total.v[other] = total.v[other] + t_n.v[a] * own * w.slope[other][at[other]];
                    }
                });
            }
        }
    return total;
}

/// Calls for_register(slots, slot, lane) for each register of a group, after for_pack(slot) for its pack. Slots are
/// counted from the group's first one, lanes from the pack's first one.
template <class P, class Places, class ForPack, class ForRegister>
FIRN_INLINE void for_registers(const Places& places, const BlockGroup& group, const ForPack& for_pack,
                               const ForRegister& for_register) {
    for (std::size_t slot = 0; slot < group.packs() * pack_size; slot += pack_size) {
        for_pack(slot);
        for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes)
            for_register(places.slots(slot + std::size_t(lane)), slot + std::size_t(lane), lane);
    }
}

}  // namespace firn::inline FIRN_BUILD::detail
