/// \file Point masses: the particles of systems of springs, constraints and collisions, without a grid.
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

namespace firn {

/// What forces see: n points. Everything by place, 0 ≤ i < n.
template <class S, int D>
struct PointView {
    std::span<const Vec<S, D>> position;  ///< [m]
    std::span<const Vec<S, D>> velocity;  ///< [m/s]
    std::span<const S> mass;              ///< [kg]
    std::span<const S> radius;            ///< [m]
    double time = 0;                      ///< [s]

    std::size_t size() const { return position.size(); }
};

/// One point, as it is added.
template <int D>
struct PointMass {
    Vec<double, D> position{};  ///< [m]
    Vec<double, D> velocity{};  ///< [m/s]
    double mass = 1;            ///< [kg]
    double radius = 0;          ///< for collisions and drag [m]
    /// Points of one group do not collide with each other; those of group 0 collide with all.
    std::uint32_t group = 0;
    double end = std::numeric_limits<double>::infinity();  ///< when it is taken out [s]
};

/// Particles that keep the order of their ids. Each field lies in an array of its own, position after position: what
/// links and cells name is then one or two cache lines. A point's place may change when points are taken out; its id
/// never does.
///
/// A pinned point has inverse mass 0: no force, constraint or collision moves it; it moves by its velocity.
template <std::floating_point S, int D>
struct PointMasses {
    using V = Vec<S, D>;

    FieldArray<V> position;      ///< [m]
    FieldArray<V> velocity;      ///< [m/s]
    FieldArray<S> mass;          ///< [kg]
    FieldArray<S> inverse_mass;  ///< [1/kg]; 0: pinned
    FieldArray<S> radius;        ///< [m]
    FieldArray<S> since;         ///< how long before now the velocity was as given [s]; see Verlet
    FieldArray<std::uint32_t> group;
    FieldArray<std::uint32_t> id;
    FieldArray<double> end;  ///< when it is taken out [s]

    /// f(info, member) for every field: what is a member above has its line here.
    template <class F>
    static void for_fields(const F& f) {
        using enum FieldShape;
        using enum FieldRole;
        using enum FieldRange;
        using P = PointMasses;
        f(FieldInfo{"position", "m", vector, motion}, &P::position);
        f(FieldInfo{"velocity", "m/s", vector, motion}, &P::velocity);
        f(FieldInfo{"mass", "kg", scalar, given, {}, positive}, &P::mass);
        f(FieldInfo{"inverse_mass", "1/kg", scalar, given, {}, not_negative}, &P::inverse_mass);
        f(FieldInfo{"radius", "m", scalar, given, {}, not_negative}, &P::radius);
        f(FieldInfo{"since", "s", scalar, motion, {}, not_negative}, &P::since);
        f(FieldInfo{"group", "1", scalar, given, {}, not_negative, FieldNumber::uint32}, &P::group);
        f(FieldInfo{"id", "1", scalar, given, {}, not_negative, FieldNumber::uint32}, &P::id);
        f(FieldInfo{"end", "s", scalar, given, {}, finite, FieldNumber::float64}, &P::end);
    }
    static FieldTable table() {
        FieldTable all;
        for_fields([&](const FieldInfo& info, auto) { all.push_back(info); });
        return all;
    }

    PointMasses() : memory_(table(), D, sizeof(S), SlotOrder::by_id) {}
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

    std::size_t size() const { return size_; }
    PointView<S, D> view(double time = 0) const { return {position, velocity, mass, radius, time}; }
    /// No id is given out twice.
    std::uint32_t next_id() const { return ids_.next(); }

    /// Makes room for so many points, which each worker is the first to write in its share.
    /// \param threads  0: as many as thread_count() says
    /// \throws memory_error  if there is not enough for so many
    void reserve(std::size_t count, int threads = 0) {
        if (count <= memory_.slots()) return;
        const std::size_t slots = (std::max(count, size_ + size_ / 2) + pack_size - 1) / pack_size * pack_size;
        require_memory(double(memory_.bytes()) + double(memory_.bytes_for(slots)),
                       sentence("Room for ", count, " points"), "Take fewer.");
        const int workers = thread_count(threads);
        parallel_region(workers, [&] { memory_.grow(slots, workers); });
        bind();
    }

    /// Ids below `next` are given out no more.
    void skip_ids(std::uint32_t next) { ids_.skip(next); }

    /// Appends a point of which no field is set but its id.
    /// \return its place
    std::size_t append(std::uint32_t as) {
        if (size_ == memory_.slots()) reserve(std::max<std::size_t>(4 * pack_size, size_ + 1));
        const std::size_t place = size_++;
        bind();
        id[place] = as;
        return place;
    }

    /// Could the point be added, as one of this id?
    /// \throws parameter_error  unless numbers are finite, the mass positive, and the radius not negative, in S
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

    /// \return its id
    /// \throws parameter_error  as check()
    std::uint32_t add(const PointMass<D>& point) {
        check(point, next_id());
        const std::size_t i = append(ids_.give());
        position[i] = cast<S>(point.position);
        velocity[i] = cast<S>(point.velocity);
        mass[i] = S(point.mass);
        inverse_mass[i] = 1 / mass[i];
        radius[i] = S(point.radius);
        since[i] = 0;
        group[i] = point.group;
        end[i] = point.end;
        return id[i];
    }

    /// The place of the point of this id.
    /// \throws parameter_error  if there is no such point
    std::size_t place(std::uint32_t wanted) const {
        const auto found = std::lower_bound(id.begin(), id.end(), wanted);
        if (found == id.end() || *found != wanted)
            throw parameter_error(sentence("There is no point ", wanted, ": ", size(), " points are there, ", next_id(),
                                           " ids have been given out, counted from 0."));
        return std::size_t(found - id.begin());
    }

    bool is_pinned(std::size_t i) const { return inverse_mass[i] == 0; }
    /// Holds it where it is, or lets it move by a velocity [m/s] that nothing changes.
    /// \throws parameter_error  if there is no point of this id, or the velocity is not finite
    void pin(std::uint32_t wanted, const Vec<double, D>& v = {}) {
        const std::size_t i = place(wanted);
        for (int a = 0; a < D; ++a)
            if (!std::isfinite(S(v[a])))
                throw parameter_error(
                    sentence("The pin of point ", wanted, " has velocity ", v[a], " m/s; it must be finite."));
        inverse_mass[i] = 0;
        velocity[i] = cast<S>(v);
    }
    /// \throws parameter_error  if there is no point of this id
    void unpin(std::uint32_t wanted) {
        const std::size_t i = place(wanted);
        inverse_mass[i] = 1 / mass[i];
        since[i] = 0;
    }

    /// Takes out the points for which wanted(place) says so; the others move together, in order.
    /// \return the new place of every old one, no_particle for what is gone; empty if nothing was taken out
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
    /// Says to every field where it lies now.
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

/// Gives points their new places, as remove_if says. \return whether all are still there
/// \throws parameter_error  if it does not know one
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

}  // namespace firn
