/// \file Direct solution of small dense systems.
#pragma once

#include <firn/core/config.hpp>

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Solves small systems of linear equations: by L D Lᵀ if the matrix is symmetric, else by L U with partial pivoting.
/// Eigen's decompositions sum up in an order that the width of the processor's vectors decides, so that bits would
/// differ between machines; and only core/eigen.hpp includes Eigen.
class DenseSolver {
public:
    /// Factors a matrix of n × n numbers, row by row.
    /// \return  whether the pivots are good: positive if the matrix is symmetric (it is then positive definite), else
    ///          not zero
    bool factor(std::size_t n, std::vector<double> matrix, bool is_symmetric) {
        n_ = n;
        a_ = std::move(matrix);
        row_.resize(n);
        for (std::size_t i = 0; i < n; ++i) row_[i] = i;
        for (std::size_t k = 0; k < n; ++k) {
            if (!is_symmetric) {
                std::size_t best = k;
                for (std::size_t i = k + 1; i < n; ++i)
                    if (std::abs(at(i, k)) > std::abs(at(best, k))) best = i;
                std::swap(row_[k], row_[best]);
                for (std::size_t j = 0; j < n && best != k; ++j) std::swap(at(k, j), at(best, j));
            }
            const double pivot = at(k, k);
            if (!(is_symmetric ? pivot > 0 : std::abs(pivot) > 0)) return false;
            for (std::size_t i = k + 1; i < n; ++i) {
                const double part = at(i, k) / pivot;
                at(i, k) = part;
                if (part == 0) continue;
                for (std::size_t j = k + 1; j < n; ++j) at(i, j) -= part * at(k, j);
            }
        }
        return true;
    }
    /// Solves for one right-hand side. \param b  gets the solution
    void solve(std::vector<double>& b) const {
        std::vector<double> x(n_);
        for (std::size_t i = 0; i < n_; ++i) {
            x[i] = b[row_[i]];
            for (std::size_t j = 0; j < i; ++j) x[i] -= at(i, j) * x[j];
        }
        for (std::size_t i = n_; i-- > 0;) {
            for (std::size_t j = i + 1; j < n_; ++j) x[i] -= at(i, j) * x[j];
            x[i] /= at(i, i);
        }
        b = std::move(x);
    }

private:
    double& at(std::size_t i, std::size_t j) { return a_[i * n_ + j]; }
    double at(std::size_t i, std::size_t j) const { return a_[i * n_ + j]; }

    std::size_t n_ = 0;
    std::vector<double> a_;
    std::vector<std::size_t> row_;
};

}  // namespace firn::inline FIRN_BUILD
