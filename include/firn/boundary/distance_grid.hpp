/// \file A shape given by signed distances at the nodes of a grid, for example the distances from a triangle mesh.
#pragma once

#include <firn/boundary/shape.hpp>
#include <firn/core/digest.hpp>
#include <firn/core/error.hpp>
#include <firn/core/lanes.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Signed distances at the nodes of a regular grid, and the position of this grid in the shape's coordinates.
template <class Number, int D>
struct DistanceNumbers {
    Vec<double, D> lower{};                   ///< position of the node with the lowest coordinates [m]
    double spacing = 0;                       ///< distance between neighbouring nodes [m]
    std::array<int, std::size_t(D)> nodes{};  ///< number of nodes along each axis, at least two
    /// Signed distances [m], one per node, negative inside. The index along the last axis runs fastest.
    std::vector<Number> values;
    /// If `values` are capped, the cap [m]: distances of this size or more are not exact. \see Collider
    double exact_up_to = std::numeric_limits<double>::infinity();

    /// Checks the grid and the number of its values.
    /// \throws parameter_error unless each axis has at least two nodes, `lower` is finite, `spacing` is positive and
    /// finite, there is one value per node, and `exact_up_to` is positive
    void check() const {
        double all = 1;  // a double, since the product may exceed the range of int
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            if (nodes[a] < 2 || !std::isfinite(lower[int(a)]))
                throw parameter_error(sentence("A grid of distances has ", nodes[a], " nodes along axis ", a,
                                               ", the first at ", lower[int(a)],
                                               " m; it needs at least two, at finite positions."));
            all *= nodes[a];
        }
        if (double(values.size()) != all)
            throw parameter_error(sentence("A grid of distances has ", all, " nodes but ", values.size(),
                                           " values; give one value per node."));
        if (!(spacing > 0) || !std::isfinite(spacing))
            throw parameter_error(
                sentence("The spacing of a grid of distances is ", spacing, " m; it must be positive and finite."));
        if (!(exact_up_to > 0))
            throw parameter_error(sentence("A grid holds distances up to ", exact_up_to,
                                           " m; it must be positive, and infinite if no distance is capped."));
    }
};

namespace detail {

/// A grid of distances in memory, as functions with scalar S read it.
template <scalar S, int D, class Number>
struct GridInMemory {
    static constexpr int lanes = scalar_traits<S>::lanes;
    const DistanceNumbers<Number, D>& of;
    const Vec<double, D>& origin;

    /// Which number of the grid each lane reads.
    struct Place {
        std::size_t first[lanes] = {}, stride[D];
    };
    FIRN_INLINE Place begin() const {
        Place place;
        for (std::size_t a = D, step = 1; a-- > 0; step *= std::size_t(of.nodes[a])) place.stride[a] = step;
        return place;
    }
    /// Goes on by so many nodes along axis a.
    FIRN_INLINE static void go_on(Place& place, const S& nodes, int a) {
        for (int lane = 0; lane < lanes; ++lane)
            place.first[lane] += std::size_t(lane_value(nodes, lane)) * place.stride[a];
    }
    /// Returns the number at a corner of the cell that begins there; the last axis runs fastest.
    FIRN_INLINE S number(const Place& place, int corner) const {
        std::size_t offset = 0;
        for (int a = 0; a < D; ++a) offset += (corner >> (D - 1 - a) & 1) != 0 ? place.stride[a] : 0;
        return from_lanes<S>([&](int lane) { return of.values[place.first[lane] + offset]; });
    }
    FIRN_INLINE S lower_along(int a) const { return S(of.lower[a] - origin[a]); }
    FIRN_INLINE S nodes_less(int a, int k) const { return S(of.nodes[std::size_t(a)] - k); }
    FIRN_INLINE S step() const { return S(of.spacing); }
    FIRN_INLINE S per_step() const { return S(1 / of.spacing); }
};

/// A grid of distances that lie in a buffer of a program for a GPU.
/// \tparam S      scalar type: the one that records, or double for what the program must be told
/// \tparam Index  type of what counts numbers of the buffer; when it is recorded, S
template <class S, int D, class Index = S>
struct GridInProgram {
    Vec<S, D> lower{}, nodes{};
    S spacing{}, per_spacing{};
    Vec<Index, D> strides{};  // from a node to the next one along each axis
    Index first{};            // where the grid begins in the buffer

