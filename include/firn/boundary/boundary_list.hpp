/// \file Any number of boundaries of one type, decided at run time. For the CPU; a GPU's program takes a Together.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/lanes.hpp>
#include <firn/core/names.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace firn {

namespace detail {
struct named_list {
    static constexpr const char* name = "list";
};
}  // namespace detail

/// They act on a node one after another, in the order of `all`.
template <class B>
struct BoundaryList {
    std::vector<B> all;

    template <class T>
    using with_scalar = BoundaryList<with_scalar_t<B, T>>;

    static constexpr const char* name = detail::joined_names<B, detail::named_list>::text;

    /// Once a step, before any node is touched. \throws what the boundaries throw
    template <class T>
    with_scalar<T> lifted() const {
        static_assert(
            has_lanes<T>,
            "firn: a BoundaryList has as many boundaries as its program has while it runs; the text of a GPU's "
            "program must know them. Use Together<...>.");
        with_scalar<T> other;
        other.all.reserve(all.size());
        for (const B& one : all) other.all.push_back(lift<T>(one));
        return other;
    }

    /// \throws what the boundaries throw
    void check() const {
        for (const B& one : all) check_boundary(one);
    }

    BoundaryList advanced(double dt) const {
        BoundaryList later;
        later.all.reserve(all.size());
        for (const B& one : all) later.all.push_back(firn::advanced(one, dt));
        return later;
    }

    /// On the nodes of a grid with cells of side h [m].
    BoundaryList on_grid(double h) const {
        BoundaryList there;
        there.all.reserve(all.size());
        for (const B& one : all) there.all.push_back(firn::on_grid(one, h));
        return there;
    }

    template <class S, int D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return velocity_among(x, v, NoOthers{}, AnySurface{}, 0);
    }

    /// Of all, in their order. \see has_surfaces
    template <class S, int D, class Seen>
        requires has_surfaces<B, S, D>
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        for (const B& one : all) one.surfaces(x, seen);
    }

    template <int D>
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        const auto part = [&](int k, const auto& f) { f(all[std::size_t(k)]); };
        return reach_together(int(all.size()), part, lower, upper);
    }
    double looks_around() const {
        double farthest = 0;
        for (const B& one : all) farthest = std::max(farthest, firn::looks_around(one));
        return farthest;
    }

    template <int D>
    double largest_speed(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        double largest = 0;
        for (const B& one : all) largest = std::max(largest, firn::largest_speed(one, lower, upper));
        return largest;
    }

    int part_count() const { return int(all.size()); }
    template <class S, int D, class Others, class Seen>
    FIRN_INLINE Vec<S, D> velocity_among(const Vec<S, D>& x, Vec<S, D> v, const Others& others, const Seen& seen,
                                         int first) const {
        for (const B& one : all) {
            const auto beside = [&](const Vec<S, D>& at, const auto& see) {
                others(at, see);
                if constexpr (has_surfaces<B, S, D>)
                    for (const B& other : all)
                        if (&other != &one) other.surfaces(at, see);
            };
            v = firn::velocity_among(one, x, v, beside, seen, first++);
        }
        return v;
    }
    template <int D>
    Vec<double, D> centre_of_part(int k) const {
        return part_centre<D>(all[std::size_t(k)], 0);
    }

    /// What they say of themselves, for files.
    std::string description() const {
        std::string text;
        if constexpr (requires(const B one) { one.description(); })
            for (const B& one : all) text += (text.empty() ? "" : "; ") + one.description();
        return text;
    }
};

}  // namespace firn
