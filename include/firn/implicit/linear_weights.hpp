/// \file Weights that continue a linear function from some nodes to another one.
#pragma once

#include <firn/core/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Returns the weights w of some nodes with which Σ w u is the value at the origin of the linear function that fits
/// their values u best (least squares). Linear functions are continued exactly, so Σ w = 1 and Σ w x = 0. Returns no
/// weights if the nodes determine no linear function.
/// \param nodes  places of the nodes, in whole cells from the origin
template <int D>
std::vector<double> linear_weights(std::span<const std::array<int, std::size_t(D)>> nodes) {
    constexpr std::size_t N = std::size_t(D) + 1;
    // The normal equations, with places counted from the first node. All numbers are small integers, so elimination
    // without fractions (Bareiss 1968) tells exactly whether the nodes determine a linear function.
    if (nodes.size() < N) return {};
    const auto row_of = [&](const std::array<int, std::size_t(D)>& node) {
        std::array<std::int64_t, N> row{1};
        for (std::size_t a = 0; a < std::size_t(D); ++a) row[a + 1] = node[a] - nodes[0][a];
        return row;
    };
    std::array<std::array<std::int64_t, N + 1>, N> A{};
    for (const auto& node : nodes) {
        const auto row = row_of(node);
        for (std::size_t i = 0; i < N; ++i)
            for (std::size_t j = 0; j < N; ++j) A[i][j] += row[i] * row[j];
    }
    const auto target = row_of({});
    for (std::size_t i = 0; i < N; ++i) A[i][N] = target[i];
    std::int64_t last = 1;
    for (std::size_t k = 0; k < N; ++k) {  // the matrix is semidefinite: a zero on the diagonal means a lower rank
        if (A[k][k] == 0) return {};
        for (std::size_t i = k + 1; i < N; ++i)
            for (std::size_t j = N + 1; j-- > k;) A[i][j] = (A[i][j] * A[k][k] - A[i][k] * A[k][j]) / last;
        last = A[k][k];
    }
    std::array<double, N> c{};
    for (std::size_t i = N; i-- > 0;) {
        double rest = double(A[i][N]);
        for (std::size_t j = i + 1; j < N; ++j) rest -= double(A[i][j]) * c[j];
        c[i] = rest / double(A[i][i]);
    }
    std::vector<double> weights;
    for (const auto& node : nodes) {
        const auto row = row_of(node);
        double weight = 0;
        for (std::size_t i = 0; i < N; ++i) weight += double(row[i]) * c[i];
        weights.push_back(weight);
    }
    return weights;
}

}  // namespace firn::inline FIRN_BUILD
