/// \file One implicit or quasi-static step of the nodes of a grid.
#pragma once

#include <firn/core/stepper.hpp>
#include <firn/implicit/integration.hpp>
#include <firn/implicit/multigrid.hpp>
#include <firn/loops/layers.hpp>
#include <firn/loops/mirror.hpp>
#include <firn/simulation/pass.hpp>

#include <optional>
#include <string>

namespace firn::inline FIRN_BUILD {

/// Layers of the grid in an implicit step. Those below belong to transfers.
namespace layer {
inline constexpr std::size_t displacement = 4;            ///< The displacement of the nodes [m].
inline constexpr std::size_t loads = 5;                   ///< The forces of loads and of the acceleration [N].
inline constexpr std::size_t free_motion = 6;             ///< The displacement of the nodes without forces [m].
inline constexpr std::size_t momenta = 7;                 ///< The momenta and masses that P2G has left.
inline constexpr std::size_t of_loads = 8;                ///< The forces of loads alone [N].
inline constexpr std::size_t trial = 9;                   ///< The displacement of a line search.
inline constexpr SolverLayers of_solver{10, 11, 12, 13};  ///< Those of the linear solves.
inline constexpr std::size_t pushed = 14;                 ///< All loads, the friction of the boundary included [N].
inline constexpr std::size_t weights = 15;                ///< Masses × acceleration [N].
inline constexpr std::size_t stage = 16;         ///< The displacement at the end of the first of two stages [m].
inline constexpr std::size_t of_multigrid = 17;  ///< The first of those of the multigrid.
inline constexpr std::size_t of_gmres = 20;      ///< The first of those of GMRES.
}  // namespace layer

namespace detail {

/// The nodes of a grid in one step: what does not change while shorter and shorter steps are tried.
template <class Time, class Kernel, std::floating_point S, int D>
class NodalStep {
public:
    /// Begins a step. P2G has left masses and momenta in the present numbers of the nodes, and the forces of loads are
    /// in layer::of_loads.
    /// \param mirrors  the mirrored walls of the boundary;  \param sets  what P2G sees of the particles
    template <class Boundary, class View>
    NodalStep(SparseGrid<S, D>& grid, int threads, const Time& rule, const Boundary& boundary, const Mirrors& mirrors,
              ParticleSets<View> sets)
        : vectors_(grid, threads), rule_(rule) {
        masses_ = masses_of_nodes(grid);
        vectors_.make(layer::momenta);
        vectors_.copy(layer::momenta, 0);
        scatter_volumes<Kernel>(grid, threads, sets);
        MirroredNodes<S, D> mirrored(grid, mirrors, threads);
        mirrored.mirror_volumes(grid.nodes(0), threads);
        small_.emplace(grid, rule.small_nodes, threads);
        constraints_.emplace(grid, boundary, std::move(mirrored), threads);
        constraints_->release(small_->nodes());
        if constexpr (Time::has_inertia) inertia_ = NodalInertia<S>{masses_, 1, layer::free_motion};
    }

    /// Calls attempt(dt), which calls solve(), for dt, dt/2, … until Newton's method converges and no node moves too
    /// far.
    /// \param dt     time of the step [s];  \param asked  that of the whole step of which it is a part [s]
    template <class Attempt>
    StepSolution take(double dt, double asked, const Attempt& attempt) {
        const double smallest = std::ldexp(asked, -rule_.most_halvings);
        solution_ = {};
        solution_.small_nodes = small_->count();
        for (;; dt /= 2, ++solution_.halvings) {
            attempt(dt);
            solution_.largest_motion =
                largest_motion(vectors_, layer::displacement).second / vectors_.grid().domain().cell_size;
            solution_.has_converged = solution_.newton.has_converged && solution_.has_settled &&
                                      solution_.largest_motion <= rule_.largest_motion;
            const bool is_hopeless = !solution_.unheld.empty() || solution_.newton.end == NewtonEnd::rounded;
            if (solution_.has_converged || is_hopeless || dt / 2 < smallest) return solution_;
        }
    }

