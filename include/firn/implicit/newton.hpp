/// \file Newton's method for an implicit step, with inexact linear solves and a line search.
#pragma once

#include <firn/implicit/gmres.hpp>
#include <firn/implicit/jacobi_preconditioner.hpp>
#include <firn/implicit/step_problem.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// When Newton's method stops, and how exactly it solves.
struct NewtonLimits {
    /// Largest gradient, as a part of the loads or of the forces of particles [1]. Rounding bounds it: in a block under
    /// its weight, floats reach 1e-5 on 64² cells and 5e-7 on 8², doubles 2e-15 on 16². A tolerance below that ends in
    /// NewtonEnd::rounded.
    double tolerance = 1e-3;
    int iterations = 30;  ///< Largest number of steps.
    /// Largest residual of the linear solves, as a part of the gradient [1]. Matter without a potential takes a tenth
    /// of it: in slopes of sand, this saved a third of the products.
    double forcing = 0.1;
    double least_forcing = 1e-12;  ///< Smallest residual of the linear solves that is asked for [1].
    int solver_iterations = 500;   ///< Largest number of products in one linear solve.
    int patience = 10;             ///< In so many steps the gradient must halve, of matter without a potential.
    int restart = 50;              ///< Number of products between restarts of GMRES.
    /// Largest number of restarts in one linear solve of GMRES. A Newton step of what one cycle finds is worth more
    /// than restarts: without them, a slope of sand near failure (256 × 128 cells) took 254 products for 1250, and a
    /// block with FBar and ν = 0.4999 650 for 1362.
    int restarts = 0;
    int cuts = 12;      ///< Largest number of halvings in one line search.
    double radius = 1;  ///< Largest motion of a node in a step along negative curvature [cells].
    int negative = 10;  ///< The number of steps with negative curvature at which it stops.

    /// Largest number of products in one linear solve of GMRES.
    int products_of_gmres() const { return int(std::min(double(solver_iterations), (1.0 + restarts) * restart)); }
};
/// Why Newton's method has ended.
enum class NewtonEnd {
    converged,           ///< The gradient is small enough.
    inverted_at_start,   ///< The first guess inverts particles.
    no_descent,          ///< A line search found nothing better, or NewtonLimits::patience has run out.
    too_many_steps,      ///< NewtonLimits::iterations steps were not enough.
    negative_curvature,  ///< NewtonLimits::negative steps have met negative curvature: a smaller load may help.
    rounded              ///< Rounding leaves a gradient above the tolerance. \see NewtonReport::rounding
};
/// How Newton's method has ended.
struct NewtonReport {
    std::vector<double> residuals{};  ///< Before each step and at the end: the gradient, as a part of the loads [1].
    int products = 0;                 ///< Number of products with the Hessian.
    int cuts = 0;                     ///< Number of halvings in all line searches.
    int negative = 0;                 ///< Number of steps that met negative curvature.
    bool has_converged = false;       ///< Whether the gradient is small enough.
    NewtonEnd end = NewtonEnd::inverted_at_start;  ///< Why it has ended.
    DisplacementReport last{};                     ///< What the last displacement means.
    /// What rounding of the displacement alone changes of the gradient, as a part of the loads; found where the
    /// gradient is small and does not fall any more, else 0 [1]. The gradient falls to about a third of it.
    double rounding = 0;
    /// Position of the node with the largest gradient at the end, D numbers [m]; none if the first guess inverts
    /// particles.
    std::vector<double> worst{};

    int steps() const { return std::max(int(residuals.size()), 1) - 1; }  ///< Number of steps.
};
/// Which layers newton() uses. All differ, from those of the problem, too, and none is 0.
struct NewtonLayers {
    std::size_t displacement;  ///< Holds a first guess; gets the displacement of the step.
    SolverLayers solver;       ///< Those of the linear solves.
    std::size_t trial;         ///< Memory for the displacements of a line search.
    /// First of 2 n + 1 layers of memory for GMRES, where n is NewtonLimits::restart. Only matter without a potential
    /// takes it. \see GmresLayers
    std::size_t basis = 0;
};

