/// \file A shape from numbers: signed distances at the nodes of a box, interpolated. For the CPU.
///
/// data/mesh_distance.hpp makes them from a closed triangle mesh.
#pragma once

#include <firn/boundary/shape.hpp>
#include <firn/core/error.hpp>
#include <firn/core/lanes.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

namespace firn {

/// Signed distances at nodes `spacing` apart, in the shape's own coordinates.
template <class Number, int D>
struct DistanceNumbers {
    Vec<double, D> lower{};                   ///< the first node [m]
    double spacing = 0;                       ///< [m]
    std::array<int, std::size_t(D)> nodes{};  ///< along each axis, two at least
    std::vector<Number> values;               ///< [m], negative inside; the last axis fastest

    /// \throws parameter_error unless there is a number for each node and they lie apart
    void check() const {
        double all = 1;  // of so many as to leave the whole numbers, too
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            if (nodes[a] < 2 || !std::isfinite(lower[int(a)]))
                throw parameter_error(sentence("A grid of distances has ", nodes[a], " nodes along axis ", a,
                                               ", the first at ", lower[int(a)],
                                               " m; it needs two at least, at finite positions."));
            all *= nodes[a];
        }
        if (double(values.size()) != all)
            throw parameter_error(sentence("A grid of distances has ", all, " nodes but ", values.size(),
                                           " numbers; give one for each."));
        if (!(spacing > 0) || !std::isfinite(spacing))
            throw parameter_error(sentence("The nodes of a grid of distances are ", spacing,
                                           " m apart; that must be positive and finite."));
    }
};

/// Interpolated linearly along each axis; beyond the box, the distance to the box is added to that at its face. The
/// normal is the direction of the interpolant's gradient. Copies share the numbers.
/// \tparam Number  float or double, whatever S is
template <scalar S, int D, class Number = float>
struct DistanceGrid {
    std::shared_ptr<const DistanceNumbers<Number, D>> numbers;

    using scalar_type = S;
    static constexpr int dimension = D;
    template <class T>
    using with_scalar = DistanceGrid<T, D, Number>;

    static constexpr const char* name = "distance_grid";
    static constexpr auto parameters() { return std::tuple{}; }

    /// \throws parameter_error for no numbers, and as theirs
    void check() const {
        if (!numbers)
            throw parameter_error("A grid of distances holds no numbers; give it some, mesh_distance() of a mesh say.");
        numbers->check();
    }
    template <class T>
    with_scalar<T> lifted() const {
        static_assert(has_lanes<T>,
                      "firn: a DistanceGrid looks its distances up in memory that a GPU's program does not have; use a "
                      "shape with a formula there.");
        return {numbers};
    }
    /// Of the interpolation of two distances, each √D/2 spacings.
    double uncertainty() const { return std::sqrt(double(D)) * numbers->spacing; }

    /// To the farthest corner of the box of numbers, which the solid is within.
    double extent() const {
        Vec<double, D> farthest{};
        for (int a = 0; a < D; ++a) {
            const double upper = numbers->lower[a] + (numbers->nodes[std::size_t(a)] - 1) * numbers->spacing;
            farthest[a] = std::max(std::abs(numbers->lower[a]), std::abs(upper));
        }
        return norm(farthest);
    }

    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const {
        const Cell cell = locate(x);
        const S square = dot(cell.beyond, cell.beyond);
        const auto is_beyond = S(0) < square;
        return reduced(cell, -1) + select(is_beyond, sqrt(select(is_beyond, square, S(1))), S(0));
    }
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>& x) const {
        const Cell cell = locate(x);
        Vec<S, D> gradient{};
        unroll<D>([&](auto a) FIRN_LAMBDA { gradient.v[a] = reduced(cell, a); });
        const auto is_beyond = S(0) < dot(cell.beyond, cell.beyond);
        return direction_or_up(select(is_beyond, cell.beyond, gradient * S(1 / numbers->spacing)));
    }

private:
    static constexpr int corners = 1 << D;
    struct Cell {
        S at[corners];       ///< the distances at its corners, the last axis fastest
        Vec<S, D> fraction;  ///< where the point is in it, 0 to 1
        Vec<S, D> beyond;    ///< from the box to the point [m]
    };

    FIRN_INLINE Cell locate(const Vec<S, D>& x) const {
        constexpr int lanes = scalar_traits<S>::lanes;
        const DistanceNumbers<Number, D>& of = *numbers;
        Cell cell{};
        std::size_t first[lanes] = {}, stride[D];
        for (std::size_t a = D, step = 1; a-- > 0; step *= std::size_t(of.nodes[a])) stride[a] = step;
        unroll<D>([&](auto a) FIRN_LAMBDA {
            const S from_lower = x.v[a] - S(of.lower[a]), spacing = S(of.spacing);
            const int last = of.nodes[a] - 1;
            const S place = from_lower / spacing, within = min(S(last), max(S(0), place));  // NaN: 0
            const S node = min(S(last - 1), floor(within));
            cell.fraction.v[a] = within - node;
            cell.beyond.v[a] = select(within == place, S(0), from_lower - within * spacing);
            for (int lane = 0; lane < lanes; ++lane) first[lane] += std::size_t(lane_value(node, lane)) * stride[a];
        });
        for (int corner = 0; corner < corners; ++corner) {
            std::size_t offset = 0;
            for (int a = 0; a < D; ++a) offset += (corner >> (D - 1 - a) & 1) != 0 ? stride[a] : 0;
            cell.at[corner] = from_lanes<S>([&](int lane) { return of.values[first[lane] + offset]; });
        }
        return cell;
    }
    /// Interpolated along all axes but `along`, where it is the difference over one spacing.
    FIRN_INLINE S reduced(const Cell& cell, int along) const {
        S left[corners];
        for (int i = 0; i < corners; ++i) left[i] = cell.at[i];
        for (int a = D - 1; a >= 0; --a)
            for (int i = 0; i < 1 << a; ++i) {
                const S difference = left[2 * i + 1] - left[2 * i];
                left[i] = a == along ? difference : left[2 * i] + difference * cell.fraction.v[a];
            }
        return left[0];
    }
};

}  // namespace firn
