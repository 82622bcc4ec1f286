/// \file Point masses, the particles of a ParticleSystem. They are simulated without a grid.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>
#include <firn/data/field_array.hpp>
#include <firn/data/field_memory.hpp>
#include <firn/data/ids.hpp>
#include <firn/data/memory.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A read-only view of all points of a system, for functions that compute forces. Element i of every field belongs to
/// the point with index i.
///
/// Positions are in double. Form the difference of two positions first, and then round it: `cast<S>(x_b − x_a)`.
template <class S, int D>
struct PointView {
    std::span<const Vec<double, D>> position;  ///< Positions [m].
    std::span<const Vec<S, D>> velocity;       ///< Velocities [m/s].
    std::span<const S> mass;                   ///< Masses [kg].
    std::span<const S> radius;                 ///< Radii [m].
    double time = 0;                           ///< Present time [s].

    /// Returns the number of points.
    std::size_t size() const { return position.size(); }
};

/// The data of a new point. \see PointMasses::add
template <int D>
struct PointMass {
    Vec<double, D> position{};  ///< Position [m].
    Vec<double, D> velocity{};  ///< Velocity [m/s].
    double mass = 1;            ///< Mass [kg].
    double radius = 0;          ///< Radius, for collisions and drag [m].
    /// The group of the point. Points of the same group do not collide with each other, except in group 0: its points
    /// collide with points of any group.
    std::uint32_t group = 0;
    double end = std::numeric_limits<double>::infinity();  ///< Time at which the point is removed [s].
};

/// The points of a system, sorted by id. Each field is stored as a separate array; element i of every field belongs to
/// the point with index i. The index of a point may change when other points are removed, but the id of a point never
/// changes. place() returns the index of the point with a given id.
///
/// Positions are stored in double, all else in S. So the small motions of single steps are not lost by rounding, and a
/// system behaves far from the origin as it does near it.
///
/// A point can be pinned; its inverse mass is then 0. A pinned point moves with its present velocity. Forces,
/// constraints and collisions do not change this velocity.
template <std::floating_point S, int D>
struct PointMasses {
    using V = Vec<S, D>;  ///< A vector in space.

    detail::FieldArray<Vec<double, D>> position;  ///< Positions [m].
    detail::FieldArray<V> velocity;               ///< Velocities [m/s].
    detail::FieldArray<S> mass;                   ///< Masses [kg].
    detail::FieldArray<S> inverse_mass;           ///< 1/mass, or 0 for a pinned point [1/kg].
    detail::FieldArray<S> radius;                 ///< Radii, for collisions and drag [m].
    detail::FieldArray<S> since;              ///< Time by which the velocity lags behind the position [s]; see Verlet.
    detail::FieldArray<std::uint32_t> group;  ///< Groups for collisions; see PointMass::group.
    detail::FieldArray<std::uint32_t> id;     ///< Ids, ascending. The id of a point never changes.
    detail::FieldArray<double> end;           ///< Times at which points are removed [s].

    /// Calls f(info, member) for every field above. `info` is the FieldInfo that describes the field, and `member` is a
    /// pointer to the field as a member of PointMasses, such as &PointMasses::position.
    template <class F>
    static void for_fields(const F& f) {
        using enum FieldShape;
        using enum FieldRole;
        using enum FieldRange;
        using P = PointMasses;
        f(FieldInfo{"position", "m", vector, motion, {}, finite, FieldNumber::float64}, &P::position);
        f(FieldInfo{"velocity", "m/s", vector, motion}, &P::velocity);
        f(FieldInfo{"mass", "kg", scalar, given, {}, positive}, &P::mass);
        f(FieldInfo{"inverse_mass", "1/kg", scalar, given, {}, not_negative}, &P::inverse_mass);
        f(FieldInfo{"radius", "m", scalar, given, {}, not_negative}, &P::radius);
        f(FieldInfo{"since", "s", scalar, motion, {}, not_negative}, &P::since);
        f(FieldInfo{"group", "1", scalar, given, {}, not_negative, FieldNumber::uint32}, &P::group);
        f(FieldInfo{"id", "1", scalar, given, {}, not_negative, FieldNumber::uint32}, &P::id);
        f(FieldInfo{"end", "s", scalar, given, {}, finite, FieldNumber::float64}, &P::end);
    }
    /// Returns a table with the description (name, unit, shape, …) of every field.
    static FieldTable table() {
        FieldTable all;
        for_fields([&](const FieldInfo& info, auto) { all.push_back(info); });
        return all;
    }

