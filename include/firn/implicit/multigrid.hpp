/// \file A geometric multigrid preconditioner for implicit steps: its iterations do not grow with the number of cells.
///
/// The finest level has no matrix: its products are those of the problem. The first coarse level, with cells of twice
/// the size, has a matrix that is summed up from the particles; those of coarser levels follow from it. All smoothers
/// are Chebyshev polynomials of block Jacobi, and the coarsest level is solved directly.
///
/// Small nodes, which follow others, get no correction from coarse levels; the matrices of these count all the same
/// what they would do as independent nodes. Without that, coarse levels are too soft at surfaces, and iterations grow.
/// Nodes behind mirrored walls move with their images on all levels.
#pragma once

#include <firn/implicit/coarse_hessian.hpp>
#include <firn/implicit/dense_solver.hpp>

#include <memory>
#include <optional>

namespace firn::inline FIRN_BUILD {

/// How a multigrid is made.
struct MultigridRule {
    int degree = 2;            ///< Degree of the smoother's polynomial, from 1 on: a cycle takes 2 degree products.
    double range = 8;          ///< Largest eigenvalue that the smoother damps, as a multiple of the smallest one [1].
    double safety = 1.15;      ///< Factor of the largest eigenvalue that power iterations find [1].
    int first_iterations = 8;  ///< Number of power iterations on a new grid; without a potential, on all coarse levels.
    int later_iterations = 1;  ///< Number of power iterations in each later renew(): they go on from the last ones.
    /// Of matter without a potential, the least eigenvalue that smoothers of coarse levels count on; elastic matter has
    /// about 3. Stiffness changes so much where matter begins to flow that power iterations find too little, and
    /// smoothers that damp too little diverge.
    double least = 4;
    std::size_t coarsest = 40;  ///< Number of nodes from which on a level is solved directly.
};

/// What a multigrid is like.
struct MultigridReport {
    std::vector<std::size_t> nodes{};   ///< Number of nodes of each level, the finest one first.
    std::vector<double> eigenvalues{};  ///< Largest eigenvalue of each level that has a smoother, with its safety [1].
    /// Whether the preconditioner is positive definite as a multigrid. If not, block Jacobi takes its place.
    bool is_definite = true;
};

/// The multigrid preconditioner of a problem: a symmetric V-cycle, as long as the problem is symmetric. Its results
/// have the same bits for any number of threads.
/// \tparam Problem  LinearSystem or StepProblem
template <class Problem>
class Multigrid {
    using Potential = std::remove_cvref_t<decltype(std::declval<Problem&>().potential())>;
    using Kernel = typename Potential::kernel_type;
    using S = typename Potential::scalar_type;
    static constexpr int D = Potential::dimension;

public:
    using Level = StencilLevel<S, D, coarse_support<Kernel> - 1>;  ///< A coarse level.
    static constexpr std::size_t layers = 3;                       ///< Number of layers of the grid that it uses.

    /// Makes a multigrid. \param first_layer  the first of the `layers` layers of the grid that it uses
    /// \throws parameter_error  if the degree or a number of iterations is not positive, or the range not above 1
    Multigrid(const MultigridRule& rule, std::size_t first_layer)
        : rule_(rule), r_(first_layer), d_(first_layer + 1), v_(first_layer + 2) {
        if (rule.degree < 1 || rule.first_iterations < 1 || rule.later_iterations < 1 || !(rule.range > 1) ||
            !(rule.safety >= 1))
            throw parameter_error(
                sentence("A multigrid takes a degree and numbers of iterations from 1 on, a range "
                         "above 1 and a safety from 1 on; not ",
                         rule.degree, ", ", rule.first_iterations, ", ", rule.later_iterations, ", ", rule.range,
                         " and ", rule.safety, "."));
    }