    template <class T>
    using with_scalar = GridInProgram<T, D>;
    static constexpr auto parameters() {
        return std::tuple{parameter{"lower", "m", &GridInProgram::lower},
                          parameter{"nodes", "1", &GridInProgram::nodes},
                          parameter{"spacing", "m", &GridInProgram::spacing},
                          parameter{"per_spacing", "1/m", &GridInProgram::per_spacing},
                          parameter{"strides", "1", &GridInProgram::strides},
                          parameter{"first", "1", &GridInProgram::first}};
    }

    Index begin() const { return first; }
    void go_on(Index& place, const S& count, int a) const { place = index_after(place, count, stride(a)); }
    S number(Index place, int corner) const {
        for (int a = 0; a < D; ++a)
            if ((corner >> (D - 1 - a) & 1) != 0) place = index_after(place, S(1), stride(a));
        return distance_at(place);
    }
    S lower_along(int a) const { return lower[a]; }
    S nodes_less(int a, int k) const { return nodes[a] - S(k); }
    S step() const { return spacing; }
    S per_step() const { return per_spacing; }

private:
    Index stride(int a) const { return a == D - 1 ? Index(1) : strides[a]; }
};

/// Nothing of a program: what a shape on the CPU has.
struct NotInProgram {};

/// What a grid of distances has at a place.
template <class S, int D>
struct FoundInGrid {
    S distance;        ///< the signed distance [m]
    Vec<S, D> normal;  ///< the outward unit normal [1]
};

/// Whether a program for a GPU is recorded that can call a function with a grid. \see wgsl::record_call
template <class Grid, class X>
concept calls_with_grid = requires(const Grid& grid, const X& x) {
    record_call("", "", {}, [](const Grid&, const X& of) { return of; }, grid, x);
};

}  // namespace detail

/// A shape given by signed distances at the nodes of a grid.
///
/// Inside the box of the grid, the distance is interpolated linearly along each axis. The normal is the direction of
/// the gradient of the interpolated distance.
///
/// For a point x outside of the box, let p be the nearest point of the box, d the distance at p, and g its gradient
/// there. The nearest point of the surface is about s = p − d g. The normal points from s to x, and
///
///     distance² = ‖x − p‖² + d² + 2 d (x − p) · g
///
/// which is ‖x − s‖² for ‖g‖ = 1. The result lies between two bounds of the true distance, √(‖x − p‖² + d²) and
/// ‖x − p‖ + d. For grids of mesh_distance(), the mean error is 0.2 % up to 3 spacings outside of the box, where the
/// normal is off by 3° on average; up to 10 spacings, it is 1 % and 6°. If x must be nearer to the truth, as where
/// large balls meet a small mesh, give the grid a wider band. If d < 0, the solid ends at the box: the distance is
/// d + ‖x − p‖, and the normal points from p to x.
///
/// Use a DistanceGrid for solids without a formula: mesh_distance() computes the distances from a closed triangle mesh,
/// sampled_distance() those of a function. Copies of the shape share the stored distances.
///
/// A program for a GPU reads distances in float from its buffer "distances", which all grids of a boundary share. Where
/// they lie is told by uniforms, so the program is the same for every mesh.
/// \tparam Number  type of the stored distances, float or double, independent of S; float for a program
template <scalar S, int D, class Number = float>
struct DistanceGrid {
    std::shared_ptr<const DistanceNumbers<Number, D>> numbers;  ///< The grid and its distances; must not be null.
    Vec<double, D> origin = Vec<double, D>::zero();             ///< The point that positions are measured from [m].

    using scalar_type = S;
    static constexpr int dimension = D;
    /// The type of this shape with scalar type T.
    template <class T>
    using with_scalar = DistanceGrid<T, D, Number>;

    /// Whether a program for a GPU is recorded: then the distances are those of its buffer.
    static constexpr bool in_program = !has_lanes<S>;
    /// Where the distances are in the buffer of a program; empty on the CPU.
    [[no_unique_address]] std::conditional_t<in_program, detail::GridInProgram<S, D>, detail::NotInProgram> grid{};

    static constexpr const char* name = "distance_grid";
    static constexpr auto parameters() {
        if constexpr (in_program)
            return std::tuple{parameter{"grid", "", &DistanceGrid::grid}};
        else
            return std::tuple{};
    }

