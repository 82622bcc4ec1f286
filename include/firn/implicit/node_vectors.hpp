/// \file Vectors of the nodes, in layers of a grid, for solvers: sums and scalar products with the same bits for any
/// number of threads.
///
/// A vector has node_width numbers of each node, of which the first D count. The others are zero, so they may take part
/// in sums and products.
#pragma once

#include <firn/core/exact_sum.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/sparse_grid.hpp>

#include <algorithm>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Vectors of the nodes of one grid. Vectors are given by the layers that hold them, k = 0 for the present numbers.
template <std::floating_point S, int D>
class NodeVectors {
public:
    /// Takes the vectors of a grid, which must exist as long as this object. \param threads  0: thread_count() chooses
    NodeVectors(SparseGrid<S, D>& grid, int threads) : grid_(grid), threads_(threads) {}

    SparseGrid<S, D>& grid() const { return grid_; }  ///< The grid.
    int threads() const { return threads_; }          ///< The number of threads that was asked for.
    /// The numbers of a vector; those of a layer k > 0 must be there. \see make
    S* numbers(std::size_t k) const { return k == 0 ? grid_.nodes(0) : grid_.layer(k); }
    /// Number of numbers of a vector.
    std::size_t size() const { return grid_.block_count() * per_block; }

    /// Sets a vector to zero, and makes its layer if it is not there.
    void make(std::size_t k) const {
        if (k > 0 && !grid_.layer(k)) {
            grid_.exchange(k, threads_);  // makes the layer, which then holds the present numbers
            grid_.exchange(k, threads_);
        }
        fill(k, S(0));
    }
    /// Sets all numbers that count of a vector to `value`. \param k  the vector
    void fill(std::size_t k, S value) const {
        for_blocks([to = numbers(k), value](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) to[i] = i % node_width < D ? value : S(0);
        });
    }
    /// Copies vector `from` to vector `to`.
    void copy(std::size_t to, std::size_t from) const {
        for_blocks([a = numbers(to), b = numbers(from)](std::size_t first, std::size_t last) {
            std::copy(b + first, b + last, a + first);
        });
    }
    /// Computes y ← s x. \param y, x  the vectors
    void set(std::size_t y, double s, std::size_t x) const {
        for_blocks([to = numbers(y), from = numbers(x), s = S(s)](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) to[i] = s * from[i];
        });
    }
    /// Computes y ← y + s x. \param y, x  the vectors
    void add(std::size_t y, double s, std::size_t x) const {
        for_blocks([to = numbers(y), from = numbers(x), s = S(s)](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) to[i] = to[i] + s * from[i];
        });
    }
    /// Computes y ← y + s x for the numbers that count, where the others of x may be anything: masses.
    void add_vectors(std::size_t y, double s, std::size_t x) const {
        for_blocks([to = numbers(y), from = numbers(x), s = S(s)](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; i += node_width)
                for (std::size_t k = i; k < i + std::size_t(D); ++k) to[k] = to[k] + s * from[k];
        });
    }
    /// Computes y ← x + s y. \param y, x  the vectors
    void scale_and_add(std::size_t y, double s, std::size_t x) const {
        for_blocks([to = numbers(y), from = numbers(x), s = S(s)](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) to[i] = from[i] + s * to[i];
        });
    }
    /// Returns the scalar product of two vectors, summed in double.
    double dot(std::size_t x, std::size_t y) const {
        sums_.resize((grid_.block_count() + together - 1) / together);
        for_blocks([&, a = numbers(x), b = numbers(y)](std::size_t first, std::size_t last) {
            std::array<double, node_width> sum{};
            for (std::size_t i = first; i < last; i += node_width)
                for (std::size_t k = 0; k < node_width; ++k) sum[k] += double(a[i + k]) * double(b[i + k]);
            sums_[first / (together * per_block)] = (sum[0] + sum[1]) + (sum[2] + sum[3]);
        });
        ExactSum all;
        all.add(sums_);
        return all.value();
    }

private:
    static constexpr std::size_t per_block = std::size_t(block_nodes<D> * node_width), together = 16;

    /// Calls f(first, last) for the numbers of a few blocks. Which blocks go together does not depend on the threads.
    template <class F>
    void for_blocks(const F& f) const {
        const std::size_t blocks = grid_.block_count();
        parallel_for((blocks + together - 1) / together, thread_count(threads_), [&](std::size_t i, int) {
            f(i * together * per_block, std::min((i + 1) * together, blocks) * per_block);
        });
    }

    SparseGrid<S, D>& grid_;
    int threads_;
    mutable std::vector<double> sums_;
};

}  // namespace firn::inline FIRN_BUILD