    /// Renews the preconditioner, at the last displacement of the problem. Overwrites the present numbers.
    void renew(Problem& problem) {
        const auto vectors = problem.vectors();
        workers_ = thread_count(vectors.threads());
        parallel_region(workers_, [&] {
            find_blocks(problem);
            if (!has_same_nodes(vectors.grid())) find_levels(vectors.grid());
            fill_levels(problem);
            const bool is_new = !vectors.grid().layer(v_) || !(eigenvalue_ > 0);
            if (is_new) start_power_iterations(vectors);
            power_iterations(problem, is_new ? rule_.first_iterations : rule_.later_iterations);
            for (const std::size_t k : {r_, d_})
                if (!vectors.grid().layer(k)) vectors.make(k);
        });
    }
    /// Applies the preconditioner: z ← V-cycle of r. \param z, r  layers; r keeps its numbers
    void apply(Problem& problem, std::size_t z, std::size_t r) {
        const auto vectors = problem.vectors();
        workers_ = thread_count(vectors.threads());
        parallel_region(workers_, [&] {
            if (is_definite_) {
                cycle(problem, z, r);
                if (!Potential::is_symmetric || !(vectors.dot(z, r) < 0)) return;
                is_definite_ = false;
            }
            vectors.copy(r_, r);
            vectors.fill(z, S(0));
            step(vectors, z, 0, 1);
        });
    }

    /// What the multigrid is like after renew().
    MultigridReport report() const {
        MultigridReport all{{at_.size()}, {eigenvalue_}, is_definite_};
        for (std::size_t k = 0; k < levels_.size(); ++k) {
            all.nodes.push_back(levels_[k]->size());
            if (k + 1 < levels_.size() || !is_direct_) all.eigenvalues.push_back(eigenvalues_[k]);
        }
        return all;
    }
    /// The coarse levels, the finest of them first.
    const std::vector<std::unique_ptr<Level>>& levels() const { return levels_; }
    /// For each node of the grid, bit a: whether it has matter and is free along axis a.
    const std::vector<std::uint8_t>& free() const { return free_; }

private:
    static constexpr std::size_t most_direct = 768;  // unknowns of the coarsest level

    // The finest level.

