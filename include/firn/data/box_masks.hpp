/// \file Sets of the nodes of a block that are boxes, as bits of an integer.
#pragma once

#include <firn/data/block_partition.hpp>

#include <array>
#include <cstdint>

namespace firn::inline FIRN_BUILD::detail {

/// Sets of nodes of a block that are boxes, as masks: bit i of a mask stands for node i of the block.
template <int D>
class BoxMasks {
public:
    /// Returns the mask of the nodes whose index along each axis a is in the set sets[a]: bit i of a set stands for
    /// index i, from 0 to block_size − 1.
    static constexpr std::uint64_t mask(const unsigned (&sets)[D]) {
        std::uint64_t mask = ~std::uint64_t(0);
        for (int a = 0; a < D; ++a) mask &= along(a, sets[a]);
        return mask;
    }
    /// Returns the mask of the nodes whose index along an axis is in a set.
    static constexpr std::uint64_t along(int axis, unsigned set) { return masks[std::size_t(axis)][set]; }

private:
    static constexpr auto masks = [] {
        std::array<std::array<std::uint64_t, 16>, std::size_t(D)> all{};
        for (int a = 0; a < D; ++a)
            for (unsigned set = 0; set < 16; ++set)
                for (int node = 0; node < block_nodes<D>; ++node)
                    if (set >> place_in_block<D>(node, a) & 1) all[std::size_t(a)][set] |= std::uint64_t(1) << node;
        return all;
    }();
};

}  // namespace firn::inline FIRN_BUILD::detail
