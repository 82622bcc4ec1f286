/// \file Emitters, which add particles one by one at a steady rate. A particle is removed after a limited time.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/recurrence.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/random.hpp>
#include <firn/lagrangian/point_masses.hpp>
#include <firn/lagrangian/surface.hpp>

#include <functional>
#include <numbers>
#include <queue>

namespace firn::inline FIRN_BUILD {

/// The id and end of life of a particle that an emitter has added.
struct EmittedChild {
    std::uint32_t id;  ///< The particle's id.
    double end;        ///< The time at which the particle is removed [s].
};
/// The data of an emitter that change during a run. \see Emitter::resume
struct EmitterHistory {
    std::uint64_t births = 0;                 ///< Number of births so far; see Emitter::births.
    std::vector<EmittedChild> children = {};  ///< Particles that may be alive; see Emitter::children.
};

/// Adds particles at a steady rate. A birth is the addition of one particle. The birth with index k (k = 0, 1, …) is
/// due at the time start + k / rate; there are no births after the time `end`. The random numbers of birth k depend
/// only on `seed` and k, not on the number of threads or the time step. A particle that is born during a step is added
/// at the end of this step, at the position that the particle has reached by then.
///
/// If `maximum` particles of the emitter are alive at the time of a birth, this birth is left out. A birth that is left
/// out does not happen later, and its index k is not used again.
template <int D>
struct Emitter {
    /// The value of `end` or `lifespan` that means "no limit" [s].
    static constexpr double forever = std::numeric_limits<double>::infinity();
    /// The value of `maximum` that means "no limit".
    static constexpr std::uint64_t no_maximum = std::numeric_limits<std::uint64_t>::max();

    Vec<double, D> position{};           ///< Centre of the nozzle [m].
    Vec<double, D> direction = up();     ///< Direction of the jet; the length of this vector has no effect.
    double nozzle = 0;                   ///< Radius of the nozzle, a disc across the jet; in 2D: half the width [m].
    double speed = 1;                    ///< Mean speed of a particle at its birth [m/s].
    double speed_spread = 0;             ///< Speeds at birth are uniform random values in speed ± speed_spread [m/s].
    double cone = 0;                     ///< Half the opening angle of the jet; π: all directions [rad].
    double rate = 100;                   ///< Births per second [1/s].
    double start = 0;                    ///< Time of the first birth [s].
    double end = forever;                ///< Time after which there are no births [s].
    double lifespan = forever;           ///< Mean time from a particle's birth to its removal [s].
    double lifespan_spread = 0;          ///< Lifespans are uniform random values in lifespan ± lifespan_spread [s].
    double mass = 1;                     ///< Mass of a particle [kg].
    double radius = 0;                   ///< Radius of a particle [m].
    std::uint32_t group = 0;             ///< Group of a particle; see PointMass::group.
    std::uint64_t maximum = no_maximum;  ///< Largest number of the emitter's particles that are alive at one time.
    std::uint64_t seed = 1;              ///< Seed of the random numbers.
    std::uint64_t births = 0;            ///< Number of births so far, including births that were left out.
    /// The emitter's particles that may still be alive, in the order of their ids. The list is empty if `maximum` is
    /// no_maximum.
    std::vector<EmittedChild> children = {};

    /// Checks the parameters above.
    /// \throws parameter_error  unless position, direction, nozzle, speed, rate, start, mass and radius are finite; the
    ///                          direction is not zero; rate, mass and lifespan are positive; nozzle, speed and radius
    ///                          are not negative; speed_spread is from 0 to speed and lifespan_spread from 0 to
    ///                          lifespan; the cone is from 0 to π; the end is not before the start; and the maximum is
    ///                          at least 1
    void check() const {
        if (!detail::is_finite(position))
            throw parameter_error(sentence("An emitter is at ", detail::describe(position), " m; give finite metres."));
        if (!(norm(direction) > 0) || !std::isfinite(norm(direction)))
            throw parameter_error(sentence("The direction of an emitter is ", detail::describe(direction),
                                           "; it must be finite and not zero."));
        require_range("nozzle", nozzle, 0, forever, "finite and not negative [m]");
        require_range("speed", speed, 0, forever, "finite and not negative [m/s]");
        require_range("spread of speed", speed_spread, 0, speed, "from 0 to the speed [m/s]");
        require_range("cone", cone, 0, std::numbers::pi, "from 0 to pi [rad]");
        recurrence().check(lifespan);
        require_range("spread of the lifespan", lifespan_spread, 0, std::min(lifespan, 1e300),
                      "from 0 to the lifespan [s]");
        detail::check_positive(mass, "The mass of an emitter's particle", "kg");
        require_range("radius", radius, 0, forever, "finite and not negative [m]");
        if (maximum == 0) throw parameter_error("An emitter's maximum is 0 particles; give 1 or more.");
    }

    /// Returns the time at which the birth with the index `birth` is due [s].
    double time_of(std::uint64_t birth) const { return recurrence().time_of(birth); }