    /// Solves a step of the potential's dt. Leaves the displacement in layer::displacement.
    /// \param part        the part of the load step that it takes [1]
    /// \param is_uniform  whether the acceleration is the same everywhere
    /// \param update      update() divides the momenta in the present numbers of the nodes by their masses, and adds
    ///                    acceleration × dt
    template <class Potential, class Update>
    void solve(Potential& potential, [[maybe_unused]] double part, bool is_uniform, const Update& update) {
        const double dt = potential.dt();
        for (const std::size_t k :
             {layer::loads, layer::free_motion, layer::displacement, layer::trial, layer::pushed, layer::stage})
            vectors_.make(k);
        find_weights(dt, is_uniform, update);
        vectors_.copy(layer::loads, layer::weights);
        vectors_.add(layer::loads, 1, layer::of_loads);
        if constexpr (!Time::has_inertia) {
            if (part < 1) mix_loads(potential, part, 1 - part);
            settle(potential, dt);
        } else if constexpr (Time::stages == 1) {
            begin_stage(dt, dt, [&](S v, S) { return S(dt) * v; });
            settle(potential, dt);
        } else {
            // The trapezoidal rule over γ dt, then BDF2 over the whole step.
            const double first = Time::first_stage * dt, after = first / 2,
                         c = 1 / (Time::first_stage * (2 - Time::first_stage));
            potential.set_dt(first);
            mix_loads(potential, 2, -1);
            begin_stage(first, after, [&](S v, S) { return S(first) * v; });
            settle(potential, first);
            potential.set_dt(dt);
            if (!solution_.newton.has_converged || !solution_.has_settled) return;
            vectors_.copy(layer::stage, layer::displacement);
            vectors_.copy(layer::loads, layer::weights);
            vectors_.add(layer::loads, 1, layer::of_loads);
            begin_stage(dt, after, [&](S v, S u) {
                const S of_stage = S(2 / first) * u - v;  // the velocity at the end of the first stage
                return S(c) * u + S(after) * (S(c) * of_stage - S(c - 1) * v);
            });
            settle(potential, dt);
        }
    }

    /// Sums what the boundary exerts in the step that solve() has found.
    template <class Potential, class Boundary>
    void react(Potential& potential, const StepNow<S, D>& now, const Boundary& boundary, Reactions<D>& reactions) {
        constexpr std::size_t of_mirrors = layer::of_solver.solution;
        vectors_.make(of_mirrors);
        StepProblem problem(potential, *small_, *constraints_, layer::pushed, inertia_);
        problem.displace(layer::displacement);
        problem.reactions(layer::displacement, layer::trial, of_mirrors);
        constraints_->add_friction(vectors_.numbers(0));
        // The velocities that nodes would have without the boundary, from which it takes them to those of the step.
        S* const nodes = vectors_.numbers(0);
        const S* const u = vectors_.numbers(layer::displacement);
        constraints_->push_mirrors(u, masses_, now.dt, nodes, vectors_.numbers(of_mirrors));
        for (std::size_t i = 0; i < masses_.size(); ++i) {
            bool is_held = false;
            for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k) {
                is_held = is_held || nodes[k] != S(0);
                nodes[k] = masses_[i] * (u[k] * S(1 / now.dt)) - nodes[k] * S(now.dt);
            }
            nodes[i * node_width + node_mass] = is_held ? masses_[i] : S(0);
        }
        update_grid(now.threads, now.ranks, vectors_.grid(), 0.0, Vec<double, D>::zero(), boundary, &reactions);
        if constexpr (has_mirrors<Boundary>) {
            // Mirrored walls do not see velocities that are even or odd as they want them, so they are left out.
            const S* const forces = vectors_.numbers(of_mirrors);
            for_numbers([&](std::size_t i, std::size_t k) {
                nodes[k] = masses_[i] > S(0) ? -forces[k] * S(now.dt) / masses_[i] : S(0);
            });
            leave_masses();
            mirror_nodes(now.threads, now.ranks, vectors_.grid(), now.mirrors, true, &reactions);
        }
    }

