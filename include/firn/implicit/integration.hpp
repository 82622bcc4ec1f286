/// \file Time integrations that solve equations in each step: QuasiStatic and Implicit.
#pragma once

#include <firn/implicit/newton.hpp>

#include <cstddef>
#include <limits>
#include <string>

namespace firn::inline FIRN_BUILD {

namespace detail {
template <class Time, class Simulation, class Kernel, class Transfer, class Force, class Boundary, class Volume,
          class Law>
struct ImplicitPassesOf;
}  // namespace detail

/// How an implicit or quasi-static step was solved. A step that does not converge is taken in parts, and each part is a
/// step of its own: these are the numbers of the last one.
struct StepSolution {
    bool has_converged = false;   ///< Whether the step was solved; if not, the step has thrown a convergence_error.
    NewtonReport newton{};        ///< How Newton's method has ended: residuals, products, cuts.
    bool has_settled = false;     ///< Whether contact with the boundary does not change any more.
    int rounds = 0;               ///< How often friction and separation were found anew, and the nodes solved for.
    int halvings = 0;             ///< How often the step was halved until it converged.
    int newton_steps = 0;         ///< Number of Newton steps, those of attempts that failed included.
    int products = 0;             ///< Number of products with the Hessian, those of attempts that failed included.
    double largest_motion = 0;    ///< Largest motion of a node in the step [cells].
    std::size_t small_nodes = 0;  ///< Number of nodes that follow others. \see SmallNodes
    /// What loads and friction add up to along directions in which the boundary holds no node of matter, D numbers [N];
    /// nothing if that is less than NewtonLimits::tolerance of all loads. Then there is no equilibrium, and none was
    /// looked for.
    std::vector<double> unheld{};
};

/// What brings the linear solves of Newton's method to their end in few products.
enum class Preconditioning {
    multigrid,    ///< A multigrid: the number of products does not grow with the number of cells. \see Multigrid
    block_jacobi  ///< The diagonal blocks of the Hessian: less work a product. It serves short steps with inertia.
};

namespace detail {
/// What QuasiStatic, Implicit and TrBdf2 share. \tparam Time  one of these
template <class Time>
struct SolvedSteps {
    static constexpr bool is_explicit = false;  ///< Steps solve equations.
    static constexpr int stages = 1;            ///< How often a step solves.
    using Solution = StepSolution;              ///< What a simulation tells of the solution of its last step.

    /// The passes of a step of a simulation.
    template <class Simulation, class Kernel, class Transfer, class Force, class Boundary, class Volume, class Law>
    using Passes = ImplicitPassesOf<Time, Simulation, Kernel, Transfer, Force, Boundary, Volume, Law>;

    NewtonLimits newton{};  ///< When Newton's method stops, and how exactly it solves.
    Preconditioning preconditioning = Preconditioning::multigrid;  ///< How linear solves are preconditioned.
    SmallNodeRule small_nodes{};                                   ///< Which nodes follow others.
    int most_rounds = 15;               ///< How often friction and separation are found anew at most.
    int most_halvings = 12;             ///< The smallest part of a step is the step over 2 to this power.
    double largest_motion = unlimited;  ///< Largest motion of a node in a step [cells]; beyond it, a step is halved.

    static constexpr double unlimited = std::numeric_limits<double>::infinity();  ///< No limit.

