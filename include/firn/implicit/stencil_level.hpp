/// \file A coarse level of a multigrid: its nodes, a matrix with a block of D × D numbers for each pair of near nodes,
/// and the smoother's blocks. All results have the same bits for any number of threads.
#pragma once

#include <firn/implicit/block_jacobi.hpp>
#include <firn/implicit/node_set.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

/// How the nodes of a level move by those of the next coarser one.
template <int D>
class NodeTransfer {
public:
    static constexpr int parents = 1 << D;       ///< Number of coarse nodes by which a fine node moves.
    static constexpr int children = 1 << 2 * D;  ///< Number of fine nodes that move by a coarse node.
    using Place = typename NodeSet<D>::Place;    ///< Index of a node along each axis.

    /// Finds the parents and children of all nodes. \param coarse  the parents of all nodes of `fine`
    NodeTransfer(const NodeSet<D>& fine, const NodeSet<D>& coarse, int workers) {
        firn::renew(parents_, fine.size() * std::size_t(parents), workers);
        firn::renew(parities_, fine.size(), workers);
        firn::renew(children_, coarse.size() * std::size_t(children), workers);
        parallel_for(
            fine.size(), workers,
            [&](std::size_t i, int) {
                Place place = fine.place(i);
                unsigned parity = 0;
                for (int& along : place) {
                    parity = 2 * parity + unsigned(along & 1);
                    along = first_parent(along);
                }
                coarse.indices(place, 2, parents_.data() + i * std::size_t(parents));
                parities_[i] = std::uint8_t(parity);
            },
            64);
        parallel_for(
            coarse.size(), workers,
            [&](std::size_t i, int) {
                Place place = coarse.place(i);
                for (int& along : place) along = first_child(along);
                fine.indices(place, children_along_axis, children_.data() + i * std::size_t(children));
            },
            64);
    }
    /// The coarse nodes by which a fine node moves, the last axis fastest.
    const std::uint32_t* parents_of(std::size_t fine) const { return parents_.data() + fine * std::size_t(parents); }
    /// The fine nodes that move by a coarse node, or no_node, the last axis fastest.
    const std::uint32_t* children_of(std::size_t coarse) const {
        return children_.data() + coarse * std::size_t(children);
    }
    /// Sets the vector of coarse nodes to the means' transpose of that of fine nodes.
    /// \param read  read(i): the vector of fine node i
    template <std::floating_point S, class Read>
    void restrict_to(S* coarse, std::size_t nodes, int workers, const Read& read) const {
        static constexpr auto weights = child_weights<S>();
        parallel_for(
            nodes, workers,
            [&](std::size_t i, int) {
                Vec<S, D> sum = Vec<S, D>::zero();
                const std::uint32_t* const from = children_of(i);
                for (int k = 0; k < children; ++k)
                    if (from[k] != no_node) sum += read(from[k]) * weights[std::size_t(k)];
                for (int a = 0; a < D; ++a) coarse[i * std::size_t(D) + std::size_t(a)] = sum[a];
            },
            64);
    }
    /// Calls write(i, v) for all fine nodes, with the means v of the vectors of their parents.
    template <std::floating_point S, class Write>
    void prolong(const S* coarse, int workers, const Write& write) const {
        static constexpr auto weights = parent_weights<S>();
        parallel_for(
            parities_.size(), workers,
            [&](std::size_t i, int) {
                Vec<S, D> sum = Vec<S, D>::zero();
                const std::uint32_t* const from = parents_of(i);
                const auto& of = weights[parities_[i]];
                for (std::size_t k = 0; k < std::size_t(parents); ++k)
                    for (int a = 0; a < D; ++a) sum[a] += of[k] * coarse[from[k] * std::size_t(D) + std::size_t(a)];
                write(i, sum);
            },
            64);
    }

