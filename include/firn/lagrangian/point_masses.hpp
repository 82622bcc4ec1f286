/// \file Point masses: the particles of systems of springs, constraints and collisions, without a grid.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>
#include <firn/data/field.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
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

/// Each field lies in an array of its own, position after position: what links and cells name is then one or two cache
/// lines. A point's place may change when points are taken out; its id never does. Places are in the order of ids.
///
/// A pinned point has inverse mass 0: no force, constraint or collision moves it; it moves by its velocity.
template <std::floating_point S, int D>
struct PointMasses {
    using V = Vec<S, D>;

    aligned_vector<V> position;      ///< [m]
    aligned_vector<V> velocity;      ///< [m/s]
    aligned_vector<S> mass;          ///< [kg]
    aligned_vector<S> inverse_mass;  ///< [1/kg]; 0: pinned
    aligned_vector<S> radius;        ///< [m]
    aligned_vector<S> since;         ///< how long before now the velocity was as given [s]; see Verlet
    aligned_vector<std::uint32_t> group;
    aligned_vector<std::uint32_t> id;
    aligned_vector<double> end;  ///< when it is taken out [s]

    std::size_t size() const { return position.size(); }
    PointView<S, D> view(double time = 0) const { return {position, velocity, mass, radius, time}; }
    /// No id is given out twice.
    std::uint32_t next_id() const { return next_id_; }

    /// Makes room for so many points, which each worker is the first to write in its share.
    /// \param threads  0: as many as thread_count() says
    void reserve(std::size_t count, int threads = 0) {
        if (count <= position.capacity()) return;
        const int workers = thread_count(threads);
        const auto make_room = [&](auto& field) {
            const std::size_t now = field.size();
            grow(field, std::max(count, now + now / 2), {}, workers);
            field.resize(now);
        };
        parallel_region(workers, [&] { for_fields(make_room); });
    }

    /// Ids below `next` are given out no more.
    void skip_ids(std::uint32_t next) { next_id_ = std::max(next_id_, next); }

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
        check(point, next_id_);
        const S m = S(point.mass);
        position.push_back(cast<S>(point.position));
        velocity.push_back(cast<S>(point.velocity));
        mass.push_back(m);
        inverse_mass.push_back(1 / m);
        radius.push_back(S(point.radius));
        since.push_back(0);
        group.push_back(point.group);
        end.push_back(point.end);
        id.push_back(next_id_);
        return next_id_++;
    }

    /// The place of the point of this id.
    /// \throws parameter_error  if there is no such point
    std::size_t place(std::uint32_t wanted) const {
        const auto found = std::lower_bound(id.begin(), id.end(), wanted);
        if (found == id.end() || *found != wanted)
            throw parameter_error(sentence("There is no point ", wanted, ": ", size(), " points are there, ", next_id_,
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
            if (!gone) for_fields([&](auto& field) { field[to] = field[i]; }), ++to;
        }
        for_fields([&](auto& field) { field.resize(to); });
        return places;
    }

private:
    template <class F>
    void for_fields(const F& f) {
        f(position), f(velocity), f(mass), f(inverse_mass), f(radius), f(since), f(group), f(end), f(id);
    }

    std::uint32_t next_id_ = 0;
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
