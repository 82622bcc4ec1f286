/// \file The block Jacobi preconditioner: each node's own block of the Hessian, inverted.
#pragma once

#include <firn/data/aligned.hpp>
#include <firn/implicit/node_vectors.hpp>
#include <firn/math/inverse.hpp>

namespace firn::inline FIRN_BUILD {

/// Applies the inverses of the diagonal blocks of a Hessian. It is positive definite: where a block is not, the sum of
/// the sizes of its numbers takes its place, which bounds its eigenvalues.
template <std::floating_point S, int D>
class BlockJacobi {
public:
    /// Inverts the blocks. \param blocks  as hessian_diagonal() computes them; nodes with zeros give zeros
    BlockJacobi(const aligned_vector<S>& blocks, int threads) {
        renew(inverses_, blocks.size(), thread_count(threads));
        detail::for_chunks(blocks.size() / std::size_t(D * D), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                const Mat<S, D> of_node = inverse_of(blocks.data() + i * std::size_t(D * D));
                for (int k = 0; k < D * D; ++k) inverses_[i * std::size_t(D * D) + std::size_t(k)] = of_node.m[k];
            }
        });
    }
    /// Computes z ← B⁻¹ r. \param z, r  vectors; they differ
    void apply(const NodeVectors<S, D>& vectors, std::size_t z, std::size_t r) const {
        detail::for_chunks(
            vectors.size() / node_width, vectors.threads(),
            [&, to = vectors.numbers(z), from = vectors.numbers(r)](std::size_t first, std::size_t last) {
                for (std::size_t i = first; i < last; ++i) {
                    Vec<S, D> v;
                    for (int a = 0; a < D; ++a) v[a] = from[i * node_width + std::size_t(a)];
                    const Vec<S, D> of_node = inverse(i) * v;
                    for (int a = 0; a < node_width; ++a)
                        to[i * node_width + std::size_t(a)] = a < D ? of_node[a] : S(0);
                }
            });
    }

    /// Returns the inverse of a node's block, or of the bound that takes its place. \param i  index of the node
    Mat<S, D> inverse(std::size_t i) const {
        Mat<S, D> of_node;
        for (int k = 0; k < D * D; ++k) of_node.m[k] = inverses_[i * std::size_t(D * D) + std::size_t(k)];
        return of_node;
    }

    /// Returns the inverse of the symmetric part of a block, or of the bound that takes its place.
    /// \param numbers  the D × D numbers of the block
    static Mat<S, D> inverse_of(const S* numbers) {
        Mat<S, D> block;
        for (int k = 0; k < D * D; ++k) block.m[k] = numbers[k];
        return inverse_of((block + transpose(block)) * S(0.5));
    }
    /// Returns the inverse of a symmetric block, or of the bound that takes its place; zero of a block of zeros.
    static Mat<S, D> inverse_of(const Mat<S, D>& B) {
        S size = S(0);
        for (const S& number : B.m) size += std::abs(number);
        if (!(size > S(0))) return Mat<S, D>::zero();
        // Sylvester's criterion, with room for rounding.
        const Mat<S, D> relative = B * (S(1) / size);
        const S least = S(64) * std::numeric_limits<S>::epsilon();
        bool is_definite = relative(0, 0) > least && determinant(relative) > least * least;
        if constexpr (D == 3)
            is_definite =
                is_definite && relative(0, 0) * relative(1, 1) - relative(0, 1) * relative(1, 0) > least * least;
        if (!is_definite) return Mat<S, D>::diagonal(S(1) / size);
        return inverse_transposed<S, D>(relative) * (S(1) / size);
    }

private:
    aligned_vector<S> inverses_;
};

}  // namespace firn::inline FIRN_BUILD
