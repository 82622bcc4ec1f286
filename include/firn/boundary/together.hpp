/// \file Several boundaries as one.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>

#include <algorithm>
#include <iterator>
#include <string>
#include <tuple>

namespace firn {

namespace detail {

inline constexpr const char* numerals[] = {"0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11"};

/// The I-th part among the parameters of a Together; the part's own parameters are named I_NAME.
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

/// Several boundaries as one: `Together(walls, ball)` is a `Together<Walls<float, 3>, Collider<Sphere<float, 3>>>`.
///
/// They act on a node one after another, in order: where two touch a node, the later one decides. A face that another
/// boundary covers, such as the lower face of a box on a floor, has no effect there. Collider says how.
///
/// Take it for walls and colliders in one simulation. For many boundaries of one type, take a BoundaryList.
/// \tparam B  one to twelve boundaries with the same scalar; one may be a Together or a BoundaryList
template <class... B>
struct Together {
    static_assert(sizeof...(B) > 0 && sizeof...(B) <= std::size(detail::numerals),
                  "firn: a Together has one to twelve parts; one of them may be a Together or a BoundaryList.");

    std::tuple<B...> parts;  ///< The boundaries, in the order in which they act.

    /// Makes each part with its default values.
    constexpr Together() = default;
    /// Makes one boundary of these.
    constexpr Together(const B&... each) : parts(each...) {}

    /// The same boundaries with scalar T.
    template <class T>
    using with_scalar = Together<with_scalar_t<B, T>...>;

    static constexpr const char* name = detail::joined_names<B...>::text;
    static constexpr auto parameters() {
        return []<std::size_t... I>(std::index_sequence<I...>) {
            return std::tuple{detail::part_parameter<I>{}...};
        }(std::index_sequence_for<B...>{});
    }

    /// The boundary with every part lifted to the scalar T. Called once a step, before any node changes.
    /// \throws what the parts' checks throw
    template <class T>
    with_scalar<T> lifted() const {
        return std::apply([](const auto&... part) { return with_scalar<T>(lift<T>(part)...); }, parts);
    }

    /// Checks each part.
    /// \throws what the parts' checks throw
    void check() const {
        std::apply([](const auto&... part) { (check_boundary(part), ...); }, parts);
    }

    /// The boundaries dt [s] later.
    Together advanced(double dt) const {
        return std::apply([&](const auto&... part) { return Together(firn::advanced(part, dt)...); }, parts);
    }

    /// The boundaries for a grid with cells of side h [m].
    template <class H>
    FIRN_INLINE Together on_grid(const H& h) const {
        return std::apply([&](const auto&... part) { return Together(firn::on_grid(part, h)...); }, parts);
    }

    /// The velocity [m/s] of a node at x [m] after all parts have acted on its velocity v [m/s].
    template <class S, int D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return velocity_among(x, v, NoOthers{}, AnySurface{}, 0);
    }

    /// The surfaces of all parts, in their order. \see has_surfaces
    template <class S, int D, class Seen>
        requires(has_surfaces<B, S, D> && ...)
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        unroll<int(sizeof...(B))>([&](auto i) FIRN_LAMBDA { std::get<i>(parts).surfaces(x, seen); });
    }

    /// Can one of the parts change nodes of the box [lower, upper] [m]?
    template <int D>
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        const auto part = [&](int k, const auto& f) {
            unroll<int(sizeof...(B))>([&](auto i) {
                if (k == int(i)) f(std::get<i>(parts));
            });
        };
        return reach_together(int(sizeof...(B)), part, lower, upper);
    }
    /// How far a part looks for others, at most [m]. \see firn::looks_around
    double looks_around() const {
        return std::apply([](const auto&... part) { return std::max({firn::looks_around(part)...}); }, parts);
    }

    /// The largest speed [m/s] of a part in the box [lower, upper] [m]. \see firn::largest_speed
    template <int D>
    double largest_speed(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        return std::apply([&](const auto&... part) { return std::max({firn::largest_speed(part, lower, upper)...}); },
                          parts);
    }

    /// The number of parts, the parts of parts counted one by one.
    int part_count() const {
        return std::apply([](const auto&... part) { return (firn::part_count(part) + ...); }, parts);
    }
    /// As velocity(), beside others, and tells `seen` what each part did. \see firn::velocity_among
    template <class S, int D, class Others, class Seen>
    FIRN_INLINE Vec<S, D> velocity_among(const Vec<S, D>& x, Vec<S, D> v, const Others& others, const Seen& seen,
                                         int first) const {
        unroll<int(sizeof...(B))>([&](auto i) FIRN_LAMBDA {
            const auto& part = std::get<i>(parts);
            const auto beside = [&](const Vec<S, D>& at, const auto& see) {
                others(at, see);
                surfaces_but(i, at, see);
            };
            v = firn::velocity_among(part, x, v, beside, seen, first);
            first += firn::part_count(part);
        });
        return v;
    }
    /// The point [m] about which the torque on part k is taken. \see firn::part_centre
    template <int D>
    Vec<double, D> centre_of_part(int k) const {
        Vec<double, D> centre = Vec<double, D>::zero();
        unroll<int(sizeof...(B))>([&](auto i) {
            const int count = firn::part_count(std::get<i>(parts));
            if (k >= 0 && k < count) centre = firn::part_centre<D>(std::get<i>(parts), k);
            k -= count;
        });
        return centre;
    }

    /// The parts' descriptions, separated by "; ", for files.
    std::string description() const {
        std::string text;
        const auto add = [&](const auto& part) {
            if constexpr (requires { part.description(); })
                text += sentence(text.empty() ? "" : "; ", part.description());
        };
        std::apply([&](const auto&... part) { (add(part), ...); }, parts);
        return text;
    }

private:
    /// The surfaces of all parts but the i-th.
    template <class S, int D, class Seen>
    void surfaces_but(int i, const Vec<S, D>& x, const Seen& seen) const {
        unroll<int(sizeof...(B))>([&](auto j) FIRN_LAMBDA {
            using Part = std::tuple_element_t<j, std::tuple<B...>>;
            if constexpr (has_surfaces<Part, S, D>)
                if (int(j) != i) std::get<j>(parts).surfaces(x, seen);
        });
    }
};

}  // namespace firn
