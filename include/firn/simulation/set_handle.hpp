/// \file Access to the particles of one material of a simulation.
#pragma once

#include <firn/loops/totals.hpp>
#include <firn/simulation/material_set.hpp>

#include <type_traits>
#include <utility>

namespace firn::inline FIRN_BUILD {

namespace detail {
/// What a program may mean by `add(samples, {.density = 1000})`.
template <int D>
struct NamedDensity {
    double density;
    Vec<double, D> velocity{};
};
}  // namespace detail

/// The functions that add, change and read the particles of one material. They are members of SetHandle and of a
/// simulation with one material.
/// \tparam Self  the derived class, with simulation(), mine() (the MaterialSet) and number_of_mine() (the index of the
///               material in the list of materials)
template <class Self, int D>
class SetAccess {
public:
    const auto& material() const { return self().mine().material; }    ///< Returns the constitutive model.
    const auto& particles() const { return self().mine().particles; }  ///< Returns the particles of this material.
    const std::vector<Body>& bodies() const {
        return self().mine().bodies;
    }  ///< Returns the bodies of this material, in the order of their ids.
    /// Returns the facets of the nets. The corners of a facet are ids of particles; some of these particles may have
    /// been removed.
    const std::vector<Facet<D>>& facets() const { return self().mine().facets; }
    /// Returns the sources that add particles to this particle set, in the order in which they were added.
    const std::vector<Source<D>>& sources() const { return self().mine().sources; }
    /// Returns the sinks that remove particles of this particle set, in the order in which they were added.
    const std::vector<Sink<D>>& sinks() const { return self().mine().sinks; }

    /// Returns the total mass, momenta and energies of the particles. \see Totals
    Totals<D> totals() const {
        const auto& simulation = self().simulation();
        using Kernel = typename std::remove_cvref_t<decltype(simulation)>::kernel_type;
        return detail::totals_of_ranks<Kernel>(simulation.execution, particles(), simulation.domain(), material());
    }

    /// Returns the particles, so that the program can change them, for example the velocities of a body. The next step
    /// checks and sorts the particles again, and computes their stresses.
    auto& edit_particles() {
        auto& set = self().mine();
        set.readiness.edit();
        return set.particles;
    }
    /// Changes the material states of a body's particles. The next step computes the stresses from the new states.
    /// \param change  called as change(position [m], state) for each particle of the body; it may modify `state`
    /// \throws parameter_error  if `body` is not one of the bodies of this particle set
    template <class Change>
    void set_states(const Body& body, const Change& change) {
        self().mine().change_states(body, change);
    }

    /// Changes parameters of the material during a run, for example its strength. The stresses of all particles and the
    /// bound of the time step follow before the next step. States store the parameters, and restore() takes them from a
    /// state that was written after such a change.
    ///
    ///     simulation.edit_material([&](auto& clay) { clay.cohesion = peak / factor; });
    ///
    /// What particles have of their own (PerParticle) is part of their states. \see set_states
    /// \param change  called as change(material); it may modify `material`
    /// \throws parameter_error  as check_material(), if a parameter is out of range; nothing is changed in this case
    template <class Change>
    void edit_material(const Change& change) {
        auto& set = self().mine();
        auto edited = set.material;
        change(edited);
        check_material<D>(edited);
        set.material = edited;
        set.material_edited = true;
        set.readiness.edit();
    }

