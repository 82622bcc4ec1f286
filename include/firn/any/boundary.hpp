/// \file A boundary whose parts are chosen at run time.
#pragma once

#include <firn/any/named_shape.hpp>
#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/data/domain.hpp>

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A part of a boundary that is chosen at run time: walls, or a solid of one of these shapes, the last of which is one
/// that the program offers.
template <int D>
using BoundaryPart = std::variant<Walls<double, D>, Collider<HalfSpace<double, D>>, Collider<Sphere<double, D>>,
                                  Collider<Box<double, D>>, Collider<Capsule<double, D>>,
                                  Collider<DistanceGrid<double, D>>, Collider<NamedShape<D>>>;

namespace detail {

/// The boundary of a simulation that is chosen at run time: a list for each kind of solid, the program's own last.
template <class S, int D, template <class, int> class... Own>
using AnyBoundary = Together<Walls<S, D>, BoundaryList<Collider<HalfSpace<S, D>>>, BoundaryList<Collider<Sphere<S, D>>>,
                             BoundaryList<Collider<Box<S, D>>>, BoundaryList<Collider<Capsule<S, D>>>,
                             BoundaryList<Collider<DistanceGrid<S, D>>>, BoundaryList<Collider<Own<S, D>>>...>;

/// Where a part of a choice is in the boundary.
struct PlaceOfPart {
    std::size_t kind,  ///< index of its type among the parts of AnyBoundary
        number;        ///< index in the list of its kind
};

/// Returns the index of a part's type among the parts of AnyBoundary.
/// \param own  the names of the program's own shapes
/// \throws parameter_error  if the shape of the part is not offered
template <int D>
std::size_t kind_of(const BoundaryPart<D>& part, const std::vector<std::string>& own) {
    const auto* const named = std::get_if<Collider<NamedShape<D>>>(&part);
    if (!named) return part.index();
    const auto found = std::find(own.begin(), own.end(), named->shape.shape);
    if (found == own.end()) {
        std::vector<std::string> all{HalfSpace<double, D>::name, Sphere<double, D>::name, Box<double, D>::name,
                                     Capsule<double, D>::name};
        all.insert(all.end(), own.begin(), own.end());
        throw_not_offered("shape", named->shape.shape, all);
    }
    return part.index() + std::size_t(found - own.begin());
}
/// Returns where each part is: parts of one kind keep their order.
template <int D>
std::vector<PlaceOfPart> places_of(const std::vector<BoundaryPart<D>>& parts, const std::vector<std::string>& own) {
    std::vector<PlaceOfPart> places;
    std::vector<std::size_t> count(std::variant_size_v<BoundaryPart<D>> + own.size());
    for (const BoundaryPart<D>& part : parts) {
        const std::size_t kind = kind_of(part, own);
        places.push_back({kind, count[kind]++});
    }
    return places;
}

/// Whether a type is one of a variant's.
template <class T, class Variant>
inline constexpr bool is_alternative = false;
template <class T, class... One>
inline constexpr bool is_alternative<T, std::variant<One...>> = (std::same_as<T, One> || ...);

/// Returns a part of a choice in double, as the type that it has in a boundary.
/// \tparam Own  this type, walls or a collider, in any precision
template <class Own, int D>
with_scalar_t<Own, double> exact_part(const BoundaryPart<D>& part) {
    using Exact = with_scalar_t<Own, double>;
    if constexpr (is_alternative<Exact, BoundaryPart<D>>)
        return std::get<Exact>(part);
    else
        return typed_solid<decltype(Exact::shape)>(std::get<Collider<NamedShape<D>>>(part));
}

/// Calls f(kind) with the walls of a boundary, or with the list of a kind of solids.
template <class Boundary, class F>
void with_kind(Boundary& boundary, std::size_t kind, const F& f) {
    [&]<std::size_t... K>(std::index_sequence<K...>) {
        ((K == kind ? void(f(std::get<K>(boundary.parts))) : void()), ...);
    }(std::make_index_sequence<std::tuple_size_v<decltype(boundary.parts)>>{});
}

/// Calls f(part) with the part at a place of a boundary, walls or collider.
template <class Boundary, class F>
void with_part(Boundary& boundary, const PlaceOfPart& place, const F& f) {
    with_kind(boundary, place.kind, [&](auto& kind) {
        if constexpr (requires { kind.all; })
            f(kind.all[place.number]);
        else
            f(kind);
    });
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
/// \throws parameter_error  if there are walls twice, if a shape is not offered, or if a part has a value out of range
template <class S, int D, template <class, int> class... Own>
AnyBoundary<S, D, Own...> boundary_of(OfferedShapes<Own...> offered, const std::vector<BoundaryPart<D>>& parts,
                                      const Domain<D>& domain) {
    static_assert(
        (!is_alternative<Collider<Own<double, D>>, BoundaryPart<D>> && ...),
        "firn: spheres, boxes, capsules, half-spaces and grids of distances are there without OfferedShapes.");
    AnyBoundary<S, D, Own...> boundary;
    std::get<0>(boundary.parts) = Walls<S, D>::all(domain.lower, domain.upper, {Contact::none, 0});
    bool has_walls = false;
    const std::vector<std::string> own = names_of<D>(offered);
    for (const BoundaryPart<D>& part : parts)
        with_kind(boundary, kind_of(part, own), [&]<class Kind>(Kind& kind) {
            if constexpr (std::same_as<Kind, Walls<S, D>>) {
                const auto walls = exact_part<Kind>(part);
                check_boundary(walls);
                if (has_walls)
                    throw parameter_error(
                        "The boundary has walls twice; give one box of walls, and half-spaces for more planes.");
                has_walls = true;
                kind = lift<S>(walls);
            } else {
                const auto solid = exact_part<typename decltype(kind.all)::value_type>(part);
                check_boundary(solid);
                kind.all.push_back(lift<S>(solid));
            }
        });
    return boundary;
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
