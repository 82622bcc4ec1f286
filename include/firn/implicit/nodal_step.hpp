/// \file One implicit or quasi-static step of the nodes of a grid.
#pragma once

#include <firn/implicit/integration.hpp>
#include <firn/loops/layers.hpp>
#include <firn/simulation/pass.hpp>

#include <optional>
#include <string>

namespace firn::inline FIRN_BUILD {

/// Layers of the grid in an implicit step. Those below belong to transfers.
namespace layer {
inline constexpr std::size_t displacement = 4;            ///< The displacement of the nodes [m].
inline constexpr std::size_t loads = 5;                   ///< The forces of loads and, without inertia, of gravity [N].
inline constexpr std::size_t free_motion = 6;             ///< The displacement of the nodes without forces [m].
inline constexpr std::size_t momenta = 7;                 ///< The momenta and masses that P2G has left.
inline constexpr std::size_t of_loads = 8;                ///< The forces of loads alone [N].
inline constexpr std::size_t trial = 9;                   ///< The displacement of a line search.
inline constexpr SolverLayers of_solver{10, 11, 12, 13};  ///< Those of the linear solves.
inline constexpr std::size_t pushed = 14;                 ///< All loads, the friction of the boundary included [N].
inline constexpr std::size_t first_free = 15;             ///< The first of those that a preconditioner may use.
}  // namespace layer

namespace detail {

/// The nodes of a grid in one step: what does not change while shorter and shorter steps are tried.
template <class Time, class Kernel, std::floating_point S, int D>
class NodalStep {
public:
    /// Begins a step. P2G has left masses and momenta in the present numbers of the nodes, and the forces of loads are
    /// in layer::of_loads.
    /// \param sets  what P2G sees of the particles
    template <class Boundary, class View>
    NodalStep(SparseGrid<S, D>& grid, int threads, const Time& rule, const Boundary& boundary, ParticleSets<View> sets)
        : vectors_(grid, threads), rule_(rule) {
        masses_ = masses_of_nodes(grid);
        vectors_.make(layer::momenta);
        vectors_.copy(layer::momenta, 0);
        scatter_volumes<Kernel>(grid, threads, sets);
        small_.emplace(grid, rule.small_nodes, threads);
        constraints_.emplace(grid, boundary, threads);
        constraints_->release(small_->nodes());
        if constexpr (Time::has_inertia) inertia_ = NodalInertia<S>{masses_, 1, layer::free_motion};
    }

    /// Calls attempt(dt), which calls solve(), for dt, dt/2, … until Newton's method converges and no node moves too
    /// far.
    /// \param dt  time of the step [s]
    template <class Attempt>
    StepSolution take(double dt, const Attempt& attempt) {
        solution_ = {};
        solution_.small_nodes = small_->count();
        for (;; dt /= 2, ++solution_.halvings) {
            attempt(dt);
            solution_.largest_motion =
                largest_motion(vectors_, layer::displacement) / vectors_.grid().domain().cell_size;
            solution_.has_converged = solution_.newton.has_converged && solution_.has_settled &&
                                      solution_.largest_motion <= rule_.largest_motion;
            if (solution_.has_converged || solution_.halvings == rule_.most_halvings) return solution_;
        }
    }

