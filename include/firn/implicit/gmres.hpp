/// \file GMRES, for the linear system of a Newton step whose matrix is not symmetric: with plastic flow or viscosity.
///
/// The variant is FGMRES of Saad 1993, "A flexible inner-outer preconditioned GMRES algorithm": preconditioned from the
/// right, so that residuals are those of the system itself, and by a preconditioner that may change from one product to
/// the next. Restarts bound its memory.
#pragma once

#include <firn/implicit/linear_system.hpp>

#include <limits>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Which layers gmres() uses. All differ, and none is 0.
struct GmresLayers {
    std::size_t solution,  ///< Gets the solution, a displacement.
        residual,          ///< Holds the right-hand side, forces on the unknowns; then that of the last restart.
        basis;             ///< First of 2 n + 1 layers of memory for n products between restarts; made when needed.
};
/// When gmres() stops.
struct GmresLimits {
    double tolerance = 1e-8;  ///< Largest residual, as a part of the right-hand side [1].
    int iterations = 10'000;  ///< Largest number of products with the matrix.
    int restart = 50;         ///< Number of products between restarts.
};

namespace detail {

/// The least-squares problem min |β e₀ − H y| of GMRES, with the Hessenberg matrix H, column by column. Givens
/// rotations keep H triangular.
class HessenbergProblem {
public:
    explicit HessenbergProblem(double beta) : right_{beta} {}

    /// Appends a column of H. \param column  its n + 2 numbers, where H has n columns;  \param least  norms up to it
    /// count as zero
    /// \return  whether the column is independent of the others; if it is not, it is left out
    bool append(std::vector<double> column, double least) {
        const std::size_t n = columns_.size();
        for (std::size_t i = 0; i < n; ++i) rotate(rotations_[i], column[i], column[i + 1]);
        const double norm = std::hypot(column[n], column[n + 1]);
        if (!(norm > least)) return false;
        rotations_.push_back({column[n] / norm, column[n + 1] / norm});
        rotate(rotations_[n], column[n], column[n + 1]);
        right_.push_back(0);
        rotate(rotations_[n], right_[n], right_[n + 1]);
        columns_.push_back(std::move(column));
        return true;
    }
    /// Returns the smallest norm.
    double residual() const { return std::abs(right_.back()); }
    /// Returns the y with the smallest norm.
    std::vector<double> solution() const {
        std::vector<double> y(columns_.size());
        for (std::size_t i = y.size(); i-- > 0;) {
            y[i] = right_[i];
            for (std::size_t j = i + 1; j < y.size(); ++j) y[i] -= columns_[j][i] * y[j];
            y[i] /= columns_[i][i];
        }
        return y;
    }

private:
    struct Rotation {
        double cosine, sine;
    };
    static void rotate(const Rotation& by, double& a, double& b) {
        const double first = by.cosine * a + by.sine * b;
        b = by.cosine * b - by.sine * a;
        a = first;
    }

    std::vector<std::vector<double>> columns_;
    std::vector<Rotation> rotations_;
    std::vector<double> right_;
};

}  // namespace detail

/// Solves a linear system by GMRES. The matrix need not be symmetric. It stops, too, when the residual at a restart has
/// not become smaller than at the one before. The results have the same bits for any number of threads.
/// \param precondition  precondition(z, r) sets the vector in layer z to that of layer r, preconditioned
/// \return  how it has ended; has_found_negative says nothing
template <class System, class Precondition>
SolverReport gmres(System& system, const Precondition& precondition, const GmresLayers& layers,
                   const GmresLimits& limits) {
    const auto vectors = system.vectors();
    using S = std::remove_reference_t<decltype(vectors.numbers(0)[0])>;
    const double rounding = double(std::numeric_limits<S>::epsilon());
    const auto [x, r, basis] = layers;
    const auto v = [&](std::size_t k) { return basis + 2 * k; };      // orthonormal forces
    const auto z = [&](std::size_t k) { return basis + 2 * k + 1; };  // displacements: v, preconditioned
    vectors.make(x);
    SolverReport report;
    const double begin = std::sqrt(vectors.dot(r, r));
    if (begin == 0) {
        report.has_converged = true;
        return report;
    }
    report.residual = 1;
    vectors.make(v(0));
    for (double beta = begin; report.iterations < limits.iterations;) {
        detail::HessenbergProblem problem(beta);
        vectors.set(v(0), 1 / beta, r);
        for (std::size_t n = 0; n < std::size_t(limits.restart) && report.iterations < limits.iterations; ++n) {
            vectors.make(z(n));
            precondition(z(n), v(n));
            system.multiply(z(n));
            ++report.iterations;
            // Modified Gram–Schmidt: GMRES needs no better one (Greenbaum, Rozložník and Strakoš 1997).
            const double size = std::sqrt(vectors.dot(0, 0));
            std::vector<double> column;
            for (std::size_t i = 0; i <= n; ++i) {
                column.push_back(vectors.dot(0, v(i)));
                vectors.add(0, -column[i], v(i));
            }
            const double rest = std::sqrt(vectors.dot(0, 0));
            column.push_back(rest);
            if (!problem.append(std::move(column), rounding * size)) break;
            if (problem.residual() <= limits.tolerance * begin || !(rest > rounding * size)) break;
            vectors.make(v(n + 1));
            vectors.set(v(n + 1), 1 / rest, 0);
        }
        // The correction of the solution, in place of the first vector.
        const std::vector<double> y = problem.solution();
        vectors.fill(v(0), S(0));
        for (std::size_t i = 0; i < y.size(); ++i) vectors.add(v(0), y[i], z(i));
        vectors.add(x, 1, v(0));
        report.residual = problem.residual() / begin;
        report.has_converged = report.residual <= limits.tolerance;
        if (report.has_converged || report.iterations >= limits.iterations) return report;
        system.multiply(v(0));
        ++report.iterations;
        vectors.add(r, -1, 0);
        const double before = beta;
        beta = std::sqrt(vectors.dot(r, r));
        report.residual = beta / begin;
        report.has_converged = report.residual <= limits.tolerance;
        if (report.has_converged || !(beta < before)) return report;
    }
    return report;
}

}  // namespace firn::inline FIRN_BUILD