    /// The weights of the children of any node.
    template <std::floating_point S>
    static constexpr std::array<S, std::size_t(children)> child_weights() {
        std::array<S, std::size_t(children)> weights{};
        for (int k = 0; k < children; ++k) {
            double weight = 1;
            for (int a = 0; a < D; ++a) {
                const int along = k >> 2 * a & 3;
                weight *= along == 0 || along == 3 ? 0.25 : 0.75;
            }
            weights[std::size_t(k)] = S(weight);
        }
        return weights;
    }
    /// The weights of the parents of a node, for each parity of its place: bit D − 1 − a is that along axis a.
    template <std::floating_point S>
    static constexpr auto parent_weights() {
        std::array<std::array<S, std::size_t(parents)>, std::size_t(parents)> weights{};
        for (int parity = 0; parity < parents; ++parity)
            for (int k = 0; k < parents; ++k) {
                double weight = 1;
                for (int a = 0; a < D; ++a) weight *= parent_weight(parity >> a & 1, k >> a & 1);
                weights[std::size_t(parity)][std::size_t(k)] = S(weight);
            }
        return weights;
    }

private:
    aligned_vector<std::uint32_t> parents_, children_;
    aligned_vector<std::uint8_t> parities_;
};

/// A coarse level. \tparam R  how far two nodes may lie apart that have a block in the matrix [nodes]
template <std::floating_point S, int D, int R>
class StencilLevel {
public:
    static constexpr int width = 2 * R + 1;  ///< Number of blocks of a row along each axis.
    static constexpr int blocks = D == 2 ? width * width : width * width * width;  ///< Number of blocks of a row.
    static constexpr int centre = blocks / 2;                             ///< Index of the block of a node with itself.
    static constexpr std::size_t row_size = std::size_t(blocks * D * D);  ///< Number of numbers of a row.
    using Place = typename NodeSet<D>::Place;                             ///< Index of a node along each axis.

    /// Makes the level of some nodes, with a matrix of zeros.
    StencilLevel(NodeSet<D> nodes, int workers) : nodes_(std::move(nodes)), workers_(workers) {
        firn::renew(neighbours_, size() * std::size_t(blocks), workers);
        firn::renew(matrix_, size() * row_size + packs * lanes, workers);  // packs read beyond the last row
        spread_.assign((size() + 1) * std::size_t(packs * lanes), S(0));
        for (auto* const vector : {&x, &r, &d, &y}) vector->assign((size() + 1) * std::size_t(D), S(0));
        for_nodes([&](std::size_t i) {
            Place low = nodes_.place(i);
            for (int& along : low) along -= R;
            std::uint32_t* const to = neighbours_.data() + i * std::size_t(blocks);
            nodes_.indices(low, width, to);
            for (int k = 0; k < blocks; ++k) to[k] = std::min(to[k], std::uint32_t(size()));
        });
        find_colours();
        clear();
    }

    // Vectors of the smoother, with a zero behind the last node.
    aligned_vector<S> x,  ///< The solution.
        r,                ///< The residual.
        d,                ///< The direction.
        y;                ///< A product.

    std::size_t size() const { return nodes_.size(); }  ///< Number of nodes.
    const NodeSet<D>& nodes() const { return nodes_; }  ///< The nodes.
    /// The blocks of one node with the nodes around it, the last axis fastest, each column by column.
    S* row(std::size_t i) { return matrix_.data() + i * row_size; }
    /// The blocks of one node with the nodes around it.
    const S* row(std::size_t i) const { return matrix_.data() + i * row_size; }
    /// The nodes around a node, as in its row; size() where there is none.
    const std::uint32_t* neighbours(std::size_t i) const { return neighbours_.data() + i * std::size_t(blocks); }
    /// The index of a block in a row. \param offset  of the other node, along each axis
    static constexpr int block_of(const Place& offset) {
        int k = 0;
        for (const int along : offset) k = k * width + along + R;
        return k;
    }

