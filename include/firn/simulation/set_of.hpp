/// \file The set of particles of one material, as far as the material does not matter.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/core/stepper.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particle_store.hpp>
#include <firn/lagrangian/net.hpp>
#include <firn/loops/g2p.hpp>
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
    SetOf();                             ///< Makes a set without particles.
    SetOf(const SetOf&);                 ///< Copies the set.
    SetOf(SetOf&&) noexcept;             ///< Takes the set over.
    SetOf& operator=(const SetOf&);      ///< Copies the set.
    SetOf& operator=(SetOf&&) noexcept;  ///< Takes the set over.
    virtual ~SetOf();

    /// \name What needs the material
    /// @{
    virtual std::unique_ptr<SetOf> copy() const = 0;        ///< Returns a copy of the set.
    virtual ParticleStore<S, D>& store() = 0;               ///< Returns the particles.
    virtual std::string_view name_of_material() const = 0;  ///< Returns the name of the material's type.
    virtual void start_state(std::size_t slot) = 0;         ///< Sets the state of a particle to that of matter at rest.
    /// Computes all stresses. \param time  the present time [s]. \see firn::update_stress
    virtual detail::PassReport update_stress(int threads, double time) = 0;
    /// Tells a reader facts about all particles. \param dt  of the step that moved them [s]; 0: none did
    virtual void read_facts(double dt, detail::FactsReader& reader) = 0;
    /// Returns the particles that are stretched most. \see detail::most_stretched
    virtual std::vector<detail::Stretched> most_stretched(const KernelFacts& kernel, int threads) = 0;
    /// Returns facts about the deformation gradient of a particle; none if the state has no member F.
    virtual std::optional<detail::GradientFacts<S, D>> gradient_of(std::size_t slot) const = 0;
    virtual std::span<const StateOutput> outputs() const = 0;  ///< Returns what states have besides the fields.
    /// Computes the outputs of a particle. \param time  the present time [s]
    /// \param to  memory for as many numbers as there are outputs
    virtual void output(std::size_t slot, double time, S* to) const = 0;
    virtual bool is_elastic() const = 0;  ///< Returns whether F alone is the state, and nothing yields.
    /// @}

    /// Returns the particles.
    const ParticleStore<S, D>& store() const { return const_cast<SetOf&>(*this).store(); }

    BlockPartition<D> partition{};     ///< Blocks into which the particles are sorted.
    std::vector<Body> bodies{};        ///< Bodies of this set, in the order of their ids.
    G2PReport report{};                ///< What the last G2P reported about the particles.
    Readiness readiness{};             ///< Which preparations for a step are done.
    std::optional<Moment> restored{};  ///< Moment to which the set was restored; empty after a step.
    bool material_edited = false;      ///< Whether the program has changed the material. \see SetAccess::edit_material
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
             const Share& share = {});
    /// Adds some of the samples of a body; other processes add the others.
    /// \param part  which of the samples become particles, and which part of the body the samples are
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity, int threads,
             const PartOfBody& part);

    /// Adds the points of a net as particles that have mass and no volume, to a set of NoStress.
    /// \param masses    mass of each point [kg]
    /// \param velocity  velocity of all points [m/s]
    /// \param threads   number of threads that will use the particles. \see Particles::reserve
    /// \throws parameter_error  if a mass, the velocity or a corner of a facet is out of range
    /// \throws particle_error   if a position is not finite or not in the domain; nothing is added in this case
    Body add(const Net<D>& net, std::span<const double> masses, const Vec<double, D>& velocity, int threads);

    /// Adds a source. If steps were already taken, bursts that were due at or before `now` are skipped.
    /// \see SetAccess::add_source
    void add(Source<D> source, const Moment& now);
    /// Adds a load. \see SetAccess::add_load
    /// \throws parameter_error  if the load's force is an empty function, or if `load.body` is not one of the bodies of
    ///                          this set
    /// \return the number of the load
    std::uint32_t add(Load<D> load);
    /// Removes a load. \see SetAccess::remove_load
    /// \throws parameter_error  if this set has no load of this number
    void remove_load(std::uint32_t number);
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
    std::size_t body_of(std::uint32_t id) const;

    /// Checks that a body belongs to this set.
    /// \throws parameter_error  if `body` has ids that were not yet given to particles of this set
    void check_body(const Body& body) const;

    /// Gives the sources, sinks, loads, forces and facets to a set that will take the place of this one. Its sources
    /// skip the bursts that were due at or before `moment`.
    void hand_over(SetOf& stored, const Moment& moment);

    /// Checks all positions, if particles were changed since the last check.
    /// \throws particle_error  if a position is not finite or not in the domain; the message names the first such
    ///                         particle
    void check_positions();

    /// Moves the particles of a body to the blocks of a contact group.
    void move_to_group(const Body& body, int group);
    /// Puts the particles of a body into a contact group. \see SetAccess::set_contact_group
    /// \throws parameter_error  if `body` is not one of the bodies of this set, if it has no particles, or if the group
    ///                          is out of range
    void set_contact_group(const Body& body, int group);

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
    void give(double time, int threads, const Share& share = {});
    /// Removes the particles whose way since push() meets a sink, and the particles of bodies whose `end` is at
    /// or before `time` [s].
    void take(double time);
    /// Returns whether take() will remove a particle.
    bool will_take(double time) const;
    /// Returns the time of the next burst of any source [s]; infinite if no burst follows.
    double next_burst() const;

    /// Adds the impulses of loads and forces over a step of `dt` [s] to the particles' velocities. If there are sinks,
    /// takes note of where the particles are.
    /// \throws particle_error  if a velocity is not finite afterwards; the message gives the lowest id of such a
    ///                         particle
    /// \param sums  receives what loads exert on the particles
    void push(const Moment& now, double dt, bool in_float, int threads, const detail::SumsOfSet<D>& sums);
    /// Lets loads and forces forget what they know of the particles, as these have moved to other slots.
    void forget_pushes();

