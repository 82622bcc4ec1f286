/// \file Points under forces, constraints and collisions, stepped through time. It only composes what lies beside it.
#pragma once

#include <firn/core/optimised.hpp>
#include <firn/core/stepper.hpp>
#include <firn/data/mesh.hpp>
#include <firn/lagrangian/collisions.hpp>
#include <firn/lagrangian/distance_constraints.hpp>
#include <firn/lagrangian/emitter.hpp>
#include <firn/lagrangian/integrator.hpp>
#include <firn/lagrangian/point_forces.hpp>
#include <firn/lagrangian/surface_contact.hpp>
#include <firn/stage/grid_update.hpp>

#include <atomic>
#include <optional>
#include <string>

namespace firn {

/// How the points of a net become point masses.
struct NetOptions {
    double mass = 1;                  ///< of every point [kg]
    std::vector<double> masses = {};  ///< of each [kg], in place of that; empty: all alike
    double radius = 0;                ///< [m]
    std::uint32_t group = 0;          ///< \see PointMass
};

/// All that steps change about a system, but for its boundary.
template <std::floating_point S, int D>
struct SystemMoment {
    PointMasses<S, D> points;
    std::vector<Facet<D>> facets;  ///< by places
    std::vector<Torn> torn;        ///< by places
    ConstraintHistory constraints;
    std::vector<EmitterHistory> emitters;
    std::optional<std::vector<KeptImpulse<S, D>>> impulses;  ///< see Collisions::kept
    Moment now;
};

/// \tparam D           2 or 3
/// \tparam S           float or double
/// \tparam Integrator  SymplecticEuler or Verlet
/// \tparam Boundary    a boundary policy in S that says where its surfaces are: Walls, Collider, Together, …
///
/// A step: emitters give points; forces change velocities; points in contact, with each other and with the boundary,
/// change each other's; points move; constraints pull them where they should be, which changes velocities, too; what
/// overlaps is moved apart, which does not.
template <int D, std::floating_point S = float, integrator Integrator = Verlet, class Boundary = NoBoundary>
class ParticleSystem : public Stepper<D> {
    using Stepper<D>::now_;

public:
    static_assert(D == 2 || D == 3, "firn simulates in two or three dimensions");
    using scalar_type = S;
    static constexpr int dimension = D;

    ParticleSystem() : ParticleSystem(Boundary{}) {}
    explicit ParticleSystem(const Boundary& with) : boundary(with) {
        detail::tell_unoptimised<FIRN_TELLS_UNOPTIMISED>();
    }

    PointMasses<S, D> points;
    using Stepper<D>::gravity;
    using Stepper<D>::warn;  ///< of a time step above the bound of the forces
    double damping = 0;      ///< c [1/s]: velocities fall by e^(−c dt) a step
    DistanceConstraints<S, D> constraints;
    int iterations = 8;  ///< of the constraints, in every step
    /// Given, points collide with each other.
    std::optional<Collisions<S, D>> collisions{};
    Boundary boundary{};           ///< what moves is moved by steps
    double restitution = 0;        ///< of points at the boundary, Newton's e, from 0 to 1 [1]
    int threads = 0;               ///< 0: as many as thread_count() says
    std::vector<Facet<D>> facets;  ///< the surface, by places of points: for output; torn with the constraints

    /// Adds the points and facets of a net; what joins the points is added by place, from the one returned.
    /// \return the place of its first point
    /// \throws parameter_error (nothing is added)
    std::size_t add(const Net<D>& net, const NetOptions& options, const Vec<double, D>& velocity = {}) {
        if (!options.masses.empty() && options.masses.size() != net.positions.size())
            throw parameter_error(sentence("A net of ", net.positions.size(), " points is given ",
                                           options.masses.size(), " masses; give one for each, or one for all."));
        for (const Facet<D>& facet : net.facets)
            for (const std::uint32_t corner : facet) detail::point_of(net, corner);
        const auto point = [&](std::size_t i) {
            return PointMass<D>{.position = net.positions[i],
                                .velocity = velocity,
                                .mass = options.masses.empty() ? options.mass : options.masses[i],
                                .radius = options.radius,
                                .group = options.group};
        };
        for (std::size_t i = 0; i < net.positions.size(); ++i) points.check(point(i), points.next_id() + i);
        const std::size_t first = points.size();
        points.reserve(first + net.positions.size(), threads);
        for (std::size_t i = 0; i < net.positions.size(); ++i) points.add(point(i));
        for (Facet<D> facet : net.facets) {
            for (std::uint32_t& corner : facet) corner = detail::moved_place(corner, first);
            facets.push_back(facet);
        }
        return first;
    }