namespace detail {

/// Returns the node that a vector moves farthest, and by what distance [m]. \return  (index of the node, distance)
template <std::floating_point S, int D>
std::pair<std::size_t, double> largest_motion(const NodeVectors<S, D>& vectors, std::size_t k) {
    const S* const numbers = vectors.numbers(k);
    std::pair<std::size_t, double> largest{0, 0};
    for (std::size_t i = 0; i < vectors.size(); i += node_width) {
        double here = 0;
        for (std::size_t a = 0; a < std::size_t(D); ++a) here += double(numbers[i + a]) * double(numbers[i + a]);
        if (here > largest.second) largest = {i / node_width, here};
    }
    return {largest.first, std::sqrt(largest.second)};
}
/// Returns the largest t ≥ 0 with which x + t p moves no node farther than `radius`; 0 if already x does.
template <std::floating_point S, int D>
double part_to_radius(const NodeVectors<S, D>& vectors, std::size_t x, std::size_t p, double radius) {
    const S *const from = vectors.numbers(x), *const along = vectors.numbers(p);
    double part = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < vectors.size(); i += node_width) {
        double pp = 0, xp = 0, rest = radius * radius;
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            const double u = double(from[i + a]), v = double(along[i + a]);
            pp += v * v, xp += u * v, rest -= u * u;
        }
        if (rest <= 0) return 0;
        if (pp > 0) part = std::min(part, rest / (xp + std::sqrt(xp * xp + pp * rest)));
    }
    return std::isfinite(part) ? part : 0;
}
/// Continues the step that conjugate_gradients() has found before a direction of negative curvature, along this
/// direction, until a node has moved by `radius` (Steihaug 1983); or shortens it.
template <class Problem>
void step_to_radius(Problem& problem, const SolverLayers& layers, double radius) {
    const auto vectors = problem.vectors();
    const auto [x, r, p, z] = layers;
    problem.to_displacement(x);
    const double motion = largest_motion(vectors, x).second;
    if (motion < radius)
        vectors.add(x, part_to_radius(vectors, x, p, radius), p);
    else
        vectors.set(x, radius / motion, x);
}

/// A line search from a displacement: halves the step until a merit has become smaller as it should. The merit is Φ,
/// or, of matter that has none, the norm of its gradient. Leaves the trial in its layer, displaced, and its gradient in
/// the present numbers.
template <class Problem>
class LineSearch {
public:
    LineSearch(Problem& problem, const NewtonLayers& layers, const NewtonLimits& limits)
        : problem_(problem), layers_(layers), limits_(limits) {}

    DisplacementReport report{};  ///< what the accepted trial means
    double size = 0;              ///< the measure of its forces [N]
    int cuts = 0;                 ///< number of halvings

    /// Searches for a smaller Φ. \param energy  Φ at the start;  \param slope  the derivative of Φ along the step,
    /// negative
    /// \param is_negative  whether the step goes along negative curvature: then Φ must fall by more than rounding,
    /// which
    ///                     makes curvatures negative, too
    /// \return  whether a trial was accepted
    bool run(double energy, double slope, bool is_negative) {
        // Rounding of the energies of particles hides smaller changes.
        const double room = (is_negative ? -64 : 64) *
                            double(std::numeric_limits<typename Problem::scalar_type>::epsilon()) * std::abs(energy);
        double part = 1;
        for (cuts = 0; cuts <= limits_.cuts; ++cuts, part /= 2) {
            displace(part);
            if (report.is_regular() && report.energy <= energy + 1e-4 * part * slope + room) {
                size = problem_.gradient(layers_.trial);
                return true;
            }
        }
        return false;
    }
    /// Searches for a smaller gradient: the first one that has become smaller as it should, else the smallest one.
    /// \param gradient  its norm at the start
    /// \return  whether a trial was accepted
    bool run(double gradient) {
        double part = 1, best = gradient, best_part = 0;
        for (cuts = 0; cuts <= limits_.cuts; ++cuts, part /= 2) {
            displace(part);
            if (!report.is_regular()) continue;
            const double norm = gradient_of_trial();
            if (norm <= (1 - 1e-4 * part) * gradient) return true;
            if (norm < best) best = norm, best_part = part;
        }
        if (best_part == 0) return false;
        displace(best_part);
        gradient_of_trial();
        return true;
    }

private:
    void displace(double part) {
        const auto vectors = problem_.vectors();
        vectors.copy(layers_.trial, layers_.displacement);
        vectors.add(layers_.trial, part, layers_.solver.solution);
        report = problem_.displace(layers_.trial);
    }
    double gradient_of_trial() {
        size = problem_.gradient(layers_.trial);
        const auto vectors = problem_.vectors();
        return std::sqrt(vectors.dot(0, 0));
    }

