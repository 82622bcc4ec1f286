/// \file The linear system of a Newton step: the Hessian of an incremental potential, with small nodes that follow
/// large ones, nodes that a boundary holds and nodes behind mirrored walls; and conjugate gradients that solve it.
///
/// With the projection W of constrained nodes, the extension M behind mirrored walls and the extension E to small
/// nodes, the displacements of all nodes are Q x with Q = M W E M W, and the system is Qᵀ K Q x = Qᵀ b. Q Q is Q.
/// Displacements in a layer have all nodes set that follow others; forces have zeros there. So the scalar product of a
/// displacement and a force is that of the unknowns alone. Large nodes behind a wall are set before small nodes follow
/// them, so that half of a body at a plane of symmetry moves as half of the whole one.
#pragma once

#include <firn/implicit/node_constraints.hpp>
#include <firn/implicit/node_vectors.hpp>
#include <firn/implicit/potential.hpp>
#include <firn/implicit/small_nodes.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

/// The Hessian of a potential at its last displacement, on the unknowns of a step. What it refers to must exist as long
/// as it.
template <class Potential, std::floating_point S, int D>
class LinearSystem {
public:
    /// Makes the system of a potential, with the small nodes and the constraints of its grid.
    LinearSystem(Potential& potential, const SmallNodes<S, D>& small, const NodeConstraints<S, D>& constraints)
        : potential_(potential), small_(small), constraints_(constraints) {}

    /// The vectors of the system's nodes.
    NodeVectors<S, D> vectors() const { return {potential_.grid(), potential_.threads()}; }
    Potential& potential() const { return potential_; }                        ///< The potential of the particles.
    const SmallNodes<S, D>& small_nodes() const { return small_; }             ///< The nodes that follow others.
    const NodeConstraints<S, D>& constraints() const { return constraints_; }  ///< The nodes that a boundary holds.
    /// Turns a vector into a displacement: nodes that follow others do so, and constrained nodes keep their free part
    /// alone.
    void to_displacement(std::size_t k) const {
        S* const numbers = vectors().numbers(k);
        constraints_.project(numbers, potential_.threads());
        constraints_.mirrored().extend(numbers, potential_.threads());
        small_.extend(numbers, potential_.threads());
        constraints_.project(numbers, potential_.threads());
        constraints_.mirrored().extend(numbers, potential_.threads());
    }
    /// Turns forces on all nodes into those on the unknowns.
    void to_forces(std::size_t k) const {
        S* const numbers = vectors().numbers(k);
        constraints_.mirrored().fold(numbers, potential_.threads());
        constraints_.project(numbers, potential_.threads());
        small_.fold(numbers, potential_.threads());
        constraints_.mirrored().fold(numbers, potential_.threads());
        constraints_.project(numbers, potential_.threads());
    }
    /// Turns forces on all nodes into those by which constrained ones are held alone: what to_forces() drops.
    /// \param memory      a vector that is overwritten
    /// \param of_mirrors  a vector that gets the forces of mirrored walls, which are not among those; 0: none gets them
    void to_reactions(std::size_t k, std::size_t memory, std::size_t of_mirrors = 0) const {
        const NodeVectors<S, D> all = vectors();
        const int threads = potential_.threads();
        S* const numbers = all.numbers(k);
        // Each constraint in turn holds what it takes away: the difference before and after it.
        const auto mirror = [&] {
            if (of_mirrors != 0) all.add(of_mirrors, 1, k);
            constraints_.mirrored().fold(numbers, threads);
            if (of_mirrors != 0) all.add(of_mirrors, -1, k);
        };
        const auto hold = [&] {
            all.add(memory, 1, k);
            constraints_.project(numbers, threads);
            all.add(memory, -1, k);
        };
        all.fill(memory, S(0));
        if (of_mirrors != 0) all.fill(of_mirrors, S(0));
        mirror();
        hold();
        small_.fold(numbers, threads);
        mirror();
        hold();
        all.copy(k, memory);
    }
    /// Sets the present numbers of the nodes to the system's matrix times a vector. The vector becomes a displacement.
    void multiply(std::size_t k) {
        to_displacement(k);
        potential_.product(k);
        to_forces(0);
    }

private:
    Potential& potential_;
    const SmallNodes<S, D>& small_;
    const NodeConstraints<S, D>& constraints_;
};
/// Takes the precision and the dimension from the potential.
template <class Kernel, class Force, std::floating_point S, int D, class... Sets>
LinearSystem(IncrementalPotential<Kernel, Force, S, D, Sets...>&, const SmallNodes<S, D>&, const NodeConstraints<S, D>&)
    -> LinearSystem<IncrementalPotential<Kernel, Force, S, D, Sets...>, S, D>;

/// Which layers conjugate_gradients() uses. All differ, and none is 0.
struct SolverLayers {
    std::size_t solution,  ///< Gets the solution, a displacement.
        residual,          ///< Holds the right-hand side, forces on the unknowns; then what is left of it.
        direction,         ///< Memory for the direction of search.
        preconditioned;    ///< Memory for the preconditioned residual.
};
/// When conjugate_gradients() stops.
struct SolverLimits {
    double tolerance = 1e-8;  ///< Largest residual, as a part of the right-hand side [1].
    int iterations = 10'000;  ///< Largest number of iterations.
};
/// How conjugate_gradients() has ended.
struct SolverReport {
    int iterations = 0;               ///< Number of products with the matrix.
    double residual = 0;              ///< Norm of the residual, as a part of that of the right-hand side [1].
    bool has_converged = false;       ///< Whether the residual is small enough.
    bool has_found_negative = false;  ///< Whether the matrix is not positive definite along the last direction.
};

/// Solves a linear system by conjugate gradients. They stop at a direction of negative curvature, as Steihaug's do: the
/// solution is then the one before that direction, or, at the first iteration, zero, and the direction is kept in its
/// layer. The results have the same bits for any number of threads.
/// \param precondition  precondition(z, r) sets the vector in layer z to that of layer r, preconditioned
template <class System, class Precondition>
SolverReport conjugate_gradients(System& system, const Precondition& precondition, const SolverLayers& layers,
                                 const SolverLimits& limits) {
    const auto vectors = system.vectors();
    const auto [x, r, p, z] = layers;
    vectors.make(x);
    vectors.make(p);
    vectors.make(z);
    SolverReport report;
    const double begin = std::sqrt(vectors.dot(r, r));
    if (begin == 0) {
        report.has_converged = true;
        return report;
    }
    const auto preconditioned = [&] {
        precondition(z, r);  // it becomes a displacement as part of the next direction
        return vectors.dot(r, z);
    };
    double rz = preconditioned();
    vectors.copy(p, z);
    report.residual = 1;
    while (report.iterations < limits.iterations) {
        system.multiply(p);
        ++report.iterations;
        const double curvature = vectors.dot(p, 0);
        if (!(curvature > 0)) {
            report.has_found_negative = true;
            return report;
        }
        const double step = rz / curvature;
        vectors.add(x, step, p);
        vectors.add(r, -step, 0);
        report.residual = std::sqrt(vectors.dot(r, r)) / begin;
        if (report.residual <= limits.tolerance) {
            report.has_converged = true;
            return report;
        }
        const double before = rz;
        rz = preconditioned();
        vectors.scale_and_add(p, rz / before, z);
    }
    return report;
}

}  // namespace firn::inline FIRN_BUILD
