/// \file Forces of elements, such as springs and triangles, each of which joins a few points.
///
/// Forces are computed element by element. Then the forces on each point are summed, in the same order for any number
/// of threads.
#pragma once

#include <firn/core/digest.hpp>
#include <firn/core/error.hpp>
#include <firn/lagrangian/any_force.hpp>
#include <firn/lagrangian/incidence.hpp>
#include <firn/lagrangian/net.hpp>

#include <algorithm>
#include <atomic>
#include <optional>

namespace firn::inline FIRN_BUILD {

/// The forces of many elements that follow the same law, such as springs or triangles.
///
/// A law must have three members: the type Law::Element (the data of one element), the number of corners
/// Law::corners = K, and law.forces(element, x, v), which returns the forces [N] on the K corners. x are the positions
/// [m] and v the velocities [m/s] of the corners, in arrays of K vectors. Positions are counted from the first corner,
/// so x[0] is zero: differences of positions are formed in double, and do not lose digits far from the origin. The one
/// position of an element of one corner is counted from the origin. A law that needs places in space, as an anchor
/// does, takes a last argument more, `at`: the position of the first corner, as Vec<double, D>. x is then always
/// counted from the first corner. The members below may take it, too.
///
/// Optional members are:
///
///     energy(element, x)          elastic energy [J]
///     stiffness(element, x)       an upper bound for the eigenvalues of the stiffness matrix −∂f/∂x [N/m]
///     damping(element, x, v)      an upper bound for the eigenvalues of the damping matrix −∂f/∂v [N s/m]; or
///                                 damping(element), if it depends on neither
///     check(element), check()     throw an error if a parameter is out of range
///
/// Stiffness and damping bound the time step, see ParticleSystem::stable_time_step. If the force of a law depends on
/// positions and the law has no stiffness(), or on velocities and it has no damping(), then nothing tells that a step
/// is too large for it.
///
/// If K is 2, the law has a number `tear_factor`, and its elements have a length at rest `rest` [m], then the elements
/// tear as springs do, see SpringDamper::tear_factor.
/// \tparam Law  the law of an element: springs, membranes, drag on facets, …
/// \tparam D    2 or 3
template <class Law, int D>
class ElementForces {
public:
    using S = typename Law::scalar_type;            ///< float or double.
    using Element = typename Law::Element;          ///< The data of one element.
    static constexpr std::size_t K = Law::corners;  ///< Number of corners of an element.
    static constexpr bool opens_no_region = true;   ///< add_forces() opens no parallel region. \see point_force
    using Corners = std::array<std::uint32_t, K>;   ///< The indices (into PointMasses) of an element's corner points.

    /// Makes an object without elements. The elements that are added later follow the law `with`.
    explicit ElementForces(const Law& with = {}) : law(with) {}

    Law law;  ///< The law that all elements follow.

    /// Returns the number of elements.
    std::size_t size() const { return corners_.size(); }
    /// Returns a digest of all elements as they were added, including those that were removed later. Of elements' data
    /// it has what `Digest digest(element)` of the law has, if the law has this function.
    std::uint64_t digest() const { return as_added_.value(); }
    /// Returns the indices (into PointMasses) of the corner points of the element with index e.
    const Corners& corners(std::size_t e) const { return corners_[e]; }
    /// @{
    /// Returns the data of the element with index e.
    Element& element(std::size_t e) { return elements_[e]; }
    const Element& element(std::size_t e) const { return elements_[e]; }
    /// @}

    /// Adds an element.
    /// \param corners      the indices (into PointMasses) of the corner points
    /// \param element      the data of the element
    /// \param kind         of a spring: the kind of link. When links tear, springs of the kinds shear and bend may go
    ///                     with them, see ParticleSystem::tear. Other elements do not use it.
    /// \param tear_factor  of a spring: see SpringOptions::tear_factor. Other elements do not use it.
    /// \throws parameter_error  if law.check(element) throws it, or if the tear factor is not above 1
    void add(const Corners& corners, const Element& element = {}, LinkKind kind = LinkKind::stretch,
             const std::optional<double>& tear_factor = {}) {
        if constexpr (requires { law.check(element); }) law.check(element);
        if constexpr (is_link) {
            factors_.add(tear_factor, size());
            kinds_.push_back(kind);
        }
        as_added_.add(corners).add(kind).add(tear_factor.value_or(0));
        if constexpr (requires { law.digest(element); }) as_added_.add(law.digest(element).value());
        corners_.push_back(corners);
        elements_.push_back(element);
        incidence_.clear();
    }

