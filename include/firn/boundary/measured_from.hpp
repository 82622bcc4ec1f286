/// \file Boundaries for positions that are measured from a corner.
///
/// Where nodes are updated, positions are measured from the domain's lower corner, so that a float has digits enough in
/// domains far from 0, too. firn's own boundaries have a function measured_from(corner), which moves them in double; a
/// boundary without it gets positions in metres, from which a float leaves as many digits as it can.
#pragma once

#include <firn/boundary/concept.hpp>

#include <concepts>
#include <tuple>
#include <type_traits>
#include <utility>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A boundary that does not have measured_from(), for positions that are measured from a corner: it gets the positions
/// that it knows.
template <class B, int D>
struct InMetres {
    B boundary;             ///< the boundary
    Vec<double, D> corner;  ///< the position that positions are measured from [m]

    /// \name Interface of boundaries, as in boundary/concept.hpp
    /// @{

    /// with_scalar, lifted(), on_grid(), reaches(), velocity(), surfaces() and acting_surfaces() are those of
    /// `boundary`, with positions and boxes measured from `corner`.
    template <class T>
    using with_scalar = InMetres<with_scalar_t<B, T>, D>;
    template <class T>
    with_scalar<T> lifted() const {
        return {lift<T>(boundary), corner};
    }
    template <class H>
    FIRN_INLINE InMetres on_grid(const H& h) const {
        return {firn::on_grid(boundary, h), corner};
    }
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        return boundary.reaches(lower + corner, upper + corner);
    }
    template <class S>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return detail::in_own_terms(boundary.velocity(x + cast<S>(corner), v));
    }
    template <class S>
        requires acts_by_force<B, S, D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v, const S& mass, const S& dt) const {
        return detail::in_own_terms(boundary.velocity(x + cast<S>(corner), v, mass, dt));
    }
    template <class S, class Seen>
        requires has_surfaces<B, S, D>
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        boundary.surfaces(x + cast<S>(corner), seen);
    }
    template <class S, class Others, class Seen>
        requires has_acting_surfaces<B, S, D>
    FIRN_INLINE void acting_surfaces(const Vec<S, D>& x, const Vec<S, D>& v, const Others& others,
                                     const Seen& seen) const {
        const auto beside = [&](const Vec<S, D>& at, const auto& see) { others(at - cast<S>(corner), see); };
        boundary.acting_surfaces(x + cast<S>(corner), v, beside, seen);
    }
    /// @}
};

}  // namespace detail

/// Returns the boundary for positions that are measured from `corner` [m]: boundary.measured_from(corner) if the
/// boundary has this function, else the boundary with a corner that it adds to positions.
template <class B, int D>
FIRN_INLINE auto measured_from(const B& boundary, const Vec<double, D>& corner) {
    if constexpr (requires { boundary.measured_from(corner); })
        return boundary.measured_from(corner);
    else
        return detail::InMetres<B, D>{boundary, corner};
}

/// Whether a boundary of type B, or one of its parts, gets positions as they are, because it does not have
/// measured_from().
template <class B, int D>
constexpr bool sees_metres() {
    bool sees = false;
    using Measured = decltype(measured_from(std::declval<const B&>(), Vec<double, D>{}));
    if constexpr (std::same_as<Measured, detail::InMetres<B, D>>)
        sees = true;
    else if constexpr (requires(const B all) { all.parts; })
        []<class... Part>(std::type_identity<std::tuple<Part...>>, bool& any) {
            any = (sees_metres<Part, D>() || ...);
        }(std::type_identity<std::remove_cvref_t<decltype(std::declval<const B&>().parts)>>{}, sees);
    else if constexpr (requires(const B all) { all.all[0]; })
        sees = sees_metres<std::remove_cvref_t<decltype(std::declval<const B&>().all[0])>, D>();
    return sees;
}

}  // namespace firn::inline FIRN_BUILD