    Problem& problem_;
    const NewtonLayers& layers_;
    const NewtonLimits& limits_;
};

/// Solves the linear system of a Newton step.
template <class Problem, class Preconditioner>
SolverReport solve(Problem& problem, const NewtonLayers& layers, const NewtonLimits& limits, double tolerance,
                   Preconditioner& preconditioner) {
    const auto precondition = [&](std::size_t to, std::size_t from) { preconditioner.apply(problem, to, from); };
    if constexpr (Problem::is_symmetric)
        return conjugate_gradients(problem, precondition, layers.solver, {tolerance, limits.solver_iterations});
    else
        return gmres(problem, precondition, {layers.solver.solution, layers.solver.residual, layers.basis},
                     {tolerance, limits.products_of_gmres(), limits.restart});
}

/// Returns what the gradient changes by, as a part of its measure, if the numbers of the displacement change by as much
/// as they are rounded. Leaves the gradient at the displacement in the present numbers.
template <class Problem>
double rounding_of_gradient(Problem& problem, const NewtonLayers& layers) {
    using S = typename Problem::scalar_type;
    const auto vectors = problem.vectors();
    const std::size_t changed = layers.solver.residual;
    vectors.copy(layers.trial, layers.displacement);
    S* const numbers = vectors.numbers(layers.trial);
    std::uint32_t random = 1;
    for (std::size_t k = 0; k < vectors.size(); ++k) {
        random = random * 1664525U + 1013904223U;
        numbers[k] *= S(1) + (random >> 31 != 0 ? S(1) : S(-1)) * std::numeric_limits<S>::epsilon();
    }
    const bool is_regular = problem.displace(layers.trial).is_regular();
    problem.gradient(layers.trial);
    vectors.copy(changed, 0);
    problem.displace(layers.displacement);
    const double size = problem.gradient(layers.displacement);
    vectors.add(changed, -1, 0);
    return is_regular && size > 0 ? std::sqrt(vectors.dot(changed, changed)) / size : 0;
}

/// Finds where the gradient, the present numbers of the nodes, is largest.
template <std::floating_point S, int D>
std::vector<double> worst_node(const NodeVectors<S, D>& vectors) {
    const std::size_t node = largest_motion(vectors, 0).first, nodes = std::size_t(block_nodes<D>);
    if (vectors.size() == 0) return {};
    const Vec<double, D> x = node_position(vectors.grid(), node / nodes, int(node % nodes));
    return {x.v, x.v + D};
}

}  // namespace detail

