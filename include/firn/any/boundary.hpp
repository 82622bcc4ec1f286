/// \file A boundary whose parts are chosen at run time.
#pragma once

#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/data/domain.hpp>

#include <tuple>
#include <utility>
#include <variant>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A part of a boundary that is chosen at run time: walls, or a solid of one of these shapes.
template <int D>
using BoundaryPart =
    std::variant<Walls<double, D>, Collider<HalfSpace<double, D>>, Collider<Sphere<double, D>>,
                 Collider<Box<double, D>>, Collider<Capsule<double, D>>, Collider<DistanceGrid<double, D>>>;

namespace detail {

/// The boundary of a simulation that is chosen at run time: a list for each kind of solid.
template <class S, int D>
using AnyBoundary = Together<Walls<S, D>, BoundaryList<Collider<HalfSpace<S, D>>>, BoundaryList<Collider<Sphere<S, D>>>,
                             BoundaryList<Collider<Box<S, D>>>, BoundaryList<Collider<Capsule<S, D>>>,
                             BoundaryList<Collider<DistanceGrid<S, D>>>>;

/// Where a part of a choice is in the boundary.
struct PlaceOfPart {
    std::size_t kind,  ///< index of its type in BoundaryPart
        number;        ///< index in the list of its kind
};

/// Returns where each part is: parts of one kind keep their order.
template <int D>
std::vector<PlaceOfPart> places_of(const std::vector<BoundaryPart<D>>& parts) {
    std::vector<PlaceOfPart> places;
    std::size_t count[std::variant_size_v<BoundaryPart<D>>] = {};
    for (const BoundaryPart<D>& part : parts) places.push_back({part.index(), count[part.index()]++});
    return places;
}

/// Calls f(part) with the part at a place of a boundary, walls or collider.
template <class Boundary, class F>
void with_part(Boundary& boundary, const PlaceOfPart& place, const F& f) {
    [&]<std::size_t... K>(std::index_sequence<K...>) {
        const auto look = [&]<std::size_t Kind>(std::integral_constant<std::size_t, Kind>) {
            if (Kind != place.kind) return;
            if constexpr (Kind == 0)
                f(std::get<0>(boundary.parts));
            else
                f(std::get<Kind>(boundary.parts).all[place.number]);
        };
        (look(std::integral_constant<std::size_t, K>{}), ...);
    }(std::make_index_sequence<std::tuple_size_v<decltype(boundary.parts)>>{});
}

/// Returns the index among the parts of the boundary, see part_count(), of the part at a place.
template <class Boundary>
int index_of_part(const Boundary& boundary, const PlaceOfPart& place) {
    int first = 0;
    [&]<std::size_t... K>(std::index_sequence<K...>) {
        (((K < place.kind) ? void(first += part_count(std::get<K>(boundary.parts))) : void()), ...);
    }(std::make_index_sequence<std::tuple_size_v<decltype(boundary.parts)>>{});
    return first + int(place.number);
}

/// Makes the boundary of these parts. Without walls, it has none.
/// \throws parameter_error  if there are walls twice, or if a part has a value out of range
template <class S, int D>
AnyBoundary<S, D> boundary_of(const std::vector<BoundaryPart<D>>& parts, const Domain<D>& domain) {
    AnyBoundary<S, D> boundary;
    auto& walls = std::get<0>(boundary.parts);
    walls = Walls<S, D>::all(domain.lower, domain.upper, {Contact::none, 0});
    bool has_walls = false;
    for (const BoundaryPart<D>& part : parts)
        std::visit(
            [&]<class Part>(const Part& one) {
                check_boundary(one);
                if constexpr (std::same_as<Part, Walls<double, D>>) {
                    if (has_walls)
                        throw parameter_error(
                            "The boundary has walls twice; give one box of walls, and half-spaces for more planes.");
                    has_walls = true;
                    walls = lift<S>(one);
                } else {
                    std::get<BoundaryList<with_scalar_t<Part, S>>>(boundary.parts).all.push_back(lift<S>(one));
                }
            },
            part);
    return boundary;
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
