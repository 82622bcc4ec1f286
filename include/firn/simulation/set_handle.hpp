/// \file Access to the particles of one material of a simulation.
#pragma once

#include <firn/exec/totals.hpp>
#include <firn/simulation/material_set.hpp>

#include <type_traits>
#include <utility>

namespace firn {

/// Access to a set of particles: adding, changing and reading them. SetHandle offers it, and a simulation with one
/// material does, too.
/// \tparam Self  has simulation(), mine() (its MaterialSet) and number_of_mine() (the place of its material)
template <class Self, int D>
class SetAccess {
public:
    const auto& material() const { return self().mine().material; }    ///< The constitutive model.
    const auto& particles() const { return self().mine().particles; }  ///< The particles.
    const std::vector<Body>& bodies() const {
        return self().mine().bodies;
    }  ///< The bodies, in the order of their ids.
    /// The facets of the nets, by ids of particles. Some of these particles may have been taken out.
    const std::vector<Facet<D>>& facets() const { return self().mine().facets; }

    /// Total mass, momenta and energies of the particles.
    Totals<D> totals() const {
        const auto& simulation = self().simulation();
        using Kernel = typename std::remove_cvref_t<decltype(simulation)>::kernel_type;
        return firn::totals<Kernel>(particles(), simulation.domain(), material(),
                                    requested_threads(simulation.execution));
    }

    /// The particles, to be changed: the velocities of a body, for example. The next step checks and sorts them again,
    /// and computes their stress.
    auto& edit_particles() {
        auto& set = self().mine();
        set.readiness.edit();
        return set.particles;
    }
    /// Changes the states of a body's particles. The next step computes their stress from the new states.
    /// \param change  change(position [m], state of the material), which may change the state
    /// \throws parameter_error  if there is no such body
    template <class Change>
    void set_states(const Body& body, const Change& change) {
        self().mine().change_states(body, change);
    }

    /// Adds a body of uniform density and velocity. \see sample_box, sample_mesh
    /// \param samples   positions [m] and the volume of a particle [m^D]
    /// \param density   [kg/m³; kg/m² in 2D]
    /// \param velocity  [m/s]
    /// \return the body: the ids of its particles
    /// \throws parameter_error  if the density, the volume or the velocity is out of range
    /// \throws particle_error   if a position is not finite or not in the domain. Nothing is added then.
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        return self().simulation().add_to(self().number_of_mine(), samples, density, velocity);
    }
    /// Does not compile: the samples or the velocity have another dimension.
    template <int N, int M = D>
        requires(N != D || M != D)
    Body add(const Samples<N>&, double, const Vec<double, M>& = {}) {
        static_assert(N == D, "firn: these samples have another dimension than the simulation.");
        static_assert(M == D, "firn: this velocity has another dimension than the simulation.");
        return {};
    }
    /// Adds the points of a net as particles that have mass and no volume. The material must be NoStress.
    /// \param masses    of each point [kg]
    /// \param velocity  of all points [m/s]
    /// \return the body: the ids of its particles, in the order of the points
    /// \throws parameter_error  if a mass, the velocity or a corner of a facet is out of range
    /// \throws particle_error   if a position is not finite or not in the domain. Nothing is added then.
    Body add(const Net<D>& net, std::span<const double> masses, const Vec<double, D>& velocity = {}) {
        return self().mine().add(net, masses, velocity, self().simulation().workers());
    }

    /// Adds a force between the particles of a body, which acts in every following step: springs, membranes, wind.
    ///
    /// The force sees the particles as points, numbered from 0 in the order in which they were added, without a radius
    /// and with positions in S. Its stiffness bounds the time step. If a particle is taken out, the springs and
    /// elements at it go, too.
    /// \return the stored force; its parameters may be changed
    /// \throws parameter_error  if there is no such body
    /// \see element_forces.hpp
    template <class BetweenPoints>
    BetweenPoints& add_force(const Body& body, BetweenPoints force) {
        return self().mine().add_force(body, std::move(force));
    }
    /// Adds a source, which gives particles during the following steps. Each burst is a body.
    /// \throws parameter_error  if a number of the source is out of range
    void add_source(const Source<D>& source) {
        source.check();
        self().simulation().warn_of_spacing(source.samples);
        self().mine().add(source, self().simulation().moment());
    }
    /// Adds a sink, which takes out the particles in its box after every step.
    /// \throws parameter_error  if upper is below lower
    void add_sink(const Sink<D>& sink) {
        sink.check();
        self().mine().sinks.push_back(sink);
    }
    /// Adds a load, which pushes the particles of a body in every following step.
    /// \param force  force(position [m], time [s]) on one particle [N]. Several threads call it at the same time.
    /// \throws parameter_error  if there is no such body, or the force is an empty function
    template <class OfParticle>
    void add_load(const Body& body, const OfParticle& force) {
        static_assert(
            detail::returns_numbers<OfParticle, Vec<double, D>, double>,
            "firn: this load returns an expression, which refers to values that are gone when it has returned. "
            "Give it a return type that holds the numbers: -> Eigen::Vector3d.");
        self().mine().add(Load<D>{body, force});
    }
    /// Takes out the particles for which wanted(position [m], id) is true. The other particles keep their ids.
    /// \return the number of particles taken out
    template <class Wanted>
    std::size_t remove_if(const Wanted& wanted) {
        return self().mine().remove_if(wanted);
    }

    /// The blocks that the particles are sorted into. Prepares the particles for a step first.
    /// \throws particle_error  as Simulation::stable_time_step()
    const BlockPartition<D>& partition() {
        self().simulation().prepare();
        return self().mine().partition;
    }
    /// The report of the last G2P, which sets the bound of the next step. Prepares the particles for a step first.
    /// \throws particle_error  as Simulation::stable_time_step()
    const G2PReport& report() {
        self().simulation().prepare();
        return self().mine().report;
    }

private:
    Self& self() { return static_cast<Self&>(*this); }
    const Self& self() const { return static_cast<const Self&>(*this); }
};

/// A handle to one set of particles of a simulation. It refers to the simulation, which must outlive it and must not
/// be moved.
/// \tparam I  the place of the material
template <class Simulation, std::size_t I>
class SetHandle : public SetAccess<SetHandle<Simulation, I>, Simulation::dimension> {
    using Access = SetAccess<SetHandle, Simulation::dimension>;
    friend Access;

public:
    /// A handle to a set of this simulation. \see Simulation::set
    explicit SetHandle(Simulation& simulation) : simulation_(&simulation) {}

    Simulation& simulation() const { return *simulation_; }  ///< The simulation.

private:
    auto& mine() const { return simulation_->template set_at<I>(); }
    static constexpr std::size_t number_of_mine() { return I; }

    Simulation* simulation_;
};

}  // namespace firn