    /// Checks the parameters.
    /// \throws parameter_error  if one is out of range
    void check() const {
        const auto require = [](bool is_right, const char* name, double value, const char* range) {
            if (!is_right) throw parameter_error(sentence("The ", name, " is ", value, "; it must be ", range, "."));
        };
        require(newton.tolerance > 0 && newton.tolerance < 1, "tolerance of Newton's method", newton.tolerance,
                "between 0 and 1");
        require(newton.iterations > 0, "number of Newton steps", newton.iterations, "positive");
        require(newton.forcing > 0 && newton.forcing < 1, "forcing of Newton's method", newton.forcing,
                "between 0 and 1");
        require(newton.radius > 0, "radius of Newton's method", newton.radius, "positive");
        require(newton.solver_iterations > 0, "number of products of a linear solve", newton.solver_iterations,
                "positive");
        require(newton.patience > 0, "patience of Newton's method", newton.patience, "positive");
        require(newton.restart > 0, "number of products between restarts", newton.restart, "positive");
        require(newton.restarts >= 0, "number of restarts", newton.restarts, "0 or larger");
        require(newton.negative > 0, "number of steps with negative curvature", newton.negative, "positive");
        require(newton.cuts >= 0, "number of cuts of a line search", newton.cuts, "0 or larger");
        require(small_nodes.threshold >= 0 && small_nodes.threshold <= 1, "threshold of small nodes",
                small_nodes.threshold, "from 0 to 1");
        require(most_rounds > 0, "number of rounds", most_rounds, "positive");
        require(most_halvings >= 0, "number of halvings of a step", most_halvings, "0 or larger");
        require(largest_motion > 0, "largest motion of a step", largest_motion, "positive");
    }
    /// Returns the parameters as a text: a restart to the same bits needs the same ones.
    std::string description(bool /* exactly */) const {
        std::string text = "solved steps";
        for (const double number :
             {newton.tolerance, double(preconditioning), double(newton.iterations), newton.forcing,
              newton.least_forcing, double(newton.solver_iterations), double(newton.patience), double(newton.restart),
              double(newton.restarts), double(newton.negative), double(newton.cuts), newton.radius,
              small_nodes.threshold, double(most_rounds), double(most_halvings), largest_motion})
            text += " " + exact_text(number);
        return text;
    }
};
}  // namespace detail

/// Quasi-static time integration: each step finds the equilibrium of the forces of particles with the loads, gravity
/// and the boundary as they are at the end of the step. There is no inertia, and velocities are 0 after a step; time
/// only says how far loads and the boundary have come.
///
///     firn::Simulation slope(domain, material, walls, firn::WeightGradientForce{}, firn::QuasiStatic{});
///     slope.add(…);
///     slope.advance(1);  // one load step: all of gravity at once
///
/// advance() takes one load step, or steps of `fixed_time_step`. A load step that does not converge is halved: its
/// first half ends where forces are half-way between those at its start and the loads. Steps may move matter by many
/// cells: a step is exact for any displacement of the nodes. A second step under the same loads lets the weights of
/// nodes follow the matter.
///
/// Matter must be held. Where loads push all of it along a direction in which no boundary holds it, a step ends in a
/// convergence_error at once; where a body is free to turn, or one of several is free to move, once halvings have
/// failed. Take Implicit or TrBdf2 then. Matter without stiffness against shear, such as a fluid without viscosity, is
/// refused by a parameter_error. A viscous fluid creeps: a step finds Stokes flow, for the length of the step.
struct QuasiStatic : detail::SolvedSteps<QuasiStatic> {
    static constexpr const char* name = "quasi_static";
    static constexpr bool has_inertia = false;  ///< Matter has no inertia.

    QuasiStatic() { most_halvings = 6; }  ///< Takes the default parameters.
};

/// Implicit time integration by backward Euler: forces are those at the end of a step, so a step is not bounded by the
/// speed of sound. Waves that a step does not resolve die out.
///
/// A step is `fixed_time_step`, or so long that matter under the acceleration of the step would move by half a cell. A
/// step that moves a node by more than `largest_motion`, or that does not converge, is halved.
///
/// The step minimises Σ m/(2 dt²) |u − dt v|² + Σ V0 ψ, less the work of loads: Radovitzky and Ortiz 1999, "Error
/// estimation and adaptive meshing in strongly nonlinear dynamic problems", §2; for MPM Gast et al. 2015,
/// "Optimization integrator for large time steps".
struct Implicit : detail::SolvedSteps<Implicit> {
    static constexpr const char* name = "implicit";
    static constexpr bool has_inertia = true;  ///< Matter has inertia.

    Implicit() { largest_motion = 0.5; }  ///< Takes the default parameters.
};

/// Implicit time integration by TR-BDF2, of second order: the trapezoidal rule over γ dt with γ = 2 − √2, then BDF2
/// over the whole step, both on the weights at its start. It damps resolved motion much less than Implicit, and waves
/// that a step does not resolve as much. It solves twice a step, and takes the transfer Flip.
///
/// Bank et al. 1985, "Transient simulation of silicon devices and circuits", §IV; the γ with which both stages have the
/// same matrix is theirs. The reactions of a step are those of the forces at its end, times dt.
struct TrBdf2 : detail::SolvedSteps<TrBdf2> {
    static constexpr const char* name = "tr_bdf2";
    static constexpr bool has_inertia = true;  ///< Matter has inertia.
    static constexpr int stages = 2;           ///< A step solves twice.
    static constexpr double first_stage =
        2 - 1.41421356237309504880169;  ///< γ: where in the step the first stage ends [1].

    TrBdf2() { largest_motion = 0.5; }  ///< Takes the default parameters.
};

}  // namespace firn::inline FIRN_BUILD
