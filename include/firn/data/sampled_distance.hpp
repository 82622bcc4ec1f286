/// \file Samples a function of signed distances, or a shape, at each node of a grid. With this grid, it can be the
/// shape of a collider on the CPU and on a GPU, whatever the function needs.
///
///     const auto waves = [](const firn::Vec<double, 2>& x) { return x[1] - 0.1 * std::sin(20 * x[0]); };
///     Collider<DistanceGrid<float, 2>> floor{
///         .shape = {sampled_distance<2>(waves, {.lower = {0, -0.2}, .upper = {1, 0.4}, .spacing = 0.01})}};
#pragma once

#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/shape.hpp>
#include <firn/data/memory.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <utility>

namespace firn::inline FIRN_BUILD {

/// Options of sampled_distance(), which determine the grid of distances.
template <int D>
struct SampledDistanceOptions {
    Vec<double, D> lower{};  ///< position of the node with the lowest coordinates [m]
    Vec<double, D> upper{};  ///< the grid reaches this corner [m], at least; farther away, see DistanceGrid
    double spacing = 0;      ///< distance between nodes [m]; good values: the simulation's cell size, or half of it
    /// If the function caps its distances, the cap [m]: those of this size or more are not exact. \see Collider
    double exact_up_to = std::numeric_limits<double>::infinity();
    double most_bytes = 0x1p32;  ///< largest size of the grid [bytes]; a larger grid is an error
};

/// Returns a grid with the signed distance [m] at each node.
///
/// A function that is no distance, but is zero on the surface, has the right sign and a slope of about 1 near it,
/// serves where it is needed: in the layer of a Collider, and two cells around it.
/// \param f  a shape, as described in boundary/shape.hpp, or a function of a `Vec<double, D>` [m] that returns the
///           signed distance [m], negative inside. It is called once for each node, one after another
/// \tparam Number  float or double
/// \throws parameter_error  if a corner is not finite, or `upper` not above `lower`; if the spacing or `exact_up_to` is
///                          not positive, or the spacing not finite; if the grid is larger than most_bytes; or if a
///                          distance is not finite (the message says where)
/// \throws memory_error     if the grid does not fit into memory
template <int D, std::floating_point Number = float, class F>
[[nodiscard]] std::shared_ptr<const DistanceNumbers<Number, D>> sampled_distance(
    const F& f, const SampledDistanceOptions<D>& options) {
    const double spacing = options.spacing;
    if (!(spacing > 0) || !std::isfinite(spacing))
        throw parameter_error(
            sentence("The spacing of a grid of distances is ", spacing, " m; it must be positive and finite."));
    DistanceNumbers<Number, D> grid{options.lower, spacing, {}, {}, options.exact_up_to};
    Vec<double, D> count{};
    double all = 1, most = 0;
    for (int a = 0; a < D; ++a) {
        const double low = options.lower[a], high = options.upper[a];
        if (!std::isfinite(low) || !std::isfinite(high) || !(high > low))
            throw parameter_error(sentence("A grid of distances reaches from ", low, " to ", high, " m along axis ", a,
                                           "; the ends must be finite, and the second one above the first one."));
        const double cells = (high - low) / spacing;
        count[a] = std::max(std::ceil(cells * (1 - 1e-12)), 1.0) + 1;
        all *= count[a];
        most = std::max(most, count[a]);
    }
    const double bytes = all * sizeof(Number);
    require_memory(bytes, sentence("A grid of ", all, " distances, ", spacing, " m apart,"),
                   "Take a wider spacing or a smaller box.");
    if (!(bytes <= options.most_bytes) || !(most < 1e9))
        throw parameter_error(sentence("At a spacing of ", spacing, " m a grid of distances has ", all, " nodes, ",
                                       bytes, " bytes; at most ", options.most_bytes,
                                       " are allowed. Take a wider spacing, a smaller box, or raise most_bytes."));
    for (int a = 0; a < D; ++a) grid.nodes[std::size_t(a)] = int(count[a]);

    const auto distance_at = [&](const Vec<double, D>& x) {
        if constexpr (requires { lift<double>(f).signed_distance(x); })
            return double(lift<double>(f).signed_distance(x));
        else
            return double(f(x));
    };
    grid.values.reserve(std::size_t(all));
    std::array<int, std::size_t(D)> node{};
    for (std::size_t done = 0; done < std::size_t(all); ++done) {
        Vec<double, D> x{};
        for (int a = 0; a < D; ++a) x[a] = grid.lower[a] + node[std::size_t(a)] * spacing;
        const double distance = distance_at(x);
        if (!std::isfinite(Number(distance))) {
            std::string at;
            for (int a = 0; a < D; ++a) at += sentence(a > 0 ? ", " : "", x[a]);
            throw parameter_error(
                sentence("The distance at (", at, ") m is ", distance, "; a grid of distances holds finite numbers."));
        }
        grid.values.push_back(Number(distance));
        for (std::size_t a = std::size_t(D); a-- > 0 && ++node[a] == grid.nodes[a];) node[a] = 0;
    }
    grid.check();
    return std::make_shared<const DistanceNumbers<Number, D>>(std::move(grid));
}

}  // namespace firn::inline FIRN_BUILD