    /// Checks the grid and its distances.
    /// \throws parameter_error if `numbers` is null, or if DistanceNumbers::check() throws it
    void check() const {
        if (!numbers)
            throw parameter_error("A grid of distances holds no numbers; set them, for example by mesh_distance().");
        numbers->check();
    }
    /// Returns a digest of the grid and its distances, by which a restart tells whether the shape is the same.
    std::uint64_t digest() const {
        if (!numbers) return 0;
        return Digest().add(numbers->lower).add(numbers->spacing).add(numbers->nodes).add(numbers->values).value();
    }
    /// Returns this shape with scalar type T. The copy shares the stored distances with this shape.
    template <class T>
    with_scalar<T> lifted() const {
        static_assert(has_lanes<T> || std::same_as<Number, float>,
                      "firn: a program for a GPU reads distances in float: use DistanceGrid<float, D>, whose distances "
                      "are in float on the CPU, too.");
        if constexpr (in_program)
            return {numbers, origin, lift<T>(grid)};
        else
            return {numbers, origin};
    }
    /// Returns what a program for a GPU is told of the grid, whose distances begin at the index `first` of its buffer.
    auto told_to_program(std::uint32_t first) const
        requires(!in_program && std::same_as<Number, float>)
    {
        detail::GridInProgram<double, D, std::uint32_t> told{numbers->lower - origin, {}, numbers->spacing,
                                                             1 / numbers->spacing,    {}, first};
        std::uint32_t step = 1;
        for (int a = D - 1; a >= 0; step *= std::uint32_t(numbers->nodes[std::size_t(a--)])) {
            told.nodes[a] = numbers->nodes[std::size_t(a)];
            told.strides[a] = step;
        }
        return told;
    }
    /// Returns this shape for positions that are measured from another point, and this point [m]. Where the grid is far
    /// from its origin, such as one of a mesh in map coordinates, that is the grid's lower corner.
    std::pair<DistanceGrid, Vec<double, D>> from_its_place() const {
        double size = 0;
        for (const int n : numbers->nodes) size = std::max(size, n * numbers->spacing);
        const bool far = norm(numbers->lower - origin) > 100 * size;
        return {{numbers, far ? numbers->lower : origin}, far ? numbers->lower - origin : Vec<double, D>::zero()};
    }
    /// The size [m] from which on distances are not exact: that of the stored numbers.
    double exact_up_to() const { return numbers ? numbers->exact_up_to : std::numeric_limits<double>::infinity(); }
    /// Returns an upper bound [m] of the error of a difference between two interpolated distances: √D times the
    /// spacing. Each of the two distances has an error of at most half of this bound.
    double uncertainty() const { return std::sqrt(double(D)) * numbers->spacing; }
    /// Returns two numbers [m]. The signed distances of all points within `radius` [m] of x [m] lie between them.
    ///
    /// With d and p as above, (‖x − p‖, d) changes by at most the way between two points, since p is the projection on
    /// a convex box. The distance changes by no more, except where the solid reaches the end of the grid: there it is
    /// the sum of both, as its upper bound is everywhere outside, and changes by up to √2 times the way.
    std::array<double, 2> distances_within(const Vec<double, D>& x, double radius) const {
        const auto exact = lift<double>(*this);
        const auto cell = exact.locate(x);
        const double d = exact.reduced(cell, -1), beyond = norm(cell.beyond), most = std::sqrt(2.0) * radius;
        bool leaves = false;  // whether some of the points are outside of the box
        for (int a = 0; a < D; ++a) {
            const double from_lower = x[a] + origin[a] - numbers->lower[a];
            const double size = (numbers->nodes[std::size_t(a)] - 1) * numbers->spacing;
            leaves = leaves || !(std::min(from_lower, size - from_lower) > radius);
        }
        double least = (d >= 0 ? std::hypot(d, beyond) : d + beyond) - radius;
        if (leaves && d <= radius + uncertainty()) least = std::min(least, d + beyond - most);
        return {least - uncertainty(), d + beyond + (leaves ? most : radius) + uncertainty()};
    }

    /// Returns the distance [m] from the origin to the farthest corner of the grid. No point of the solid is farther
    /// away, since the solid lies inside the grid.
    double extent() const {
        Vec<double, D> farthest{};
        for (int a = 0; a < D; ++a) {
            const double lower = numbers->lower[a] - origin[a];
            const double upper = lower + (numbers->nodes[std::size_t(a)] - 1) * numbers->spacing;
            farthest[a] = std::max(std::abs(lower), std::abs(upper));
        }
        return norm(farthest);
    }