    /// Finds the smoother's blocks, and which nodes are free.
    void find_blocks(Problem& problem) {
        hessian_diagonal(problem.potential(), blocks_);
        if constexpr (requires { problem.add_diagonal(blocks_); }) problem.add_diagonal(blocks_);
        const std::size_t nodes = blocks_.size() / std::size_t(D * D);
        was_free_ = std::move(free_);
        free_.assign(nodes, 0);
        follows_.assign(nodes, 0);
        detail::for_chunks(nodes, workers_, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                for (std::size_t k = 0; k < std::size_t(D * D); ++k)
                    if (blocks_[i * std::size_t(D * D) + k] != S(0)) free_[i] = (1 << D) - 1;
        });
        const auto& mirrored = problem.constraints().mirrored();
        for (const std::uint32_t i : problem.small_nodes().nodes()) follows_[i] = 1;
        was_images_ = std::move(images_);
        images_.assign(mirrored.nodes().empty() ? 0 : nodes, 0);
        for (std::size_t k = 0; k < mirrored.nodes().size(); ++k) {
            const std::uint32_t i = mirrored.nodes()[k], image = mirrored.masters()[k];
            images_[i] = mirrored.images()[k];
            follows_[i] = 1;
            free_[image] |= free_[i];
        }
        mirrored.fold_blocks(blocks_.data(), workers_);
        problem.small_nodes().fold_blocks(blocks_.data(), workers_);
        mirrored.fold_blocks(blocks_.data(), workers_);
        // A held node keeps P B P on its free part.
        const auto hold = [&](std::size_t i, const Mat<S, D>& free) {
            if (free_[i] == 0) return;
            Mat<S, D> block;
            for (int k = 0; k < D * D; ++k) block.m[k] = blocks_[i * std::size_t(D * D) + std::size_t(k)];
            S size = S(0);
            for (int a = 0; a < D; ++a) size += block(a, a) / S(D);
            block = transpose(free) * block * free + (Mat<S, D>::identity() - free) * size;
            for (int k = 0; k < D * D; ++k) blocks_[i * std::size_t(D * D) + std::size_t(k)] = block.m[k];
            for (int a = 0; a < D; ++a)
                if (!(free(a, a) > S(0.5))) free_[i] = std::uint8_t(free_[i] & ~(1 << a));
        };
        mirrored.for_on_walls(hold);
        problem.constraints().for_held(hold);
        for (std::size_t k = 0; k < mirrored.nodes().size(); ++k)
            free_[mirrored.nodes()[k]] &= free_[mirrored.masters()[k]];
        jacobi_.emplace(blocks_, workers_);
    }
    /// d ← s d + t B⁻¹ r, x ← x + d.
    void step(const NodeVectors<S, D>& vectors, std::size_t x, S s, S t) const {
        detail::for_chunks(free_.size(), workers_,
                           [&, to = vectors.numbers(x), d = vectors.numbers(d_), r = vectors.numbers(r_)](
                               std::size_t first, std::size_t last) {
                               for (std::size_t i = first; i < last; ++i) {
                                   Vec<S, D> rest;
                                   for (int a = 0; a < D; ++a) rest[a] = r[i * node_width + std::size_t(a)];
                                   const Vec<S, D> change = jacobi_->inverse(i) * rest;
                                   for (std::size_t a = 0, k = i * node_width; a < node_width; ++a, ++k) {
                                       const S part = a < std::size_t(D) ? t * change[int(a)] : S(0);
                                       d[k] = s == S(0) ? part : s * d[k] + part;
                                       to[k] += d[k];
                                   }
                               }
                           });
    }
    /// r ← r − A d.
    void reduce(Problem& problem) const {
        problem.multiply(d_);
        problem.vectors().add(r_, -1, 0);
    }
    void start_power_iterations(const NodeVectors<S, D>& vectors) {
        vectors.make(v_);
        S* const v = vectors.numbers(v_);
        for (std::size_t q = 0; q < at_.size(); ++q)
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                v[at_[q] * std::size_t(node_width) + a] = S(std::sin(1.7 * double(q * std::size_t(D) + a) + 0.3) + 0.1);
        normalise(vectors, v_);
    }
    /// Gives a vector the norm 1. \return  its norm before
    static double normalise(const NodeVectors<S, D>& vectors, std::size_t k) {
        const double size = std::sqrt(vectors.dot(k, k));
        if (!(size > 0)) return 0;
        vectors.set(k, 1 / size, k);
        return size;
    }
    void power_iterations(Problem& problem, int count) {
        const auto vectors = problem.vectors();
        for (int k = 0; k < count; ++k) {
            problem.multiply(v_);
            jacobi_->apply(vectors, v_, 0);
            eigenvalue_ = rule_.safety * normalise(vectors, v_);
        }
    }

    // The coarse levels.

