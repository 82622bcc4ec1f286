/// \file The set of particles of one material, as far as the material does not matter.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/core/stepper.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particle_store.hpp>
#include <firn/exec/g2p.hpp>
#include <firn/lagrangian/net.hpp>
#include <firn/simulation/body.hpp>
#include <firn/simulation/body_force.hpp>
#include <firn/simulation/load.hpp>
#include <firn/simulation/readiness.hpp>
#include <firn/simulation/source.hpp>
#include <firn/simulation/stretch.hpp>

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Which particles of a body a process adds, when several processes add a body together.
struct PartOfBody {
    std::size_t begin,  ///< index of the first sample that becomes a particle of this process
        end,            ///< index of the last such sample, plus 1
        before,         ///< number of particles of the body before the first sample
        count;          ///< number of particles of the whole body
};

/// A set of particles, those of one material, with their blocks, bodies, sources, sinks and forces. What needs the
/// material is virtual, and is called once a step or less: G2P calls the material itself. \see MaterialSet
template <std::floating_point S, int D>
class SetOf {
public:
    virtual ~SetOf() = default;

    /// \name What needs the material
    /// @{
    virtual std::unique_ptr<SetOf> copy() const = 0;        ///< Returns a copy of the set.
    virtual ParticleStore<S, D>& store() = 0;               ///< Returns the particles.
    virtual std::string_view name_of_material() const = 0;  ///< Returns the name of the material's type.
    virtual void start_state(std::size_t slot) = 0;         ///< Sets the state of a particle to that of matter at rest.
    virtual detail::PassReport update_stress(int threads) = 0;  ///< Computes all stresses. \see firn::update_stress
    /// Tells a reader facts about all particles. \param dt  of the step that moved them [s]; 0: none did
    virtual void read_facts(double dt, detail::FactsReader& reader) = 0;
    /// Returns the particles that are stretched most. \see detail::most_stretched
    virtual std::vector<detail::Stretched> most_stretched(const KernelFacts& kernel, int threads) = 0;
    /// Returns facts about the deformation gradient of a particle; none if the state has no member F.
    virtual std::optional<detail::GradientFacts<S, D>> gradient_of(std::size_t slot) const = 0;
    virtual bool is_elastic() const = 0;  ///< Returns whether F alone is the state, and nothing yields.
    /// @}

    const ParticleStore<S, D>& store() const { return const_cast<SetOf&>(*this).store(); }

    BlockPartition<D> partition{};     ///< Blocks into which the particles are sorted.
    std::vector<Body> bodies{};        ///< Bodies of this set, in the order of their ids.
    G2PReport report{};                ///< What the last G2P reported about the particles.
    Readiness readiness{};             ///< Which preparations for a step are done.
    std::optional<Moment> restored{};  ///< Moment to which the set was restored; empty after a step.
    std::vector<Source<D>> sources{};  ///< Sources that add particles to this set.
    std::vector<Sink<D>> sinks{};      ///< Sinks that remove particles of this set.
    detail::MaybePush<S, D> loads{},   ///< Loads on bodies.
        forces{};                      ///< Forces between the particles of bodies.
    std::vector<Facet<D>> facets{};    ///< Facets of the added nets, with particle ids as corners.
    /// For each slot, the place of its particle before the step, within its block [cells]; empty if there is no sink.
    std::vector<Vec<S, D>> places_before{};

