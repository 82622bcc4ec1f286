/// \file Newton's method for an implicit step, with inexact linear solves and a line search.
#pragma once

#include <firn/implicit/jacobi_preconditioner.hpp>
#include <firn/implicit/step_problem.hpp>

#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// When Newton's method stops, and how exactly it solves.
struct NewtonLimits {
    double tolerance = 1e-3;        ///< Largest gradient, as a part of the loads or of the forces of particles [1].
    int iterations = 30;            ///< Largest number of steps.
    double forcing = 0.1;           ///< Largest residual of the linear solves, as a part of the gradient [1].
    double least_forcing = 1e-12;   ///< Smallest residual of the linear solves that is asked for [1].
    int solver_iterations = 2'000;  ///< Largest number of products in one linear solve.
    int cuts = 12;                  ///< Largest number of halvings in one line search.
    double radius = 1;              ///< Largest motion of a node in a step along negative curvature [cells].
};
/// How Newton's method has ended.
struct NewtonReport {
    std::vector<double> residuals{};  ///< Before each step and at the end: the gradient, as a part of the loads [1].
    int products = 0;                 ///< Number of products with the Hessian.
    int cuts = 0;                     ///< Number of halvings in all line searches.
    int negative = 0;                 ///< Number of steps that met negative curvature.
    bool has_converged = false;       ///< Whether the gradient is small enough.
    DisplacementReport last{};        ///< What the last displacement means.

    int steps() const { return std::max(int(residuals.size()), 1) - 1; }  ///< Number of steps.
};
/// Which layers newton() uses. All differ, from those of the problem, too, and none is 0.
struct NewtonLayers {
    std::size_t displacement;  ///< Holds a first guess; gets the displacement of the step.
    SolverLayers solver;       ///< Those of the linear solves.
    std::size_t trial;         ///< Memory for the displacements of a line search.
};

namespace detail {

/// Returns the largest distance by which a displacement moves a node [m].
template <std::floating_point S, int D>
double largest_motion(const NodeVectors<S, D>& vectors, std::size_t k) {
    const S* const numbers = vectors.numbers(k);
    double squared = 0;
    for (std::size_t i = 0; i < vectors.size(); i += node_width) {
        double here = 0;
        for (std::size_t a = 0; a < std::size_t(D); ++a) here += double(numbers[i + a]) * double(numbers[i + a]);
        squared = std::max(squared, here);
    }
    return std::sqrt(squared);
}

/// A line search from a displacement: halves the step until Φ has become smaller as it should. Leaves the trial in its
/// layer, displaced, and its gradient in the present numbers.
template <class Problem>
class LineSearch {
public:
    LineSearch(Problem& problem, const NewtonLayers& layers, const NewtonLimits& limits)
        : problem_(problem), layers_(layers), limits_(limits) {}

    DisplacementReport report{};  ///< what the accepted trial means
    double size = 0;              ///< the measure of its forces [N]
    int cuts = 0;                 ///< number of halvings

    /// \param energy  Φ at the start;  \param slope  the derivative of Φ along the step, negative
    /// \return  whether a trial was accepted
    bool run(double energy, double slope) {
        const auto vectors = problem_.vectors();
        double part = 1;
        for (cuts = 0; cuts <= limits_.cuts; ++cuts, part /= 2) {
            vectors.copy(layers_.trial, layers_.displacement);
            vectors.add(layers_.trial, part, layers_.solver.solution);
            report = problem_.displace(layers_.trial);
            // Rounding of the energies of particles hides smaller changes.
            const double room =
                64 * double(std::numeric_limits<typename Problem::scalar_type>::epsilon()) * std::abs(energy);
            if (report.is_regular() && report.energy <= energy + 1e-4 * part * slope + room) {
                size = problem_.gradient(layers_.trial);
                return true;
            }
        }
        return false;
    }

private:
    Problem& problem_;
    const NewtonLayers& layers_;
    const NewtonLimits& limits_;
};

}  // namespace detail

/// Minimises the Φ of a step, beginning at the displacement in layers.displacement. All materials must have a
/// potential: with plastic flow or viscosity, the Hessian is not symmetric.
/// \param preconditioner  an object with two functions: renew(problem), called before each linear solve, at the
/// problem's
///                        last displacement; and apply(problem, z, r), which sets the vector in layer z to that of
///                        layer r, preconditioned, and may change the present numbers of the nodes
/// \return  how it has ended. If it has not converged, the layer holds the best displacement that was found; if already
///          the first guess inverts particles, nothing is done.
template <class Problem, class Preconditioner>
NewtonReport newton(Problem& problem, const NewtonLayers& layers, const NewtonLimits& limits,
                    Preconditioner& preconditioner) {
    const auto vectors = problem.vectors();
    const double h = vectors.grid().domain().cell_size;
    using S = typename Problem::scalar_type;
    const auto [x, r, p, z] = layers.solver;
    vectors.make(layers.trial);
    vectors.make(r);
    NewtonReport report;
    report.last = problem.displace(layers.displacement);
    if (!report.last.is_regular()) return report;
    double size = problem.gradient(layers.displacement);
    for (;;) {
        const double gradient = std::sqrt(vectors.dot(0, 0));
        const double residual = size > 0 ? gradient / size : 0;
        report.residuals.push_back(residual);
        report.has_converged = residual <= limits.tolerance;
        if (report.has_converged || report.steps() >= limits.iterations) return report;
        vectors.fill(r, S(0));
        vectors.add(r, -1, 0);

        preconditioner.renew(problem);
        vectors.copy(layers.trial, r);  // the solver changes its right-hand side
        const SolverReport solved = conjugate_gradients(
            problem, [&](std::size_t to, std::size_t from) { preconditioner.apply(problem, to, from); }, layers.solver,
            {std::max(std::min(limits.forcing, residual), limits.least_forcing), limits.solver_iterations});
        report.products += solved.iterations;
        if (solved.has_found_negative) {
            ++report.negative;
            if (solved.iterations == 1) vectors.copy(x, p);
            problem.to_displacement(x);
            const double motion = detail::largest_motion(vectors, x);
            if (motion > limits.radius * h) {
                vectors.copy(p, x);
                vectors.fill(x, S(0));
                vectors.add(x, limits.radius * h / motion, p);
            }
        }
        const double slope = -vectors.dot(layers.trial, x);
        detail::LineSearch<Problem> search(problem, layers, limits);
        const bool is_accepted = slope < 0 && search.run(report.last.energy, slope);
        report.cuts += search.cuts;
        if (!is_accepted) return report;
        report.last = search.report;
        size = search.size;
        vectors.copy(layers.displacement, layers.trial);
    }
}
/// As above, with the diagonal blocks of the Hessian as preconditioner.
template <class Problem>
NewtonReport newton(Problem& problem, const NewtonLayers& layers, const NewtonLimits& limits) {
    JacobiPreconditioner<typename Problem::scalar_type, Problem::dimension> jacobi;
    return newton(problem, layers, limits, jacobi);
}

}  // namespace firn::inline FIRN_BUILD