    PointMasses() : memory_(table(), D, sizeof(S), SlotOrder::by_id) {}  ///< Makes an object without points.
    /// \name Copy, move and swap
    /// @{

    /// Copies, moves or swaps all points. The points keep their ids. After a move, the source has no points.
    PointMasses(const PointMasses& other) : size_(other.size_), ids_(other.ids_), memory_(other.memory_) { bind(); }
    PointMasses(PointMasses&& other) noexcept : PointMasses() { swap(other); }
    PointMasses& operator=(PointMasses other) noexcept {
        swap(other);
        return *this;
    }
    ~PointMasses() = default;
    void swap(PointMasses& other) noexcept {
        std::swap(size_, other.size_);
        std::swap(ids_, other.ids_);
        std::swap(memory_, other.memory_);
        bind();
        other.bind();
    }
    /// @}

    /// Returns the number of points.
    std::size_t size() const { return size_; }
    /// Returns a view of all points. The view is valid until points are added or removed.
    /// \param time  the present time [s], stored in the view
    PointView<S, D> view(double time = 0) const { return {position, velocity, mass, radius, time}; }
    /// Returns the id that the next new point will get. Each id is used for one point only.
    std::uint32_t next_id() const { return ids_.next(); }

    /// Allocates memory for at least `count` points. Each thread is the first to write to a part of the new memory, so
    /// that this part lies near the processor of the thread.
    /// \param count    number of points, including existing ones
    /// \param threads  number of threads; 0: the number that thread_count() returns
    /// \throws memory_error  if there is not enough memory
    void reserve(std::size_t count, int threads = 0) {
        if (count <= memory_.slots()) return;
        const std::size_t slots = (std::max(count, size_ + size_ / 2) + pack_size - 1) / pack_size * pack_size;
        require_memory(double(memory_.bytes()) + double(memory_.bytes_for(slots)),
                       sentence("Room for ", count, " points"), "Take fewer.");
        const int workers = thread_count(threads);
        parallel_region(workers, [&] { memory_.grow(slots, workers); });
        bind();
    }

    /// Ensures that points added later get no id below `next`.
    void skip_ids(std::uint32_t next) { ids_.skip(next); }

    /// Appends a point with the id `as`, which must be above all existing ids. The caller must set all other fields of
    /// the point.
    /// \return the index of the new point
    std::size_t append(std::uint32_t as) {
        if (size_ == memory_.slots()) reserve(std::max<std::size_t>(4 * pack_size, size_ + 1));
        const std::size_t place = size_++;
        bind();
        id[place] = as;
        return place;
    }

    /// Checks that the data of a point and the id `as`, which the point would get, are valid.
    /// \throws parameter_error  unless position, velocity, mass, 1/mass and radius are finite after rounding to S, the
    ///                          mass is positive, the radius is not negative, `end` is not NaN, and `as` is below the
    ///                          limit for ids (no_particle)
    static void check(const PointMass<D>& point, std::uint64_t as) {
        const auto refuse = [&](const char* what, double given, const char* allowed) {
            throw parameter_error(sentence("The ", what, " of point ", as, " is ", given, "; it must be ", allowed,
                                           ". Nothing was added."));
        };
        for (int a = 0; a < D; ++a) {
            if (!std::isfinite(S(point.position[a]))) refuse("position", point.position[a], "finite [m]");
            if (!std::isfinite(S(point.velocity[a]))) refuse("velocity", point.velocity[a], "finite [m/s]");
        }
        const S m = S(point.mass);
        if (!(m > 0) || !std::isfinite(m) || !std::isfinite(1 / m)) refuse("mass", point.mass, "positive [kg]");
        if (!(point.radius >= 0) || !std::isfinite(S(point.radius)))
            refuse("radius", point.radius, "finite and not negative [m]");
        if (std::isnan(point.end)) refuse("end", point.end, "a time [s]");
        if (as >= no_particle) throw parameter_error(sentence("All ", no_particle, " ids of points are given out."));
    }