    /// From now on the force acts in every step.
    /// \return it, as it is kept: its parameters may be changed
    template <class Force>
        requires point_force<Force, S, D>
    Force& add_force(Force force) {
        largest_step_ = 0;
        return forces_.emplace_back(std::move(force)).template as<Force>();
    }

    /// Gives points from now on.
    /// \throws parameter_error  if a number is out of range
    void add_emitter(const Emitter<D>& emitter) {
        emitter.check();
        Emitter<D> added = emitter;
        if (now_.steps > 0) added.skip(now_.time);
        emitters_.push_back(std::move(added));
    }
    const std::vector<Emitter<D>>& emitters() const { return emitters_; }

    /// Takes out the points for which wanted(place) says so, with all that they are joined by.
    /// \return how many that were
    /// \throws parameter_error  if a force or constraint joins a point that is not there: the system is then of no use
    template <class Wanted>
    std::size_t remove_if(const Wanted& wanted) {
        const std::vector<std::uint32_t> new_place = points.remove_if(wanted);
        if (new_place.empty()) return 0;
        constraints.renumber(new_place);
        if (collisions) collisions->renumber(new_place);
        for (auto& force : forces_) force.renumber(new_place);
        std::erase_if(facets, [&](Facet<D>& facet) { return !detail::renumbered(facet, new_place); });
        std::erase_if(torn_, [&](Torn& ends) { return !detail::renumbered(ends, new_place); });
        largest_step_ = 0;
        return new_place.size() - points.size();
    }

    /// Above this [s] the forces' springs and dampers let an explicit step grow without bound, as they are now;
    /// infinite without such. Constraints have no bound.
    double stable_time_step() {
        double bound = 0;
        parallel_region(workers_of_steps(),
                        [&] { bound = detail::largest_step<S, D>(forces_, points.view(now_.time), threads); });
        return bound;
    }

    /// One step of dt [s].
    /// \throws parameter_error  unless dt is positive; and what forces throw
    /// \throws particle_error   where a point or the force on it is not finite, before anything has moved; or where a
    ///                          point would not be finite after the step, which has then spoiled the points
    void step(double dt) { take_steps(dt, 1); }

    /// Steps of equal length, at most dt [s], until `duration` [s] has passed.
    void advance(double duration, double dt) {
        check(dt);
        if (!(duration >= 0) || !std::isfinite(duration))
            throw parameter_error(sentence("The time to advance is ", duration, " s; it must not be negative."));
        const auto count = std::uint64_t(std::ceil(duration / dt * (1 - 1e-12)));
        if (count > 0) take_steps(duration / double(count), count);
    }

    /// The torn links between points that there still are, by places.
    const std::vector<Torn>& torn() const { return torn_; }

    /// Goes on from a moment of another run, to the same bits: this system was made as that one, up to its first step.
    /// \throws usage_error      when it has taken a step
    /// \throws parameter_error  where the moment is not one of such a run; nothing has changed then
    void resume(SystemMoment<S, D> moment) {
        if (now_.steps > 0)
            throw usage_error(sentence("The system has taken ", now_.steps,
                                       " steps; go on from a moment of another run before the first."));
        const std::size_t count = moment.points.size();
        const std::vector<std::uint32_t> new_place = places_in(moment.points);
        for (const Torn& ends : moment.torn)
            if (std::max(ends[0], ends[1]) >= count)
                throw parameter_error(sentence("A torn link names point ", std::max(ends[0], ends[1]), "; there are ",
                                               count, ", counted from 0."));
        DistanceConstraints<S, D> resumed_constraints = constraints;
        resumed_constraints.resume(moment.constraints, new_place, count);
        std::optional<Collisions<S, D>> resumed_collisions = collisions;
        if (moment.impulses && !collisions)
            throw parameter_error("In the run that is to go on points collided; let those of this system collide.");
        if (collisions) {
            resumed_collisions->renumber(new_place);
            resumed_collisions->resume(moment.impulses);
        }
        if (moment.emitters.size() != emitters_.size())
            throw parameter_error(sentence("The run that is to go on had ", moment.emitters.size(),
                                           " emitters, this system has ", emitters_.size(), ". Add the same."));
        std::vector<Emitter<D>> resumed_emitters = emitters_;
        for (std::size_t k = 0; k < emitters_.size(); ++k)
            resumed_emitters[k].resume(moment.emitters[k], moment.now.time, moment.now.steps > 0);
        const auto resume_forces = [&](std::span<detail::AnyForce<S, D>> forces) {
            for (auto& force : forces) force.renumber(new_place), force.tear(moment.torn);
        };
        std::vector<detail::AnyForce<S, D>> rehearsal = forces_;  // that may throw, and the program may hold the others
        resume_forces(rehearsal);
        resume_forces(forces_);
        points = std::move(moment.points);
        facets = std::move(moment.facets);
        torn_ = std::move(moment.torn);
        constraints = std::move(resumed_constraints);
        collisions = std::move(resumed_collisions);
        emitters_ = std::move(resumed_emitters);
        now_ = moment.now;
        largest_step_ = 0;
    }

private:
    void check(double dt) const {
        if (!(dt > 0) || !std::isfinite(dt))
            throw parameter_error(sentence("The time step is ", dt, " s; it must be positive."));
        if (iterations < 0) throw parameter_error(sentence("There are ", iterations, " iterations; give 0 or more."));
        if (!(damping >= 0) || !std::isfinite(damping))
            throw parameter_error(sentence("The damping is ", damping, " /s; it must be finite and not negative."));
        if (!detail::is_finite(cast<S>(gravity)))
            throw parameter_error(
                sentence("Gravity is ", detail::describe(gravity), " m/s^2; it must be finite along every axis."));
        check_restitution(restitution);
        check_boundary(boundary);
    }

