/// \file The room that a boundary leaves to matter: a box between walls, and the distances from solids.
///
/// Nodes are held where a boundary acts, so matter comes to rest beside the outermost nodes that are held. Walls lie on
/// planes of nodes. The layer of another solid ends anywhere between two nodes; matter then rests half a cell inside of
/// the layer, in the mean. \see Collider
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/walls.hpp>

namespace firn::inline FIRN_BUILD {

/// A box without an end along some axes.
template <int D>
struct RoomBox {
    Vec<double, D> lower{},  ///< lower corner [m]; −∞ along an axis without a lower end
        upper{};             ///< upper corner [m]; ∞ along an axis without an upper end
};

namespace detail {

/// True for Walls.
template <class B>
inline constexpr bool is_walls = false;
template <class S, int D>
inline constexpr bool is_walls<Walls<S, D>> = true;

/// Returns how far matter comes to rest inside of the surface that surfaces() of a solid reports [m].
/// \param h  cell size [m]
template <class S, class B>
FIRN_INLINE S rests_within(const B& solid, bool by_gap, const S& h) {
    if (!by_gap) return S(0.5) * h;
    if constexpr (requires { solid.thickness_in_cells; })
        return S(solid.thickness_in_cells) * h;
    else
        return S(0);
}

}  // namespace detail

/// Narrows a box to the room between the walls of a boundary. A face with Contact::none has no wall.
template <class B, int D>
void narrow_to_walls(RoomBox<D>& room, const B& boundary) {
    detail::for_single_parts(boundary, [&]<class Part>(const Part& part, bool) {
        if constexpr (detail::is_walls<Part>)
            for (int a = 0; a < D; ++a) {
                const std::size_t axis = std::size_t(a);
                if (part.at_lower[axis].contact != Contact::none)
                    room.lower[a] = std::max(room.lower[a], double(part.lower[a]));
                if (part.at_upper[axis].contact != Contact::none)
                    room.upper[a] = std::min(room.upper[a], double(part.upper[a]));
            }
    });
}

/// Whether a boundary may have solids besides walls, for scalar type S in D dimensions.
template <class B, class S, int D>
inline constexpr bool may_have_solids = !detail::is_walls<B> && has_surfaces<B, S, D>;
/// Whether this is so for one of the parts.
template <template <class...> class All, class... B, class S, int D>
    requires detail::has_boundaries<All<B...>>
inline constexpr bool may_have_solids<All<B...>, S, D> = (may_have_solids<B, S, D> || ...);

/// Calls seen(distance, normal) for each solid of a boundary besides its walls: the distance of x from the surface at
/// which matter comes to rest [m], negative inside, and the unit normal of the surface, which points into free space.
/// A boundary that does not say where its surfaces are has none here. \see has_surfaces
/// \param h  cell size [m]
template <class B, class S, int D, class Seen>
FIRN_INLINE void solids_around(const B& boundary, const Vec<S, D>& x, const S& h, const Seen& seen) {
    detail::for_single_parts(boundary, [&]<class Part>(const Part& part, bool by_gap) FIRN_LAMBDA {
        if constexpr (!detail::is_walls<Part> && has_surfaces<Part, S, D>) {
            const S within = detail::rests_within(part, by_gap, h);
            part.surfaces(x, [&](const S& distance, const Vec<S, D>& normal, const auto&, Contact contact, const auto&)
                                 FIRN_LAMBDA {
                                     if (contact != Contact::none) seen(distance + within, normal);
                                 });
        }
    });
}

}  // namespace firn::inline FIRN_BUILD