    /// Adds the force [N] of all elements on each point to the array `force`, which has one entry per point.
    /// \throws parameter_error  if an element names a point that does not exist, or if law.check() throws it
    void add_forces(const PointView<S, D>& points, std::span<Vec<S, D>> force, int threads) {
        if constexpr (requires { law.check(); }) law.check();
        prepare(points.size());
        renew(parts_, size() * K, thread_count(threads));
        detail::for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t e = first; e < last; ++e) {
                const auto v = at_corners(points.velocity, e);
                const auto of_element =
                    from_first<has_forces<Place>>(points, e, [&](const Vectors& x, const auto&... at) FIRN_LAMBDA {
                        return law.forces(elements_[e], x, v, at...);
                    });
                std::copy(of_element.begin(), of_element.end(), parts_.begin() + std::ptrdiff_t(e * K));
            }
        });
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                for (const std::uint32_t corner : incidence_.of(i)) force[i] += parts_[corner];
        });
    }

    /// Adds the stiffness [N/m] and damping [N s/m] of all elements to the arrays `stiffness` and `damping`, which have
    /// one entry per point. An element adds to the entries of each of its corner points. Divided by the mass of the
    /// point, the stiffness at a point is an upper bound for squared angular frequencies [1/s²], and the damping at a
    /// point is an upper bound for decay rates [1/s].
    /// \throws parameter_error  if an element names a point that does not exist
    void add_stiffness(const PointView<S, D>& points, std::span<double> stiffness, std::span<double> damping,
                       int threads) {
        if constexpr (bounds_step) {
            prepare(points.size());
            renew(bounds_, size(), thread_count(threads));
            detail::for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
                for (std::size_t e = first; e < last; ++e)
                    bounds_[e] = {stiffness_of(points, e), damping_of(points, e)};
            });
            detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
                for (std::size_t i = first; i < last; ++i)
                    for (const std::uint32_t corner : incidence_.of(i)) {
                        stiffness[i] += bounds_[corner / K][0];
                        damping[i] += bounds_[corner / K][1];
                    }
            });
        }
    }

    /// Returns the elastic energy of all elements [J], summed in double precision in the order of the elements.
    /// \throws parameter_error  if an element names a point that does not exist
    double energy(const PointView<S, D>& points) {
        prepare(points.size());
        double sum = 0;
        for (std::size_t e = 0; e < size(); ++e)
            sum += double(from_first<has_energy<Place>>(
                points, e, [&](const Vectors& x, const auto&... at) { return law.energy(elements_[e], x, at...); }));
        return sum;
    }

    /// Updates the elements' point indices. Elements that have lost a corner point are removed. Call renumber() after
    /// points are removed.
    /// \param new_place  the list that PointMasses::remove_if returned: the new index for each old one
    /// \throws parameter_error  if an element names a point without an entry in new_place
    void renumber(std::span<const std::uint32_t> new_place) {
        keep_if([&](Corners& corners) { return detail::renumbered(corners, new_place); });
    }
    /// Removes the elements at torn links: each element that has both end points of a torn link among its corners.
    void tear(std::span<const Torn> torn) {
        const detail::TornLinks links(torn);
        keep_if([&](const Corners& corners) { return !links.are_in(corners); });
    }

    /// Returns whether some element may tear by itself. Only springs do.
    bool may_tear() const {
        if constexpr (is_link) return factors_.may_tear(double(law.tear_factor));
        return false;
    }
    /// Returns whether some spring is longer than its tear factor allows. Call add_forces() first, which checks the
    /// springs' point indices.
    bool is_overlong(const PointView<S, D>& points, int threads) const {
        std::atomic<bool> found = false;
        if constexpr (is_link) {
            if (!may_tear()) return false;
            const S of_others = factors_.square(double(law.tear_factor));
            detail::for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
                bool any = false;
                for (std::size_t e = first; e < last; ++e) {
                    const auto [a, b] = corners_[e];
                    any |= detail::is_too_long(points.position[a], points.position[b], elements_[e].rest,
                                               factors_.square_of(e, of_others));
                }
                if (any) found = true;
            });
        }
        return found;
    }
    /// Adds the springs to a list of links that tear together.
    void list_links(std::vector<detail::TearingLink<S>>& links) const {
        if constexpr (is_link) {
            const S of_others = factors_.square(double(law.tear_factor));
            for (std::size_t e = 0; e < size(); ++e)
                links.push_back({corners_[e], elements_[e].rest, factors_.square_of(e, of_others), kinds_[e]});
        }
    }