    /// Of a region that several steps share: 1 where forces of the user's may open their own.
    int workers_of_steps() const {
        const bool is_left =
            std::any_of(forces_.begin(), forces_.end(), [](const auto& f) { return f.may_open_regions(); });
        return is_left ? 1 : thread_count(threads);
    }

    void take_steps(double dt, std::uint64_t count) {
        check(dt);
        const std::uint64_t last = now_.steps + count;
        Stepper<D>::take_steps(
            workers_of_steps(), last, [&] { return now_.steps == last; },
            [&](std::string& warning) {
                if (now_.steps == 0) emit();
                warning = warning_of(dt);
                if (warning.empty()) take_step(dt);
            });
    }

    void take_step(double dt) {
        renew(force_, points.size(), thread_count(threads));
        detail::fill_chunks(force_, Vec<S, D>::zero(), threads);
        for (auto& force : forces_) force.add_forces(points.view(now_.time), force_, threads);
        parallel_region(thread_count(threads), [&] {
            check_finite(dt);
            kick(dt);
            if (collisions) {
                collisions->find(points, boundary, restitution, threads);
                collisions->change_velocities(points, threads);
            }
            drift(dt);
            if (constraints.size() > 0) keep_distances(dt);
            boundary = advanced(boundary, dt);
            if (collisions) collisions->shift(points, threads);
            if constexpr (!std::same_as<Boundary, NoBoundary>) meet_surfaces(points, boundary, restitution, threads);
        });
        now_ = {now_.time + dt, now_.steps + 1, dt};
        tear();
        remove_if([&](std::size_t i) { return points.end[i] <= now_.time; });
        emit();
    }

    /// Of a step above the bound, which is computed anew now and then, and when forces change; or empty.
    std::string warning_of(double dt) {
        if (largest_step_ == 0 || now_.steps % 64 == 0) largest_step_ = stable_time_step();
        const double ratio = dt / largest_step_;  // infinite where no step is small enough
        if (!(ratio >= warned_ratio_) || std::isinf(warned_ratio_)) return {};
        warned_ratio_ = 1.2 * ratio;
        if (!warn) return {};
        return sentence("the time step of ", dt, " s is ", ratio, " times the bound of ", largest_step_,
                        " s of the springs and dampers at step ", now_.steps, "; points may fly apart.");
    }

    FIRN_INLINE static S total(const Vec<S, D>& a) {
        S sum = a[0];
        unroll<D - 1>([&](auto i) FIRN_LAMBDA { sum += a[i + 1]; });
        return sum;
    }

