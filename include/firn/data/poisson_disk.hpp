/// \file Poisson-disk points: random points at distances of at least r from each other, so dense that hardly any
/// further point could be added.
///
/// Bridson 2007, "Fast Poisson disk sampling in arbitrary dimensions", SIGGRAPH sketches. The active list contains the
/// points around which new points may still be found. Candidates for new points are drawn at distances of r to 2r from
/// a point of this list. A background grid with cells of side r/√D holds at most one point per cell. Positions are
/// integers (in steps of 2⁻²⁰ r), so the points are the same with every compiler and on every machine.
#pragma once

#include <firn/data/samples.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Density of the points that Bridson's algorithm makes with 30 candidates: the mean number of points in a volume (in
/// 2D: an area) of r^D. This density was measured in large boxes, away from the boxes' surfaces
/// (tests/unit/data/sampling.cpp checks it to 1 %).
template <int D>
inline constexpr double poisson_density = D == 2 ? 0.615 : 0.577;

/// Bridson's algorithm in a box. Positions are whole steps of 2⁻²⁰ r from the lower corner of the box.
template <int D>
class PoissonDisk {
public:
    PoissonDisk(const Vec<double, D>& lower, const Vec<double, D>& upper, double radius, double max_cells)
        : step_(radius / double(r)) {
        max_cells = std::min(max_cells, double(std::numeric_limits<std::int32_t>::max()));  // indices have 32 bits
        double total = 1;
        for (std::size_t k = 0; k < D; ++k) {
            const double extent = upper[int(k)] - lower[int(k)];
            if (!(extent > 0) || !std::isfinite(extent)) {
                throw parameter_error(sentence("Points cannot fill the box from ", describe(lower), " to ",
                                               describe(upper), " m; upper must be above lower and both finite."));
            }
            total *= extent / step_ / double(cell) + 1 + 2 * reach;
            check_count(total, "cells of side r/√D in the box to fill", max_cells, sizeof(std::int32_t));
            size_[k] = std::int64_t(extent / step_);
            // With a rim of empty cells, so that no index must be checked against the bounds.
            cells_[k] = size_[k] / cell + 1 + 2 * reach;
        }
        grid_.assign(std::size_t(total) + 1, empty);
        find_nearby();
    }

    /// Makes the points, near points that were made before, until no place is found any more.
    void fill(std::uint64_t seed, int candidates) {
        RandomSequence random(seed);
        Index start{};
        for (std::size_t k = 0; k < D; ++k) start[k] = std::int64_t(unit_interval(random.bits()) * double(size_[k]));
        add(start);
        while (!active_.empty()) {
            const auto chosen = std::size_t(random.below(active_.size()));
            if (adds_near(points_[std::size_t(active_[chosen])], random, candidates)) continue;
            active_[chosen] = active_.back();
            active_.pop_back();
        }
    }

    /// Returns the positions of the points [m].
    std::vector<Vec<double, D>> positions(const Vec<double, D>& lower) const {
        std::vector<Vec<double, D>> positions(points_.size());
        for (std::size_t i = 0; i < points_.size(); ++i) {
            for (int k = 0; k < D; ++k) positions[i][k] = std::fma(double(points_[i][std::size_t(k)]), step_, lower[k]);
        }
        return positions;
    }

private:
    using Index = std::array<std::int64_t, D>;
    static constexpr std::int64_t r = std::int64_t(1) << 20;
    static constexpr std::int64_t cell = D == 2 ? 741455 : 605389;  // ⌊r/√D⌋
    static constexpr std::int64_t reach = 2;  // ⌈r/cell⌉: points closer than r are at most 2 cells away
    static constexpr std::int32_t empty = -1;

    struct Near {
        std::int64_t distance, offset;  // squared distance [cells²]; offset of the cell in `grid_`
        bool operator<(const Near& other) const {
            return distance != other.distance ? distance < other.distance : offset < other.offset;
        }
    };

