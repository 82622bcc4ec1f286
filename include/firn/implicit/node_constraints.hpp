/// \file The nodes that a boundary holds, as linear constraints of an implicit step.
#pragma once

#include <firn/boundary/measured_from.hpp>
#include <firn/core/parallel.hpp>
#include <firn/loops/grid_update.hpp>

#include <cstdint>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// What a boundary leaves of a node's motion: v → P v + c, with a projection P and a velocity c. So it is for `stick`
/// (P = 0) and for `slip` without friction (P = I − n nᵀ). P and c are read from the boundary's own velocity().
template <std::floating_point S, int D>
class NodeConstraints {
public:
    /// Finds the constraints of all nodes of the grid.
    /// \param threads  number of threads; 0: thread_count() chooses
    /// \throws usage_error  if the boundary does not act linearly at a node: with friction, or with separation; or if
    /// it
    ///                      has mirrored walls
    template <class Boundary>
    NodeConstraints(const SparseGrid<S, D>& grid, const Boundary& boundary, int threads) {
        static_assert(detail::require_boundary<Boundary, S, D>());
        constexpr bool by_velocity =
            !acts_by_gap<Boundary> && changes_velocity<with_scalar_t<Boundary, double>, double, D>;
        static_assert(by_velocity,
                      "firn: an implicit step takes boundaries that change the velocity of a node whatever its mass: "
                      "no GapContact, and none with velocity(x, v, mass, dt).");
        check_boundary(boundary);
        detail::refuse_mirrors(boundary);
        const double h = grid.domain().cell_size;
        const auto here = on_grid(measured_from(boundary, grid.domain().lower), h);
        const auto lifted = lift<double>(here);
        std::vector<std::vector<Constraint>> of_blocks(grid.block_count());
        parallel_for(
            grid.block_count(), thread_count(threads),
            [&](std::size_t b, int) {
                const detail::CornersOfBlock<D> corners(grid, b);
                if (!here.reaches(corners.low, corners.high)) return;
                for (int i = 0; i < block_nodes<D>; ++i) {
                    Vec<double, D> x = corners.low;
                    for (int a = 0; a < D; ++a) x[a] += h * place_in_block<D>(i, a);
                    find(lifted, x, std::uint32_t(b * std::size_t(block_nodes<D>)) + std::uint32_t(i), of_blocks[b]);
                }
            },
            16);
        for (const auto& of_block : of_blocks) all_.insert(all_.end(), of_block.begin(), of_block.end());
        for (const Constraint& one : all_)
            if (!one.is_linear) refuse(grid, one.node);
    }

    std::size_t count() const { return all_.size(); }  ///< Number of nodes that the boundary holds.

    /// Replaces the vectors v of constrained nodes by P v: what is free of a change of their displacements, or of the
    /// force on them. \param numbers  those of all nodes
    void project(S* numbers, int threads) const {
        for_each(threads, [&](const Constraint& one) { put(one.P * get(numbers, one.node), numbers, one.node); });
    }
    /// Replaces the displacements u of constrained nodes by P u + c dt. \param numbers  those of all nodes
    /// \param dt  time of the step [s]
    void impose(S* numbers, double dt, int threads) const {
        for_each(threads, [&](const Constraint& one) {
            put(one.P * get(numbers, one.node) + one.velocity * S(dt), numbers, one.node);
        });
    }

private:
    struct Constraint {
        std::uint32_t node;
        bool is_linear;
        Mat<S, D> P;
        Vec<S, D> velocity;
    };

    template <class F>
    void for_each(int threads, const F& f) const {
        parallel_for(all_.size(), thread_count(threads), [&](std::size_t i, int) { f(all_[i]); }, 256);
    }
    static Vec<S, D> get(const S* numbers, std::uint32_t node) {
        Vec<S, D> v{};
        for (int a = 0; a < D; ++a) v[a] = numbers[node * std::size_t(node_width) + std::size_t(a)];
        return v;
    }
    static void put(const Vec<S, D>& v, S* numbers, std::uint32_t node) {
        for (int a = 0; a < D; ++a) numbers[node * std::size_t(node_width) + std::size_t(a)] = v[a];
    }

    /// Probes the boundary with a few velocities of about 1 m/s.
    template <class Boundary>
    static void find(const Boundary& boundary, const Vec<double, D>& x, std::uint32_t node,
                     std::vector<Constraint>& found) {
        const auto after = [&](const Vec<double, D>& v) { return velocity_after(boundary, x, v, NoInertia{}); };
        const Vec<double, D> c = after(Vec<double, D>::zero());
        Mat<double, D> P{};
        bool is_free = dot(c, c) == 0;
        for (int j = 0; j < D; ++j) {
            Vec<double, D> e = Vec<double, D>::zero();
            e[j] = 1;
            const Vec<double, D> column = after(e) - c;
            for (int i = 0; i < D; ++i) P(i, j) = column[i];
            is_free = is_free && column == e;
        }
        bool is_linear = true;
        for (int sign = -1; sign <= 1; sign += 2) {
            Vec<double, D> v{};
            for (int a = 0; a < D; ++a) v[a] = sign * (1 - 0.31 * a);
            const Vec<double, D> error = after(v) - (P * v + c);
            is_linear = is_linear && dot(error, error) <= 1e-20 * (1 + dot(c, c));
        }
        if (!is_free || !is_linear) found.push_back({node, is_linear, cast<S>(P), cast<S>(c)});
    }
    [[noreturn, gnu::cold]] static void refuse(const SparseGrid<S, D>& grid, std::uint32_t node) {
        const std::size_t nodes = std::size_t(block_nodes<D>);
        const Vec<double, D> x = node_position(grid, node / nodes, int(node % nodes));
        std::string place = sentence(x[0]);
        for (int a = 1; a < D; ++a) place += sentence(", ", x[a]);
        throw usage_error(sentence("The boundary at the node (", place,
                                   ") m acts with friction or lets matter separate, which an implicit step does not "
                                   "solve for. Take Contact::stick, or Contact::slip with friction 0."));
    }

    std::vector<Constraint> all_;
};

}  // namespace firn::inline FIRN_BUILD
