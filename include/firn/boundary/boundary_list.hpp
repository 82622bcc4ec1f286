/// \file A list of boundaries of one type, with a length chosen at run time.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/measured_from.hpp>
#include <firn/core/lanes.hpp>
#include <firn/core/names.hpp>

#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_list {
    static constexpr const char* name = "list";
};
}  // namespace detail

/// A list of boundaries of one type, which together act as one boundary: `BoundaryList<Collider<Sphere<float, 3>>>`.
///
/// All surfaces act on a node at once, whatever their order. \see NodeAtSurfaces. If a boundary covers a face of
/// another boundary, as a floor covers the lower face of a box that stands on the floor, this face has no effect; see
/// Collider.
///
/// Use a BoundaryList for many colliders of one shape, or where the number of colliders is known only at run time. A
/// BoundaryList works on the CPU only; on a GPU, use Together.
/// \tparam B  the type of each boundary
template <class B>
struct BoundaryList {
    std::vector<B> all;  ///< The boundaries. Of those that stick to a node, the last decides.

    /// The type of this list with scalar type T.
    template <class T>
    using with_scalar = BoundaryList<with_scalar_t<B, T>>;

    static constexpr const char* name = detail::joined_names<B, detail::named_list>::text;

    /// Returns the list with every boundary converted to scalar type T. A simulation calls this function once per step,
    /// before any node changes.
    /// \throws parameter_error if check() of a boundary throws it
    template <class T>
    with_scalar<T> lifted() const {
        static_assert(has_lanes<T>,
                      "firn: a BoundaryList gets its length at run time; a program for a GPU must know the number of "
                      "boundaries when it is written. Use Together<...>.");
        with_scalar<T> other;
        other.all.reserve(all.size());
        for (const B& one : all) other.all.push_back(lift<T>(one));
        return other;
    }

    /// Calls f(boundary) for each boundary.
    template <class F>
    FIRN_INLINE void for_members(const F& f) const {
        for (const B& one : all) f(one);
    }

    /// Checks each boundary.
    /// \throws parameter_error if check() of a boundary throws it
    void check() const {
        for (const B& one : all) check_boundary(one);
    }

    /// Returns the list at a time dt [s] later: every boundary is replaced by firn::advanced(boundary, dt).
    BoundaryList advanced(double dt) const {
        BoundaryList later;
        later.all.reserve(all.size());
        for (const B& one : all) later.all.push_back(firn::advanced(one, dt));
        return later;
    }

    /// Returns the list with every boundary adapted to a grid with cells of side h [m].
    BoundaryList on_grid(double h) const {
        BoundaryList there;
        there.all.reserve(all.size());
        for (const B& one : all) there.all.push_back(firn::on_grid(one, h));
        return there;
    }

    /// Returns the list for positions that are measured from `corner` [m]. \see firn::measured_from
    template <int D>
    auto measured_from(const Vec<double, D>& corner) const {
        firn::BoundaryList<decltype(firn::measured_from(std::declval<const B&>(), corner))> there;
        there.all.reserve(all.size());
        for (const B& one : all) there.all.push_back(firn::measured_from(one, corner));
        return there;
    }

    /// Returns the velocity [m/s] of a node at x [m] after all boundaries have acted; v [m/s] is the node's velocity
    /// before.
    template <class S, int D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return velocity_among(*this, x, v, NoOthers{}, AnySurface{});
    }
    /// As velocity(x, v), where a part acts with a force: mass [kg] is that of the node, dt [s] the time step.
    template <class S, int D>
        requires acts_by_force<B, S, D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v, const S& mass, const S& dt) const {
        return velocity_among(*this, x, v, NoOthers{}, AnySurface{}, NodeInertia<S>{mass, dt});
    }

    /// Calls `seen` for the surfaces of all boundaries, in the order of `all`. \see has_surfaces
    template <class S, int D, class Seen>
        requires has_surfaces<B, S, D>
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        for (const B& one : all) one.surfaces(x, seen);
    }

    /// Returns true if at least one of the boundaries may change nodes in the box [lower, upper] [m].
    template <int D>
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        return detail::reach_together(*this, lower, upper);
    }

    /// Calls f(part, others, k) for each part of all boundaries in the list. \see firn::for_parts
    template <class Others, class F>
    FIRN_INLINE void for_parts(const Others& others, const F& f, int first) const {
        for (const B& one : all) {
            const auto beside = [&]<class S, int D>(const Vec<S, D>& at, const auto& see) {
                others(at, see);
                if constexpr (has_surfaces<B, S, D>)
                    for (const B& other : all)
                        if (&other != &one) other.surfaces(at, see);
            };
            firn::for_parts(one, beside, f, first);
            first += firn::part_count(one);
        }
    }

    /// Calls `seen` for the mirrored walls of all boundaries. \see has_mirrors
    template <class Seen>
        requires has_mirrors<B>
    void mirrors(const Seen& seen) const {
        detail::mirrors_together(*this, seen);
    }

    /// Returns the descriptions of the boundaries, separated by "; ", as they are written into files.
    std::string description() const { return detail::descriptions(*this); }
};

}  // namespace firn::inline FIRN_BUILD
