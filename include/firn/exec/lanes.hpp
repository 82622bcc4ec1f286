/// \file A block of cells as the lane loops see it: where its arena of nodes begins, and where a particle lies in it.
#pragma once

#include <firn/data/particle_view.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/exec/row.hpp>
#include <firn/exec/transpose.hpp>
#include <firn/kernel/concept.hpp>

namespace firn {

/// Nodes along one axis that the particles of a block can touch until they are sorted again. Blocks of one colour lie
/// two blocks apart, so theirs never overlap.
template <class Kernel>
inline constexpr int arena_size = block_size + 2 * allowed_drift + Kernel::support - 1;

/// Rows of nodes of one block and its surroundings: contiguous, with compile-time strides.
template <class Kernel, std::floating_point S, int D>
struct Arena {
    static_assert(arena_size<Kernel> <= 2 * block_size, "firn: this kernel is too wide for blocks of four cells");
    static constexpr int n = arena_size<Kernel>;
    static constexpr int node_count = D == 2 ? n * n : n * n * n;

    alignas(64) S node[(node_count + 4) * node_width];  // rows of a whole register may reach over the end

    /// Calls f(number in the arena, numbers in the grid, nodes) for each run of nodes that are neighbours in both; the
    /// count of nodes is a compile-time constant: these are the loops through which the whole grid passes twice a step.
    template <class Grid, class F>
    FIRN_INLINE static void for_runs(Grid& grid, const std::uint32_t* neighbours, const F& f) {
        constexpr int before = block_size - allowed_drift;  // nodes of the first block that the arena leaves out
        constexpr int blocks = (before + n + block_size - 1) / block_size;
        constexpr int lines = node_count / n;
        for (int line = 0; line < lines; ++line) {
            int outer_block = 0, outer_node = 0;
            for (int a = 0, scale = lines; a < D - 1; ++a) {
                scale /= n;
                const int i = line / scale % n + before;
                outer_block = outer_block * 3 + i / block_size;
                outer_node = outer_node * block_size + i % block_size;
            }
            unroll<blocks>([&](auto b) FIRN_LAMBDA {
                constexpr int first = b == 0 ? before : 0;
                constexpr int last = b == blocks - 1 ? before + n - b * block_size : block_size;
                auto* nodes =
                    grid.nodes(neighbours[outer_block * 3 + b]) + (outer_node * block_size + first) * node_width;
                f((line * n + b * block_size + first - before) * node_width, nodes,
                  std::integral_constant<int, last - first>{});
            });
        }
    }
};

/// What is the same for all particles of a block.
template <std::floating_point S, int D>
struct BlockFrame {
    Vec<S, D> lower;  ///< of the domain [m]
    S per_cell;       ///< 1/h [1/m]
    Vec<S, D> first;  ///< index of the arena's first node

    BlockFrame(const Domain<D>& domain, const BlockCoordinate<D>& block) : per_cell(S(1 / domain.cell_size)) {
        for (int a = 0; a < D; ++a) {
            lower[a] = S(domain.lower[a]);
            first[a] = S(block[std::size_t(a)] * block_size - allowed_drift);
        }
    }
};

/// A particle's place: its base node in the arena, and the fractional position.
template <class P, int D>
struct Place {
    Vec<P, D> node;      ///< base node, counted from the arena's first [0, block_size − 1 + 2 drift]
    Vec<P, D> fraction;  ///< f = x/h − base, in cells
};

template <class Kernel, class P, int D>
FIRN_INLINE Place<P, D> locate(const Vec<P, D>& position, const BlockFrame<value_type_t<P>, D>& frame) {
    constexpr int last = block_size - 1 + 2 * allowed_drift;
    Place<P, D> place;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const P x = (position.v[a] - P(frame.lower.v[a])) * P(frame.per_cell);
        const P node = base_node<Kernel>(x) - P(frame.first.v[a]);
        // Bounded even if a position were not a number: memory outside the arena is never touched.
        place.node.v[a] = select(node > P(0), select(node < P(last), node, P(last)), P(0));
        place.fraction.v[a] = x - (place.node.v[a] + P(frame.first.v[a]));
    });
    return place;
}