    /// Adds a body of uniform density and velocity, with one particle for each sample.
    /// \param density   density of the body [kg/m³]
    /// \param velocity  velocity of the body [m/s]
    /// \param threads   number of threads that will use the particles. \see Particles::reserve
    /// \throws parameter_error  if the density, the volume of a particle or the velocity is out of range
    /// \throws particle_error   if a position is not finite or not in the domain; nothing is added in this case
    /// \param share     the part of the samples that becomes particles of this process; all get ids
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity, int threads,
             const Share& share = {}) {
        const std::size_t n = samples.positions.size();
        return add(samples, density, velocity, threads, {share.first(n), share.last(n), 0, n});
    }
    /// Adds some of the samples of a body; other processes add the others.
    /// \param part  which of the samples become particles, and which part of the body the samples are
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity, int threads,
             const PartOfBody& part) {
        if (!(density > 0) || !std::isfinite(density))
            throw parameter_error(sentence("The density is ", density, " kg/m^3; it must be positive and finite."));
        if (!(samples.volume > 0) || !std::isfinite(samples.volume))
            throw parameter_error(sentence("The volume of a particle is ", samples.volume, " m^", D,
                                           "; it must be positive and finite."));
        const S volume = S(samples.volume), mass = S(density * samples.volume);
        if (!(volume > 0) || !(mass > 0) || !std::isfinite(volume) || !std::isfinite(mass))
            throw parameter_error(sentence("A particle of ", samples.volume, " m^", D, " and ",
                                           density * samples.volume,
                                           " kg is too small or too large for the simulation's precision. Use "
                                           "double."));
        return add_all(samples.positions, velocity, volume, {&mass, 1}, threads, part);
    }

    /// Adds the points of a net as particles that have mass and no volume, to a set of NoStress.
    /// \param masses    mass of each point [kg]
    /// \param velocity  velocity of all points [m/s]
    /// \param threads   number of threads that will use the particles. \see Particles::reserve
    /// \throws parameter_error  if a mass, the velocity or a corner of a facet is out of range
    /// \throws particle_error   if a position is not finite or not in the domain; nothing is added in this case
    Body add(const Net<D>& net, std::span<const double> masses, const Vec<double, D>& velocity, int threads) {
        if (masses.size() != net.positions.size())
            throw parameter_error(sentence("A net of ", net.positions.size(), " points is given ", masses.size(),
                                           " masses; give one for each."));
        for (std::size_t i = 0; i < masses.size(); ++i)
            if (!(S(masses[i]) > 0) || !std::isfinite(S(masses[i])))
                throw parameter_error(
                    sentence("The mass of point ", i, " is ", masses[i], " kg; it must be positive and finite."));
        for (const Facet<D>& facet : net.facets)
            for (const std::uint32_t corner : facet)
                if (corner >= masses.size())
                    throw parameter_error(sentence("A facet of the net has the corner ", corner, "; there are ",
                                                   masses.size(), " points, counted from 0."));
        const std::size_t n = masses.size();
        const std::vector<S> rounded(masses.begin(), masses.end());
        const Body body = add_all(net.positions, velocity, S(0), rounded, threads, {0, n, 0, n});
        for (Facet<D> facet : net.facets) {
            for (std::uint32_t& corner : facet) corner += body.first;
            facets.push_back(facet);
        }
        return body;
    }

    /// Adds a source. If steps were already taken, bursts that were due at or before `now` are skipped.
    /// \see SetAccess::add_source
    void add(Source<D> source, const Moment& now) {
        if (now.steps > 0) source.skip(now.time);
        sources.push_back(std::move(source));
    }
    /// Adds a load. \see SetAccess::add_load
    /// \throws parameter_error  if the load's force is an empty function, or if `load.body` is not one of the bodies of
    ///                          this set
    /// \return the number of the load
    std::uint32_t add(Load<D> load) {
        if (!load.force) throw parameter_error("A load is an empty function; give one that returns a force.");
        check_body(load.body);
        return loads.template made<detail::Loads<S, D>>().add(std::move(load));
    }
    /// Removes a load. \see SetAccess::remove_load
    /// \throws parameter_error  if this set has no load of this number
    void remove_load(std::uint32_t number) {
        if (!loads || !loads.template made<detail::Loads<S, D>>().remove(number))
            throw parameter_error(sentence("There is no load ", number,
                                           " of this material: it was removed already, or is another material's. Give "
                                           "what add_load() has returned."));
    }
    /// Adds a force between the particles of a body. \see SetAccess::add_force
    /// \return a reference to the stored force
    /// \throws parameter_error  if `body` is not one of the bodies of this set
    template <class BetweenPoints>
    BetweenPoints& add_force(const Body& body, BetweenPoints force) {
        check_body(body);
        return forces.template made<detail::BodyForces<S, D>>()
            .add(body, detail::AnyForce<S, D>(std::move(force)))
            .template as<BetweenPoints>();
    }

    /// Returns the index, in `bodies`, of the body to which the particle with the given id belongs; bodies.size() if no
    /// body has this id.
    std::size_t body_of(std::uint32_t id) const {
        const auto next = std::upper_bound(bodies.begin(), bodies.end(), id,
                                           [](std::uint32_t wanted, const Body& body) { return wanted < body.first; });
        return next == bodies.begin() ? bodies.size() : std::size_t(next - bodies.begin()) - 1;
    }

    /// Checks that a body belongs to this set.
    /// \throws parameter_error  if `body` has ids that were not yet given to particles of this set
    void check_body(const Body& body) const {
        if (std::uint64_t(body.first) + body.count > store().next_id())
            throw parameter_error(sentence("There is no body of the particles ", body.first, " to ",
                                           std::uint64_t(body.first) + body.count - 1, ": ", store().next_id(),
                                           " ids of this material have been given out, counted from 0. Give the body "
                                           "that add() has returned for this material."));
    }

    /// Gives the sources, sinks, loads, forces and facets to a set that will take the place of this one. Its sources
    /// skip the bursts that were due at or before `moment`.
    void hand_over(SetOf& stored, const Moment& moment) {
        stored.sources = std::move(sources);
        stored.sinks = std::move(sinks);
        stored.loads = std::move(loads);
        stored.forces = std::move(forces);
        if (stored.forces) stored.forces->forget();
        stored.facets = std::move(facets);
        stored.restored = moment;
        for (Source<D>& source : stored.sources) source.skip(moment.time);
    }

    /// Checks all positions, if particles were changed since the last check.
    /// \throws particle_error  if a position is not finite or not in the domain; the message names the first such
    ///                         particle
    void check_positions() {
        const ParticleStore<S, D>& particles = store();
        if (!readiness.is(Readiness::inside))
            firn::check_positions<double, D, S>(
                particles.slots(), particles.domain(),
                [&](std::size_t i, int a) { return particles.exact_position(i)[a]; },
                [&](std::size_t i) { return particles.id(i); });
        readiness.check();
    }

    /// Moves the particles of a body to the blocks of a contact group.
    void move_to_group(const Body& body, int group) {
        ParticleStore<S, D>& particles = store();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot) && body.holds(particles.id(slot))) particles.set_contact_group(slot, group);
    }
    /// Puts the particles of a body into a contact group. \see SetAccess::set_contact_group
    /// \throws parameter_error  if `body` is not one of the bodies of this set, if it has no particles, or if the group
    ///                          is out of range
    void set_contact_group(const Body& body, int group) {
        check_body(body);
        const int most = most_contact_groups(store().domain());
        if (group < 0 || group >= most)
            throw parameter_error(sentence("A body is put into contact group ", group,
                                           "; in this domain there are groups 0 to ", most - 1, "."));
        if (body.count == 0)
            throw parameter_error(sentence("A body without particles is put into contact group ", group,
                                           ". Give the body that add() has returned."));
        readiness.edit();
        move_to_group(body, group);
        for (Body& of : bodies)
            if (of.first >= body.first && of.first - body.first < body.count) of.contact_group = group;
    }

    /// Removes the particles for which wanted(position [m], id) returns true.
    /// \return the number of removed particles
    template <class Wanted>
    std::size_t remove_if(const Wanted& wanted) {
        ParticleStore<S, D>& particles = store();
        const std::size_t before = particles.size();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot) && wanted(particles.exact_position(slot), particles.id(slot)))
                particles.remove(slot);
        if (particles.size() < before) readiness.unprepare();
        return before - particles.size();
    }

    /// Adds the particles of all bursts that are due at `time` [s].
    /// \throws parameter_error  if the bursts have more particles than there are unused ids
    /// \param share  the part of each burst that becomes particles of this process
    void give(double time, int threads, const Share& share = {}) {
        for (Source<D>& source : sources) {
            source.require_ids(time, no_particle - store().next_id());
            for (; source.is_due(time); ++source.bursts) {
                Samples<D> burst = source.samples;
                const double born = source.time_of(source.bursts);
                for (Vec<double, D>& x : burst.positions) x += source.velocity * (time - born);
                const Body body = add(burst, source.density, source.velocity, threads, share);
                if (!sinks.empty())
                    remove_if([&](const Vec<double, D>&, std::uint32_t id) {
                        const std::size_t i = id - body.first;
                        return id >= body.first && is_taken(source.samples.positions[i], burst.positions[i]);
                    });
                bodies.back().end = born + source.lifespan;
                if (source.contact_group != 0) set_contact_group(bodies.back(), source.contact_group);
            }
        }
    }
    /// Removes the particles whose way since push() meets a sink, and the particles of bodies whose `end` is at
    /// or before `time` [s].
    void take(double time) {
        if (!may_take(time)) return;
        ParticleStore<S, D>& particles = store();
        const std::size_t before = particles.size();
        for (std::size_t slot = 0; slot < particles.used_slots(); ++slot)
            if (particles.is_particle(slot) && takes(slot, time)) particles.remove(slot);
        if (particles.size() < before) readiness.unprepare();
        for (Body& body : bodies)
            if (has_ended(body, time)) body.count = 0;
    }
    /// Returns whether take() will remove a particle.
    bool will_take(double time) const {
        const ParticleStore<S, D>& particles = store();
        for (std::size_t slot = 0; may_take(time) && slot < particles.used_slots(); ++slot)
            if (particles.is_particle(slot) && takes(slot, time)) return true;
        return false;
    }
    /// Returns the time of the next burst of any source [s]; infinite if no burst follows.
    double next_burst() const {
        double next = std::numeric_limits<double>::infinity();
        for (const Source<D>& source : sources)
            if (const double due = source.time_of(source.bursts); due <= source.end) next = std::min(next, due);
        return next;
    }

    /// Adds the impulses of loads and forces over a step of `dt` [s] to the particles' velocities. If there are sinks,
    /// takes note of where the particles are.
    /// \throws particle_error  if a velocity is not finite afterwards; the message gives the lowest id of such a
    ///                         particle
    /// \param sums  receives what loads exert on the particles
    void push(const Moment& now, double dt, int threads, const detail::SumsOfSet<D>& sums) {
        ParticleStore<S, D>& particles = store();
        places_before.resize(sinks.empty() ? 0 : particles.used_slots());
        for (std::size_t slot = 0; slot < places_before.size(); ++slot) places_before[slot] = particles.place(slot);
        if (!loads && !forces) return;
        readiness.spoil();  // the particles cannot be used until the step has ended
        if (loads) loads->push(particles, now, dt, threads, sums);
        if (loads && forces) forces->forget();
        if (forces) forces->push(particles, now, dt, threads, sums);
    }
    /// Lets loads and forces forget what they know of the particles, as these have moved to other slots.
    void forget_pushes() {
        if (loads) loads->forget();
        if (forces) forces->forget();
    }