    /// \throws particle_error  where a point or the force on it is not finite
    void check_finite(double dt) const {
        std::atomic<bool> wrong = false;
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            S all = 0;  // zero times a number is not zero where that is not finite
            for (std::size_t i = first; i < last; ++i)
                all += (total(points.position[i]) + total(points.velocity[i]) + total(force_[i])) * S(0);
            if (!(all == 0)) wrong = true;
        });
        if (wrong) throw_not_finite(dt, "Nothing has moved.");
    }

    /// Names the first point that is not finite, and how many there are.
    [[noreturn, gnu::cold]] void throw_not_finite(double dt, const char* done) const {
        std::size_t first = points.size(), count = 0;
        for (std::size_t i = points.size(); i-- > 0;)
            if (!detail::is_finite(points.position[i]) || !detail::is_finite(points.velocity[i]) ||
                !detail::is_finite(force_[i]))
                first = i, ++count;
        if (count == 0)
            throw particle_error(sentence("At step ", now_.steps, " numbers are too large to be added up. ", done));
        throw particle_error(sentence(
            "At step ", now_.steps, ", at ", now_.time, " s, ", count, " of ", points.size(),
            " points or the forces on them are not finite. The first is point ", points.id[first], " at ",
            detail::describe(points.position[first]), " m with velocity ", detail::describe(points.velocity[first]),
            " m/s under a force of ", detail::describe(force_[first]), " N. ", done, " ",
            dt > largest_step_ ? sentence("The step of ", dt, " s is ", dt / largest_step_, " times the bound of ",
                                          largest_step_, " s of the springs and dampers: shorten it.")
                               : std::string("Look at what was set by hand, and at forces of your own.")));
    }

    void kick(double dt) {
        const S step = S(dt);
        const Vec<S, D> g = cast<S>(gravity);
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                const S kick = Integrator::kick(step, points.since[i]);
                points.since[i] = Integrator::since(step);
                if (points.is_pinned(i)) continue;
                Vec<S, D>& v = points.velocity[i];
                if (damping > 0) v = v * S(std::exp(-damping * double(kick)));
                v += (g + force_[i] * points.inverse_mass[i]) * kick;
            }
        });
    }

    void drift(double dt) {
        std::atomic<bool> wrong = false;
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            S all = 0;
            for (std::size_t i = first; i < last; ++i) {
                points.position[i] += points.velocity[i] * S(dt);
                all += total(points.position[i]) * S(0);
            }
            if (!(all == 0)) wrong = true;
        });
        if (wrong) throw_not_finite(dt, half_way);
    }

    void keep_distances(double dt) {
        renew(moved_, points.size(), thread_count(threads));
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            std::copy(points.position.data() + first, points.position.data() + last, moved_.data() + first);
        });
        constraints.solve(points.position, points.inverse_mass, dt, iterations, threads);
        const S per_dt = S(1 / dt);
        std::atomic<bool> wrong = false;
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            S all = 0;
            for (std::size_t i = first; i < last; ++i) {
                points.velocity[i] += (points.position[i] - moved_[i]) * per_dt;
                all += total(points.velocity[i]) * S(0);
            }
            if (!(all == 0)) wrong = true;
        });
        if (wrong) throw_not_finite(dt, half_way);
    }
    static constexpr const char* half_way = "The points are of no use any more: go on from the last state written.";

    void emit() {
        std::size_t born = 0;
        for (Emitter<D>& emitter : emitters_) born += emitter.give(points, now_.time, gravity);
        if (born > 0) largest_step_ = 0;
    }

    void tear() {
        const std::vector<Torn> torn = constraints.torn(points.position);
        if (torn.empty()) return;
        for (auto& force : forces_) force.tear(torn);
        const detail::TornLinks links(torn);
        std::erase_if(facets, [&](const Facet<D>& facet) { return links.are_in(facet); });
        torn_.insert(torn_.end(), torn.begin(), torn.end());
        largest_step_ = 0;
    }

    /// Where in a later moment the points are that this system has now.
    std::vector<std::uint32_t> places_in(const PointMasses<S, D>& later) const {
        std::vector<std::uint32_t> places(points.size(), no_particle);
        std::size_t known = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const auto found = std::lower_bound(later.id.begin(), later.id.end(), points.id[i]);
            if (found == later.id.end() || *found != points.id[i]) continue;
            places[i] = std::uint32_t(found - later.id.begin());
            ++known;
        }
        const auto born = later.id.end() - std::lower_bound(later.id.begin(), later.id.end(), points.next_id());
        if (later.next_id() < points.next_id() || known + std::size_t(born) != later.size())
            throw parameter_error(sentence("The run that is to go on has given out ", later.next_id(),
                                           " ids of points; this system has given out ", points.next_id(),
                                           " before its first step, or others are there. Add the same points."));
        return places;
    }

    std::vector<Emitter<D>> emitters_;
    std::vector<detail::AnyForce<S, D>> forces_;
    std::vector<Torn> torn_;
    aligned_vector<Vec<S, D>> force_, moved_;
    double largest_step_ = 0, warned_ratio_ = 1;
};

/// Of a boundary, in its precision and dimension: firn::ParticleSystem system(firn::Together(walls, ball));
template <class Boundary>
explicit ParticleSystem(const Boundary&)
    -> ParticleSystem<detail::made_for<Boundary>::D, typename detail::made_for<Boundary>::S, Verlet, Boundary>;

}  // namespace firn
