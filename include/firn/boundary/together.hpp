/// \file Several boundaries as one: Together<Walls<float, 3>, Collider<Sphere<float, 3>>>.
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

/// The I-th part among the parameters of a Together: its own are called I_NAME.
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

/// Boundaries that act on a node one after another, the first first: where two of them touch it, the last has its way.
/// A face that another covers, as a floor does what stands on it, holds nothing there. \see Collider
/// \tparam B  boundary policies in one scalar, twelve at most
template <class... B>
struct Together {
    static_assert(sizeof...(B) > 0 && sizeof...(B) <= std::size(detail::numerals),
                  "firn: a Together has one to twelve parts; one of them may be a Together or a BoundaryList.");

    std::tuple<B...> parts;

    constexpr Together() = default;
    constexpr Together(const B&... each) : parts(each...) {}

    template <class T>
    using with_scalar = Together<with_scalar_t<B, T>...>;

    static constexpr const char* name = detail::joined_names<B...>::text;
    static constexpr auto parameters() {
        return []<std::size_t... I>(std::index_sequence<I...>) {
            return std::tuple{detail::part_parameter<I>{}...};
        }(std::index_sequence_for<B...>{});
    }

    /// Once a step, before any node is touched. \throws what the parts throw
    template <class T>
    with_scalar<T> lifted() const {
        return std::apply([](const auto&... part) { return with_scalar<T>(lift<T>(part)...); }, parts);
    }

    /// \throws what the parts throw
    void check() const {
        std::apply([](const auto&... part) { (check_boundary(part), ...); }, parts);
    }

    Together advanced(double dt) const {
        return std::apply([&](const auto&... part) { return Together(firn::advanced(part, dt)...); }, parts);
    }

    /// On the nodes of a grid with cells of side h [m].
    template <class H>
    FIRN_INLINE Together on_grid(const H& h) const {
        return std::apply([&](const auto&... part) { return Together(firn::on_grid(part, h)...); }, parts);
    }

    template <class S, int D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return velocity_among(x, v, NoOthers{}, AnySurface{}, 0);
    }

    /// Of all parts, in their order. \see has_surfaces
    template <class S, int D, class Seen>
        requires(has_surfaces<B, S, D> && ...)
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        unroll<int(sizeof...(B))>([&](auto i) FIRN_LAMBDA { std::get<i>(parts).surfaces(x, seen); });
    }

    template <int D>
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        const auto part = [&](int k, const auto& f) {
            unroll<int(sizeof...(B))>([&](auto i) {
                if (k == int(i)) f(std::get<i>(parts));
            });
        };
        return reach_together(int(sizeof...(B)), part, lower, upper);
    }
    double looks_around() const {
        return std::apply([](const auto&... part) { return std::max({firn::looks_around(part)...}); }, parts);
    }

    template <int D>
    double largest_speed(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        return std::apply([&](const auto&... part) { return std::max({firn::largest_speed(part, lower, upper)...}); },
                          parts);
    }

    // The parts, for reactions; parts of parts are counted through.

    int part_count() const {
        return std::apply([](const auto&... part) { return (firn::part_count(part) + ...); }, parts);
    }
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

    /// What the parts say of themselves, for files.
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
    /// Of all parts that have surfaces but the i-th.
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