private:
    static bool has_ended(const Body& body, double time) { return body.count > 0 && body.end <= time; }
    bool may_take(double time) const {
        return !sinks.empty() ||
               std::any_of(bodies.begin(), bodies.end(), [&](const Body& body) { return has_ended(body, time); });
    }
    bool takes(std::size_t slot, double time) const {
        const ParticleStore<S, D>& particles = store();
        if (slot < places_before.size()) {
            const Vec<double, D> to = particles.exact_position(slot);
            const Vec<S, D> way = particles.place(slot) - places_before[slot];  // [cells]
            if (is_taken(to - cast<double>(way) * particles.domain().cell_size, to)) return true;
        }
        const std::size_t b = body_of(particles.id(slot));
        return b < bodies.size() && has_ended(bodies[b], time);
    }
    /// Returns whether a sink is on the way between two positions [m]. `to` lies in the domain. If `from` does not, the
    /// particle has come through the ends of periodic axes.
    bool is_taken(const Vec<double, D>& from, const Vec<double, D>& to) const {
        const Domain<D>& domain = store().domain();
        // Each bit of `images` chooses, for an axis, the way at the end where the particle has left.
        for (unsigned images = 0; images < 1u << D; ++images) {
            Vec<double, D> shift{};
            bool is_image = true;
            for (int a = 0; a < D; ++a) {
                if ((images >> a & 1u) == 0) continue;
                const double extent = domain.upper[a] - domain.lower[a];
                shift[a] = from[a] < domain.lower[a] ? extent : from[a] > domain.upper[a] ? -extent : 0;
                is_image = is_image && domain.periodic[std::size_t(a)] && shift[a] != 0;
            }
            if (is_image && std::any_of(sinks.begin(), sinks.end(), [&](const Sink<D>& sink) {
                    return sink.is_on_the_way(from + shift, to + shift);
                }))
                return true;
        }
        return false;
    }

    /// \param masses  one for each position, or one for all [kg]
    Body add_all(const std::vector<Vec<double, D>>& x, const Vec<double, D>& velocity, S volume,
                 std::span<const S> masses, int threads, const PartOfBody& part) {
        ParticleStore<S, D>& particles = store();
        for (int a = 0; a < D; ++a)
            if (!std::isfinite(S(velocity[a])))
                throw parameter_error(sentence("Component ", a, " of the velocity is ", velocity[a],
                                               " m/s; it must be finite in the simulation's precision."));
        if (!x.empty() || part.count == 0)
            firn::check_positions<double, D, S>(x.size(), particles.domain(),
                                                [&](std::size_t i, int a) { return x[i][a]; });
        if (part.count > particles.ids_left())
            throw parameter_error(sentence("A body of ", part.count, " particles: only ", particles.ids_left(),
                                           " ids of this material are left."));
        const Body body{store().next_id(), std::uint32_t(part.count)};
        particles.reserve(particles.size() + (part.end - part.begin), threads);
        particles.skip_ids(body.first + std::uint32_t(part.before + part.begin));
        for (std::size_t i = part.begin; i < part.end; ++i) {
            const std::size_t slot = particles.push_back(x[i]);
            particles.set_velocity(slot, cast<S>(velocity));
            particles.set_mass(slot, masses[masses.size() == 1 ? 0 : i]);
            particles.set_volume(slot, volume);
            start_state(slot);
        }
        particles.skip_ids(body.first + body.count);
        bodies.push_back(body);
        readiness.unprepare();
        return body;
    }
};

