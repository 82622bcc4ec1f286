/// \file The nodes that a boundary holds, as linear constraints of an implicit step; where it acts with friction or
/// lets matter separate, they are found together with the forces by which it holds.
#pragma once

#include <firn/boundary/measured_from.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/aligned.hpp>
#include <firn/implicit/mirrored_nodes.hpp>
#include <firn/loops/grid_update.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// What a boundary leaves of a node's motion: v → P v + c, with a projection P and a velocity c. So it is for `stick`
/// (P = 0) and for `slip` without friction (P = I − n nᵀ). P and c are read from the boundary's own velocity().
///
/// Friction and separation are not linear: there P and c, and the force of friction along the surface, hold for one
/// velocity v and one force R of the boundary on the node. renew() finds them for the last ones, until nothing changes.
/// Then v = B(v − ρ R), with the boundary's velocity B() and any ρ > 0: Alart and Curnier 1991, "A mixed formulation
/// for frictional contact problems prone to Newton like solution methods", whose projections B() is.
template <std::floating_point S, int D>
class NodeConstraints {
public:
    /// Finds the constraints of all nodes of the grid. Where they are not linear, they are those of matter at rest.
    /// \param threads  number of threads; 0: thread_count() chooses
    /// \throws usage_error  if the boundary has mirrored walls
    template <class Boundary>
    NodeConstraints(const SparseGrid<S, D>& grid, const Boundary& boundary, int threads)
        : NodeConstraints(grid, boundary, MirroredNodes<S, D>{}, threads) {
        if constexpr (has_mirrors<Boundary>)
            boundary.mirrors([](auto&&...) {
                throw usage_error(
                    "The boundary has mirrored walls. Give NodeConstraints the MirroredNodes of what "
                    "mirrors_of<Kernel>(boundary, domain) returns, too.");
            });
    }
    /// As above, beside mirrored walls: nodes behind them are not held, as they follow others; and of a node on one,
    /// the boundary holds what the wall leaves free.
    template <class Boundary>
    NodeConstraints(const SparseGrid<S, D>& grid, const Boundary& boundary, MirroredNodes<S, D> mirrored, int threads)
        : mirrored_(std::move(mirrored)) {
        static_assert(detail::require_boundary<Boundary, S, D>());
        constexpr bool by_velocity =
            !acts_by_gap<Boundary> && changes_velocity<with_scalar_t<Boundary, double>, double, D>;
        static_assert(by_velocity,
                      "firn: an implicit step takes boundaries that change the velocity of a node whatever its mass: "
                      "no GapContact, and none with velocity(x, v, mass, dt).");
        check_boundary(boundary);
        const double h = grid.domain().cell_size;
        const auto here = on_grid(measured_from(boundary, grid.domain().lower), h);
        after_ = [lifted = lift<double>(here)](const Vec<double, D>& x, const Vec<double, D>& v) {
            return velocity_after(lifted, x, v, NoInertia{});
        };
        std::vector<std::vector<Constraint>> of_blocks(grid.block_count());
        parallel_for(
            grid.block_count(), thread_count(threads),
            [&](std::size_t b, int) {
                const detail::CornersOfBlock<D> corners(grid, b);
                if (!here.reaches(corners.low, corners.high)) return;
                for (int i = 0; i < block_nodes<D>; ++i) {
                    Vec<double, D> x = corners.low;
                    for (int a = 0; a < D; ++a) x[a] += h * place_in_block<D>(i, a);
                    find(x, std::uint32_t(b * std::size_t(block_nodes<D>)) + std::uint32_t(i), of_blocks[b]);
                }
            },
            16);
        for (const auto& of_block : of_blocks)
            for (const Constraint& one : of_block) {
                if (!one.is_linear) contacts_.push_back(all_.size());
                all_.push_back(one);
            }
    }

    const MirroredNodes<S, D>& mirrored() const { return mirrored_; }  ///< The nodes beside mirrored walls.
    std::size_t count() const { return all_.size(); }                  ///< Number of nodes that the boundary holds.

    /// Whether friction or separation acts at a node, so that constraints depend on the solution. \see renew
    bool are_nonlinear() const { return !contacts_.empty(); }

    /// Calls f(index of a node, P) for all nodes that the boundary holds, in the order of the nodes.
    template <class F>
    void for_held(const F& f) const {
        for (const Constraint& one : all_) f(std::size_t(one.node), one.P);
    }
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

    /// Returns the projection onto the translations that the present constraints and mirrored walls leave to all nodes
    /// with matter. \param masses  masses of all nodes [kg]
    Mat<double, D> free_translations(const aligned_vector<S>& masses) const {
        Mat<double, D> held = Mat<double, D>::zero();
        const auto hold = [&](std::size_t node, const Mat<S, D>& free) {
            if (!(masses[node] > S(0))) return;
            const Mat<double, D> taken = Mat<double, D>::identity() - cast<double>(free);
            held += transpose(taken) * taken;
        };
        mirrored_.for_on_walls(hold);
        for_held(hold);
        double largest = 0;
        for (int j = 0; j < D; ++j) largest = std::max(largest, held(j, j));
        std::array<Vec<double, D>, std::size_t(D)> columns;
        for (int j = 0; j < D; ++j)
            for (int i = 0; i < D; ++i) columns[std::size_t(j)][i] = held(i, j);
        // Normals of one flat wall differ by rounding, that of floats included.
        return Mat<double, D>::identity() - span_of(columns, largest > 0 ? 1e-10 * largest : 1);
    }

