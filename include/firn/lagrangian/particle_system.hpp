/// \file A system of point masses that move under forces, constraints and collisions.
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
#include <firn/stage/time_step.hpp>

#include <atomic>
#include <optional>
#include <string>
#include <utility>

namespace firn::inline FIRN_BUILD {

/// The masses, radius and group of the point masses that ParticleSystem::add makes from the points of a net.
struct NetOptions {
    double mass = 1;                  ///< Mass of every point if `masses` is empty [kg].
    std::vector<double> masses = {};  ///< One mass per point [kg]; empty: all points have `mass`.
    double radius = 0;                ///< Radius of every point [m].
    std::uint32_t group = 0;          ///< Group of every point, for collisions. \see PointMass::group
};

/// The state of a ParticleSystem between two steps: everything that steps change, except the boundary.
template <std::floating_point S, int D>
struct SystemMoment {
    PointMasses<S, D> points;              ///< All points.
    std::vector<Facet<D>> facets;          ///< Facets of the surface, as point indices.
    std::vector<Torn> torn;                ///< Torn links, as indices of their end points.
    ConstraintHistory constraints;         ///< Removed constraints; see DistanceConstraints::history.
    std::vector<EmitterHistory> emitters;  ///< Histories of all emitters, in the order they were added.
    std::optional<std::vector<KeptImpulse<S, D>>> impulses;  ///< Impulses of contacts; see Collisions::kept.
    Moment now;                                              ///< Time, number of steps and last time step.
};

/// A system of point masses that move under forces, constraints and collisions.
///
/// A step does the following, in this order:
/// 1. Forces, gravity and damping change velocities.
/// 2. Collisions with other points and with the boundary change velocities.
/// 3. Points move, by their velocities and by the constraints, so that the distances approach the lengths at rest.
///    Constraints change the velocities, too.
/// 4. The moving parts of the boundary move. Collisions move overlapping points apart; this does not change velocities.
/// 5. The contact with the surfaces of the boundary changes velocities and positions, see meet_surfaces().
/// 6. Constraints and springs tear, see tear(). Points are removed at the end of their life, and emitters add points.
///    In the first step, emitters also add the points that are due at the beginning of the step, before everything
///    else.
///
/// Positions are in double, whatever S is, and differences of positions are formed in double. All else is in S. So a
/// float system moves at map coordinates as it does at the origin, in steps of any size. What float loses is the change
/// of a velocity in a step below 6e-8 of the velocity: at 10 m/s, gravity is off by up to 5 % in steps of 1e-6 s, and
/// not there in steps of 4e-8 s. Take double where it counts.
/// \tparam D           2 or 3
/// \tparam S           float or double
/// \tparam Integrator  SymplecticEuler or Verlet
/// \tparam Boundary    a boundary with scalar type S and a member function surfaces(), such as Walls, Collider or
///                     Together
template <int D, std::floating_point S = float, integrator Integrator = Verlet, class Boundary = NoBoundary>
class ParticleSystem : public Stepper<D> {
    using Stepper<D>::now_;

public:
    static_assert(D == 2 || D == 3, "firn simulates in two or three dimensions");
    using scalar_type = S;
    static constexpr int dimension = D;

    /// Makes a system without points, with a default boundary.
    ParticleSystem() : ParticleSystem(Boundary{}) {}
    /// Makes a system without points, with the given boundary.
    explicit ParticleSystem(const Boundary& with) : boundary(with) {
        detail::tell_unoptimised<FIRN_TELLS_UNOPTIMISED>();
    }

    PointMasses<S, D> points;  ///< All points.
    using Stepper<D>::gravity;
    /// Function that is called with a warning if a time step is above stable_time_step(), or if the iterations leave
    /// constraints with larger errors than DistanceConstraints::rigid_tolerance and compliant_tolerance allow.
    using Stepper<D>::warn;
    double damping = 0;  ///< Damping rate c [1/s]: a step of length dt multiplies velocities by exp(−c dt).
    DistanceConstraints<S, D> constraints;  ///< Constraints on the distances between points.
    int iterations = 8;                     ///< Number of iterations of the constraints per step.
    /// The collisions of points with each other. If this std::optional is empty, points do not collide. After
    /// system.collisions.emplace(), points collide, with default parameters.
    std::optional<Collisions<S, D>> collisions{};
    Boundary boundary{};  ///< The boundary. Each step also moves the boundary's moving parts.
    /// Coefficient of restitution between points and the boundary, from 0 to 1 [1]; see rebound().
    double restitution = 0;
    int threads = 0;  ///< Number of threads; 0: the number that thread_count() returns.
    /// The facets of the surface, as point indices, for output. A facet is removed if both end points of a torn link
    /// are corners of it.
    std::vector<Facet<D>> facets;