    /// Adds a point at the end of all fields.
    /// \return the id of the new point
    /// \throws parameter_error  if check() throws it; no point is added then
    std::uint32_t add(const PointMass<D>& point) {
        check(point, next_id());
        const std::size_t i = append(ids_.give());
        position[i] = point.position;
        velocity[i] = cast<S>(point.velocity);
        mass[i] = S(point.mass);
        inverse_mass[i] = 1 / mass[i];
        radius[i] = S(point.radius);
        since[i] = 0;
        group[i] = point.group;
        end[i] = point.end;
        return id[i];
    }

    /// Returns the index of the point with the id `wanted`.
    /// \throws parameter_error  if there is no point with this id
    std::size_t place(std::uint32_t wanted) const {
        const auto found = std::lower_bound(id.begin(), id.end(), wanted);
        if (found == id.end() || *found != wanted)
            throw parameter_error(sentence("There is no point ", wanted, ": ", size(), " points are there, ", next_id(),
                                           " ids have been given out, counted from 0."));
        return std::size_t(found - id.begin());
    }

    /// Returns whether the point with index i is pinned.
    bool is_pinned(std::size_t i) const { return inverse_mass[i] == 0; }
    /// Pins the point with the id `wanted`. The point then moves with the constant velocity `v`.
    /// \param wanted  id of the point
    /// \param v       velocity of the pinned point [m/s]; by default zero
    /// \throws parameter_error  if there is no point with this id, or if the velocity is not finite
    void pin(std::uint32_t wanted, const Vec<double, D>& v = {}) {
        const std::size_t i = place(wanted);
        for (int a = 0; a < D; ++a)
            if (!std::isfinite(S(v[a])))
                throw parameter_error(
                    sentence("The pin of point ", wanted, " has velocity ", v[a], " m/s; it must be finite."));
        inverse_mass[i] = 0;
        velocity[i] = cast<S>(v);
    }
    /// Unpins the point with the id `wanted`. The point keeps its present velocity until forces change it.
    /// \throws parameter_error  if there is no point with this id
    void unpin(std::uint32_t wanted) {
        const std::size_t i = place(wanted);
        inverse_mass[i] = 1 / mass[i];
        since[i] = 0;
    }

    /// Removes points: for each index i, removes the point with this index if wanted(i) is true. The remaining points
    /// keep their order, and they get the indices 0, 1, 2, …
    /// \return a list with one entry per old index: the new index of the point, or no_particle if the point was
    ///         removed. The list is empty if no point was removed.
    template <class Wanted>
    std::vector<std::uint32_t> remove_if(const Wanted& wanted) {
        std::vector<std::uint32_t> places;
        std::size_t to = 0;
        const std::size_t count = size();
        for (std::size_t i = 0; i < count; ++i) {
            const bool gone = wanted(i);
            if (gone && places.empty()) {
                places.resize(count);
                for (std::size_t k = 0; k < i; ++k) places[k] = std::uint32_t(k);
            }
            if (places.empty()) {
                ++to;
                continue;
            }
            places[i] = gone ? no_particle : std::uint32_t(to);
            if (!gone) memory_.copy(i, to++);
        }
        size_ = to;
        bind();
        return places;
    }

private:
    /// Sets the address and the size of every field array.
    void bind() {
        std::size_t f = 0;
        for_fields([&](const FieldInfo&, auto member) {
            using T = typename std::remove_cvref_t<decltype(this->*member)>::value_type;
            (this->*member).bind(memory_.numbers<T>(f++), size_);
        });
    }

    std::size_t size_ = 0;
    Ids ids_;
    FieldMemory memory_;
};

namespace detail {

/// Replaces the indices of points by their new indices.
/// \param points     indices of points, changed in place
/// \param new_place  the list that PointMasses::remove_if returned: the new index for each old one
/// \return whether all the given points still exist
/// \throws parameter_error  if an index has no entry in new_place
template <std::size_t K>
bool renumbered(std::array<std::uint32_t, K>& points, std::span<const std::uint32_t> new_place) {
    bool all = true;
    for (std::uint32_t& point : points) {
        if (point >= new_place.size())
            throw parameter_error(sentence("Point ", point, " is joined to others, but there are ", new_place.size(),
                                           " points, counted from 0."));
        point = new_place[point];
        all = all && point != no_particle;
    }
    return all;
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
