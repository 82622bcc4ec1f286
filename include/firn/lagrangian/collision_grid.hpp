/// \file Finds points that are near each other. To do so, it sorts the points by the cells of a uniform grid.
///
/// Each cell has an index; cells are counted row by row along the first axis. The points are sorted by the index of
/// their cell. So all neighbours of a point lie in 3 (2D) or 9 (3D) ranges of consecutive sorted points; each range
/// covers three cells along the first axis. If the bounding box of the points has at most a few cells per point, a
/// table stores where the points of each cell begin. Otherwise the ranges are found by a search in the sorted cell
/// indices. The result is the same in both cases.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/parallel.hpp>
#include <firn/core/tensor.hpp>
#include <firn/lagrangian/point_masses.hpp>
#include <firn/sort/radix_sort.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A range of consecutive points in the sorted order of a CollisionGrid.
struct SortedRange {
    std::uint32_t begin,  ///< Index, in the sorted order, of the range's first point.
        end;              ///< Index, in the sorted order, of the range's last point, plus one.
};

}  // namespace detail

/// Sorts points by the cells of a uniform grid, so that the class Neighbours can find the points near each point. Call
/// build() first.
/// \tparam S  float or double
/// \tparam D  2 or 3
template <std::floating_point S, int D>
class CollisionGrid {
public:
    using Place = Vec<double, D>;                ///< A position [m].
    static constexpr int rows = D == 2 ? 3 : 9;  ///< Number of sorted ranges in which a point's neighbours lie.
    /// Number of zeros that are stored after the coordinates and after the radii, so that SIMD loads may read past the
    /// end.
    static constexpr std::size_t padding = 16;

    /// Sorts the points whose radius is positive; points of radius 0 are left out.
    /// \param points   the points to sort; they do not change
    /// \param threads  number of threads; 0: the number that thread_count() returns
    /// \param reach    the largest distance between two neighbours [m]; 0: twice the largest radius
    /// \throws particle_error   if a position or radius is not finite, or if a radius is negative
    /// \throws parameter_error  if `reach` is negative or not finite
    void build(const PointMasses<S, D>& points, int threads = 0, double reach = 0) {
        if (!(reach >= 0) || !std::isfinite(reach))
            throw parameter_error(sentence("The reach of neighbours is ", reach,
                                           " m; it must be finite and not negative (0: twice the largest radius)."));
        threads = thread_count(threads);
        survey(points, threads);
        lay_out(points, reach);
        if (size_ == 0) return;
        table_.clear();
        if (cells_ <= std::min<std::uint64_t>(4 * std::uint64_t(size_) + 4096, 0xfffffff0u)) {
            sort(near_, points, threads);
            fill_table(threads);
        } else {
            sort(far_, points, threads);
        }
    }

    /// Returns the number of sorted points, which are the points with a positive radius.
    std::size_t size() const { return size_; }
    /// Returns the index (into PointMasses) of the point that has the index k in the sorted order, 0 ≤ k < size().
    std::uint32_t place(std::size_t k) const { return order_[k]; }
    /// Returns the position, when the points were sorted, of the point that has the index k in the sorted order [m].
    FIRN_INLINE Place position(std::size_t k) const {
        Place x;
        unroll<D>([&](auto a) FIRN_LAMBDA { x.v[a] = positions_[4 * k + a]; });
        return x;
    }
    /// Writes four numbers to memory: the vector from point j to point k [m], rounded to S, then zeros. The points are
    /// given by their indices in the sorted order.
    FIRN_INLINE void write_vector(std::size_t j, std::size_t k, S* to) const {
        using Row = pack<double, 4>;
        typedef S of_four [[gnu::vector_size(4 * sizeof(S))]];
        const Row between = Row::load(positions_.data() + 4 * k) - Row::load(positions_.data() + 4 * j);
        const of_four rounded = __builtin_convertvector(between.lanes, of_four);
        std::memcpy(to, &rounded, sizeof rounded);
    }
    /// Returns an array of the sorted points' coordinates along an axis, counted from origin() and rounded to S [m], in
    /// sorted order, followed by `padding` zeros.
    const S* coordinates(int axis) const { return coordinates_[std::size_t(axis)].data(); }
    /// Returns the position from which coordinates() are counted [m].
    const Place& origin() const { return from_; }
    /// Returns an upper bound of the rounding error of a distance of two points that is computed from coordinates()
    /// [m].
    double error_of_distance() const { return error_; }
    /// Returns an array of the sorted points' radii [m], in sorted order, followed by `padding` zeros.
    const S* radii() const { return radii_.data(); }
    /// Returns the side length of a cell [m].
    double cell_side() const { return side_; }
    /// Returns the size of the allocated memory [bytes].
    std::size_t bytes() const {
        std::size_t sum = (near_.items.capacity() * 2) * sizeof(near_.items[0]) +
                          (far_.items.capacity() * 2) * sizeof(far_.items[0]) + table_.capacity() * 4 +
                          order_.capacity() * 4 + radii_.capacity() * sizeof(S) +
                          positions_.capacity() * sizeof(double);
        for (const auto& axis : coordinates_) sum += axis.capacity() * sizeof(S);
        return sum;
    }