    /// Sets the present numbers of the nodes to the velocities with which matter moves in the step, for G2P: u/dt.
    /// \param dt  time of the step [s]
    void leave_velocities(double dt) const {
        for_numbers([&, nodes = vectors_.numbers(0), u = vectors_.numbers(layer::displacement)](
                        std::size_t, std::size_t k) { nodes[k] = u[k] * S(1 / dt); });
        leave_masses();
    }
    /// Where the velocities at the end of a step of two stages differ from those with which matter moves: changes the
    /// velocities before forces so that FLIP gives particles the former. \param ratio  α of FLIP
    void leave_velocities_before(double dt, double ratio) const {
        const double after = Time::first_stage * dt / 2, c = 1 / (Time::first_stage * (2 - Time::first_stage));
        for_numbers([&, before = vectors_.numbers(layer::before_forces), u = vectors_.numbers(layer::displacement),
                     of_stage = vectors_.numbers(layer::stage)](std::size_t, std::size_t k) {
            // α (v + w − b) + (1 − α) w is to be α (v + w' − v₀) + (1 − α) w', with w = u/dt and w' the end's velocity.
            const S w = u[k] * S(1 / dt), end = (u[k] - S(c) * of_stage[k]) * S(1 / after);
            before[k] += (w - end) * S(1 / ratio);
        });
    }

private:
    /// Calls f(i, k) for each number k that counts of each node i.
    template <class F>
    void for_numbers(const F& f) const {
        for_chunks(masses_.size(), vectors_.threads(), [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                for (std::size_t k = i * node_width; k < i * node_width + std::size_t(D); ++k) f(i, k);
        });
    }
    void leave_masses() const {
        for (std::size_t i = 0; i < masses_.size(); ++i) vectors_.numbers(0)[i * node_width + node_mass] = masses_[i];
    }
    /// The velocity of node i before forces act, of which k is one number; 0 without matter.
    S velocity(std::size_t i, std::size_t k) const {
        return masses_[i] > S(0) ? vectors_.numbers(layer::momenta)[k] / masses_[i] : S(0);
    }

