/// \file The field whose level is a surface, at the nodes of a sparse lattice: the second part of
/// firn/data/surface.hpp.
#pragma once

#include <firn/data/surface_particles.hpp>

#include <bit>

namespace firn::inline FIRN_BUILD::detail {

/// The field of ellipsoids at the nodes of blocks of 8³ cells, wherever it is not 0. Everything is in an order that
/// depends on the ellipsoids alone, and each block is computed by one worker.
class SurfaceLattice {
    using Lanes = Neighbourhood::Lanes;  // of nodes: two lines of a block

public:
    static constexpr int side = 8;                            ///< nodes of a block along an axis
    static constexpr std::size_t nodes = side * side * side;  ///< of a block

    /// \param cell  side of a cell [m]
    /// \throws parameter_error  if the ellipsoids reach too far for the cells
    /// \throws memory_error     if the blocks do not fit into memory
    SurfaceLattice(const std::vector<Ellipsoid>& ellipsoids, double cell, int threads)
        : cell_(cell), threads_(threads) {
        std::vector<Vec<double, 3>> centres(ellipsoids.size());
        std::vector<std::uint32_t> in_order(ellipsoids.size());
        std::iota(in_order.begin(), in_order.end(), 0U);
        for (std::size_t k = 0; k < ellipsoids.size(); ++k) centres[k] = ellipsoids[k].centre;
        sources_ = boxes_of(centres, std::move(in_order), side * cell, threads);
        kernels_.resize(ellipsoids.size());
        for_chunks(ellipsoids.size(), threads, [&](std::size_t from, std::size_t to) {
            for (std::size_t i = from; i < to; ++i) kernels_[i] = kernel_of(ellipsoids[sources_.order[i]]);
        });
        find_blocks();
        values_.resize(blocks() * nodes);
        parallel_for(blocks(), thread_count(threads), [&](std::size_t b, int) { sum(b); });
    }

    double cell() const { return cell_; }                                            ///< Side of a cell [m].
    int threads() const { return threads_; }                                         ///< As given.
    std::size_t blocks() const { return keys_.size(); }                              ///< Number of blocks.
    BoxIndex block(std::size_t b) const { return sources_.keys.box(keys_[b]); }      ///< Place of a block.
    const float* values(std::size_t b) const { return values_.data() + b * nodes; }  ///< At the nodes, x first.
    static std::size_t node(int i, int j, int k) { return std::size_t(i + side * (j + side * k)); }  ///< Index.