    /// Sets the matrix to zero.
    void clear() { detail::fill_chunks(matrix_, S(0), workers_); }
    /// Sets the blocks before the middle of each row from those after it, as the matrix is symmetric.
    void mirror() {
        for_nodes([&](std::size_t i) {
            for (int k = 0; k < centre; ++k) {
                const std::uint32_t other = neighbours(i)[k];
                if (other == size()) continue;
                S* const to = row(i) + k * D * D;
                const S* const from = row(other) + (blocks - 1 - k) * D * D;
                for (int a = 0; a < D; ++a)
                    for (int b = 0; b < D; ++b) to[a + D * b] = from[b + D * a];
            }
        });
    }
    /// Adds the matrix of the next finer level, weighted on both sides.
    void add_coarsened(const StencilLevel& fine, const NodeTransfer<D>& transfer) {
        for_cells([&](std::size_t cell) {
            const std::uint32_t* const children = transfer.children_of(cell);
            for (int q = 0; q < 1 << D; ++q) {
                const std::uint32_t i = children[child_in_cell(q)];
                if (i != no_node) add_row(cell, q, fine.row(i));
            }
        });
    }
    /// Adds a diagonal matrix of the next finer level, weighted on both sides. \param of  of(i): that of fine node i
    template <class OfNode>
    void add_coarsened_diagonal(const NodeTransfer<D>& transfer, const OfNode& of) {
        static constexpr auto weights = NodeTransfer<D>::template parent_weights<S>();
        for_cells([&](std::size_t cell) {
            const std::uint32_t* const children = transfer.children_of(cell);
            for (int q = 0; q < 1 << D; ++q) {
                const std::uint32_t i = children[child_in_cell(q)];
                if (i == no_node) continue;
                const Vec<S, D> diagonal = of(i);
                const auto& mine = weights[std::size_t(q ^ ((1 << D) - 1))];  // 2 I − 1 is odd, 2 I is even
                for (int e = 0; e < 1 << D; ++e) {
                    S* const to = row(corner(cell, e));
                    for (int f = 0; f < 1 << D; ++f) {
                        Place offset{};
                        for (int a = 0; a < D; ++a)
                            offset[std::size_t(a)] = (f >> (D - 1 - a) & 1) - (e >> (D - 1 - a) & 1);
                        const S part = mine[std::size_t(e)] * mine[std::size_t(f)];
                        for (int a = 0; a < D; ++a) to[block_of(offset) * D * D + a * (D + 1)] += part * diagonal[a];
                    }
                }
            }
        });
    }