    /// The signed distance of x from the surface [m], negative inside.
    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const {
        if constexpr (calls)
            return found_at(x).distance;
        else
            return distance_in(locate(x));
    }
    /// The outward unit normal at x [1].
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>& x) const {
        if constexpr (calls)
            return found_at(x).normal;
        else
            return normal_in(locate(x));
    }

private:
    template <scalar, int, class>
    friend struct DistanceGrid;
    static constexpr int corners = 1 << D;
    struct Cell {
        S at[corners];       ///< signed distances at the corners of the cell [m], last axis fastest
        Vec<S, D> fraction;  ///< position in the cell along each axis, 0 to 1
        Vec<S, D> beyond;    ///< vector from the nearest point of the grid to the position [m]
    };

    /// Whether a program has the look-up as a function of its own; with dual numbers, it does not.
    static constexpr bool calls = detail::calls_with_grid<decltype(grid), Vec<S, D>>;
    using Found = detail::FoundInGrid<S, D>;

    /// Returns what a program finds at x [m]. Its function is the same for all grids.
    Found found_at(const Vec<S, D>& x) const {
        const auto look_up = [](const decltype(grid)& of, const Vec<S, D>& at) {
            const DistanceGrid there{nullptr, {}, of};
            const Cell cell = there.locate(at);
            return Found{there.distance_in(cell), there.normal_in(cell)};
        };
        return record_call("found_in_grid", "firn/boundary/distance_grid.hpp: distance [m] and normal", {"grid", "x"},
                           look_up, grid, x);
    }
    FIRN_INLINE S distance_in(const Cell& cell) const {
        const S distance = reduced(cell, -1), square = dot(cell.beyond, cell.beyond);
        const auto is_beyond = S(0) < square;
        if (!any(is_beyond)) return distance;
        const S beyond = sqrt(select(is_beyond, square, S(1)));
        const S d = max(distance, S(0)), along = min(max(dot(cell.beyond, gradient(cell)), S(0)), beyond);
        const S from_surface = sqrt(select(is_beyond, square + d * d + S(2) * d * along, S(1)));
        return select(is_beyond, select(distance < S(0), distance + beyond, from_surface), distance);
    }
    FIRN_INLINE Vec<S, D> normal_in(const Cell& cell) const {
        const Vec<S, D> slope = gradient(cell);
        const auto is_beyond = S(0) < dot(cell.beyond, cell.beyond);
        if (!any(is_beyond)) return direction_or_up(slope);
        const S d = select(S(0) < dot(cell.beyond, slope), max(reduced(cell, -1), S(0)), S(0));
        return direction_or_up(select(is_beyond, cell.beyond + slope * d, slope));
    }
    FIRN_INLINE Cell locate(const Vec<S, D>& x) const {
        Cell cell{};
        const auto of = stored();
        auto first = of.begin();
        unroll<D>([&](auto a) FIRN_LAMBDA {
            const S from_lower = x.v[a] - of.lower_along(a), spacing = of.step();
            const S place = from_lower / spacing, within = min(of.nodes_less(a, 1), max(S(0), place));  // NaN gives 0
            const S node = min(of.nodes_less(a, 2), floor(within));
            cell.fraction.v[a] = within - node;
            cell.beyond.v[a] = select(within == place, S(0), from_lower - within * spacing);
            of.go_on(first, node, a);
        });
        for (int corner = 0; corner < corners; ++corner) cell.at[corner] = of.number(first, corner);
        return cell;
    }
    /// Returns the grid as functions with this scalar read it.
    FIRN_INLINE auto stored() const {
        if constexpr (in_program)
            return grid;
        else
            return detail::GridInMemory<S, D, Number>{*numbers, origin};
    }
    /// Returns the signed distance [m] in the cell. If `along` is −1, the distance is interpolated along all axes. If
    /// `along` is an axis, the result is the difference between the two sides of the cell along this axis, interpolated
    /// along the other axes.
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
    /// Returns the gradient [1] of the interpolated distance in the cell.
    FIRN_INLINE Vec<S, D> gradient(const Cell& cell) const {
        Vec<S, D> slope{};
        unroll<D>([&](auto a) FIRN_LAMBDA { slope.v[a] = reduced(cell, a); });
        return slope * stored().per_step();
    }
};

}  // namespace firn::inline FIRN_BUILD