private:
    static constexpr bool is_link = K == 2 && requires(const Law l, const Element e) {
        double(l.tear_factor);
        S(e.rest);
    };
    using Vectors = std::array<Vec<S, D>, K>;
    using Place = Vec<double, D>;
    template <class... At>
    static constexpr bool has_forces =
        requires(const Law l, const Element e, const Vectors x, const At... at) { l.forces(e, x, x, at...); };
    template <class... At>
    static constexpr bool has_energy =
        requires(const Law l, const Element e, const Vectors x, const At... at) { l.energy(e, x, at...); };
    template <class... At>
    static constexpr bool has_stiffness =
        requires(const Law l, const Element e, const Vectors x, const At... at) { l.stiffness(e, x, at...); };
    template <class... At>
    static constexpr bool has_damping =
        requires(const Law l, const Element e, const Vectors x, const At... at) { l.damping(e, x, x, at...); };
    static constexpr bool has_constant_damping = requires(const Law l, const Element e) { l.damping(e); };
    static constexpr bool bounds_step =
        has_stiffness<> || has_stiffness<Place> || has_damping<> || has_damping<Place> || has_constant_damping;

    /// Calls f with the positions of an element's corners, counted from the first one. If `WithPlace`, f gets the
    /// position of the first one, too.
    template <bool WithPlace, class F>
    FIRN_INLINE auto from_first(const PointView<S, D>& points, std::size_t e, const F& f) const {
        const Corners& corners = corners_[e];
        const Place first = points.position[corners[0]];
        Vectors x;
        x[0] = K == 1 && !WithPlace ? cast<S>(first) : Vec<S, D>::zero();
        for (std::size_t k = 1; k < K; ++k) x[k] = cast<S>(points.position[corners[k]] - first);
        if constexpr (WithPlace)
            return f(x, first);
        else
            return f(x);
    }
    double stiffness_of(const PointView<S, D>& points, std::size_t e) const {
        if constexpr (has_stiffness<> || has_stiffness<Place>)
            return from_first<has_stiffness<Place>>(points, e, [&](const Vectors& x, const auto&... at) {
                return double(law.stiffness(elements_[e], x, at...));
            });
        else
            return 0;
    }
    double damping_of(const PointView<S, D>& points, std::size_t e) const {
        if constexpr (has_damping<> || has_damping<Place>)
            return from_first<has_damping<Place>>(points, e, [&](const Vectors& x, const auto&... at) {
                return double(law.damping(elements_[e], x, at_corners(points.velocity, e), at...));
            });
        else if constexpr (has_constant_damping)
            return double(law.damping(elements_[e]));
        else
            return 0;
    }

    template <class Wanted>
    void keep_if(const Wanted& wanted) {
        std::size_t to = 0;
        for (std::size_t e = 0; e < size(); ++e) {
            if (!wanted(corners_[e])) continue;
            if constexpr (is_link) {
                kinds_[to] = kinds_[e];
                factors_.move(e, to);
            }
            corners_[to] = corners_[e];
            elements_[to++] = elements_[e];
        }
        corners_.resize(to);
        elements_.resize(to);
        if constexpr (is_link) {
            kinds_.resize(to);
            factors_.shrink(to);
        }
        incidence_.clear();
    }

    Vectors at_corners(std::span<const Vec<S, D>> values, std::size_t e) const {
        Vectors at;
        for (std::size_t k = 0; k < K; ++k) at[k] = values[corners_[e][k]];
        return at;
    }

    void prepare(std::size_t points) {
        if (incidence_.is_for(points)) return;
        for (std::size_t e = 0; e < size(); ++e)
            for (const std::uint32_t point : corners_[e])
                if (point >= points)
                    throw parameter_error(sentence("Element ", e, " of a force joins point ", point, "; there are ",
                                                   points, ", counted from 0."));
        incidence_ = detail::Incidence(std::span<const Corners>(corners_), points);
    }

    std::vector<Corners> corners_;
    std::vector<Element> elements_;
    std::vector<LinkKind> kinds_;     // one per spring; empty for other elements
    detail::TearFactors<S> factors_;  // of springs
    Digest as_added_;
    detail::Incidence incidence_;
    aligned_vector<std::array<double, 2>> bounds_;  // one per element: stiffness [N/m] and damping [N s/m]
    aligned_vector<Vec<S, D>> parts_;               // K per element: the forces on its corners [N]
};

}  // namespace firn::inline FIRN_BUILD