    /// Inverts the blocks of the smoother.
    void invert_blocks() {
        inverses_.resize(size());
        for_nodes([&](std::size_t i) { inverses_[i] = BlockJacobi<S, D>::inverse_of(row(i) + centre * D * D); });
    }
    /// d ← s d + t B⁻¹ r, x ← x + d. \param s  0: d may hold anything
    void step(S s, S t) {
        for_nodes([&](std::size_t i) {
            const Vec<S, D> change = inverses_[i] * get(r, i);
            for (std::size_t a = 0, k = i * std::size_t(D); a < std::size_t(D); ++a, ++k) {
                d[k] = s == S(0) ? t * change[int(a)] : s * d[k] + t * change[int(a)];
                x[k] += d[k];
            }
        });
    }
    /// r ← r − A d.
    void reduce() {
        spread(d);
        for_nodes([&](std::size_t i) {
            const Vec<S, D> product = product_of(i);
            for (std::size_t a = 0; a < std::size_t(D); ++a) r[i * std::size_t(D) + a] -= product[int(a)];
        });
    }
    /// Power iterations for the largest eigenvalue of B⁻¹ A, from the vector in y. \return  the last ratio of norms
    double power_iterations(int count) {
        double ratio = 0;
        for (int k = 0; k < count; ++k) {
            const double before = norm(y);
            if (!(before > 0)) return 0;
            spread(y);
            for_nodes([&](std::size_t i) { put(d, i, inverses_[i] * product_of(i)); });
            const double after = norm(d);
            ratio = after / before;
            for_nodes([&](std::size_t i) { put(y, i, get(d, i) * S(after > 0 ? 1 / after : 0)); });
        }
        return ratio;
    }
    /// Sets y to numbers as from chance.
    void fill_y() {
        for (std::size_t k = 0; k < size() * std::size_t(D); ++k) y[k] = S(std::sin(1.7 * double(k) + 0.3) + 0.1);
    }
    /// Returns the matrix, row by row.
    std::vector<double> dense() const {
        const std::size_t n = size() * std::size_t(D);
        std::vector<double> all(n * n);
        for (std::size_t i = 0; i < size(); ++i)
            for (std::size_t k = 0; k < std::size_t(blocks); ++k) {
                const std::size_t j = neighbours(i)[k];
                if (j == size()) continue;
                for (std::size_t a = 0; a < std::size_t(D); ++a)
                    for (std::size_t b = 0; b < std::size_t(D); ++b)
                        all[(i * std::size_t(D) + a) * n + j * std::size_t(D) + b] +=
                            double(row(i)[k * std::size_t(D * D) + a + std::size_t(D) * b]);
            }
        return all;
    }
    /// Returns the vector of one node.
    static Vec<S, D> get(const aligned_vector<S>& v, std::size_t i) {
        Vec<S, D> of_node;
        for (int a = 0; a < D; ++a) of_node[a] = v[i * std::size_t(D) + std::size_t(a)];
        return of_node;
    }
    /// Sets the vector of one node.
    static void put(aligned_vector<S>& v, std::size_t i, const Vec<S, D>& of_node) {
        for (int a = 0; a < D; ++a) v[i * std::size_t(D) + std::size_t(a)] = of_node[a];
    }
    /// Calls f(i) for all nodes, on several threads.
    template <class F>
    void for_nodes(const F& f) const {
        parallel_for(size(), size() < 256 ? 1 : workers_, [&](std::size_t i, int) { f(i); }, 32);
    }

private:
    using P = native_pack<S>;
    static constexpr int lanes = scalar_traits<P>::lanes;
    static constexpr int packs = (D * D + lanes - 1) / lanes;  // of a block