    /// Finds the neighbours of sorted points, one point after another.
    class Neighbours {
    public:
        /// Makes an object that finds neighbours in `grid`. The grid must live at least as long as this object.
        explicit Neighbours(const CollisionGrid& grid) : grid_(grid) {}

        /// Returns ranges of sorted points. They contain all neighbours of the point that has the index k in the sorted
        /// order. They also contain this point itself and some points that are not its neighbours. From one call of
        /// of() to the next, k must not decrease.
        FIRN_INLINE const std::array<detail::SortedRange, rows>& of(std::size_t k) {
            if (grid_.table_.empty()) {
                const std::uint64_t key = grid_.far_.items[k].key;
                if (key != key_) walk_to(key);
            } else if (const std::uint64_t key = grid_.near_.items[k].key; key != key_) {
                key_ = key;
                const std::uint32_t* const at = grid_.table_.data() + key;
                for (std::size_t r = 0; r < rows; ++r) ranges_[r] = {at[grid_.row_[r] - 1], at[grid_.row_[r] + 2]};
            }
            return ranges_;
        }

    private:
        void walk_to(std::uint64_t key) {
            const auto& items = grid_.far_.items;
            const auto before = [](const Keyed<std::uint64_t>& item, std::uint64_t wanted) {
                return item.key < wanted;
            };
            for (std::size_t r = 0; r < rows; ++r) {
                const std::uint64_t from = key + std::uint64_t(grid_.row_[r]) - 1, to = from + 3;
                detail::SortedRange& range = ranges_[r];
                if (key_ == none) {
                    range.begin =
                        std::uint32_t(std::lower_bound(items.begin(), items.end(), from, before) - items.begin());
                    range.end = range.begin;
                }
                while (range.begin < items.size() && items[range.begin].key < from) ++range.begin;
                range.end = std::max(range.begin, range.end);
                while (range.end < items.size() && items[range.end].key < to) ++range.end;
            }
            key_ = key;
        }

        static constexpr std::uint64_t none = ~std::uint64_t(0);
        const CollisionGrid& grid_;
        std::uint64_t key_ = none;
        std::array<detail::SortedRange, rows> ranges_{};
    };

private:
    struct Part {  // bounding box, largest radius and counts of those points that one thread handles
        Place lower, upper;
        S largest = 0;
        std::size_t wrong = 0, first_wrong = 0, sorted = 0;
    };

    std::size_t first_of(std::size_t part) const { return count_ * part / parts_.size(); }

