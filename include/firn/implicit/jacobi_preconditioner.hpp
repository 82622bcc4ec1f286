/// \file The block Jacobi preconditioner of an implicit step.
#pragma once

#include <firn/implicit/block_jacobi.hpp>
#include <firn/implicit/diagonal.hpp>

#include <optional>

namespace firn::inline FIRN_BUILD {

/// Preconditions the linear solves of newton() with the diagonal blocks of the Hessian.
template <std::floating_point S, int D>
class JacobiPreconditioner {
public:
    /// Takes the blocks of the Hessian of a problem, at its last displacement.
    template <class Problem>
    void renew(Problem& problem) {
        hessian_diagonal(problem.potential(), blocks_);
        problem.add_diagonal(blocks_);
        jacobi_.emplace(blocks_, problem.vectors().threads());
    }
    /// Sets the vector in layer z to that of layer r, preconditioned. \param z, r  they differ
    template <class Problem>
    void apply(Problem& problem, std::size_t z, std::size_t r) const {
        jacobi_->apply(problem.vectors(), z, r);
    }

private:
    aligned_vector<S> blocks_;
    std::optional<BlockJacobi<S, D>> jacobi_;
};

}  // namespace firn::inline FIRN_BUILD
