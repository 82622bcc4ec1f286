/// \file One implicit step of a block of particles, and what is out of balance after it by definition.
#pragma once

#include "support/implicit.hpp"
#include <firn/implicit/newton.hpp>

#include <optional>
#include <utility>

namespace implicit_steps {

/// What holds a block: nothing; a floor and a wall beside it; a floor and walls on all sides. Walls are smooth.
enum class Floor { none, stick, trough };

/// One implicit step of a block.
template <class Scene>
struct Step {
    static constexpr int D = Scene::D;
    using S = typename Scene::S;
    static constexpr std::size_t u = 3, loads = 4, free_motion = 5;
    NewtonLayers layers{u, {6, 7, 8, 9}, 10, 11};

    Scene& block;
    int threads;
    Numbers masses, weights, free = Numbers::Zero(block.size());
    std::optional<SmallNodes<S, D>> small;
    std::optional<NodeConstraints<S, D>> constraints;
    std::optional<NodalInertia<S>> inertia;

    Step(Scene& of, double gravity, Floor floor = Floor::stick, int workers = 1) : block(of), threads(workers) {
        const auto set = firn::detail::motion_of_set(block.set());
        const std::array sets{set};
        using View = std::remove_cvref_t<decltype(set.view)>;
        p2g<typename Scene::Kernel, Pic, NoForce>(Coloured{threads}, block.grid, 0, ParticleSets<View>(sets));
        const aligned_vector<S> of_nodes = masses_of_nodes(block.grid);
        masses = weights = Numbers::Zero(block.size());
        for (int i = 0; i < block.size(); ++i) {
            masses[i] = double(of_nodes[block.offsets[std::size_t(i / D)] / node_width]);
            if (i % D == 1) weights[i] = -gravity * masses[i];
        }
        small.emplace(block.small_nodes(threads));
        auto upper = Vec<double, D>::filled(4.4);
        if (floor == Floor::trough)
            for (int a = 0; a < D; ++a)
                if (a != 1) upper[a] = of.domain.lower[a] + of.domain.cell_size * (last_node(a) - 1.2);
        auto walls =
            Walls<S, D>::all(Vec<double, D>::filled(floor == Floor::none ? -0.2 : 0.32), upper, {Contact::slip, 0});
        if (floor != Floor::none) walls.at_lower[1].contact = Contact::stick;
        constraints.emplace(block.grid, walls, threads);
    }
    /// The last node along an axis that particles reach.
    int last_node(int axis) const {
        int last = 0;
        for (const auto& [index, number] : block.nodes) last = std::max(last, index[std::size_t(axis)]);
        return last;
    }
    /// Backward Euler of dt, from the velocity v.
    void set_inertia(double dt, const Vec<double, D>& v) {
        NodalInertia<S> one{aligned_vector<S>(block.grid.block_count() * std::size_t(block_nodes<D>), S(0)), dt,
                            free_motion};
        for (int i = 0; i < block.size(); ++i) {
            one.masses[block.offsets[std::size_t(i / D)] / node_width] = S(masses[i]);
            free[i] = dt * v[i % D];
        }
        inertia = one;
    }
    auto solve(const NewtonLimits& limits) { return solve(limits, block.potential(threads)); }
    /// \param potential  in place of the block's
    template <class Potential>
    auto solve(const NewtonLimits& limits, Potential potential) {
        StepProblem problem(potential, *small, *constraints, loads, inertia);
        const auto vectors = problem.vectors();
        for (const std::size_t k : {u, loads, free_motion}) vectors.make(k);
        block.put(weights, loads);
        block.put(free, free_motion);
        block.put(free, u);
        problem.to_displacement(u);
        NewtonReport report = newton(problem, layers, limits);
        vectors.copy(0, u);
        return std::pair{block.get(), report};
    }
    /// The displacement that follows from number i of the nodes, at 1.
    Numbers allowed(int i) {
        auto potential = block.potential();
        LinearSystem system(potential, *small, *constraints);
        system.vectors().fill(0, 0);
        block.grid.nodes(0)[block.offsets[std::size_t(i / D)] + std::size_t(i % D)] = 1;
        system.to_displacement(0);
        return block.get();
    }
    /// What is out of balance at u, in parts of the loads: forces on all nodes, weighted by all displacements that the
    /// unknowns allow.
    double imbalance(const Numbers& at) { return imbalance(at, block.gradient(at)); }
    /// \param gradient  of the potential, at u
    double imbalance(const Numbers& at, const Numbers& gradient) { return works(at, gradient).norm() / weights.norm(); }
    /// The position of the node that is worst out of balance at u.
    std::vector<double> worst(const Numbers& at) {
        const Numbers of_numbers = works(at, block.gradient(at));
        double largest = 0;
        std::vector<double> position(D);
        for (const auto& [index, number] : block.nodes) {
            const double here = of_numbers.segment<D>(D * number).norm();
            if (here <= largest) continue;
            largest = here;
            for (int a = 0; a < D; ++a)
                position[std::size_t(a)] = block.domain.lower[a] + block.domain.cell_size * index[std::size_t(a)];
        }
        return position;
    }

private:
    Numbers works(const Numbers& at, const Numbers& gradient) {
        Numbers rest = gradient - weights, all(block.size());
        if (inertia) rest += masses.cwiseProduct(at - free) / (inertia->dt * inertia->dt);
        for (int i = 0; i < block.size(); ++i) all[i] = allowed(i).dot(rest);
        return all;
    }
};

}  // namespace implicit_steps