    /// Solves a step of the potential's dt. Leaves the displacement in layer::displacement.
    /// \param part    the part of the load step that it takes [1]
    /// \param update  update() turns the momenta in the present numbers of the nodes into velocities without forces
    template <class Potential, class Update>
    void solve(Potential& potential, double part, const Update& update) {
        vectors_.copy(0, layer::momenta);
        update();
        const double dt = potential.dt();
        for (const std::size_t k : {layer::loads, layer::free_motion, layer::displacement, layer::trial})
            vectors_.make(k);
        vectors_.add(layer::loads, 1, layer::of_loads);
        if constexpr (Time::has_inertia) {
            vectors_.add_vectors(layer::free_motion, dt, 0);
            vectors_.copy(layer::displacement, layer::free_motion);
            inertia_->dt = dt;
            inertia_->size = inertial_size(dt);
        } else {
            weigh(S(1 / dt));
            vectors_.add_vectors(layer::loads, 1, 0);
            if (part < 1 && potential.displace(layer::trial).is_regular()) {
                potential.gradient();
                vectors_.scale_and_add(layer::trial, 0, layer::loads);
                vectors_.fill(layer::loads, S(0));
                vectors_.add(layer::loads, part, layer::trial);
                vectors_.add(layer::loads, 1 - part, 0);
            }
        }
        vectors_.make(layer::pushed);
        begin_contact(dt);
        for (solution_.rounds = 1;; ++solution_.rounds) {
            vectors_.copy(layer::pushed, layer::loads);
            constraints_->add_friction(vectors_.numbers(layer::pushed));
            impose(dt);
            StepProblem problem(potential, *small_, *constraints_, layer::pushed, inertia_);
            solution_.newton =
                newton(problem, {layer::displacement, layer::of_solver, layer::trial}, rule_.newton, preconditioner_);
            solution_.newton_steps += solution_.newton.steps();
            solution_.products += solution_.newton.products;
            solution_.has_settled = !constraints_->are_nonlinear();
            if (!solution_.newton.has_converged || solution_.has_settled) return;
            // Friction and separation: constraints follow from the forces that they take, until nothing changes.
            problem.displace(layer::displacement);
            const double size = problem.gradient(layer::displacement);
            problem.reactions(layer::displacement, layer::trial);
            if (solution_.rounds == 1) {
                hessian_diagonal(potential, blocks_);
                problem.add_diagonal(blocks_);
            }
            solution_.has_settled = !constraints_->renew(vectors_.numbers(layer::displacement), vectors_.numbers(0),
                                                         blocks_, dt, rule_.newton.tolerance * size);
            if (solution_.has_settled || solution_.rounds == rule_.most_rounds) return;
        }
    }

    /// Sums what the boundary exerts in the step that solve() has found.
    template <class Potential, class Boundary>
    void react(Potential& potential, const StepNow<S, D>& now, const Boundary& boundary, Reactions<D>& reactions) {
        StepProblem problem(potential, *small_, *constraints_, layer::pushed, inertia_);
        problem.displace(layer::displacement);
        problem.reactions(layer::displacement, layer::trial);
        constraints_->add_friction(vectors_.numbers(0));
        // The velocities that nodes would have without the boundary, from which it takes them to those of the step.
        S* const nodes = vectors_.numbers(0);
        const S* const u = vectors_.numbers(layer::displacement);
        for_nodes([&](std::size_t i) {
            bool is_held = false;
            for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k) {
                is_held = is_held || nodes[k] != S(0);
                nodes[k] = masses_[i] * (u[k] * S(1 / now.dt)) - nodes[k] * S(now.dt);
            }
            nodes[i * node_width + node_mass] = is_held ? masses_[i] : S(0);
        });
        update_grid(now.threads, now.ranks, vectors_.grid(), 0.0, Vec<double, D>::zero(), boundary, &reactions);
    }