    void survey(const PointMasses<S, D>& points, int threads) {
        count_ = points.size();
        parts_.assign(std::min<std::size_t>(std::size_t(threads), count_ / 4096 + 1), {});
        parallel_for(parts_.size(), threads, [&](std::size_t p, int) {
            Part part;
            part.lower = Place::filled(std::numeric_limits<double>::infinity());
            part.upper = -part.lower;
            for (std::size_t i = first_of(p), end = first_of(p + 1); i < end; ++i) {
                const S radius = points.radius[i];
                bool right = radius >= 0 && radius <= std::numeric_limits<S>::max();
                for (int a = 0; a < D; ++a)
                    right = right && std::abs(points.position[i][a]) <= double(std::numeric_limits<S>::max());
                if (!right && part.wrong++ == 0) part.first_wrong = i;
                if (!right || radius == 0) continue;
                ++part.sorted;
                part.largest = std::max(part.largest, radius);
                for (int a = 0; a < D; ++a) {
                    part.lower[a] = std::min(part.lower[a], points.position[i][a]);
                    part.upper[a] = std::max(part.upper[a], points.position[i][a]);
                }
            }
            parts_[p] = part;
        });
        Part& all = parts_.front();
        std::size_t wrong = 0;
        const Part* worst = nullptr;
        for (const Part& part : parts_) {
            if (part.wrong > 0 && !worst) worst = &part;
            wrong += part.wrong;
        }
        if (worst) refuse(points, wrong, worst->first_wrong);
        largest_ = 0;
        size_ = 0;
        lower_ = all.lower;
        upper_ = all.upper;
        for (Part& part : parts_) {
            largest_ = std::max(largest_, part.largest);
            for (int a = 0; a < D; ++a) {
                lower_[a] = std::min(lower_[a], part.lower[a]);
                upper_[a] = std::max(upper_[a], part.upper[a]);
            }
            const std::size_t sorted = part.sorted;
            part.sorted = size_;  // from here on: where the part's points begin in the list to sort
            size_ += sorted;
        }
    }

    [[noreturn]] static void refuse(const PointMasses<S, D>& points, std::size_t wrong, std::size_t first) {
        std::string at;
        for (int a = 0; a < D; ++a) at += sentence(a ? ", " : "", points.position[first][a]);
        throw particle_error(sentence(wrong, " of ", points.size(), " points cannot collide; the first is point ",
                                      points.id[first], " at (", at, ") m with radius ", points.radius[first],
                                      " m. Positions and radii must be finite, radii not negative: has a time step "
                                      "been too large?"));
    }

    void lay_out(const PointMasses<S, D>& points, double reach) {
        // Cell indices are computed in double precision, and cells are slightly larger than needed. So rounding cannot
        // put two neighbours more than one cell apart.
        side_ = (reach > 0 ? reach : 2 * double(largest_)) * (1 + 1e-6);
        if (size_ == 0) return;
        // The largest allowed number of cells along an axis. With this limit, cell indices need at most 62 bits.
        constexpr double most = D == 2 ? double(1 << 30) : double(1 << 20);
        side_ = std::max(side_, std::numeric_limits<double>::min() / std::numeric_limits<double>::epsilon());
        Place upper = upper_;
        from_ = lower_;
        for (int a = 0; a < D; ++a)
            if (!((upper[a] - from_[a]) / side_ < most)) {
                const auto [low, high] = where_most_are(points, a);
                from_[a] = std::max(from_[a], low - (high - low));
                upper[a] = std::min(upper[a], high + (high - low));
                side_ = std::max(side_, (upper[a] - from_[a]) / (most - 1));
            }
        double farthest = 0;  // coordinate
        for (int a = 0; a < D; ++a)
            farthest = std::max({farthest, std::abs(lower_[a] - from_[a]), std::abs(upper_[a] - from_[a])});
        error_ = 2 * double(std::numeric_limits<S>::epsilon()) * farthest;  // of 2 axes √2, of 3 √3 as much at most
        cells_ = 1;
        for (int a = 0; a < D; ++a) {
            last_[a] = std::floor(std::min((upper[a] - from_[a]) / side_, most - 1));
            stride_[std::size_t(a)] = cells_;
            cells_ *= std::uint64_t(last_[a]) + 3;  // plus one empty cell at either end
        }
        for (std::size_t r = 0; r < rows; ++r)
            row_[r] = std::int64_t(stride_[1]) * (std::int64_t(r % 3) - 1) +
                      (D == 3 ? std::int64_t(stride_[D - 1]) * (std::int64_t(r / 3) - 1) : 0);
    }