    /// Returns the index of the block at a place, or blocks().
    std::size_t find(const BoxIndex& at) const {
        const auto found = std::lower_bound(keys_.begin(), keys_.end(), sources_.keys(at));
        return found != keys_.end() && *found == sources_.keys(at) ? std::size_t(found - keys_.begin()) : blocks();
    }
    /// Returns the blocks at `at` and one further along each axis, in the order of bits; blocks() where there is none.
    std::array<std::size_t, 8> from(const BoxIndex& at) const {
        std::array<std::size_t, 8> found{};
        for (std::size_t n = 0; n < 8; ++n)
            found[n] = find({at[0] + int(n & 1), at[1] + int(n >> 1 & 1), at[2] + int(n >> 2)});
        return found;
    }
    /// The kernels that reach a block, in cells from the block's corner, lane by lane.
    struct Near {
        std::array<std::vector<float>, 10> numbers{};  ///< centre, metric, height
        std::vector<std::uint32_t> ellipsoid{};        ///< of each kernel
        Vec<double, 3> corner{};                       ///< of the block [cells]
    };
    /// Gets the kernels that reach block b.
    void find_near(std::size_t b, Near& near) const {
        const auto at = block(b);
        for (int a = 0; a < 3; ++a) near.corner[a] = double(side * at[std::size_t(a)]);
        for (auto& numbers : near.numbers) numbers.clear();
        near.ellipsoid.clear();
        for (std::size_t s = first_source_[b]; s < first_source_[b + 1]; ++s)
            for (std::uint32_t i = sources_.first[source_[s]]; i < sources_.first[source_[s] + 1]; ++i) {
                const Kernel& kernel = kernels_[i];
                std::array<float, 3> c{};
                bool meets = kernel.height > 0;
                for (std::size_t a = 0; a < 3; ++a) {
                    c[a] = float(kernel.centre[int(a)] - near.corner[int(a)]);
                    meets = meets && c[a] - kernel.reach[a] <= float(side) && c[a] + kernel.reach[a] >= 0;
                }
                if (!meets) continue;
                for (std::size_t a = 0; a < 3; ++a) near.numbers[a].push_back(c[a]);
                for (std::size_t k = 0; k < 6; ++k) near.numbers[3 + k].push_back(kernel.metric[k]);
                near.numbers[9].push_back(kernel.height);
                near.ellipsoid.push_back(sources_.order[i]);
            }
        for (auto& numbers : near.numbers)  // kernels of height 0
            numbers.resize((numbers.size() + Neighbourhood::lanes - 1) / Neighbourhood::lanes * Neighbourhood::lanes);
    }
    /// Calls f(ellipsoid, w) for each kernel that has a value w above 0 at x [m], in an order that depends on the
    /// ellipsoids alone. Where there is none, calls it for the nearest, with w = 1.
    template <class F>
    void weights(const Near& near, const Vec<double, 3>& x, const F& f) const {
        const auto in_block = x * (1 / cell_) - near.corner;
        const Lanes x0 = float(in_block[0]), y0 = float(in_block[1]), z0 = float(in_block[2]);
        bool any = false;
        float nearest = std::numeric_limits<float>::infinity();
        std::size_t nearest_one = 0;
        const auto distance = [&](std::size_t k) {
            const auto number = [&](std::size_t n) { return Lanes::load(&near.numbers[n][k]); };
            const Lanes dx = number(0) - x0, dy = number(1) - y0, dz = number(2) - z0;
            return dx * (dx * number(3) + Lanes(2.0F) * (dy * number(4) + dz * number(5))) +
                   dy * (dy * number(6) + Lanes(2.0F) * (dz * number(7))) + dz * dz * number(8);
        };
        for (std::size_t k = 0; k < near.numbers[0].size(); k += Neighbourhood::lanes) {
            const Lanes rest = max(Lanes(0.0F), Lanes(1.0F) - distance(k));
            const Lanes w = rest * rest * rest * Lanes::load(&near.numbers[9][k]);
            for (std::uint32_t lanes = lane_bits(w > Lanes(0.0F)); lanes != 0; lanes &= lanes - 1) {
                const int lane = std::countr_zero(lanes);
                f(near.ellipsoid[k + std::size_t(lane)], double(w[lane]));
                any = true;
            }
        }
        if (any) return;
        for (std::size_t k = 0; k < near.ellipsoid.size(); ++k) {
            const float q = distance(k / Neighbourhood::lanes * Neighbourhood::lanes)[int(k % Neighbourhood::lanes)];
            if (q < nearest) nearest = q, nearest_one = k;
        }
        f(near.ellipsoid[nearest_one], 1.0);
    }

private:
    /// An ellipsoid, in cells.
    struct Kernel {
        Vec<double, 3> centre;
        std::array<float, 6> metric;  ///< B⁻¹: xx, xy, xz, yy, yz, zz
        std::array<float, 3> reach;   ///< half the sides of its bounding box
        float height;                 ///< value at the centre
    };
    Kernel kernel_of(const Ellipsoid& ellipsoid) const {
        const double xx = ellipsoid.shape[0], xy = ellipsoid.shape[1], xz = ellipsoid.shape[2], yy = ellipsoid.shape[3],
                     yz = ellipsoid.shape[4], zz = ellipsoid.shape[5];
        const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
        const double det = xx * a + xy * b + xz * c, scale = cell_ * cell_ / det;
        Kernel kernel;
        kernel.centre = ellipsoid.centre * (1 / cell_);
        kernel.metric = {float(a * scale),
                         float(b * scale),
                         float(c * scale),
                         float((xx * zz - xz * xz) * scale),
                         float((xy * xz - xx * yz) * scale),
                         float((xx * yy - xy * xy) * scale)};
        kernel.reach = {float(std::sqrt(xx) / cell_), float(std::sqrt(yy) / cell_), float(std::sqrt(zz) / cell_)};
        kernel.height = float(kernel_constant * ellipsoid.volume / std::sqrt(det));
        return kernel;
    }

