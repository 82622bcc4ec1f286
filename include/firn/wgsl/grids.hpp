/// \file The grids of distances that a WGSL program reads from its buffer "distances".
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/parameters.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD::wgsl {

/// Distances that lie one after another in the buffer "distances" of a program: those of each grid, as in
/// DistanceNumbers::values. They are shared with the shapes that have them.
struct Distances {
    std::vector<std::shared_ptr<const std::vector<float>>> grids{};  ///< the distances of each grid [m]

    /// Returns how many distances there are.
    std::size_t size() const {
        std::size_t all = 0;
        for (const auto& grid : grids) all += grid->size();
        return all;
    }
    /// Returns the contents of the buffer.
    std::vector<float> joined() const {
        std::vector<float> all;
        all.reserve(size());
        for (const auto& grid : grids) all.insert(all.end(), grid->begin(), grid->end());
        return all;
    }
    /// Adds those of a shape, and returns what a program is told of its grid. \see DistanceGrid::told_to_program
    /// \throws parameter_error  if the shape's check() throws it; if an axis has 2^24 nodes or more, or all grids 2^32;
    ///                          or if the grid is so far from its origin that float has no digits for it
    template <class Shape>
    auto add(const Shape& shape) {
        shape.check();
        const std::size_t first = size();
        for (const int nodes : shape.numbers->nodes)
            if (nodes >= 1 << 24)
                throw parameter_error(sentence("A grid of distances has ", nodes,
                                               " nodes along an axis; on a GPU it "
                                               "can have ",
                                               (1 << 24) - 1, ". Take a wider spacing."));
        if (double(first) + double(shape.numbers->values.size()) >= 0x1p32)
            throw parameter_error(sentence("The grids of distances have ", first, " and ", shape.numbers->values.size(),
                                           " nodes; on a GPU they can have 4294967295. Take a wider spacing."));
        const auto [moved, way] = shape.from_its_place();
        if (!(dot(way, way) == 0))
            throw parameter_error(
                "A grid of distances is more than 100 times its size away from the shape's origin, which costs digits "
                "on a GPU: set the shape's `origin` to the grid's lower corner, and move the collider there.");
        grids.emplace_back(shape.numbers, &shape.numbers->values);
        return shape.told_to_program(std::uint32_t(first));
    }
};

namespace detail {

/// Calls f(shape, name) for each shape among a policy and its inner policies that reads numbers of a grid. What the
/// program is told of it has parameters whose names begin with `name`.
template <class P, class F>
void for_grids(const P& policy, const F& f, const std::string& before) {
    if constexpr (requires { policy.told_to_program(std::uint32_t{}); })
        f(policy, before + "grid_");
    else if constexpr (has_parameters<P>)
        std::apply(
            [&](const auto&... p) {
                [[maybe_unused]] const auto visit = [&](const auto& one) {
                    const auto& value = one.of(policy);
                    if constexpr (firn::detail::is_policy<std::remove_cvref_t<decltype(value)>>)
                        for_grids(value, f, before + one.name + "_");
                };
                (visit(p), ...);
            },
            P::parameters());
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD::wgsl