/// Which particles lie beyond the reach of their block.
template <class Kernel, class P, int D>
FIRN_INLINE mask_t<P> strays(const Vec<P, D>& position, const BlockFrame<value_type_t<P>, D>& frame) {
    mask_t<P> stray = P(1) < P(0);
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const P node =
            base_node<Kernel>((position.v[a] - P(frame.lower.v[a])) * P(frame.per_cell)) - P(frame.first.v[a]);
        stray = stray | (node < P(0)) | (node > P(block_size - 1 + 2 * allowed_drift));
    });
    return stray;
}

/// The fractional position becomes the distance from the centre node.
template <class Kernel, class P, int D>
FIRN_INLINE Vec<P, D> from_centre(const Vec<P, D>& fraction) {
    return fraction - Vec<P, D>::filled(P(centre_node<Kernel>));
}

/// Weights of sixteen particles, laid out for the row kernels: a number an axis and node for the leading axes,
/// a quad of the nodes' weights for the last axis.
template <class Kernel, std::floating_point S, int D, bool Gradients>
struct PackWeights {
    static constexpr int K = Kernel::support;
    using P = native_pack<S>;
    using Index = typename P::integer;

    alignas(64) S leading[D - 1][K][pack_size];
    alignas(64) S leading_gradient[Gradients ? D - 1 : 1][K][pack_size];
    alignas(64) S last[pack_size * 4];
    alignas(64) S last_gradient[Gradients ? pack_size * 4 : 4];
    alignas(64) Index corner[pack_size];  ///< the base node's first number in the arena

    FIRN_INLINE void fill(int lane, const Place<P, D>& place) {
        constexpr int n = arena_size<Kernel>;
        P corner_node = place.node.v[0];
        unroll<D - 1>([&](auto a) FIRN_LAMBDA { corner_node = corner_node * P(n) + place.node.v[a + 1]; });
        const typename P::mask_vector index =
            __builtin_convertvector((corner_node * P(node_width)).lanes, typename P::mask_vector);
        std::memcpy(corner + lane, &index, sizeof index);
        unroll<D>([&](auto a) FIRN_LAMBDA {
            put(a, Kernel::weights(place.fraction.v[a]), lane, leading[a < D - 1 ? int(a) : 0], last);
            if constexpr (Gradients)
                put(a, Kernel::gradients(place.fraction.v[a]), lane, leading_gradient[a < D - 1 ? int(a) : 0],
                    last_gradient);
        });
    }

    /// Weight of the particle in lane l at node k of leading axis a, …
    FIRN_INLINE std::array<S, std::size_t(K)> leading_weights(int a, int l) const { return pick(leading[a], l); }
    FIRN_INLINE std::array<S, std::size_t(K)> leading_gradients(int a, int l) const {
        if constexpr (Gradients)
            return pick(leading_gradient[a], l);
        else
            return {};
    }

private:
    template <class A>
    FIRN_INLINE static void put(A axis, const std::array<P, std::size_t(K)>& values, int lane, S (&lead)[K][pack_size],
                                S* quads) {
        if constexpr (axis < D - 1) {
            unroll<K>([&](auto k) FIRN_LAMBDA { values[k].store(lead[k] + lane); });
        } else {
            P r[4] = {P(0), P(0), P(0), P(0)};
            unroll<K>([&](auto k) FIRN_LAMBDA { r[k] = values[k]; });
            store_quads(r, quads + lane * 4);
        }
    }
    FIRN_INLINE static std::array<S, std::size_t(K)> pick(const S (&table)[K][pack_size], int l) {
        std::array<S, std::size_t(K)> r;
        unroll<K>([&](auto k) FIRN_LAMBDA { r[k] = table[k][l]; });
        return r;
    }
};

/// Where lane l (of sixteen) of a pack has its quad, in numbers.
template <class P>
FIRN_INLINE constexpr int quad_offset(int l) {
    constexpr int lanes = scalar_traits<P>::lanes;
    return (l / lanes * lanes + quad_of_lane<P>(l % lanes)) * 4;
}

}  // namespace firn