    /// Lets some nodes go where friction or separation acts: those that follow others, whose motion no force of their
    /// own decides. \param nodes  indices of the nodes, ascending
    void release(const std::vector<std::uint32_t>& nodes) {
        std::erase_if(contacts_, [&](std::size_t i) {
            Constraint& one = all_[i];
            const bool follows = std::ranges::binary_search(nodes, one.node);
            if (follows) one.P = Mat<S, D>::identity(), one.velocity = Vec<S, D>::zero();
            return follows;
        });
    }
    /// Finds the constraints at nodes with friction or separation, for the velocities that nodes would have without the
    /// boundary. \param velocities  those of all nodes [m/s]
    void begin(const S* velocities) {
        for (const std::size_t i : contacts_) set(all_[i], cast<double>(get(velocities, all_[i].node)), 0);
    }
    /// Holds the nodes that begin() lets slide, as if friction were as large as it takes: where little but other matter
    /// presses a node onto the boundary, begin() finds too little friction.
    void hold_sliding() {
        for (const std::size_t i : contacts_)
            if (trace(all_[i].P) < S(D - 0.5)) all_[i].P = Mat<S, D>::zero();
    }
    /// Finds these constraints for a displacement, and for the forces by which the boundary held the nodes with the
    /// constraints so far.
    /// \param u       the displacements of all nodes [m]
    /// \param forces  the forces of the boundary on all nodes [N], without friction
    /// \param blocks  the diagonal blocks of the Hessian [N/m]: by the stiffness of a node, ρ weighs forces against
    ///                velocities. \see hessian_diagonal
    /// \param dt      time of the step [s];  \param least  an error of the forces that may remain [N]
    /// \return  whether the boundary would exert other forces on nodes that move so, by more than `least`
    bool renew(const S* u, const S* forces, const aligned_vector<S>& blocks, double dt, double least) {
        double squared = 0;
        for (const std::size_t i : contacts_) {
            Constraint& one = all_[i];
            double stiffness = 0;
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                stiffness += double(blocks[one.node * std::size_t(D * D) + a * std::size_t(D + 1)]) / D;
            if (!(stiffness > 0)) continue;
            const double per_force = 1 / (stiffness * dt);
            const Vec<double, D> v = cast<double>(get(u, one.node)) * (1 / dt),
                                 R = cast<double>(get(forces, one.node) + one.friction);
            const Vec<double, D> error = (set(one, v - R * per_force, per_force) - v) * (1 / per_force);
            squared += dot(error, error);
        }
        return std::sqrt(squared) > least;
    }
    /// Adds the forces of friction to forces on all nodes [N].
    void add_friction(S* forces) const {
        for (const std::size_t i : contacts_) put(get(forces, all_[i].node) + all_[i].friction, forces, all_[i].node);
    }
    /// Lets the boundary push nodes on mirrored walls along its own normals: adds the components of its forces that the
    /// walls take up again.
    /// \param u       the displacements of all nodes [m];  \param masses  their masses [kg]
    /// \param forces  the forces of the boundary on all nodes [N], friction included
    /// \param of_mirrors  those of the mirrored walls [N]
    void push_mirrors(const S* u, const aligned_vector<S>& masses, double dt, S* forces, S* of_mirrors) const {
        for (const Constraint& one : all_) {
            const double mass = double(masses[one.node]);
            if (one.even == Vec<double, D>::filled(1) || !(mass > 0)) continue;
            const Vec<double, D> v = cast<double>(get(u, one.node)) * (1 / dt);
            const Vec<double, D> f = cast<double>(get(forces, one.node)) * (dt / mass);
            Vec<double, D> odd = Vec<double, D>::zero();
            for (int turn = 0; turn < most_turns; ++turn) {
                const Vec<double, D> error = after_(one.x, v - f - odd) - v, of_odd = error - product(one.even, error);
                odd += of_odd;
                if (dot(of_odd, of_odd) <= 1e-30 * dot(f, f)) break;
            }
            const Vec<S, D> more = cast<S>(odd * (mass / dt));
            put(get(forces, one.node) + more, forces, one.node);
            put(get(of_mirrors, one.node) - more, of_mirrors, one.node);
        }
    }

private:
    struct Constraint {
        std::uint32_t node;
        bool is_linear;
        Vec<double, D> x;  ///< from the domain's corner [m]
        Mat<S, D> P;
        Vec<S, D> velocity, friction;
        Vec<double, D> even;  ///< \see MirroredNodes::even
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

