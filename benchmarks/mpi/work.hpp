/// \file Measures what a rank does with pieces of shared blocks, besides sending them: clear, pack, unpack and add.
#pragma once

#include <firn/data/aligned.hpp>
#include <firn/data/random.hpp>

#include "messages.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>

namespace geometry {

/// Nanoseconds of the work on pieces.
struct WorkOnPieces {
    double clear = 0;  ///< to set all nodes of one piece to zero
    double pack = 0;   ///< to move one node of a piece into a message
    double add = 0;    ///< to add one node of a message to a node
    double place = 0;  ///< to move one node of a returned message to its place
};

/// Measures the work on as many pieces of 4³ nodes as a rank with 10⁶ particles has. Their masks are boxes of one to
/// three nodes along each axis.
inline WorkOnPieces measure_work() {
    constexpr std::size_t count = 13'000, numbers = 64 * firn::node_width, turns = 15;
    firn::aligned_vector<float> pieces(count * numbers, 1.f), message(count * numbers);
    std::vector<std::uint64_t> masks(count);
    firn::RandomSequence random(1);
    std::size_t nodes = 0;
    for (std::uint64_t& mask : masks) {
        detail::Box<3> box{};
        for (std::size_t a = 0; a < 3; ++a) {
            const int n = 1 + int(random.below(3));  // the first one or two nodes of a block, or its last
            box.first[a] = n == 3 ? block_size - 1 : 0;
            box.last[a] = n == 3 ? block_size - 1 : n - 1;
        }
        mask = box.mask({0, 0, 0});
        nodes += std::size_t(std::popcount(mask));
    }
    /// Calls f(node of a piece, node of the message) for all nodes that are sent.
    const auto for_nodes = [&](const auto& f) {
        float* at = message.data();
        for (std::size_t p = 0; p < count; ++p)
            for (std::uint64_t rest = masks[p]; rest != 0; rest &= rest - 1, at += firn::node_width)
                f(pieces.data() + p * numbers + std::size_t(std::countr_zero(rest)) * firn::node_width, at);
    };
    const auto least = [&](std::size_t each, const auto& f) {
        double nanoseconds = 1e300;
        for (std::size_t k = 0; k < turns; ++k) {
            const auto begin = std::chrono::steady_clock::now();
            f();
            const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - begin;
            nanoseconds = std::min(nanoseconds, time.count() / double(each));
        }
        return nanoseconds;
    };
    constexpr std::size_t node = firn::node_width * sizeof(float);
    WorkOnPieces work;
    work.pack = least(nodes, [&] { for_nodes([](const float* from, float* to) { std::memcpy(to, from, node); }); });
    work.place = least(nodes, [&] { for_nodes([](float* to, const float* from) { std::memcpy(to, from, node); }); });
    work.add = least(nodes, [&] {
        for_nodes([](float* to, const float* from) {
            for (int k = 0; k < firn::node_width; ++k) to[k] += from[k];
        });
    });
    work.clear = least(count, [&] {
        for (std::size_t p = 0; p < count; ++p) {
            std::memset(pieces.data() + p * numbers, 0, numbers * sizeof(float));
            asm volatile("" : : "r"(pieces.data()) : "memory");
        }
    });
    return work;
}

}  // namespace geometry
