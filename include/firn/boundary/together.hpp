/// \file Several boundaries, combined into one.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/measured_from.hpp>
#include <firn/core/names.hpp>

#include <iterator>
#include <string>
#include <tuple>

namespace firn::inline FIRN_BUILD {

namespace detail {

inline constexpr const char* numerals[] = {"0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11"};

/// The entry of the part with index I in the list of parameters of a Together boundary. The parameters of this part get
/// the names I_NAME, for example 1_friction.
template <std::size_t I>
struct part_parameter {
    const char* name = numerals[I];
    const char* unit = "";
    template <class Owner>
    FIRN_INLINE constexpr auto& of(Owner& owner) const {
        return std::get<I>(owner.parts);
    }
};

}  // namespace detail

/// Several boundaries, combined into one: `Together(walls, ball)` is a
/// `Together<Walls<float, 3>, Collider<Sphere<float, 3>>>`.
///
/// All surfaces act on a node at once, whatever the order of the parts. \see NodeAtSurfaces. A boundary of your own
/// without acting_surfaces() acts after them. If a boundary covers a face of another boundary, as a floor covers the
/// lower face of a box that stands on the floor, this face has no effect; see Collider.
///
/// Use Together for walls and colliders in one simulation. For many boundaries of one type, use a BoundaryList.
/// \tparam B  the types of one to twelve boundaries with the same scalar type; a boundary may itself be of type
/// Together or BoundaryList
template <class... B>
struct Together {
    static_assert(sizeof...(B) > 0 && sizeof...(B) <= std::size(detail::numerals),
                  "firn: a Together has one to twelve parts; one of them may be a Together or a BoundaryList.");

    std::tuple<B...> parts;  ///< The boundaries. Of those that stick to a node, the last decides.

    /// Makes every part with the default values of its type.
    constexpr Together() = default;
    /// Combines the given boundaries.
    constexpr Together(const B&... each) : parts(each...) {}

    /// The type of this boundary with scalar type T.
    template <class T>
    using with_scalar = Together<with_scalar_t<B, T>...>;

    static constexpr const char* name = detail::joined_names<B...>::text;
    static constexpr auto parameters() {
        return []<std::size_t... I>(std::index_sequence<I...>) {
            return std::tuple{detail::part_parameter<I>{}...};
        }(std::index_sequence_for<B...>{});
    }

    /// Returns this boundary with every part converted to scalar type T. A simulation calls this function once per
    /// step, before any node changes.
    /// \throws parameter_error if check() of a part throws it
    template <class T>
    with_scalar<T> lifted() const {
        return std::apply([](const auto&... part) { return with_scalar<T>(lift<T>(part)...); }, parts);
    }

    /// Calls f(part) for each part.
    template <class F>
    FIRN_INLINE void for_members(const F& f) const {
        std::apply([&](const auto&... part) FIRN_LAMBDA { (f(part), ...); }, parts);
    }

    /// Checks each part.
    /// \throws parameter_error if check() of a part throws it
    void check() const {
        for_members([](const auto& part) { check_boundary(part); });
    }

    /// Returns this boundary at a time dt [s] later: every part is replaced by firn::advanced(part, dt).
    Together advanced(double dt) const {
        return std::apply([&](const auto&... part) { return Together(firn::advanced(part, dt)...); }, parts);
    }

    /// Returns this boundary with every part adapted to a grid with cells of side h [m].
    template <class H>
    FIRN_INLINE Together on_grid(const H& h) const {
        return std::apply([&](const auto&... part) { return Together(firn::on_grid(part, h)...); }, parts);
    }

    /// Returns this boundary for positions that are measured from `corner` [m]. \see firn::measured_from
    template <int D>
    auto measured_from(const Vec<double, D>& corner) const {
        return std::apply(
            [&](const auto&... part) {
                return firn::Together<decltype(firn::measured_from(part, corner))...>(
                    firn::measured_from(part, corner)...);
            },
            parts);
    }

    /// Returns the velocity [m/s] of a node at x [m] after all parts have acted; v [m/s] is the node's velocity before.
    template <class S, int D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return velocity_among(*this, x, v, NoOthers{}, AnySurface{});
    }
    /// As velocity(x, v), where a part acts with a force: mass [kg] is that of the node, dt [s] the time step.
    template <class S, int D>
        requires(acts_by_force<B, S, D> || ...)
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v, const S& mass, const S& dt) const {
        return velocity_among(*this, x, v, NoOthers{}, AnySurface{}, NodeInertia<S>{mass, dt});
    }

    /// Calls `seen` for the surfaces of all parts, in the order of the parts. \see has_surfaces
    template <class S, int D, class Seen>
        requires(has_surfaces<B, S, D> && ...)
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        unroll<int(sizeof...(B))>([&](auto i) FIRN_LAMBDA { std::get<i>(parts).surfaces(x, seen); });
    }

    /// Returns true if at least one of the parts may change nodes in the box [lower, upper] [m].
    template <int D>
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        return detail::reach_together(*this, lower, upper);
    }

    /// Calls f(part, others, k) for each part. If a part is itself of type Together or BoundaryList, the parts in this
    /// part are meant instead. \see firn::for_parts
    template <class Others, class F>
    FIRN_INLINE void for_parts(const Others& others, const F& f, int first) const {
        unroll<int(sizeof...(B))>([&](auto i) FIRN_LAMBDA {
            const auto& part = std::get<i>(parts);
            const auto beside = [&](const auto& at, const auto& see) {
                others(at, see);
                surfaces_but(i, at, see);
            };
            firn::for_parts(part, beside, f, first);
            first += firn::part_count(part);
        });
    }

    /// Calls `seen` for the mirrored walls of all parts. \see has_mirrors
    template <class Seen>
        requires(has_mirrors<B> || ...)
    void mirrors(const Seen& seen) const {
        detail::mirrors_together(*this, seen);
    }

    /// Returns the descriptions of the parts, separated by "; ", as they are written into files.
    std::string description() const { return detail::descriptions(*this); }

private:
    /// Calls `seen` for the surfaces of all parts except part i.
    template <class S, int D, class Seen>
    void surfaces_but(int i, const Vec<S, D>& x, const Seen& seen) const {
        unroll<int(sizeof...(B))>([&](auto j) FIRN_LAMBDA {
            using Part = std::tuple_element_t<j, std::tuple<B...>>;
            if constexpr (has_surfaces<Part, S, D>)
                if (int(j) != i) std::get<j>(parts).surfaces(x, seen);
        });
    }
};

}  // namespace firn::inline FIRN_BUILD