    /// Adds a body of uniform density and velocity, with one particle for each sample. \see sample_box, sample_mesh
    /// \param samples   positions of the particles [m], and the volume of each particle [m^D]
    /// \param density   density of the body [kg/m³]
    /// \param velocity  velocity of the body [m/s]
    /// \return the body, which holds the ids of its particles
    /// \throws parameter_error  if the density, the volume of a particle or the velocity is out of range
    /// \throws particle_error   if a position is not finite or not in the domain; nothing is added in this case
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        return self().simulation().add_to(self().number_of_mine(), samples, density, velocity);
    }
    /// This overload does not compile: the compiler prints a message that the samples or the velocity do not have the
    /// dimension of the simulation.
    template <int N, int M = D>
        requires(N != D || M != D)
    Body add(const Samples<N>&, double, const Vec<double, M>& = {}) {
        static_assert(N == D, "firn: these samples have another dimension than the simulation.");
        static_assert(M == D, "firn: this velocity has another dimension than the simulation.");
        return {};
    }
    /// This overload does not compile: the compiler prints a message that the density is a number.
    template <class T = void>
    Body add(const Samples<D>&, const detail::NamedDensity<D>&) {
        static_assert(!std::same_as<T, void>,
                      "firn: the density of a body is the second argument, a number [kg/m^3], and the velocity [m/s] "
                      "the third: simulation.add(samples, 1000, {0, -2}).");
        return {};
    }
    /// Adds a body of which this process has only a part of the samples, for runs on many ranks: the body has `count`
    /// particles, of which the samples are those from `before` on. Other ranks add the others. \see mpi::add
    /// \param before  number of particles of the body before the first sample
    /// \param count   number of particles of the whole body; the same on all ranks
    /// \return the whole body
    /// \throws parameter_error  if the samples reach beyond `count`, or a number is out of range as for add()
    /// \throws particle_error   if a position is not finite or not in the domain
    Body add_part(const Samples<D>& samples, std::size_t before, std::size_t count, double density,
                  const Vec<double, D>& velocity = {}) {
        const std::size_t n = samples.positions.size();
        if (before > count || n > count - before)
            throw parameter_error(sentence("A part of ", n, " particles from particle ", before,
                                           " on reaches beyond a body of ", count, " particles."));
        return self().mine().add(samples, density, velocity, self().simulation().workers(), {0, n, before, count});
    }
    /// Adds the points of a net as particles that have mass and no volume. The material must be NoStress.
    /// \param masses    mass of each point [kg]
    /// \param velocity  velocity of all points [m/s]
    /// \return the body, which holds the ids of its particles; the ids are in the order of the net's points
    /// \throws parameter_error  if a mass, the velocity or a corner of a facet is out of range
    /// \throws particle_error   if a position is not finite or not in the domain; nothing is added in this case
    Body add(const Net<D>& net, std::span<const double> masses, const Vec<double, D>& velocity = {}) {
        using Material = std::remove_cvref_t<decltype(material())>;
        static_assert(std::same_as<Material, NoStress<material_scalar_t<Material>>>,
                      "firn: the points of a net carry mass only; add them to the material NoStress.");
        require_one_rank();
        return self().mine().add(net, masses, velocity, self().simulation().workers());
    }

    /// Adds a force between the particles of a body, for example springs, membranes or wind. The force acts in every
    /// following step.
    ///
    /// The force acts between points. The points are the particles of the body, numbered from 0 in the order in which
    /// the particles were added. The radius of each point is 0, and the positions have the precision of the simulation.
    /// The stiffness of the force limits the time step. If a particle is removed, the springs and elements at this
    /// particle are removed, too.
    /// \return a reference to the stored force, through which its parameters may be changed
    /// \throws parameter_error  if `body` is not one of the bodies of this particle set, or if the force has springs
    ///                          with a tear factor: on a grid, springs do not tear
    /// \see element_forces.hpp
    template <class BetweenPoints>
    BetweenPoints& add_force(const Body& body, BetweenPoints force) {
        require_one_rank();
        return self().mine().add_force(body, std::move(force));
    }
    /// Puts a body into a contact group. Bodies of different groups meet by the simulation's contact law; bodies of one
    /// group share one field of velocities. All bodies are in group 0 at first. Of a source, set the member
    /// `contact_group`.
    /// \param group  number of the group. The larger the domain, the fewer groups it can have: about 10⁶ divided by the
    ///               number of its blocks of 4 cells along axis 0
    /// \throws parameter_error  if `body` is not one of the bodies of this particle set, if it has no particles, or if
    ///                          the group is out of range
    void set_contact_group(const Body& body, int group) {
        require_groups();
        self().mine().set_contact_group(body, group);
    }
    /// Puts all bodies of this particle set into a contact group. \see set_contact_group(const Body&, int)
    void set_contact_group(int group) {
        require_groups();
        auto& set = self().mine();
        set.set_contact_group(Body{0, set.particles.next_id()}, group);
    }
    /// Adds a source, which adds particles during the following steps. Each burst is a body.
    /// \throws parameter_error  if the source has no particles, or one of its parameters is out of range
    void add_source(const Source<D>& source) {
        source.check();
        self().simulation().warn_of_spacing(source.samples);
        self().mine().add(source, self().simulation().moment());
    }
    /// Adds a sink, which removes the particles that are in its box at the end of a step, or have come through it
    /// during the step.
    /// \throws parameter_error  if `upper` is below `lower` along an axis
    void add_sink(const Sink<D>& sink) {
        sink.check();
        self().mine().sinks.push_back(sink);
    }
    /// Adds a load: a force on each particle of a body, in every following step.
    /// \param force  force(position [m], time [s]) returns the force on one particle [N]. Several threads call this
    ///               function at the same time.
    /// \return the name of the load, for remove_load() and Reactions::of()
    /// \throws parameter_error  if `body` is not one of the bodies of this particle set, or if the force is an empty
    ///                          function
    template <class OfParticle>
    LoadId add_load(const Body& body, const OfParticle& force) {
        static_assert(
            detail::returns_numbers<OfParticle, Vec<double, D>, double>,
            "firn: this load returns an expression, which refers to values that are gone when it has returned. "
            "Give it a return type that holds the numbers: -> Eigen::Vector3d.");
        constexpr bool is_force = std::is_constructible_v<decltype(Load<D>::force), const OfParticle&>;
        static_assert(
            is_force,
            "firn: a load is a function of a position [m] and the time [s] that returns a force [N]: [](const "
            "firn::Vec<double, 2>& x, double time) { return firn::Vec<double, 2>{…}; }.");
        LoadId id{std::uint32_t(self().number_of_mine())};
        if constexpr (is_force) id.number = self().mine().add(Load<D>{body, force});
        return id;
    }
    /// Removes a load, which acts no more from the next step on.
    /// \throws parameter_error  if `load` is not one of the loads of this particle set
    void remove_load(const LoadId& load) {
        if (load.material != self().number_of_mine())
            throw parameter_error(sentence("Load ", load.number, " is one of material ", load.material,
                                           ", not of material ", self().number_of_mine(),
                                           ". Remove it from the set to which it was added."));
        self().mine().remove_load(load.number);
    }
    /// Removes the particles for which wanted(position [m], id) returns true. The other particles keep their ids.
    /// \return the number of removed particles
    template <class Wanted>
    std::size_t remove_if(const Wanted& wanted) {
        const std::size_t removed = self().simulation().ranks().sum(self().mine().remove_if(wanted));
        if (removed > 0) self().mine().readiness.unprepare();
        return removed;
    }