    /// Sets layer::weights to masses × acceleration [N].
    template <class Update>
    void find_weights(double dt, bool is_uniform, const Update& update) {
        // Where the acceleration does not depend on the velocity, it is found for matter at rest, without rounding.
        vectors_.copy(0, layer::momenta);
        const bool at_rest = is_uniform || !Time::has_inertia;
        if (at_rest) for_numbers([nodes = vectors_.numbers(0)](std::size_t, std::size_t k) { nodes[k] = S(0); });
        update();
        vectors_.make(layer::weights);
        for_numbers(
            [&, nodes = vectors_.numbers(0), weights = vectors_.numbers(layer::weights)](std::size_t i, std::size_t k) {
                weights[k] = masses_[i] * ((at_rest ? nodes[k] : nodes[k] - velocity(i, k)) * S(1 / dt));
            });
    }
    /// Replaces the loads f by of_loads f + of_forces g, with the gradient g of the potential at the start of the step.
    template <class Potential>
    void mix_loads(Potential& potential, double of_loads, double of_forces) {
        vectors_.make(layer::trial);
        if (!potential.displace(layer::trial).is_regular()) return;  // never: nothing has moved
        potential.gradient();
        vectors_.set(layer::trial, of_loads, layer::loads);
        vectors_.add(layer::trial, of_forces, 0);
        vectors_.copy(layer::loads, layer::trial);
    }
    /// Begins a stage with inertia: from the velocities at the start of the step.
    /// \param until  time from the start of the step to the end of the stage [s];  \param dt  that of the inertia [s]
    /// \param free   free(v, u) is the displacement û without forces, for the velocity v and the displacement u of the
    ///               stage before
    template <class Free>
    void begin_stage(double until, double dt, const Free& free) {
        for_numbers([&, to = vectors_.numbers(layer::free_motion), u = vectors_.numbers(layer::displacement),
                     of_stage = vectors_.numbers(layer::stage),
                     loads = vectors_.numbers(layer::loads)](std::size_t i, std::size_t k) {
            to[k] = free(velocity(i, k), of_stage[k]);
            u[k] = masses_[i] > S(0) ? to[k] + S(dt * dt) * (loads[k] / masses_[i]) : S(0);
        });
        inertia_->dt = dt;
        // Where no forces act but those of rounding, a thousandth of the force that would stop matter is the measure.
        vectors_.make(layer::trial);
        vectors_.add_vectors(layer::trial, 1 / until, layer::momenta);
        inertia_->size = std::max(std::sqrt(vectors_.dot(layer::weights, layer::weights)),
                                  1e-3 * std::sqrt(vectors_.dot(layer::trial, layer::trial)));
    }
    /// Solves for layer::displacement under layer::loads, until contact with the boundary does not change any more.
    /// \param dt  time from the start of the step [s]
    template <class Potential>
    void settle(Potential& potential, double dt) {
        using Problem = StepProblem<Potential, S, D>;
        if (constraints_->are_nonlinear()) begin_contact(dt);
        Multigrid<Problem> multigrid({}, layer::of_multigrid);
        JacobiPreconditioner<S, D> jacobi;
        int unsolved = 0;
        for (solution_.rounds = 1;; ++solution_.rounds) {
            vectors_.copy(layer::pushed, layer::loads);
            constraints_->add_friction(vectors_.numbers(layer::pushed));
            impose(dt);
            Problem problem(potential, *small_, *constraints_, layer::pushed, inertia_);
            const NewtonLayers layers{layer::displacement, layer::of_solver, layer::trial, layer::of_gmres};
            if constexpr (!Time::has_inertia) {
                solution_.unheld = unheld_loads();
                if (!solution_.unheld.empty() && solution_.rounds == 1 && constraints_->are_nonlinear()) {
                    constraints_->hold_sliding();
                    impose(dt);
                    solution_.unheld = unheld_loads();
                }
            }
            if (!solution_.unheld.empty())
                solution_.newton = {};
            else
                solution_.newton = rule_.preconditioning == Preconditioning::multigrid
                                       ? newton(problem, layers, rule_.newton, multigrid)
                                       : newton(problem, layers, rule_.newton, jacobi);
            solution_.newton_steps += solution_.newton.steps();
            solution_.products += solution_.newton.products;
            const bool is_solved = solution_.newton.has_converged;
            solution_.has_settled = !constraints_->are_nonlinear();
            if (solution_.has_settled || (!is_solved && !solution_.newton.last.is_regular())) return;
            // Friction and separation: constraints follow from the forces that they take, until nothing changes. Matter
            // that flows may have no equilibrium until it leans on a wall: then they follow from where it has come.
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
            if (is_solved) continue;
            if (++unsolved == most_unsolved) return;
            if constexpr (Time::has_inertia)
                vectors_.copy(layer::displacement, layer::free_motion);
            else
                vectors_.fill(layer::displacement, S(0));
        }
    }
    /// \see StepSolution::unheld
    std::vector<double> unheld_loads() const {
        const S* const loads = vectors_.numbers(layer::pushed);
        Vec<double, D> sum{};
        double size = 0;
        for (std::size_t i = 0; i < masses_.size(); ++i) {
            Vec<double, D> f{};
            for (int a = 0; a < D; ++a) f[a] = double(loads[i * node_width + std::size_t(a)]);
            sum += f;
            size += norm(f);
        }
        sum = constraints_->free_translations(masses_) * sum + Vec<double, D>::zero();  // −0 becomes 0
        if (norm(sum) > rule_.newton.tolerance * size) return {sum.v, sum.v + D};
        return {};
    }
    /// Lets small nodes and those behind mirrored walls follow the displacement, and the boundary hold it.
    void impose(double dt) const {
        S* const u = vectors_.numbers(layer::displacement);
        const int threads = vectors_.threads();
        constraints_->impose(u, dt, threads);
        constraints_->mirrored().extend(u, threads);
        small_->extend(u, threads);
        constraints_->impose(u, dt, threads);
        constraints_->mirrored().extend(u, threads);
    }
    /// Lets the boundary meet nodes that loads push for the time of the step.
    void begin_contact(double dt) {
        for_numbers([&, nodes = vectors_.numbers(0), loads = vectors_.numbers(layer::loads),
                     free = vectors_.numbers(layer::free_motion)](std::size_t i, std::size_t k) {
            nodes[k] = masses_[i] > S(0) ? free[k] * S(1 / dt) + loads[k] / masses_[i] * S(dt) : S(0);
        });
        constraints_->begin(vectors_.numbers(0));
    }