    /// Finds the blocks that the kernels reach, and for each block the boxes whose kernels reach it.
    void find_blocks() {
        const std::size_t n = sources_.size();
        std::vector<std::array<BoxIndex, 2>> range(n);
        std::vector<double> pairs(n);
        for_chunks(n, threads_, [&](std::size_t from, std::size_t to) {
            for (std::size_t s = from; s < to; ++s) {
                double count = 0;
                for (std::size_t a = 0; a < 3; ++a) {
                    double low = std::numeric_limits<double>::infinity(), high = -low;
                    for (std::uint32_t i = sources_.first[s]; i < sources_.first[s + 1]; ++i) {
                        if (!(kernels_[i].height > 0)) continue;
                        low = std::min(low, kernels_[i].centre[int(a)] - double(kernels_[i].reach[a]));
                        high = std::max(high, kernels_[i].centre[int(a)] + double(kernels_[i].reach[a]));
                    }
                    if (!(low <= high)) {
                        count = 0;
                        break;
                    }
                    // The blocks of all nodes from that below `low` to that below `high`: all cells with a node that a
                    // kernel reaches begin there.
                    range[s][0][a] = std::int64_t(std::floor(low / side));
                    range[s][1][a] = std::int64_t(std::floor(high / side));
                    const double boxes = double(range[s][1][a] - range[s][0][a] + 1);
                    count = a == 0 ? boxes : count * boxes;
                    const std::int64_t first = range[s][0][a] - sources_.keys.origin[a],
                                       last = range[s][1][a] - sources_.keys.origin[a];
                    if (first < 0 || last + 2 > BoxKeys::most) refuse_fineness();  // the next block has a key, too
                }
                pairs[s] = count;
            }
        });
        double most = 0;
        for (const double count : pairs) most += count;
        // Kernels of a box may reach few of the blocks between them: each pair is one block at most.
        require_memory(16 * most, sentence("A surface with cells of ", cell_, " m"), advice);
        struct Pair {
            std::uint64_t target;
            std::uint32_t source;
            bool operator<(const Pair& other) const {
                return target != other.target ? target < other.target : source < other.source;
            }
        };
        std::vector<Pair> reached;
        reached.reserve(std::size_t(most));
        for (std::size_t s = 0; s < n; ++s) {
            if (!(pairs[s] > 0)) continue;
            const auto& [low, high] = range[s];
            for (auto z = low[2]; z <= high[2]; ++z)
                for (auto y = low[1]; y <= high[1]; ++y)
                    for (auto x = low[0]; x <= high[0]; ++x)
                        reached.push_back({sources_.keys({x, y, z}), std::uint32_t(s)});
        }
        std::sort(reached.begin(), reached.end());
        for (std::size_t p = 0; p < reached.size(); ++p) {
            if (p == 0 || reached[p].target != reached[p - 1].target) {
                keys_.push_back(reached[p].target);
                first_source_.push_back(p);
            }
            source_.push_back(reached[p].source);
        }
        first_source_.push_back(reached.size());
        // The field, the vertices on the edges of each node, and as much for the mesh.
        require_memory(16 * most + double(blocks()) * nodes * 2 * sizeof(float),
                       sentence("A surface with cells of ", cell_, " m"), advice);
    }
    [[noreturn]] void refuse_fineness() const {
        throw parameter_error(sentence("Cells of ", cell_,
                                       " m are too small for these particles: a kernel reaches over "
                                       "more of them than can be numbered. ",
                                       advice));
    }

    /// Computes the field at the nodes of block b.
    void sum(std::size_t b) {
        const BoxIndex at = block(b);
        std::array<double, 3> corner{};
        for (std::size_t a = 0; a < 3; ++a) corner[a] = double(side * at[a]);
        alignas(64) std::array<float, nodes> field{};
        std::array<float, 16> x_of_lanes{}, y_of_lanes{};
        for (std::size_t l = 0; l < 16; ++l) x_of_lanes[l] = float(l % 8), y_of_lanes[l] = float(l / 8);
        const Lanes x = Lanes::load(x_of_lanes.data()), y = Lanes::load(y_of_lanes.data());
        for (std::size_t s = first_source_[b]; s < first_source_[b + 1]; ++s)
            for (std::uint32_t i = sources_.first[source_[s]]; i < sources_.first[source_[s] + 1]; ++i) {
                const Kernel& kernel = kernels_[i];
                if (!(kernel.height > 0)) continue;
                std::array<float, 3> c{};
                bool meets = true;
                for (std::size_t a = 0; a < 3; ++a) {
                    c[a] = float(kernel.centre[int(a)] - corner[a]);
                    meets = meets && c[a] - kernel.reach[a] <= float(side - 1) && c[a] + kernel.reach[a] >= 0;
                }
                if (!meets) continue;
                std::array<int, 3> low{}, high{};
                for (std::size_t a = 0; a < 3; ++a) {
                    low[a] = int(std::max(0.0F, std::ceil(c[a] - kernel.reach[a])));
                    high[a] = int(std::min(float(side - 1), std::floor(c[a] + kernel.reach[a])));
                }
                const auto& Q = kernel.metric;
                const Lanes dx = x - Lanes(c[0]), along_x = dx * dx * Lanes(Q[0]);
                for (int j = low[1] & ~1; j <= high[1]; j += 2) {
                    const Lanes dy = y + Lanes(float(j) - c[1]);
                    const Lanes plane = along_x + dy * (dx * Lanes(2 * Q[1]) + dy * Lanes(Q[3]));
                    const Lanes slope = dx * Lanes(2 * Q[2]) + dy * Lanes(2 * Q[4]);
                    for (int k = low[2]; k <= high[2]; ++k) {
                        const float dz = float(k) - c[2];
                        const Lanes q = plane + (slope + Lanes(Q[5] * dz)) * Lanes(dz);
                        const Lanes rest = max(Lanes(0.0F), Lanes(1.0F) - q);
                        float* const to = field.data() + node(0, j, k);
                        (Lanes::load(to) + rest * rest * rest * Lanes(kernel.height)).store(to);
                    }
                }
            }
        std::copy(field.begin(), field.end(), values_.begin() + std::ptrdiff_t(b * nodes));
    }

    static constexpr const char* advice =
        "Give a larger cell_size, or volumes that fit the distances of the particles.";

    double cell_;
    int threads_;
    Boxes sources_;                // the ellipsoids
    std::vector<Kernel> kernels_;  // in the order of sources_
    std::vector<std::uint64_t> keys_;
    std::vector<std::size_t> first_source_;  // for each block, its first in source_
    std::vector<std::uint32_t> source_;      // boxes of sources_
    std::vector<float> values_;
};

}  // namespace firn::inline FIRN_BUILD::detail