    /// Returns the particle of the birth with index k, with its position and velocity at the time of birth.
    PointMass<D> born(std::uint64_t k) const {
        const auto random = [&](std::uint64_t which) { return unit_interval(random_bits(seed, 8 * k + which)); };
        const auto within = [&](double mean, double spread, std::uint64_t which) {
            return spread > 0 ? mean + spread * (2 * random(which) - 1) : mean;
        };
        const Vec<double, D> ahead = direction * (1 / norm(direction));
        PointMass<D> point{.position = position, .velocity = {}, .mass = mass, .radius = radius, .group = group};
        Vec<double, D> along = ahead;
        if constexpr (D == 2) {
            const Vec<double, 2> left{-ahead[1], ahead[0]};
            point.position += left * (nozzle * (2 * random(0) - 1));
            const double angle = cone * (2 * random(1) - 1);
            along = ahead * std::cos(angle) + left * std::sin(angle);
        } else {
            const auto [u, v] = perpendicular(ahead);
            // Positions are uniform over the disc. Directions are uniform over a cap of the unit sphere. The area of a
            // cap is proportional to its height (Archimedes), so the cosine is uniform.
            const double r = nozzle * std::sqrt(random(0)), turn = 2 * std::numbers::pi * random(1);
            point.position += (u * std::cos(turn) + v * std::sin(turn)) * r;
            const double cosine = 1 - random(2) * (1 - std::cos(cone)), around = 2 * std::numbers::pi * random(3);
            const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
            along = ahead * cosine + (u * std::cos(around) + v * std::sin(around)) * sine;
        }
        point.velocity = along * within(speed, speed_spread, 4);
        point.end = time_of(k) + within(lifespan, lifespan_spread, 5);
        return point;
    }

    /// Leaves out all births that are due up to and including `time` [s]: the particles of these births are never
    /// added.
    void skip(double time) { births = recurrence().first_after(births, time); }

    /// Continues from the history that the same emitter had in another run at the given time.
    /// \param given      the emitter's number of births and living particles in the other run
    /// \param time       the time that the other run had reached [s]
    /// \param has_given  whether the other run had added the particles of all births that were due by `time`
    /// \throws parameter_error  if the number of births in the history does not fit this emitter and `time`, if the ids
    ///                          of the particles in the history are not ascending, or if the end of a particle is NaN.
    ///                          This emitter has not changed then.
    void resume(const EmitterHistory& given, double time, bool has_given) {
        const detail::Recurrence schedule = recurrence();
        const bool too_many = given.births > births && !schedule.is_due(given.births - 1, time);
        if (given.births < births || too_many || (has_given && schedule.is_due(given.births, time)))
            throw parameter_error(sentence("In the run to resume, an emitter had ", given.births, " births due by ",
                                           time, " s; this emitter of ", rate, " births a second from ", start,
                                           " s on had another number. Add the same emitters in the same order."));
        for (std::size_t k = 0; k < given.children.size(); ++k)
            if (std::isnan(given.children[k].end) || (k > 0 && given.children[k].id <= given.children[k - 1].id))
                throw parameter_error(
                    "The ids of an emitter's particles must be ascending, and the time of their end must be a number.");
        births = given.births;
        children = given.children;
    }

    /// Adds particles for all births that are due up to and including `time` and have not been handled yet. A particle
    /// whose life ends by `time` is not added.
    /// \param points        the points to add the particles to
    /// \param time          present time [s]
    /// \param acceleration  acceleration of the new particles between birth and `time` [m/s²]
    /// \return the number of particles added
    /// \throws parameter_error  if check() or PointMasses::add() throws it, or if there are not enough unused ids for
    ///                          the new particles
    template <std::floating_point S>
    std::size_t give(PointMasses<S, D>& points, double time, const Vec<double, D>& acceleration = {}) {
        const detail::Recurrence schedule = recurrence();
        if (!schedule.is_due(births, time)) return 0;
        check();
        schedule.require_ids(births, time, 1, no_particle - points.next_id());
        // The times at which the living particles will be removed, earliest first.
        std::priority_queue<double, std::vector<double>, std::greater<>> ends;
        if (maximum != no_maximum) {
            forget_missing(points);
            for (const EmittedChild& child : children) ends.push(child.end);
        }
        const std::size_t before = points.size();
        for (; schedule.is_due(births, time); ++births) {
            const double birth = time_of(births), age = time - birth;
            while (!ends.empty() && ends.top() <= birth) ends.pop();
            if (ends.size() >= maximum) continue;
            PointMass<D> point = born(births);
            if (maximum != no_maximum) ends.push(point.end);
            if (point.end <= time) continue;
            point.position += point.velocity * age + acceleration * (age * age / 2);
            point.velocity += acceleration * age;
            const std::uint32_t id = points.add(point);
            if (maximum != no_maximum) children.push_back({id, point.end});
        }
        return points.size() - before;
    }

private:
    detail::Recurrence recurrence() const { return {"An emitter", "births", rate, start, end}; }

    /// Removes from `children` the particles that are no longer among `points`. `children` and `points` are both sorted
    /// by id.
    template <std::floating_point S>
    void forget_missing(const PointMasses<S, D>& points) {
        auto at = points.id.begin();
        std::erase_if(children, [&](const EmittedChild& child) {
            at = std::lower_bound(at, points.id.end(), child.id);
            return at == points.id.end() || *at != child.id;
        });
    }

    static void require_range(const char* what, double given, double least, double most, const char* allowed) {
        if (!(given >= least && given <= most) || !std::isfinite(given))
            throw parameter_error(sentence("The ", what, " of an emitter is ", given, "; it must be ", allowed, "."));
    }
    static constexpr Vec<double, D> up() {
        Vec<double, D> direction{};
        direction[1] = 1;
        return direction;
    }
};

}  // namespace firn::inline FIRN_BUILD
