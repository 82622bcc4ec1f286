/// \file What an implicit step minimises: the incremental potential, less the work of loads, plus inertia.
///
///     Φ(u) = Π(u) − Σ fᵢ · uᵢ + Σ mᵢ/(2 dt²) |uᵢ − ûᵢ|²
///
/// fᵢ are the loads on the nodes, mᵢ their masses, û the displacement without forces, dt v. Without inertia (dt = ∞)
/// a step is quasi-static. Matter without a potential has no Φ, only its gradient, the forces that are out of balance.
#pragma once

#include <firn/implicit/linear_system.hpp>

#include <optional>

namespace firn::inline FIRN_BUILD {

/// The inertia of the nodes in a step. Without it, a step is quasi-static.
template <std::floating_point S>
struct NodalInertia {
    aligned_vector<S> masses;  ///< mass of each node [kg], in the order of the nodes
    double dt = 1;             ///< time of the step [s]
    std::size_t free_motion;   ///< the layer with û [m], the displacement of the nodes without forces
    double size = 0;           ///< the measure of inertial forces [N], beside which a small gradient is none
};
/// Returns the masses of the nodes, which P2G has left in their present numbers.
template <std::floating_point S, int D>
aligned_vector<S> masses_of_nodes(const SparseGrid<S, D>& grid) {
    aligned_vector<S> masses(grid.block_count() * std::size_t(block_nodes<D>));
    for (std::size_t i = 0; i < masses.size(); ++i) masses[i] = grid.nodes(0)[i * node_width + node_mass];
    return masses;
}

/// The problem of one step: Φ, its gradient and its Hessian, on the unknowns of the step.
template <class Potential, std::floating_point S, int D>
class StepProblem : public LinearSystem<Potential, S, D> {
    using System = LinearSystem<Potential, S, D>;

public:
    using scalar_type = S;               ///< The scalar type: float or double.
    static constexpr int dimension = D;  ///< The dimension: 2 or 3.
    /// Whether all materials have a potential: then there is a Φ, and its Hessian is symmetric.
    static constexpr bool is_symmetric = Potential::is_symmetric;

    /// Makes the problem of a potential, with the small nodes and the constraints of its grid.
    /// \param loads    the layer with the loads on all nodes [N]
    /// \param inertia  the inertia of the nodes; nothing for a quasi-static step
    StepProblem(Potential& potential, const SmallNodes<S, D>& small, const NodeConstraints<S, D>& constraints,
                std::size_t loads, const std::optional<NodalInertia<S>>& inertia)
        : System(potential, small, constraints), potential_(potential), loads_(loads), inertia_(inertia) {}
    StepProblem(Potential&, const SmallNodes<S, D>&, const NodeConstraints<S, D>&, std::size_t,
                std::optional<NodalInertia<S>>&&) = delete;  ///< The inertia must exist as long as the problem.

    /// What a displacement of the nodes means: Φ [J] in place of Π; NaN if there is no Φ. \param u  the layer of the
    /// displacement
    DisplacementReport displace(std::size_t u) {
        DisplacementReport report = potential_.displace(u);
        if constexpr (is_symmetric) {
            report.energy -= this->vectors().dot(loads_, u);
            if (inertia_) report.energy += inertial_energy(u);
        }
        return report;
    }
    /// Sets the present numbers of the nodes to the gradient of Φ on the unknowns [N], at the displacement of the last
    /// displace(). \param u  the layer of that displacement
    /// \return  the largest one of the norms of all loads and of all forces of particles [N], held nodes included, and
    /// of
    ///          the measure of inertial forces: the measure of what is a small gradient
    double gradient(std::size_t u) {
        potential_.gradient();
        const auto vectors = this->vectors();
        const double size = std::max(std::sqrt(std::max(vectors.dot(0, 0), vectors.dot(loads_, loads_))),
                                     inertia_ ? inertia_->size : 0.0);
        vectors.add(0, -1, loads_);
        add_inertia(u, true);
        this->to_forces(0);
        return size;
    }
    /// Sets the present numbers of the nodes to the forces [N] by which a boundary holds them, at the displacement of
    /// the last displace(): what is out of balance on constrained nodes. Follows displace(), before any product.
    /// \param u  the layer of that displacement;  \param memory  a layer that is overwritten
    /// \param of_mirrors  a layer that gets the forces of mirrored walls [N]; 0: none gets them
    void reactions(std::size_t u, std::size_t memory, std::size_t of_mirrors = 0) {
        potential_.gradient();
        const auto vectors = this->vectors();
        vectors.add(0, -1, loads_);
        add_inertia(u, true);
        this->to_reactions(0, memory, of_mirrors);
    }
    /// Sets the present numbers of the nodes to the Hessian of Φ times a vector. The vector becomes a displacement.
    void multiply(std::size_t k) {
        this->to_displacement(k);
        potential_.product(k);
        add_inertia(k, false);
        this->to_forces(0);
    }
    /// Adds the inertia to the diagonal blocks of a Hessian. \see hessian_diagonal
    void add_diagonal(aligned_vector<S>& blocks) const {
        if (!inertia_) return;
        for (std::size_t i = 0; i < inertia_->masses.size(); ++i)
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                blocks[(i * std::size_t(D) + a) * std::size_t(D) + a] += inertia_->masses[i] * per_square();
    }
    const std::optional<NodalInertia<S>>& inertia() const { return inertia_; }  ///< The inertia of the nodes, if any.

private:
    S per_square() const { return S(1 / (inertia_->dt * inertia_->dt)); }

    /// Adds m/dt² (u − û), or m/dt² u, to the present numbers of the nodes.
    void add_inertia(std::size_t u, bool from_free) const {
        if (!inertia_) return;
        const auto vectors = this->vectors();
        S* const to = vectors.numbers(0);
        const S *const from = vectors.numbers(u), *const free = vectors.numbers(inertia_->free_motion);
        detail::for_chunks(inertia_->masses.size(), vectors.threads(), [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k)
                    to[k] += inertia_->masses[i] * per_square() * (from_free ? from[k] - free[k] : from[k]);
        });
    }
    double inertial_energy(std::size_t u) const {
        const auto vectors = this->vectors();
        const S *const from = vectors.numbers(u), *const free = vectors.numbers(inertia_->free_motion);
        std::vector<double> of_blocks(potential_.grid().block_count());
        parallel_for(
            of_blocks.size(), thread_count(vectors.threads()),
            [&](std::size_t b, int) {
                const std::size_t nodes = std::size_t(block_nodes<D>);
                for (std::size_t i = b * nodes; i < (b + 1) * nodes; ++i)
                    for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k) {
                        const double change = double(from[k]) - double(free[k]);
                        of_blocks[b] += 0.5 * double(inertia_->masses[i]) * double(per_square()) * change * change;
                    }
            },
            16);
        ExactSum sum;
        sum.add(of_blocks);
        return sum.value();
    }

    Potential& potential_;
    std::size_t loads_;
    const std::optional<NodalInertia<S>>& inertia_;
};
/// Takes the precision and the dimension from the potential.
template <class Kernel, class Force, std::floating_point S, int D, class... Sets>
StepProblem(IncrementalPotential<Kernel, Force, S, D, Sets...>&, const SmallNodes<S, D>&, const NodeConstraints<S, D>&,
            std::size_t, const std::optional<NodalInertia<S>>&)
    -> StepProblem<IncrementalPotential<Kernel, Force, S, D, Sets...>, S, D>;

}  // namespace firn::inline FIRN_BUILD