    /// Whether the levels fit: whether the grid has the blocks, and the nodes the freedom, of the last time.
    bool has_same_nodes(const SparseGrid<S, D>& grid) const {
        bool same = block_keys_.size() == grid.block_count() && free_ == was_free_ && images_ == was_images_;
        for (std::size_t b = 0; same && b < block_keys_.size(); ++b)
            same = block_keys_[b] == block_key<D>(grid.block(b));
        return same;
    }
    void find_levels(const SparseGrid<S, D>& grid) {
        levels_.clear();
        transfers_.clear();
        at_.clear();
        block_keys_.resize(grid.block_count());
        bool has_copies = false;
        std::array<int, std::size_t(D)> periods{};
        for (int a = 0; a < D; ++a)
            if (grid.domain().periodic[std::size_t(a)]) periods[std::size_t(a)] = grid.domain().cells(a);
        NodeSet<D> finest(periods);
        for (std::size_t b = 0; b < grid.block_count(); ++b) {
            const BlockCoordinate<D> block = grid.block(b);
            block_keys_[b] = block_key<D>(block);
            has_copies = has_copies || grid.contact_group(b) != 0;
            for (int k = 0; k < block_nodes<D>; ++k) {
                const std::size_t i = b * std::size_t(block_nodes<D>) + std::size_t(k);
                if (free_[i] == 0 || (!images_.empty() && images_[i] != 0)) continue;
                at_.push_back(std::uint32_t(i));
                typename NodeSet<D>::Place place = block;
                for (int a = 0; a < D; ++a)
                    place[std::size_t(a)] = block_size * place[std::size_t(a)] + place_in_block<D>(k, a);
                finest.mark(place);
            }
        }
        finest.finish();
        // Copies of the domain's blocks do not wrap as the domain does.
        if (periods[0] > 0 && has_copies) return;
        const NodeSet<D>* fine = &finest;
        while (fine->size() > rule_.coarsest) {
            bool is_even = true;
            for (int& period : periods) is_even = is_even && period % 2 == 0, period /= 2;
            if (!is_even) break;
            NodeSet<D> coarse(periods);
            coarse.mark_parents(*fine);
            coarse.finish();
            if (double(coarse.size()) > 0.8 * double(fine->size())) break;
            levels_.push_back(std::make_unique<Level>(std::move(coarse), workers_));
            transfers_.emplace_back(*fine, levels_.back()->nodes(), workers_);
            fine = &levels_.back()->nodes();
        }
        eigenvalues_.assign(levels_.size(), 0);
        eigenvalue_ = 0;
    }
    void fill_levels(Problem& problem) {
        is_definite_ = true;
        if (levels_.empty()) return;
        for (std::size_t k = 0; k < levels_.size(); ++k) {
            Level& level = *levels_[k];
            level.clear();
            if (k > 0)
                level.add_coarsened(*levels_[k - 1], transfers_[k]);
            else
                add_finest(problem, level);
            const bool is_last = k + 1 == levels_.size();
            is_direct_ = is_last && level.size() * std::size_t(D) <= most_direct;
            if (is_direct_) {
                is_definite_ = factor(level);
            } else {
                level.invert_blocks();
                const bool is_new = !Potential::is_symmetric || !(eigenvalues_[k] > 0);
                if (is_new) level.fill_y();
                eigenvalues_[k] =
                    rule_.safety * level.power_iterations(is_new ? rule_.first_iterations : rule_.later_iterations);
                if (!(eigenvalues_[k] > 0)) is_definite_ = false;
                if (!Potential::is_symmetric) eigenvalues_[k] = std::max(eigenvalues_[k], rule_.least);
            }
        }
    }
    void add_finest(Problem& problem, Level& level) const {
        add_coarse_hessian(problem.potential(), free_.data(), images_.empty() ? nullptr : images_.data(), level);
        if constexpr (requires { problem.inertia(); })
            if (const auto& inertia = problem.inertia()) {
                const auto& mirrored = problem.constraints().mirrored();
                aligned_vector<S> folded;
                if (!mirrored.nodes().empty()) folded = inertia->masses;
                for (std::size_t k = 0; k < mirrored.nodes().size(); ++k)
                    folded[mirrored.masters()[k]] += folded[mirrored.nodes()[k]];
                level.add_coarsened_diagonal(
                    transfers_[0], [&, masses = folded.empty() ? inertia->masses.data() : folded.data(),
                                    per_square = S(1 / (inertia->dt * inertia->dt))](std::size_t q) {
                        Vec<S, D> diagonal;
                        for (int a = 0; a < D; ++a)
                            diagonal[a] = (free_[at_[q]] >> a & 1) != 0 ? masses[at_[q]] * per_square : S(0);
                        return diagonal;
                    });
            }
    }
    bool factor(const Level& level) {
        const std::vector<double> matrix = level.dense();
        const std::size_t n = level.size() * std::size_t(D);
        // Coarse nodes by which few fine nodes move can depend on each other: pivots are then zero but for rounding, or
        // negative, as matter under pressure has less stiffness. A larger diagonal mends both.
        for (double more = sizeof(S) == 4 ? 1e-5 : 1e-10; more < 1e-2; more *= 10) {
            std::vector<double> raised = matrix;
            for (std::size_t i = 0; i < n; ++i) {
                double& number = raised[i * n + i];
                number = number == 0 ? 1 : number * (1 + more);
            }
            if (direct_.factor(n, std::move(raised), Potential::is_symmetric)) return true;
        }
        return false;
    }

    // The cycle.