    /// Returns the velocity of a node after the boundary has acted. On a mirrored wall, both act in turn until nothing
    /// changes: so alternating projections find what both allow.
    /// \param even  the components that a mirrored wall leaves to the node
    Vec<double, D> after(const Vec<double, D>& x, const Vec<double, D>& even, const Vec<double, D>& v) const {
        Vec<double, D> w = after_(x, v);
        if (even == Vec<double, D>::filled(1)) return w;
        w = product(even, w);
        for (int turn = 1; turn < most_turns; ++turn) {
            const Vec<double, D> next = product(even, after_(x, w)), change = next - w;
            w = next;
            if (dot(change, change) <= 1e-30 * dot(w, w)) break;
        }
        return w;
    }
    static constexpr int most_turns = 1000;
    static Vec<double, D> product(const Vec<double, D>& even, Vec<double, D> v) {
        for (int a = 0; a < D; ++a) v[a] *= even[a];
        return v;
    }

    /// Probes the boundary with a few velocities of about 1 m/s.
    void find(const Vec<double, D>& x, std::uint32_t node, std::vector<Constraint>& found) const {
        if (mirrored_.follows(node)) return;
        const Vec<double, D> even = cast<double>(mirrored_.even(node));
        const Vec<double, D> c = after(x, even, Vec<double, D>::zero());
        Mat<double, D> P{};
        bool is_free = dot(c, c) == 0;
        for (int j = 0; j < D; ++j) {
            Vec<double, D> e = Vec<double, D>::zero();
            e[j] = 1;
            const Vec<double, D> column = after(x, even, e) - c;
            for (int i = 0; i < D; ++i) P(i, j) = column[i];
            is_free = is_free && column == product(even, e);
        }
        bool is_linear = true;
        for (int sign = -1; sign <= 1; sign += 2) {
            Vec<double, D> v{};
            for (int a = 0; a < D; ++a) v[a] = sign * (1 - 0.31 * a);
            const Vec<double, D> error = after(x, even, v) - (P * v + c);
            is_linear = is_linear && dot(error, error) <= 1e-20 * (1 + dot(c, c));
        }
        if (is_free && is_linear) return;
        found.push_back({node, is_linear, x, cast<S>(P), cast<S>(c), Vec<S, D>::zero(), even});
    }
    /// Sets what the boundary does to a node that would have the velocity v without it.
    /// \param per_force  the change of that velocity for a force of the boundary [m/(s N)]
    /// \return  the velocity after the boundary has acted [m/s]
    Vec<double, D> set(Constraint& one, const Vec<double, D>& v, double per_force) const {
        const Vec<double, D> w = after(one.x, one.even, v);
        const double size = std::max(norm(v), norm(w));
        Mat<double, D> P = Mat<double, D>::identity();
        Vec<double, D> friction = Vec<double, D>::zero();
        if (norm(w - v) > 1e-12 * size) {
            P = freedom(one, v, w, 1e-6 * size);
            if (per_force > 0) friction = P * (w - v) * (1 / per_force);
        }
        one.P = cast<S>(P);
        one.velocity = cast<S>(w - P * w);
        one.friction = cast<S>(friction);
        return w;
    }
    /// Returns the projection onto the directions in which the velocity after the boundary has acted changes with the
    /// velocity before. \param w  the velocity after it, for v;  \param small  a small speed [m/s]
    Mat<double, D> freedom(const Constraint& one, const Vec<double, D>& v, const Vec<double, D>& w,
                           double small) const {
        std::array<Vec<double, D>, std::size_t(D)> columns;
        for (int j = 0; j < D; ++j) {
            Vec<double, D> beside = v;
            beside[j] += small;
            columns[std::size_t(j)] = (after(one.x, one.even, beside) - w) * (1 / small);
        }
        return span_of(columns, 1e-3);
    }
    /// Returns the projection onto the span of some vectors. \param least  shorter ones count as zero
    static Mat<double, D> span_of(std::array<Vec<double, D>, std::size_t(D)> columns, double least) {
        Mat<double, D> P = Mat<double, D>::zero();
        for (int rank = 0; rank < D; ++rank) {  // Gram-Schmidt, the longest column first
            const auto longest = std::max_element(columns.begin(), columns.end(),
                                                  [](const auto& a, const auto& b) { return dot(a, a) < dot(b, b); });
            if (dot(*longest, *longest) < least * least) break;
            const Vec<double, D> e = *longest * (1 / norm(*longest));
            P += outer(e, e);
            for (auto& column : columns) column = column - e * dot(e, column);
        }
        return P;
    }

    MirroredNodes<S, D> mirrored_;
    std::function<Vec<double, D>(const Vec<double, D>&, const Vec<double, D>&)> after_;
    std::vector<std::size_t> contacts_;  // indices of the constraints that are not linear
    std::vector<Constraint> all_;
};

}  // namespace firn::inline FIRN_BUILD