/// Finds the displacement of a step at which forces are balanced, beginning at the displacement in
/// layers.displacement. If all materials have a potential, it minimises Φ, by conjugate gradients and a line search on
/// Φ. Else, with plastic flow, viscosity or a fluid, it makes the gradient small, by GMRES and a line search on the
/// norm of the gradient.
/// \param preconditioner  an object with two functions: renew(problem), called before each linear solve, with the
///                        problem at its last displacement; and apply(problem, z, r), which sets the vector in layer z
///                        to that of layer r, preconditioned, and may change the present numbers of the nodes
/// \return  how it has ended. If it has not converged, the layer holds the best displacement that was found; if already
///          the first guess inverts particles, nothing is done.
/// \throws usage_error  if there are no layers for GMRES, and a material has no potential
template <class Problem, class Preconditioner>
NewtonReport newton(Problem& problem, const NewtonLayers& layers, const NewtonLimits& limits,
                    Preconditioner& preconditioner) {
    const auto vectors = problem.vectors();
    const double h = vectors.grid().domain().cell_size;
    const auto [x, r, p, z] = layers.solver;
    if (!Problem::is_symmetric && layers.basis == 0)
        throw usage_error("Newton's method needs layers for GMRES, as a material has no potential: give it the first.");
    vectors.make(layers.trial);
    vectors.make(r);
    NewtonReport report;
    report.last = problem.displace(layers.displacement);
    if (!report.last.is_regular()) return report;
    double size = problem.gradient(layers.displacement);
    const auto ended = [&](NewtonEnd end) {
        report.end = end;
        report.has_converged = end == NewtonEnd::converged;
        report.worst = detail::worst_node(vectors);
        return report;
    };
    const auto failed = [&](NewtonEnd end) {
        report.last = problem.displace(layers.displacement);
        problem.gradient(layers.displacement);
        return ended(end);
    };
    for (;;) {
        const double gradient = std::sqrt(vectors.dot(0, 0));
        const double residual = size > 0 ? gradient / size : 0;
        report.residuals.push_back(residual);
        if (residual <= limits.tolerance) return ended(NewtonEnd::converged);
        constexpr double epsilon = double(std::numeric_limits<typename Problem::scalar_type>::epsilon());
        // Rounding is looked for where it may be all that is left.
        if (report.steps() > 0 && residual < 1e5 * epsilon && residual > 0.5 * *(report.residuals.end() - 2)) {
            report.rounding = detail::rounding_of_gradient(problem, layers);
            if (residual <= report.rounding) return ended(NewtonEnd::rounded);
        }
        if (report.steps() >= limits.iterations) return ended(NewtonEnd::too_many_steps);
        if (!Problem::is_symmetric && report.steps() >= limits.patience &&
            residual > 0.5 * report.residuals[report.residuals.size() - 1 - std::size_t(limits.patience)])
            return ended(NewtonEnd::no_descent);
        vectors.set(r, -1, 0);
        vectors.copy(layers.trial, r);  // solvers change their right-hand side

        preconditioner.renew(problem);
        const double forcing = limits.forcing * (Problem::is_symmetric ? 1 : 0.1);
        const SolverReport solved = detail::solve(
            problem, layers, limits, std::max(std::min(forcing, residual), limits.least_forcing), preconditioner);
        report.products += solved.iterations;
        const bool is_negative = solved.has_found_negative;
        if (is_negative) {
            if (++report.negative >= limits.negative) return failed(NewtonEnd::negative_curvature);
            vectors.copy(z, x);  // the step before it goes along negative curvature
            detail::step_to_radius(problem, layers.solver, limits.radius * h);
        }
        detail::LineSearch<Problem> search(problem, layers, limits);
        bool is_accepted = false;
        if constexpr (Problem::is_symmetric) {
            const double energy = report.last.energy, slope = -vectors.dot(layers.trial, x),
                         before = is_negative ? -vectors.dot(layers.trial, z) : slope;
            is_accepted = slope < 0 && search.run(energy, slope, is_negative);
            if (!is_accepted && is_negative) vectors.copy(x, z);
            // Rounding hides what so small a step changes of the energy; the gradient still tells.
            if (!is_accepted && before < 0 && -before < 1e-8 * std::abs(energy)) is_accepted = search.run(gradient);
        } else {
            is_accepted = search.run(gradient);
        }
        report.cuts += search.cuts;
        if (!is_accepted) return failed(NewtonEnd::no_descent);
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