/// The sets of a run, in the order of its materials. A copy has copies of the sets.
template <std::floating_point S, int D>
class SetList {
public:
    SetList() = default;
    SetList(const SetList& other) {
        for (const SetOf<S, D>& set : other) sets_.push_back(set.copy());
    }
    SetList(SetList&&) noexcept = default;
    SetList& operator=(SetList other) noexcept {
        sets_ = std::move(other.sets_);
        return *this;
    }

    void add(std::unique_ptr<SetOf<S, D>> set) { sets_.push_back(std::move(set)); }
    std::size_t size() const { return sets_.size(); }
    SetOf<S, D>& operator[](std::size_t k) { return *sets_[k]; }
    const SetOf<S, D>& operator[](std::size_t k) const { return *sets_[k]; }

    auto begin() { return Iterator<SetOf<S, D>>{sets_.data()}; }
    auto end() { return Iterator<SetOf<S, D>>{sets_.data() + sets_.size()}; }
    auto begin() const { return Iterator<const SetOf<S, D>>{sets_.data()}; }
    auto end() const { return Iterator<const SetOf<S, D>>{sets_.data() + sets_.size()}; }

private:
    template <class Set>
    struct Iterator {
        const std::unique_ptr<SetOf<S, D>>* at;

        Set& operator*() const { return **at; }
        Iterator& operator++() {
            ++at;
            return *this;
        }
        bool operator==(const Iterator&) const = default;
    };

    std::vector<std::unique_ptr<SetOf<S, D>>> sets_;
};

}  // namespace firn::inline FIRN_BUILD