    /// Returns the two ends of an interval along an axis [m]. The interval contains most points: of about a thousand
    /// sampled points, a sixteenth lies below and a sixteenth above the interval.
    std::array<double, 2> where_most_are(const PointMasses<S, D>& points, int axis) const {
        std::vector<double> sample;
        const std::size_t step = count_ / 1024 + 1;
        for (std::size_t i = 0; i < count_; i += step) sample.push_back(points.position[i][axis]);
        std::sort(sample.begin(), sample.end());
        return {sample[sample.size() / 16], sample[sample.size() - 1 - sample.size() / 16]};
    }

    /// Returns the index of the cell that contains the position x. If x is outside of the grid, returns the index of
    /// the nearest cell, so that neighbours are still at most one cell apart.
    FIRN_INLINE std::uint64_t key_of(const Place& x) const {
        std::uint64_t key = 0;
        unroll<D>([&](auto a) FIRN_LAMBDA {
            const double cell = std::min(std::max((x.v[a] - from_.v[a]) * per_side_, 0.0), last_.v[a]);
            key += (std::uint64_t(std::int64_t(cell)) + 1) * stride_[a];
        });
        return key;
    }

    template <class Key>
    void sort(RadixSort<Key>& sorter, const PointMasses<S, D>& points, int threads) {
        per_side_ = 1 / side_;
        renew(sorter.items, size_, threads);
        parallel_for(parts_.size(), threads, [&](std::size_t p, int) {
            std::size_t to = parts_[p].sorted;
            for (std::size_t i = first_of(p), end = first_of(p + 1); i < end; ++i)
                if (points.radius[i] > 0) sorter.items[to++] = {Key(key_of(points.position[i])), std::uint32_t(i)};
        });
        const Key differ =
            std::numeric_limits<Key>::max() >> (std::numeric_limits<Key>::digits - std::bit_width(cells_));
        sorter.sort(differ, threads);
        renew(order_, size_, threads);
        const auto renew_padded = [&](aligned_vector<S>& numbers) {
            renew(numbers, size_ + padding, threads);
            std::fill_n(numbers.data() + size_, padding, S(0));
        };
        renew(positions_, 4 * size_, threads);
        renew_padded(radii_);
        for (auto& axis : coordinates_) renew_padded(axis);
        const auto copy = [&](std::size_t k, int) {
            const std::uint32_t i = sorter.items[k].number;
            order_[k] = i;
            radii_[k] = points.radius[i];
            const Place& x = points.position[i];
            double* const quad = positions_.data() + 4 * k;
            quad[2] = quad[3] = 0;
            for (int a = 0; a < D; ++a) {
                quad[a] = x[a];
                coordinates_[std::size_t(a)][k] = S(x[a] - from_[a]);
            }
        };
        parallel_for(size_, threads, copy, 4096);
    }

    void fill_table(int threads) {
        renew(table_, std::size_t(cells_) + 1, threads);
        const auto& items = near_.items;
        const auto fill = [&](std::size_t k, int) {
            for (std::size_t cell = k == 0 ? 0 : std::size_t(items[k - 1].key) + 1; cell <= items[k].key; ++cell)
                table_[cell] = std::uint32_t(k);
        };
        parallel_for(size_, threads, fill, 4096);
        std::fill(table_.begin() + std::ptrdiff_t(items.back().key) + 1, table_.end(), std::uint32_t(size_));
    }

    std::size_t count_ = 0, size_ = 0;
    std::vector<Part> parts_;
    Place lower_{}, upper_{};
    S largest_ = 0;
    double side_ = 0, per_side_ = 0, error_ = 0;
    Place from_{}, last_{};  ///< lower corner of the grid [m]; index of the last cell along each axis
    std::uint64_t cells_ = 0;
    std::array<std::uint64_t, std::size_t(D)> stride_{};
    std::array<std::int64_t, rows> row_{};
    RadixSort<std::uint32_t> near_;
    RadixSort<std::uint64_t> far_;
    aligned_vector<std::uint32_t> table_;  ///< per cell: where its sorted points begin; empty for too many cells
    aligned_vector<std::uint32_t> order_;
    aligned_vector<double> positions_;  ///< quads (four numbers per point): the position, then zeros [m]
    aligned_vector<S> radii_;
    std::array<aligned_vector<S>, std::size_t(D)> coordinates_;
};

}  // namespace firn::inline FIRN_BUILD
