/// \file What concerns the particles of one of a simulation's materials.
#pragma once

#include <firn/exec/totals.hpp>
#include <firn/simulation/material_set.hpp>

#include <type_traits>
#include <utility>

namespace firn {

/// What a handle to a set of particles offers; a simulation of one material is such a handle itself.
/// \tparam Self  has simulation(), mine(): the MaterialSet in it, and number_of_mine(): which that is
template <class Self, int D>
class SetAccess {
public:
    const auto& material() const { return self().mine().material; }
    const auto& particles() const { return self().mine().particles; }
    const std::vector<Body>& bodies() const { return self().mine().bodies; }
    /// The facets of the nets, by ids of particles. Some of those may have been taken out.
    const std::vector<Facet<D>>& facets() const { return self().mine().facets; }

    /// What the particles have in all, now.
    Totals<D> totals() const {
        const auto& simulation = self().simulation();
        using Kernel = typename std::remove_cvref_t<decltype(simulation)>::kernel_type;
        return firn::totals<Kernel>(particles(), simulation.domain(), material(),
                                    requested_threads(simulation.execution));
    }

    /// Particles for editing (velocities of a body, say). The next step looks at them anew.
    auto& edit_particles() {
        auto& set = self().mine();
        set.readiness.edit();
        return set.particles;
    }
    /// Changes the states of a body's particles: change(position [m], state of the material). The next step computes
    /// their stress anew.
    /// \throws parameter_error  if there is no such body
    template <class Change>
    void set_states(const Body& body, const Change& change) {
        self().mine().change_states(body, change);
    }

    /// Adds a body of uniform density [kg/m³; kg/m² in 2D] and velocity [m/s].
    /// \throws parameter_error, particle_error (nothing is added)
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        return self().simulation().add_to(self().number_of_mine(), samples, density, velocity);
    }
    template <int N, int M = D>
        requires(N != D || M != D)
    Body add(const Samples<N>&, double, const Vec<double, M>& = {}) {
        static_assert(N == D, "firn: these samples have another dimension than the simulation.");
        static_assert(M == D, "firn: this velocity has another dimension than the simulation.");
        return {};
    }
    /// Adds the points of a net, which carry mass [kg] and no volume, at one velocity [m/s]: to the material NoStress.
    /// \param masses  of each [kg]
    /// \throws parameter_error, particle_error (nothing is added)
    Body add(const Net<D>& net, std::span<const double> masses, const Vec<double, D>& velocity = {}) {
        return self().mine().add(net, masses, velocity, self().simulation().workers());
    }

    /// Forces between the particles of a body in every step from now on: springs, membranes, wind. As points they count
    /// from 0 in the order they were added, have no radius, and positions in S. Their stiffness bounds the time step.
    /// What joined particles that are taken out is gone with them.
    /// \return the force as it is kept: its parameters may be changed
    /// \throws parameter_error  if there is no such body
    /// \see element_forces.hpp
    template <class BetweenPoints>
    BetweenPoints& add_force(const Body& body, BetweenPoints force) {
        return self().mine().add_force(body, std::move(force));
    }
    /// Gives particles from now on; every burst is a body.
    /// \throws parameter_error  if a number is out of range
    void add_source(const Source<D>& source) {
        source.check();
        self().simulation().warn_of_spacing(source.samples);
        self().mine().add(source, self().simulation().moment());
    }
    /// Takes out, after every step, the particles that are in the sink.
    /// \throws parameter_error  if upper is below lower
    void add_sink(const Sink<D>& sink) {
        sink.check();
        self().mine().sinks.push_back(sink);
    }
    /// Pushes the particles of a body, in every step from now on: force(position [m], time [s]) on each [N], called
    /// from several threads at once.
    /// \throws parameter_error  if there is no such body, or the force is an empty function
    template <class OfParticle>
    void add_load(const Body& body, const OfParticle& force) {
        static_assert(
            detail::returns_numbers<OfParticle, Vec<double, D>, double>,
            "firn: this load returns an expression, which refers to values that are gone when it has returned. "
            "Give it a return type that holds the numbers: -> Eigen::Vector3d.");
        self().mine().add(Load<D>{body, force});
    }
    /// Takes out the particles for which wanted(position [m], id) says so. Ids of others stay.
    /// \return how many that were
    template <class Wanted>
    std::size_t remove_if(const Wanted& wanted) {
        return self().mine().remove_if(wanted);
    }

    /// The blocks that the particles are sorted into, ready for a step.
    const BlockPartition<D>& partition() {
        self().simulation().prepare();
        return self().mine().partition;
    }
    /// What the last G2P saw: the bound of the next step comes from it.
    const G2PReport& report() {
        self().simulation().prepare();
        return self().mine().report;
    }

private:
    Self& self() { return static_cast<Self&>(*this); }
    const Self& self() const { return static_cast<const Self&>(*this); }
};

/// One of a simulation's sets of particles. It names the simulation, which must outlive it and stay where it is.
template <class Simulation, std::size_t I>
class SetHandle : public SetAccess<SetHandle<Simulation, I>, Simulation::dimension> {
    using Access = SetAccess<SetHandle, Simulation::dimension>;
    friend Access;

public:
    explicit SetHandle(Simulation& simulation) : simulation_(&simulation) {}

    Simulation& simulation() const { return *simulation_; }

private:
    auto& mine() const { return simulation_->template set_at<I>(); }
    static constexpr std::size_t number_of_mine() { return I; }

    Simulation* simulation_;
};

}  // namespace firn