    /// Adds the points and facets of a net. To add springs or constraints along the net's links, call springs_of() or
    /// constraints.add() with the returned index as `first`.
    /// \param net       the net
    /// \param options   masses, radius and group of the points
    /// \param velocity  velocity of every point [m/s]
    /// \return the index of the net's first point in `points`; the other points of the net follow, in the same order
    /// \throws parameter_error  if PointMasses::check throws it, if `masses` has entries, but not one per point, or if
    ///                          a facet names a point that does not exist. Nothing is added then.
    std::size_t add(const Net<D>& net, const NetOptions& options, const Vec<double, D>& velocity = {}) {
        if (!options.masses.empty() && options.masses.size() != net.positions.size())
            throw parameter_error(sentence("A net of ", net.positions.size(), " points is given ",
                                           options.masses.size(), " masses; give one per point, or one for all."));
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

    /// Adds a force, which then acts in every step. The system stores a copy of the force.
    /// \return a reference to the stored copy; use it to change the parameters of the force
    template <class Force>
        requires point_force<Force, S, D>
    Force& add_force(Force force) {
        largest_step_ = 0;
        return forces_.emplace_back(std::move(force)).template as<Force>();
    }

    /// Adds an emitter. Births that are due up to the present time are left out if the system has already taken a step;
    /// otherwise they happen at the beginning of the first step.
    /// \throws parameter_error  if Emitter::check throws it
    void add_emitter(const Emitter<D>& emitter) {
        emitter.check();
        Emitter<D> added = emitter;
        if (now_.steps > 0) added.skip(now_.time);
        emitters_.push_back(std::move(added));
    }
    /// Returns all emitters, in the order they were added.
    const std::vector<Emitter<D>>& emitters() const { return emitters_; }
    /// Returns a digest of each force, in the order in which they were added; 0 for a force without digest().
    std::vector<std::uint64_t> digests_of_forces() const {
        std::vector<std::uint64_t> digests;
        for (const auto& force : forces_) digests.push_back(force.digest());
        return digests;
    }

    /// Removes points: for each index i, removes the point with this index if wanted(i) is true. All springs,
    /// constraints, facets and excluded pairs of a removed point are removed, too, and shear and bend links that the
    /// point supported tear, see tear(). The indices of the remaining points may change.
    /// \return the number of points removed
    /// \throws parameter_error  if a force, constraint, excluded pair or facet names a point that does not exist; do
    ///                          not use the system after this error
    template <class Wanted>
    std::size_t remove_if(const Wanted& wanted) {
        const std::vector<std::uint32_t> new_place = points.remove_if(wanted);
        if (new_place.empty()) return 0;
        remove_torn(detail::unsupported_without<S>(links(), new_place));
        constraints.renumber(new_place);
        if (collisions) collisions->renumber(new_place);
        for (auto& force : forces_) force.renumber(new_place);
        std::erase_if(facets, [&](Facet<D>& facet) { return !detail::renumbered(facet, new_place); });
        std::erase_if(torn_, [&](Torn& ends) { return !detail::renumbered(ends, new_place); });
        largest_step_ = 0;
        return new_place.size() - points.size();
    }

    /// Returns the largest time step [s] for which the forces are stable, by the stiffness and damping that they have
    /// at the present positions and velocities of the points; infinite if there are no such forces. With larger steps,
    /// velocities may grow without bound. Constraints do not limit the time step. Forces of your own limit it by what
    /// they say of themselves: see ElementForces, ForceOnEach and point_force.
    double stable_time_step() {
        double bound = 0;
        parallel_region(workers_of_steps(),
                        [&] { bound = detail::largest_step<S, D>(forces_, points.view(now_.time), threads); });
        return bound;
    }

    /// Takes one step of length dt [s].
    /// \throws parameter_error  if dt is not positive and finite, or if a parameter of the system is out of range
    /// \throws particle_error   if a position, velocity or force is not finite before the step; nothing has moved then
    /// \throws particle_error   if a position or velocity is not finite after the step; all points are invalid then
    ///
    /// If a force throws an exception, step() passes this exception on to the caller.
    void step(double dt) { take_steps(dt, 1); }

    /// Takes steps of equal length until `duration` [s] has passed. The length of a step is at most dt [s]; it is
    /// chosen so that a whole number of steps takes exactly `duration`.
    /// \throws parameter_error  if step() throws it, or if the duration is negative or not finite
    /// \throws particle_error   if step() throws it
    void advance(double duration, double dt) {
        check(dt);
        detail::check_duration(duration);
        const auto count = std::uint64_t(std::ceil(duration / dt * (1 - 1e-12)));
        if (count > 0) take_steps(duration / double(count), count);
    }

    /// Tears links, as a step does with constraints and springs that are longer than their tear factors allow. With a
    /// torn link go the constraints, springs, membranes and facets that have both of its end points. A shear or bend
    /// link that loses its support tears, too; its support is a point that stretch links join to both of its end
    /// points. What is torn stays so when another run goes on from a state of this one.
    /// \param cut  the links, by the indices (into `points`) of their end points, in any order
    /// \throws parameter_error  if one of these links, a constraint or a spring names a point that does not exist, or
    ///                          if the end points of one of these links are the same; nothing is torn then
    void tear(std::span<const Torn> cut) {
        if (cut.empty()) return;
        const std::vector<detail::TearingLink<S>> all = links();
        std::vector<Torn> torn(cut.begin(), cut.end());
        for (const auto& [a, b] : cut)
            if (std::max(a, b) >= points.size() || a == b)
                throw parameter_error(sentence("A link to tear joins points ", a, " and ", b, "; name two of the ",
                                               points.size(), " points, counted from 0."));
        for (const auto& link : all)
            if (std::max(link.ends[0], link.ends[1]) >= points.size())
                throw parameter_error(sentence("A constraint or spring joins points ", link.ends[0], " and ",
                                               link.ends[1], "; there are ", points.size(), ", counted from 0."));
        detail::add_unsupported<S>(all, points.size(), torn);
        remove_torn(detail::each_once(std::move(torn)));
    }
    /// Returns the torn links whose two end points still exist, in the order in which they tore. Each link is given by
    /// the indices (into `points`) of its end points.
    const std::vector<Torn>& torn() const { return torn_; }

    /// Continues another run from its saved state. The results are the same, bit for bit, as if the other run had
    /// continued. Before the call, set up this system exactly as the system of the other run was set up before its
    /// first step.
    /// \param moment  the saved state of the other run
    /// \throws usage_error      if this system has already taken a step
    /// \throws parameter_error  if the saved state does not fit this system; the system is then left unchanged
    void resume(SystemMoment<S, D> moment) {
        if (now_.steps > 0)
            throw usage_error(
                sentence("The system has taken ", now_.steps, " steps; call resume() before the first step."));
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
            throw parameter_error("In the run to resume, points collided; let those of this system collide.");
        if (collisions) {
            resumed_collisions->renumber(new_place);
            resumed_collisions->resume(moment.impulses);
        }
        if (moment.emitters.size() != emitters_.size())
            throw parameter_error(sentence("The run to resume had ", moment.emitters.size(),
                                           " emitters, this system has ", emitters_.size(), ". Add the same."));
        std::vector<Emitter<D>> resumed_emitters = emitters_;
        for (std::size_t k = 0; k < emitters_.size(); ++k)
            resumed_emitters[k].resume(moment.emitters[k], moment.now.time, moment.now.steps > 0);
        const auto resume_forces = [&](std::span<detail::AnyForce<S, D>> forces) {
            for (auto& force : forces) force.renumber(new_place), force.tear(moment.torn);
        };
        // The changes are tried on a copy first, because they may throw. The forces keep their addresses, because users
        // may have references to them.
        std::vector<detail::AnyForce<S, D>> rehearsal = forces_;
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

    /// Returns the number of workers of a parallel region that contains several steps. The number is 1 if some force
    /// may open a parallel region itself.
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
        bool is_overlong = false;
        parallel_region(thread_count(threads), [&] {
            check_finite(dt);
            kick(dt);
            if (collisions) {
                collisions->find(points, boundary, restitution, threads, approach(now_.last_time_step, -dt / 2));
                collisions->change_velocities(points, threads);
            }
            if (constraints.size() > 0)
                keep_distances(dt);
            else
                drift(dt);
            boundary = advanced(boundary, dt);
            if (collisions) collisions->shift(points, threads);
            if constexpr (!std::same_as<Boundary, NoBoundary>)
                meet_surfaces(points, boundary, restitution, threads, approach(dt, dt / 2));
            is_overlong = constraints.is_overlong(points.position, threads);
            for (const auto& force : forces_)
                is_overlong = is_overlong || force.is_overlong(points.view(now_.time), threads);
        });
        now_ = {now_.time + dt, now_.steps + 1, dt};
        if (is_overlong) remove_torn(detail::torn_links<S, D>(links(), points.position));
        remove_if([&](std::size_t i) { return points.end[i] <= now_.time; });
        emit();
    }

    /// Returns a warning if there is something to warn of before a step of length dt, otherwise an empty text: if the
    /// step is above stable_time_step(), or if look_at_constraints() has found something. The bound stable_time_step()
    /// is computed again every 64 steps, and after forces or points are added or removed.
    std::string warning_of(double dt) {
        if (largest_step_ == 0 || now_.steps % 64 == 0) largest_step_ = stable_time_step();
        if (!to_say_.empty()) return std::exchange(to_say_, {});
        const double ratio = dt / largest_step_;  // infinite if largest_step_ is 0
        if (!(ratio >= warned_ratio_) || std::isinf(warned_ratio_)) return {};
        warned_ratio_ = 1.2 * ratio;
        if (!warn) return {};
        return sentence("the time step of ", dt, " s is ", ratio, " times the bound of ", largest_step_,
                        " s of the forces at step ", now_.steps, "; points may fly apart.");
    }

    template <class T>
    FIRN_INLINE static T total(const Vec<T, D>& a) {
        T sum = a[0];
        unroll<D - 1>([&](auto i) FIRN_LAMBDA { sum += a[i + 1]; });
        return sum;
    }

    /// Checks that the positions and velocities of all points and the forces on all points are finite.
    /// \throws particle_error  if one of these vectors is not finite
    void check_finite(double dt) const {
        std::atomic<bool> wrong = false;
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            double all = 0;  // stays 0 if all components are finite; 0 times infinity or NaN is NaN
            for (std::size_t i = first; i < last; ++i)
                all += (total(points.position[i]) + double(total(points.velocity[i]) + total(force_[i]))) * 0.0;
            if (!(all == 0)) wrong = true;
        });
        if (wrong) throw_not_finite(dt, "Nothing has moved.");
    }