private:
    static bool has_ended(const Body& body, double time) { return body.count > 0 && body.end <= time; }
    bool may_take(double time) const;
    bool takes(std::size_t slot, double time) const;
    /// Returns whether a sink is on the way between two positions [m]. `to` lies in the domain. If `from` does not, the
    /// particle has come through the ends of periodic axes.
    bool is_taken(const Vec<double, D>& from, const Vec<double, D>& to) const;

    /// \param masses  one for each position, or one for all [kg]
    Body add_all(const std::vector<Vec<double, D>>& x, const Vec<double, D>& velocity, S volume,
                 std::span<const S> masses, int threads, const PartOfBody& part);
};

/// The sets of a run, in the order of its materials. A copy has copies of the sets.
template <std::floating_point S, int D>
class SetList {
public:
    SetList() = default;
    /// Copies all sets.
    SetList(const SetList& other) {
        for (const SetOf<S, D>& set : other) sets_.push_back(set.copy());
    }
    SetList(SetList&&) noexcept = default;  ///< Takes the sets over.
    /// Takes the sets of `other` in place of its own.
    SetList& operator=(SetList other) noexcept {
        sets_ = std::move(other.sets_);
        return *this;
    }

    /// Adds a set at the end.
    void add(std::unique_ptr<SetOf<S, D>> set) { sets_.push_back(std::move(set)); }
    /// Returns the number of sets.
    std::size_t size() const { return sets_.size(); }
    /// Returns set k, from 0.
    SetOf<S, D>& operator[](std::size_t k) { return *sets_[k]; }
    /// Returns set k, from 0.
    const SetOf<S, D>& operator[](std::size_t k) const { return *sets_[k]; }

    /// Returns an iterator to the first set.
    auto begin() { return Iterator<SetOf<S, D>>{sets_.data()}; }
    /// Returns the end of the sets.
    auto end() { return Iterator<SetOf<S, D>>{sets_.data() + sets_.size()}; }
    /// Returns an iterator to the first set.
    auto begin() const { return Iterator<const SetOf<S, D>>{sets_.data()}; }
    /// Returns the end of the sets.
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

#if FIRN_HAS_BODIES
#include <firn/simulation/set_of-inl.hpp>
#endif