    void find_nearby() {
        std::size_t known = 0;
        Index first{}, last{};
        first.fill(-reach);
        last.fill(reach + 1);
        for_lattice<D>(first, last, [&](const Index& offset, std::uint64_t) {
            std::int64_t distance = 0, at = 0;
            for (std::size_t k = D; k-- > 0;) {
                distance += offset[k] * offset[k];
                at = at * cells_[k] + offset[k];
            }
            const Near near{distance, at};
            std::size_t k = known++;
            for (; k > 0 && near < nearby_[k - 1]; --k) nearby_[k] = nearby_[k - 1];
            nearby_[k] = near;
            return true;
        });
    }
    std::int64_t cell_of(const Index& x) const {
        std::int64_t at = 0;
        for (std::size_t k = D; k-- > 0;) at = at * cells_[k] + x[k] / cell + reach;
        return at;
    }
    void add(const Index& x) {
        const auto name = std::int32_t(points_.size());
        grid_[std::size_t(cell_of(x))] = name;
        active_.push_back(name);
        points_.push_back(x);
    }
    bool is_free(const Index& x) const {
        const auto at = cell_of(x);
        for (const Near& near : nearby_) {
            const auto other = grid_[std::size_t(at + near.offset)];
            if (other == empty) continue;
            std::int64_t distance = 0;
            for (std::size_t k = 0; k < D; ++k) {
                const auto d = points_[std::size_t(other)][k] - x[k];
                distance += d * d;
            }
            if (distance < r * r) return false;
        }
        return true;
    }
    /// Adds a point at a distance of r to 2r from another, unless all `candidates` tries fail.
    bool adds_near(Index from, RandomSequence& random, int candidates) {
        for (int tried = 0; tried < candidates;) {
            Index to = from;
            std::int64_t distance = 0;
            bool in_box = true;
            for (std::size_t k = 0; k < D; ++k) {
                const auto d = std::int64_t(random.below(4 * r + 1)) - 2 * r;
                distance += d * d;
                to[k] += d;
                in_box = in_box && to[k] >= 0 && to[k] <= size_[k];
            }
            if (distance < r * r || distance > 4 * r * r) continue;  // draw again
            ++tried;
            if (!in_box || !is_free(to)) continue;
            add(to);
            return true;
        }
        return false;
    }

    double step_;                                   ///< the unit of positions [m]
    Index size_{}, cells_{};                        ///< of the box, and of the background grid
    std::array<Near, D == 2 ? 25 : 125> nearby_{};  ///< cells sorted by distance, nearest first
    std::vector<std::int32_t> grid_;                ///< for each cell, the point in it
    std::vector<std::int32_t> active_;              ///< points near which there may be a place
    std::vector<Index> points_;
};

}  // namespace detail

/// Returns the radius r [m] with which Poisson-disk points (random points at distances of at least r) are as dense as
/// the points of a lattice with this `spacing` [m].
template <int D>
double poisson_radius(double spacing) {
    return spacing * (D == 2 ? std::sqrt(detail::poisson_density<2>) : std::cbrt(detail::poisson_density<3>));
}

/// Returns random points that fill the box from `lower` to `upper` [m]. No two of the points are closer than `radius`
/// [m].
/// \param seed        seed of the random numbers
/// \param max_cells   largest number of cells of the background grid
/// \param candidates  number of tries to find a new point near a given point; if all these tries fail, no further tries
///                    are made near the given point
/// \throws parameter_error  if the box is empty, inverted or not finite, if `radius` is not above 0, if `candidates` is
///                          below 1, or if the background grid would have more than `max_cells` cells
/// \throws memory_error     if the background grid does not fit into memory
template <int D>
[[nodiscard]] std::vector<Vec<double, D>> poisson_disk_points(const Vec<double, D>& lower, const Vec<double, D>& upper,
                                                              double radius, std::uint64_t seed = 1,
                                                              double max_cells = 1e9, int candidates = 30) {
    static_assert(D == 2 || D == 3);
    if (!(radius > 0) || !std::isfinite(radius)) {
        throw parameter_error(sentence("The Poisson-disk radius is ", radius, " m; it must be finite and above 0."));
    }
    if (candidates < 1) {
        throw parameter_error(sentence("Poisson-disk sampling with ", candidates, " candidates; give 1 or more (30)."));
    }
    detail::PoissonDisk<D> disk(lower, upper, radius, max_cells);
    disk.fill(seed, candidates);
    return disk.positions(lower);
}

}  // namespace firn::inline FIRN_BUILD