    // A cell is the 2^D nodes whose first parent is one coarse node I: those at 2 I − 1 and 2 I along each axis.
    static constexpr int child_in_cell(int q) {
        int k = 0;
        for (int a = 0; a < D; ++a) k = 4 * k + 2 + (q >> (D - 1 - a) & 1);
        return k;
    }
    std::size_t corner(std::size_t cell, int e) const {
        Place offset{};
        for (int a = 0; a < D; ++a) offset[std::size_t(a)] = e >> (D - 1 - a) & 1;
        return neighbours(cell)[block_of(offset)];
    }
    /// Adds the row of node q of a cell of the finer level.
    void add_row(std::size_t cell, int q, const S* from) {
        // The parents of the nodes around: `half` before the cell's own node, to half + 1 behind it.
        constexpr int half = (R + 1) / 2, window = 2 * half + 2;
        constexpr int all = D == 2 ? window * window : window * window * window;
        static constexpr auto weights = NodeTransfer<D>::template parent_weights<S>();
        S sums[all][D * D] = {};
        for (int k = 0; k < blocks; ++k) {
            int first = 0, parity = 0;
            for (int a = 0, rest = k, size_of_rest = blocks / width; a < D; ++a) {
                const int o = rest / size_of_rest - R - 1 + (q >> (D - 1 - a) & 1);  // from 2 I
                rest %= size_of_rest, size_of_rest /= width;
                first = first * window + ((o + 1) >> 1) + half;
                parity = 2 * parity + (o & 1);
            }
            const S* const block = from + k * D * D;
            for (int e = 0; e < 1 << D; ++e) {
                S* const to = sums[first + in_box(e, window)];
                const S weight = weights[std::size_t(parity)][std::size_t(e)];
                for (int n = 0; n < D * D; ++n) to[n] += weight * block[n];
            }
        }
        const auto& mine = weights[std::size_t(q ^ ((1 << D) - 1))];
        for (int e = 0; e < 1 << D; ++e) {
            // The window begins at −half; the row of the parent at −R from the parent.
            int begin = 0;
            for (int a = 0; a < D; ++a) begin = begin * width + R - half - (e >> (D - 1 - a) & 1);
            S* const to = row(corner(cell, e)) + begin * D * D;
            for (int line = 0; line < all / window; ++line) {
                const int at = D == 2 ? line * width : line / window * width * width + line % window * width;
                const S* const sum = sums[line * window];
                for (int n = 0; n < window * D * D; ++n) to[at * D * D + n] += mine[std::size_t(e)] * sum[n];
            }
        }
    }
    static constexpr int in_box(int e, int width_of_box) {
        int k = 0;
        for (int a = 0; a < D; ++a) k = k * width_of_box + (e >> (D - 1 - a) & 1);
        return k;
    }
    /// Calls f for all cells. Those that are worked on at the same time share no parent.
    template <class F>
    void for_cells(const F& f) const {
        parallel_phases(
            std::span<const std::size_t>(counts_), workers_,
            [&](std::size_t phase, std::size_t i, int) { f(by_colour_[begins_[phase] + i]); }, 8);
    }
    void find_colours() {
        std::array<std::vector<std::uint32_t>, std::size_t(D == 2 ? 9 : 27)> of_colour;
        for (std::size_t i = 0; i < size(); ++i) {
            std::size_t colour = 0;
            for (std::size_t a = 0; a < std::size_t(D); ++a) {
                const int along = nodes_.place(i)[a], period = nodes_.periods()[a];
                colour = 3 * colour + std::size_t(period % 2 == 1 && along == period - 1 ? 2 : along & 1);
            }
            of_colour[colour].push_back(std::uint32_t(i));
        }
        for (const auto& one : of_colour) {
            begins_.push_back(by_colour_.size());
            counts_.push_back(one.size());
            by_colour_.insert(by_colour_.end(), one.begin(), one.end());
        }
    }
    /// Writes each number of a vector as often as a column of a block has numbers, for product_of().
    void spread(const aligned_vector<S>& v) {
        for_nodes([&](std::size_t i) {
            S* const to = spread_.data() + i * std::size_t(packs * lanes);
            for (int b = 0; b < D; ++b)
                for (int a = 0; a < D; ++a) to[a + D * b] = v[i * std::size_t(D) + std::size_t(b)];
        });
    }
    Vec<S, D> product_of(std::size_t i) const {
        const std::uint32_t* const near = neighbours(i);
        const S* block = row(i);
        P sums[2][packs];  // two chains of sums
        for (auto& chain : sums)
            for (P& sum : chain) sum = P(0);
        const auto add = [&](P* chain, int k) FIRN_LAMBDA {
            const S* const vector = spread_.data() + near[k] * std::size_t(packs * lanes);
            for (int p = 0; p < packs; ++p)  // beyond a block are numbers of the next one, times zero
                chain[p] = chain[p] + P::load(block + k * D * D + p * lanes) * P::load(vector + p * lanes);
        };
        for (int k = 0; k + 1 < blocks; k += 2) {
            add(sums[0], k);
            add(sums[1], k + 1);
        }
        add(sums[0], blocks - 1);
        S numbers[packs * lanes];
        for (int p = 0; p < packs; ++p) (sums[0][p] + sums[1][p]).store(numbers + p * lanes);
        Vec<S, D> product = Vec<S, D>::zero();
        for (int b = 0; b < D; ++b)
            for (int a = 0; a < D; ++a) product[a] += numbers[a + D * b];
        return product;
    }
    double norm(const aligned_vector<S>& v) const {
        double sum = 0;
        for (std::size_t k = 0; k < size() * std::size_t(D); ++k) sum += double(v[k]) * double(v[k]);
        return std::sqrt(sum);
    }

    NodeSet<D> nodes_;
    int workers_;
    aligned_vector<std::uint32_t> neighbours_;
    aligned_vector<S> matrix_, spread_;
    std::vector<Mat<S, D>> inverses_;
    std::vector<std::uint32_t> by_colour_;
    std::vector<std::size_t> begins_, counts_;
};

}  // namespace firn::inline FIRN_BUILD
