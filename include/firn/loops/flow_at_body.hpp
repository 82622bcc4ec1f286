/// \file How matter that flows around a rigid body moves in the body's layer. \see RigidBody::in_flow
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>

#include <array>
#include <limits>
#include <optional>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// How the velocity of matter along a surface's normal goes on, from the surface to matter outside of its layer: by the
/// parabola through the velocity of the surface, and those of matter at two distances.
///
/// At the distance d of a node it has the value part × (velocity of the surface) + flow. It is 1 × (velocity of the
/// surface) where d = 0, so that matter on the surface moves with the surface, and nodes on both sides of it add up to
/// that: the quadratic spline, of which their velocities are the values, keeps linear functions.
struct FlowAtNode {
    double part = 1;  ///< [1]
    double flow = 0;  ///< [m/s]
};

/// Where the parabola meets the velocity of matter: beyond the layer [cells]. Nearer nodes share particles with nodes
/// on which the body acts.
inline constexpr double flow_begins = 0.75, flow_ends = 2.25;

/// Finds velocities of matter among the nodes of a grid.
template <std::floating_point S, int D>
class FlowAtBody {
public:
    explicit FlowAtBody(const SparseGrid<S, D>& grid) : grid_(grid) {}

    /// Returns the parabola's value at a node.
    /// \param b         block of the node, in whose contact group matter is looked for;  \param x  place of the node
    /// [m]
    /// \param distance  of the node from the surface [m];  \param normal  of the surface, into free space
    /// \param layer     [m]
    FlowAtNode at(std::size_t b, const Vec<double, D>& x, double distance, const Vec<double, D>& normal,
                  double layer) const {
        const double h = grid_.domain().cell_size, near = layer + flow_begins * h, far = layer + flow_ends * h;
        const auto seen = [&](double there) { return velocity(b, x + normal * (there - distance)); };
        const auto first = seen(near);
        if (!first) return {};
        const double v = dot(*first, normal);
        const auto second = seen(far);
        if (!second) return {1 - distance / near, distance / near * v};
        return {(1 - distance / near) * (1 - distance / far),
                distance * (far - distance) / (near * (far - near)) * v -
                    distance * (near - distance) / (far * (far - near)) * dot(*second, normal)};
    }

private:
    static constexpr double least_weight = 0.9;  ///< of nodes with matter

    /// Returns the velocity of matter at x [m/s], by the quadratic spline, if nodes around it have matter.
    std::optional<Vec<double, D>> velocity(std::size_t b, const Vec<double, D>& x) const {
        const Vec<double, D> from = (x - node_position(grid_, b, 0)) * (1 / grid_.domain().cell_size);
        std::array<int, std::size_t(D)> base{};
        std::array<std::array<double, 3>, std::size_t(D)> weights{};
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            const double first = base_node<QuadraticBSpline>(from[int(a)]);
            weights[a] = QuadraticBSpline::weights(from[int(a)] - first);
            base[a] = grid_.block(b)[a] * block_size + int(first);
        }
        constexpr int count = D == 2 ? 9 : 27;
        auto sum = Vec<double, D>::zero();
        double total = 0;
        for (int k = 0; k < count; ++k) {
            auto node = base;
            double weight = 1;
            for (std::size_t a = 0, rest = std::size_t(k); a < std::size_t(D); ++a, rest /= 3) {
                node[a] += int(rest % 3);
                weight *= weights[a][rest % 3];
            }
            const S* const numbers = grid_.find_node(node);
            if (!numbers || !(numbers[node_mass] >= std::numeric_limits<S>::min())) continue;
            total += weight;
            for (int a = 0; a < D; ++a) sum[a] += weight * double(numbers[a]);
        }
        if (!(total >= least_weight)) return {};
        return sum * (1 / total);
    }

    const SparseGrid<S, D>& grid_;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