    /// Calls step(s, t) and reduce() for one polynomial, from the residual in r on. The last reduce() is left out.
    template <class Step, class Reduce>
    void smooth(double largest, const Step& step, const Reduce& reduce) const {
        const double least = largest / rule_.range, centre = (largest + least) / 2, half = (largest - least) / 2;
        double rho = half / centre;
        step(S(0), S(1 / centre));
        for (int k = 1; k < rule_.degree; ++k) {
            reduce();
            const double next = 1 / (2 * centre / half - rho);
            step(S(next * rho), S(2 * next / half));
            rho = next;
        }
    }
    void cycle(Problem& problem, std::size_t z, std::size_t r) {
        const auto vectors = problem.vectors();
        vectors.copy(r_, r);
        vectors.fill(z, S(0));
        const auto smooth_here = [&] {
            smooth(eigenvalue_, [&](S s, S t) { step(vectors, z, s, t); }, [&] { reduce(problem); });
        };
        smooth_here();
        if (levels_.empty()) return;
        reduce(problem);
        Level& coarse = *levels_[0];
        transfers_[0].restrict_to(coarse.r.data(), coarse.size(), workers_,
                                  [&, from = vectors.numbers(r_)](std::size_t q) {
                                      const std::size_t i = at_[q];
                                      Vec<S, D> v;
                                      for (int a = 0; a < D; ++a)
                                          v[a] = moves(i, a) ? from[i * node_width + std::size_t(a)] : S(0);
                                      return v;
                                  });
        coarse_cycle(0);
        vectors.fill(d_, S(0));
        transfers_[0].prolong(coarse.x.data(), workers_, [&, to = vectors.numbers(d_)](std::size_t q, const auto& v) {
            const std::size_t i = at_[q];
            for (int a = 0; a < D; ++a) to[i * node_width + std::size_t(a)] = moves(i, a) ? v[a] : S(0);
        });
        vectors.add(z, 1, d_);
        reduce(problem);
        smooth_here();
    }
    bool moves(std::size_t i, int axis) const { return follows_[i] == 0 && (free_[i] >> axis & 1) != 0; }
    void coarse_cycle(std::size_t k) {
        Level& level = *levels_[k];
        const bool is_last = k + 1 == levels_.size();
        if (is_last && is_direct_) {
            const std::size_t n = level.size() * std::size_t(D);
            std::vector<double> b(level.r.begin(), level.r.begin() + std::ptrdiff_t(n));
            direct_.solve(b);
            for (std::size_t i = 0; i < n; ++i) level.x[i] = S(b[i]);
            return;
        }
        std::fill(level.x.begin(), level.x.end(), S(0));
        const auto smooth_here = [&] {
            smooth(eigenvalues_[k], [&](S s, S t) { level.step(s, t); }, [&] { level.reduce(); });
        };
        smooth_here();
        if (is_last) return;
        level.reduce();
        Level& coarse = *levels_[k + 1];
        const int workers = level.size() < 256 ? 1 : workers_;
        transfers_[k + 1].restrict_to(coarse.r.data(), coarse.size(), workers,
                                      [&](std::size_t i) { return level.get(level.r, i); });
        coarse_cycle(k + 1);
        transfers_[k + 1].prolong(coarse.x.data(), workers,
                                  [&](std::size_t i, const auto& v) { level.put(level.d, i, v); });
        for (std::size_t i = 0; i < level.x.size(); ++i) level.x[i] += level.d[i];
        level.reduce();
        smooth_here();
    }

    MultigridRule rule_;
    std::size_t r_, d_, v_;  // layers: residual, direction of the smoother, vector of the power iterations
    int workers_ = 1;
    aligned_vector<S> blocks_;
    std::optional<BlockJacobi<S, D>> jacobi_;
    std::vector<std::uint8_t> free_, was_free_, follows_;
    std::vector<std::uint16_t> images_, was_images_;  // how nodes follow their mirror images; empty if none does
    std::vector<std::uint32_t> at_;                   // the nodes of the grid that are free along any axis
    std::vector<std::uint64_t> block_keys_;
    std::vector<std::unique_ptr<Level>> levels_;
    std::vector<NodeTransfer<D>> transfers_;  // from each level to the next coarser one
    std::vector<double> eigenvalues_;
    double eigenvalue_ = 0;
    DenseSolver direct_;
    bool is_direct_ = false, is_definite_ = true;
};

}  // namespace firn::inline FIRN_BUILD