    /// Returns the blocks into which the particles are sorted. If the particles are not prepared for a step, sorts them
    /// and computes their stresses first.
    /// \throws particle_error  in the same cases as Simulation::stable_time_step()
    const BlockPartition<D>& partition() {
        self().simulation().prepare();
        return self().mine().partition;
    }
    /// Returns the report of the last G2P, from which the bound of the next time step is computed. If the particles are
    /// not prepared for a step, sorts them and computes their stresses and the report first.
    /// \throws particle_error  in the same cases as Simulation::stable_time_step()
    const G2PReport& report() {
        self().simulation().prepare();
        return self().mine().report;
    }

private:
    void require_groups() const {
        static_assert(std::remove_cvref_t<decltype(self().simulation())>::has_contact_groups,
                      "firn: this simulation has no contact groups. Give it a contact law: "
                      "firn::Simulation simulation(domain, material, firn::CoulombContact{.friction = 0.3}).");
    }
    void require_one_rank() const {
        static_assert(has_one_rank<std::remove_cvref_t<decltype(self().simulation().execution)>>,
                      "firn: nets, and forces between the particles of a body, cannot be distributed over several "
                      "processes. Use an execution without firn::mpi for them.");
    }
    Self& self() { return static_cast<Self&>(*this); }
    const Self& self() const { return static_cast<const Self&>(*this); }
};

/// A handle to the particles of one material of a simulation. The handle refers to the simulation, which must exist as
/// long as the handle and must not be moved.
/// \tparam I  the index of the material in the list of materials
template <class Simulation, std::size_t I>
class SetHandle : public SetAccess<SetHandle<Simulation, I>, Simulation::dimension> {
    using Access = SetAccess<SetHandle, Simulation::dimension>;
    friend Access;

public:
    /// Makes a handle to the particles of material I of this simulation. \see Simulation::set
    explicit SetHandle(Simulation& simulation) : simulation_(&simulation) {}

    Simulation& simulation() const { return *simulation_; }  ///< Returns the simulation of this handle.

private:
    auto& mine() const { return simulation_->template set_at<I>(); }
    static constexpr std::size_t number_of_mine() { return I; }

    Simulation* simulation_;
};

}  // namespace firn::inline FIRN_BUILD