    /// Throws a particle_error. The message contains the number of points whose position, velocity or force is not
    /// finite, and the data of the first of these points.
    /// \param dt    time step [s]
    /// \param done  a sentence for the message; the sentence says in what state the points are
    [[noreturn, gnu::cold]] void throw_not_finite(double dt, const char* done) const {
        std::size_t first = points.size(), count = 0;
        for (std::size_t i = points.size(); i-- > 0;)
            if (!detail::is_finite(points.position[i]) || !detail::is_finite(points.velocity[i]) ||
                !detail::is_finite(force_[i]))
                first = i, ++count;
        if (count == 0)
            throw particle_error(sentence("At step ", now_.steps, ", numbers are too large to be added. ", done));
        throw particle_error(sentence(
            "At step ", now_.steps, ", at ", now_.time, " s, ", count, " of ", points.size(),
            " points or the forces on them are not finite. The first is point ", points.id[first], " at ",
            detail::describe(points.position[first]), " m with velocity ", detail::describe(points.velocity[first]),
            " m/s under a force of ", detail::describe(force_[first]), " N. ", done, " ",
            dt > largest_step_ ? sentence("The step of ", dt, " s is ", dt / largest_step_, " times the bound of ",
                                          largest_step_, " s of the forces; take a smaller one.")
                               : std::string("Check the values set by hand and your own forces.")));
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

    /// Returns how the points have come to their positions, see Approach.
    auto approach(double step, double lag) const {
        const auto acceleration = [this, g = cast<S>(gravity)](std::size_t i)
                                      FIRN_LAMBDA { return g + force_[i] * points.inverse_mass[i]; };
        return Approach<decltype(acceleration)>{step, lag, acceleration};
    }

    /// Moves the points by their velocities.
    void drift(double dt) {
        std::atomic<bool> wrong = false;
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            double all = 0;
            for (std::size_t i = first; i < last; ++i) {
                points.position[i] += cast<double>(points.velocity[i]) * dt;
                all += total(points.position[i]) * 0.0;
            }
            if (!(all == 0)) wrong = true;
        });
        if (wrong) throw_not_finite(dt, half_way);
    }

    /// Moves the points by their velocities and by the constraints, which change the velocities, too.
    void keep_distances(double dt) {
        for (auto* way : {&moved_, &free_}) renew(*way, points.size(), thread_count(threads));
        std::atomic<bool> wrong = false;
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            S all = 0;
            for (std::size_t i = first; i < last; ++i) {
                moved_[i] = free_[i] = points.velocity[i] * S(dt);
                all += total(moved_[i]) * S(0);
            }
            if (!(all == 0)) wrong = true;
        });
        if (!wrong) {  // else no point shall spoil others
            constraints.solve(points.position, moved_, points.inverse_mass, dt, iterations, threads);
            look_at_constraints();
        }
        const S per_dt = S(1 / dt);
        detail::for_chunks(points.size(), threads, [&](std::size_t first, std::size_t last) {
            double all = 0;
            for (std::size_t i = first; i < last; ++i) {
                points.position[i] += cast<double>(moved_[i]);
                points.velocity[i] += (moved_[i] - free_[i]) * per_dt;
                all += (total(points.position[i]) + double(total(points.velocity[i]))) * 0.0;
            }
            if (!(all == 0)) wrong = true;
        });
        if (wrong) throw_not_finite(dt, half_way);
    }
    /// Looks, once in 32 steps, whether the iterations have solved the constraints.
    void look_at_constraints() {
        if (has_warned_of_constraints_ || !warn || now_.steps % 32 != 31) return;
        const ConstraintErrors errors = constraints.errors(threads);
        const bool of_rigid = errors.rigid() > constraints.rigid_tolerance;
        if (!of_rigid && !(errors.compliant() > constraints.compliant_tolerance)) return;
        has_warned_of_constraints_ = true;
        to_say_ = sentence(
            "at step ", now_.steps, ", ", iterations, " iterations leave ",
            of_rigid ? sentence("rigid constraints ", errors.rigid(), " of their length too long or too short")
                     : sentence("compliant constraints with an error of ", errors.compliant(), " of their stretch"),
            " (root mean square; the worst, between points ", points.id[errors.ends[0]], " and ",
            points.id[errors.ends[1]], ", by ", errors.worst,
            " of its length). So stiffness depends on iterations and time step. Take smaller steps, or more "
            "iterations; "
            "or set DistanceConstraints::",
            of_rigid ? "rigid_tolerance" : "compliant_tolerance", ".");
    }
    static constexpr const char* half_way = "The points are invalid; go on from the last state written.";

    void emit() {
        std::size_t born = 0;
        for (Emitter<D>& emitter : emitters_) born += emitter.give(points, now_.time, gravity);
        if (born > 0) largest_step_ = 0;
    }

    /// Returns all constraints, and the springs among the forces.
    std::vector<detail::TearingLink<S>> links() const {
        std::vector<detail::TearingLink<S>> all;
        constraints.list_links(all);
        for (const auto& force : forces_) force.list_links(all);
        return all;
    }
    void remove_torn(const std::vector<Torn>& torn) {
        if (torn.empty()) return;
        constraints.tear(torn);
        for (auto& force : forces_) force.tear(torn);
        const detail::TornLinks links(torn);
        std::erase_if(facets, [&](const Facet<D>& facet) { return links.are_in(facet); });
        torn_.insert(torn_.end(), torn.begin(), torn.end());
        largest_step_ = 0;
    }

    /// Returns a list with one entry per point of this system: the index of the same point in `later`, or no_particle
    /// if the point was removed.
    /// \param later  the points of a later moment of the run
    /// \throws parameter_error  if `later` cannot have come from the points of this system
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
            throw parameter_error(sentence("The run to resume has given out ", later.next_id(),
                                           " ids of points, this system ", points.next_id(),
                                           " before its first step; their points differ. Add the same points."));
        return places;
    }

    std::vector<Emitter<D>> emitters_;
    std::vector<detail::AnyForce<S, D>> forces_;
    std::vector<Torn> torn_;
    aligned_vector<Vec<S, D>> force_;  // on each point [N]
    aligned_vector<Vec<S, D>> moved_,
        free_;  // displacement of each point in the step, with and without constraints [m]
    double largest_step_ = 0, warned_ratio_ = 1;
    bool has_warned_of_constraints_ = false;
    std::string to_say_;  // a warning that is given before the next step
};

/// Deduces the scalar type and the dimension from a boundary, as in firn::ParticleSystem system(firn::Together(walls,
/// ball)).
template <class Boundary>
explicit ParticleSystem(const Boundary&)
    -> ParticleSystem<detail::made_for<Boundary>::D, typename detail::made_for<Boundary>::S, Verlet, Boundary>;

}  // namespace firn::inline FIRN_BUILD