    static constexpr int most_unsolved = 5;  // rounds in which Newton's method has not converged

    NodeVectors<S, D> vectors_;
    const Time& rule_;
    aligned_vector<S> masses_;
    std::optional<SmallNodes<S, D>> small_;
    std::optional<NodeConstraints<S, D>> constraints_;
    std::optional<NodalInertia<S>> inertia_;
    aligned_vector<S> blocks_;
    StepSolution solution_;
};

/// Throws a convergence_error about a step that was not solved. \param whole  the time of the whole step [s]
/// \param inverted  a sentence about the first particle that the last displacement turns inside out
[[noreturn, gnu::cold]] inline void throw_not_converged(const StepSolution& solution, const Moment& begin, double whole,
                                                        double largest_motion, const std::string& inverted) {
    const NewtonReport& newton = solution.newton;
    const double part = std::ldexp(whole, -solution.halvings);
    std::string text = sentence("Step ", begin.steps, ", of ", whole, " s from ", begin.time, " s on, ");
    if (!solution.unheld.empty())
        throw convergence_error(
            text + "has no equilibrium: loads and friction add up to " +
            point_text(solution.unheld.data(), int(solution.unheld.size())) +
            " N along directions in which nothing holds the matter. Hold it by a boundary, or take Implicit or "
            "TrBdf2, in which it has inertia. The particles are those before the step.");
    if (newton.has_converged && solution.has_settled) {
        text += sentence("moves a node by ", solution.largest_motion, " cells even in a part of ", part, " s; at most ",
                         largest_motion, " are allowed. ");
    } else {
        text += sentence("does not converge, not even in a part of ", part, " s: ");
        if (newton.has_converged) {
            text += sentence("in ", solution.rounds,
                             " rounds it is not settled where the boundary holds matter by friction, and where matter "
                             "leaves it. ");
        } else {
            constexpr const char* ends[] = {"",
                                            "its first guess turns particles inside out",
                                            "no step makes it smaller",
                                            "it took too many steps",
                                            "forces have no stable balance nearby",
                                            "rounding hides what steps change"};
            text += ends[int(newton.end)];
            if (!newton.residuals.empty()) {
                text += ". Forces out of balance, as a part of the loads, were";
                for (const double residual : newton.residuals) text += " " + rounded_text(residual, 3);
            }
            if (!newton.worst.empty())
                text +=
                    "; most of them at the node " + point_text(newton.worst.data(), int(newton.worst.size())) + " m";
            text += ". " + inverted;
            if (newton.end == NewtonEnd::rounded)
                throw convergence_error(
                    text +
                    sentence("Give Newton's method a tolerance above ", newton.rounding, ", or compute in doubles. ") +
                    "The particles are those before the step.");
        }
    }
    throw convergence_error(text +
                            "Take shorter steps or more Newton steps, hold what is free to move, or look for matter "
                            "without stiffness. The particles are those before the step.");
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