    /// Sets the present numbers of the nodes to the velocities of the step, for G2P. \param dt  time of the step [s]
    void leave_velocities(double dt) const {
        S* const nodes = vectors_.numbers(0);
        const S* const u = vectors_.numbers(layer::displacement);
        for_nodes([&](std::size_t i) {
            for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k) nodes[k] = u[k] * S(1 / dt);
            nodes[i * node_width + node_mass] = masses_[i];
        });
    }

private:
    template <class F>
    void for_nodes(const F& f) const {
        for_chunks(masses_.size(), vectors_.threads(), [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) f(i);
        });
    }
    /// Lets small nodes follow the displacement, and the boundary hold it.
    void impose(double dt) const {
        S* const u = vectors_.numbers(layer::displacement);
        constraints_->impose(u, dt, vectors_.threads());
        small_->extend(u, vectors_.threads());
        constraints_->impose(u, dt, vectors_.threads());
    }
    /// Lets the boundary meet nodes that loads push for the time of the step.
    void begin_contact(double dt) {
        if (!constraints_->are_nonlinear()) return;
        S* const nodes = vectors_.numbers(0);
        const S *const loads = vectors_.numbers(layer::loads), *const free = vectors_.numbers(layer::free_motion);
        for_nodes([&](std::size_t i) {
            for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k)
                nodes[k] = masses_[i] > S(0) ? free[k] * S(1 / dt) + loads[k] / masses_[i] * S(dt) : S(0);
            nodes[i * node_width + node_mass] = S(0);
        });
        constraints_->begin(nodes);
    }
    /// Returns the measure of inertial forces [N]: the weight under the acceleration, or a thousandth of the force that
    /// would stop matter within the step. The latter counts where no forces act but those of rounding.
    double inertial_size(double dt) const {
        const S* const momenta = vectors_.numbers(layer::momenta);
        S* const nodes = vectors_.numbers(0);
        weigh(1);
        const double stop = std::sqrt(vectors_.dot(0, 0)) / dt;
        for_nodes([&](std::size_t i) {
            for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k) nodes[k] -= momenta[k];
        });
        return std::max(std::sqrt(vectors_.dot(0, 0)) / dt, 1e-3 * stop);
    }
    /// Multiplies the present numbers of the nodes by their masses, and by `factor`.
    void weigh(S factor) const {
        S* const nodes = vectors_.numbers(0);
        for_nodes([&](std::size_t i) {
            for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k)
                nodes[k] *= masses_[i] * factor;
            nodes[i * node_width + node_mass] = S(0);
        });
    }

    NodeVectors<S, D> vectors_;
    const Time& rule_;
    aligned_vector<S> masses_;
    std::optional<SmallNodes<S, D>> small_;
    std::optional<NodeConstraints<S, D>> constraints_;
    std::optional<NodalInertia<S>> inertia_;
    JacobiPreconditioner<S, D> preconditioner_;
    aligned_vector<S> blocks_;
    StepSolution solution_;
};

/// Throws a convergence_error about a step that was not solved. \param whole  the time of the whole step [s]
template <int D>
[[noreturn, gnu::cold]] void throw_not_converged(const StepSolution& solution, const Moment& begin, double whole,
                                                 double largest_motion, const std::string& where) {
    std::string text = sentence("Step ", begin.steps, ", of ", whole, " s from ", begin.time, " s on, ");
    if (solution.newton.has_converged && !solution.has_settled) {
        text += sentence("does not converge, not even in a part of ", std::ldexp(whole, -solution.halvings), " s: in ",
                         solution.rounds,
                         " rounds it is not settled where the boundary holds matter by "
                         "friction, and where matter leaves it. ");
    } else if (solution.newton.has_converged) {
        text += sentence("moves a node by ", solution.largest_motion, " cells even in a part of ",
                         std::ldexp(whole, -solution.halvings), " s; at most ", largest_motion, " are allowed. ");
    } else {
        text += sentence("does not converge, not even in a part of ", std::ldexp(whole, -solution.halvings), " s. ");
        if (solution.newton.residuals.empty()) {
            text += sentence("Its first guess turns ", solution.newton.last.inverted, " particles inside out");
        } else {
            text += "The forces out of balance, as a part of the loads, were";
            for (const double residual : solution.newton.residuals) text += " " + rounded_text(residual, 3);
        }
        text += where.empty() ? ". " : ", " + where + ". ";
    }
    throw convergence_error(text +
                            "Take shorter steps or more Newton steps, hold what is free to move, or look for matter "
                            "without stiffness. The particles are those before the step.");
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
