/// \file Derivatives of a whole run, in reverse mode: of one number that the program measures, with respect to all that
/// it has set.
#pragma once

#include <firn/adjoint/bars.hpp>
#include <firn/adjoint/checkpoints.hpp>
#include <firn/adjoint/from_to.hpp>
#include <firn/adjoint/g2p.hpp>
#include <firn/adjoint/gradient.hpp>
#include <firn/adjoint/grid_update.hpp>
#include <firn/adjoint/jumps.hpp>
#include <firn/adjoint/load.hpp>
#include <firn/adjoint/measure.hpp>
#include <firn/adjoint/mirror.hpp>
#include <firn/adjoint/motion.hpp>
#include <firn/adjoint/on_disk.hpp>
#include <firn/adjoint/p2g.hpp>
#include <firn/adjoint/reaction.hpp>
#include <firn/adjoint/series.hpp>
#include <firn/adjoint/volume.hpp>
#include <firn/simulation.hpp>

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// What an Adjoint may use.
struct AdjointOptions {
    /// Memory for checkpoints [bytes]. Where sources make the states larger, fewer of them are kept. What sources will
    /// give is not known beforehand: if not even three states fit any more, the step throws a parameter_error.
    std::size_t memory = std::size_t(1) << 30;
    /// Folder for the checkpoints that have no room in memory; none if it is empty. They lie in a file without a name,
    /// whose room is free again when the program ends, however it ends.
    std::string folder{};
    /// How many bytes they may take there. A few KiB of each stay in memory, and count there.
    std::size_t disk = 0;
};

/// The derivative of a measure along a direction, by the gradient and by differences. \see Adjoint::check
struct DerivativeCheck {
    double gradient,  ///< the gradient times the direction
        forward,      ///< (L(h) − L(0))/h
        backward,     ///< (L(0) − L(−h))/h
        central;      ///< (L(h) − L(−h))/(2 h)
    /// number of particles that end in another cell at h than at −h, or are taken away at another step
    std::size_t other_cells;
};

/// Derivatives of a run of a simulation.
///
/// The program takes steps through the adjoint, says what it measures, and asks for the gradient:
///
///     firn::Adjoint adjoint(simulation, {.memory = std::size_t(1) << 30});
///     adjoint.advance(0.5);
///     const double height = adjoint.measure([](const auto& p) { return p.position[1] * p.mass; });
///     const auto gradient = adjoint.gradient();
///     gradient.set().velocity[id];  gradient.set().material.mu;  gradient.intervals[0].gravity;
///
/// The gradient is that of the steps that were taken: their sizes dt are held. Where a step has chosen a branch (matter
/// yields, or leaves a wall), it is the derivative of that branch.
///
/// A gradient does not see a jump. With MLS forces a step is smooth where a particle changes its cell: once
/// differentiable with the quadratic B-spline, twice with the cubic one. With weight gradients it has a kink at edges
/// of matter (cubic B-spline, compact quartic) or jumps there (quadratic B-spline). It jumps with Linear at every
/// crossing, and with ASFLIP where the divergence changes its sign: of these the program is warned. The layer of a
/// collider takes and leaves nodes in jumps, and a particle that is kept inside the domain has the derivative 0.
/// \see check
///
/// With little memory and many steps, a folder saves steps that would be taken again, if its disk is fast: each
/// checkpoint that is written is to take less time than the steps that it saves.
///
///     firn::Adjoint adjoint(simulation, {.memory = 1 << 28, .folder = "/scratch", .disk = std::size_t(1) << 36});
///
/// Between two calls the program may change gravity, the boundary, the transfer and the loads; each call begins an
/// interval. It must not change particles, nor add sources or sinks.
///
/// Particles that sources give and that sinks, or the end of their lifespan, take away are followed by their ids. The
/// gradient has the derivatives by what each had when it came in. When a particle comes or goes is held: the gradient
/// does not see that a change would let it pass a sink a step earlier. The derivatives by parameters of a source are
/// left out. As a particle comes in at its sample's position + age × velocity, that by the source's velocity is the sum
/// of velocity[id] + age × position[id] over its particles, where age is the time from when the burst was due to the
/// end of the step.
///
/// The way back needs the states before all steps. As many as fit into the memory are kept, and from them the steps
/// between are taken again, to the bit. \see Checkpoints
///
/// Refused by the compiler: fixed-point sums, many ranks, contact between groups, GapContact, VolumeFilter. Refused
/// when the Adjoint is made, with a usage_error: passes of the program; loads that are not made by
/// differentiable_load(), forces between particles; a boundary that moves by code of the program which is not a
/// template over the scalar.
template <class Simulation>
class Adjoint {
    static constexpr int D = Simulation::dimension;
    using S = typename Simulation::scalar_type;

public:
    /// Begins to record a run. The simulation must exist as long as this object.
    /// \throws usage_error      if the simulation has something that has no way back
    /// \throws parameter_error  if the memory is too small for two checkpoints; if a folder is given without room for
    ///                          two states, or room without a folder
    /// \throws io_error         if no file can be made in the folder
    /// \throws particle_error   if a particle has a value that is not finite or lies outside the domain
    explicit Adjoint(Simulation& simulation, const AdjointOptions& options = {});
    Adjoint(const Adjoint&) = delete;

    /// Advances the simulation, and records its steps. \see Simulation::advance
    /// \throws usage_error      if the simulation was changed in a way that has no way back
    /// \throws parameter_error  if states have become so large that three do not fit into the memory
    /// \throws io_error         if a checkpoint cannot be written to the folder. The last step is recorded, and the
    ///                          program can go on: with the checkpoints that there are, and no more
    /// @{
    void advance(double duration) { advance(duration, simulation_.gravity); }
    template <class Acceleration>
    void advance(double duration, const Acceleration& acceleration) {
        record(acceleration, [&] { simulation_.advance(duration, acceleration); });
    }
    /// @}
    /// Takes a step of the simulation, and records it. \see Simulation::step
    /// \throws usage_error, parameter_error, io_error  in the same cases as advance()
    /// @{
    void step() { step(simulation_.gravity); }
    template <class Acceleration>
    void step(const Acceleration& acceleration) {
        record(acceleration, [&] { simulation_.step(acceleration); });
    }
    /// @}

    /// Measures the present particles: adds Σ f(particle), over the particles of material I, to what is differentiated.
    /// \param f     f(particle) takes a MeasuredParticle of any scalar type, and returns this scalar
    /// \param body  only the particles of this body count; nullptr: all that are there
    /// \return the sum
    /// \throws usage_error      if the simulation was advanced or changed without the adjoint
    /// \throws parameter_error  if `body` is not one of the bodies of material I
    template <std::size_t I = 0, class Function>
    double measure(const Function& f, const Body* body = nullptr);

    /// Measures after every step from now on: adds Σ f(particle) each time. For an integral over time, let f contain
    /// the size of a step. \see measured
    /// \param f, body  as of measure()
    /// \throws usage_error      if the simulation was advanced or changed without the adjoint
    /// \throws parameter_error  if `body` is not one of the bodies of material I
    template <std::size_t I = 0, class Function>
    void measure_steps(const Function& f, const Body* body = nullptr);

    /// Adds a measure that the program has computed itself from the present particles of material I, by its
    /// derivatives: those by each particle's position [per m] and velocity [per m/s], in the order of ids. Those of ids
    /// whose particles are gone are not read.
    /// \throws usage_error      if the simulation was advanced or changed without the adjoint
    /// \throws parameter_error  if a list has neither 0 entries nor one for each id
    template <std::size_t I = 0>
    void measure_own(std::vector<Vec<double, D>> by_position, std::vector<Vec<double, D>> by_velocity);

    /// Measures what a part of the boundary exerted on matter in the last step: adds f(reaction). The simulation must
    /// have counted the reactions: let it have `reactions` before the step. Angular impulses about a part that moves
    /// need a point of the program's own, Reactions::about.
    /// \param part  index of the part, in the order of Reactions::parts
    /// \param f     f(reaction) takes a MeasuredReaction of any scalar type, and returns this scalar
    /// \return the value of f
    /// \throws usage_error      if the simulation was advanced or changed without the adjoint, or counts no reactions
    /// \throws parameter_error  if the boundary has no such part
    template <class Function>
    double measure_reaction(std::size_t part, const Function& f);

    /// Measures a reaction after every step from now on: adds f(reaction) each time. With the impulse itself, the sum
    /// is the impulse of all these steps. \see measure_reaction
    /// \throws usage_error  if the simulation was advanced or changed without the adjoint. A step throws what
    ///                      measure_reaction() throws
    template <class Function>
    void measure_reaction_steps(std::size_t part, const Function& f);

    /// Returns the sum of all measures so far, except those of measure_own(), whose values are not known.
    double measured() const { return measured_; }

    /// Returns the gradient of the sum of all measures. The simulation is as before the call.
    /// \throws usage_error     if nothing was measured
    /// \throws particle_error  if a derivative is not finite. The message names the step and the particle
    /// \throws io_error        if a checkpoint cannot be written to the folder, or is not read as it was written
    Gradient<Simulation> gradient();

    /// Compares a gradient with differences: takes the recorded steps again, of the recorded sizes, with all that has a
    /// derivative changed by ±h times the direction. If the forward and the backward difference disagree while the
    /// central one does not settle for smaller h, there is a kink or a jump. The simulation is as before the call.
    /// \param gradient   what gradient() has returned
    /// \param direction  of the same kind: for each number, how it changes, in its own unit; gradient.zero() is none
    /// \throws usage_error  if something was measured by measure_own(): its values are not known; or if the gradient or
    ///                      the direction is of other steps than those recorded so far
    /// \throws io_error     if a checkpoint cannot be written to the folder, or is not read as it was written
    DerivativeCheck check(const Gradient<Simulation>& gradient, const Gradient<Simulation>& direction, double h);

    /// Returns the number of recorded steps.
    std::size_t steps() const { return moments_.size() - 1; }
    /// Returns how many checkpoints fit into the memory and on disk: of states as large as the largest so far.
    std::size_t checkpoints() const { return kept_->most(); }
    /// Returns for each step how often gradient() has taken it again.
    const std::vector<std::uint32_t>& repetitions() const { return repetitions_; }

private:
    static constexpr bool can_go_back =
        std::same_as<decltype(Simulation::execution), Coloured> && !Simulation::has_contact_groups &&
        !acts_by_gap<decltype(Simulation::boundary)> && !filters_volume<decltype(Simulation::volume)> &&
        Simulation::integration_type::is_explicit;
    static_assert(
        can_go_back,
        "firn: an Adjoint goes back through explicit simulations that sum with Coloured, on one rank, without "
        "contact groups, GapContact and VolumeFilter.");

    using Boundary = decltype(Simulation::boundary);
    using Transfer = decltype(Simulation::transfer);
    using P = native_pack<S>;
    using T = traced<P>;
    using Kernel = typename Simulation::kernel_type;
    using Force = typename Simulation::force_type;
    using Volume = decltype(Simulation::volume);
    static constexpr bool blended = blends_velocities<Transfer>;

    /// What the nodes held after the P2G of a step: momenta and masses, and velocities before forces if the transfer
    /// needs them.
    struct Nodes {
        aligned_vector<S> momenta, before_forces;
        bool are_kept = false;
    };
    /// A state of the simulation, and the nodes of the step from it.
    struct Snapshot {
        std::vector<std::unique_ptr<SetOf<S, D>>> sets;
        Moment now;
        Boundary boundary;
        Nodes nodes{};
        typename detail::StatesOnDisk<S, D>::Place on_disk{};  // of the particles
    };
    /// How many checkpoints have room.
    struct Room {
        std::size_t in_memory, on_disk;
    };
    /// What was set for some steps.
    struct Interval {
        std::size_t first;  // its first step
        Vec<double, D> gravity;
        Boundary boundary;
        std::vector<bool> carried;  // which numbers of the boundary motion has changed, and the program has not
        Transfer transfer;
        // Takes a step of dt [s], with the acceleration changed by t times a direction.
        std::function<void(double dt, const typename Gradient<Simulation>::OfInterval* direction, double t)> step;
        std::function<void(std::size_t step, Interval&)> back;
        std::vector<double> of_acceleration, of_boundary, of_transfer;
        std::vector<std::string> names;
        bool is_uniform;
        detail::RecordedLoads<S, D> loads;
    };
    using Bars = detail::ParticleAdjoints<S, D>;
    /// Puts the simulation back as it was.
    struct Restored {
        Adjoint& of;
        const Snapshot& end;
        const Vec<double, D>& gravity;
        const Transfer& transfer;
        PassList<S, D> passes = of.simulation_.passes_;
        std::optional<Reactions<D>> reactions = std::exchange(of.simulation_.reactions, std::nullopt);
        ~Restored() {
            of.restore(end);
            of.simulation_.gravity = gravity;
            of.simulation_.transfer = transfer;
            of.simulation_.passes_ = std::move(passes);
            of.simulation_.reactions = std::move(reactions);
        }
    };
    struct Measure {
        std::size_t state;  // the state that it measures
        std::function<void()> add;
        std::function<double()> value;  // of the present particles; empty if it is not known
    };
    /// A set in which particles came or went in the step before a state, so that its stresses were computed anew.
    struct Change {
        std::size_t state, set;
    };

    template <class Acceleration, class Take>
    void record(const Acceleration& acceleration, const Take& take);
    template <class Acceleration>
    void begin_interval(const Acceleration& acceleration);
    void refuse_what_has_no_way_back() const;
    std::size_t count_sources_and_sinks() const;
    /// Returns how many checkpoints of states as large as the present one have room.
    /// \throws parameter_error  if there is no memory for two, and the state at the end
    Room room_for_checkpoints();
    /// Returns where checkpoints lie that have no room in memory.
    Elsewhere<Snapshot> elsewhere(const Room& room);
    /// Prepares the sets in which particles came or went for the next step. \return whether there are any
    bool prepare_again();
    /// Refuses a simulation that was changed since the last recorded step. \throws usage_error
    void require_as_left() const;
    void store(Snapshot& to) const;
    void store_moment(Snapshot& to) const;
    /// Keeps the present state: the next step leaves its particles in the snapshot, or they are copied.
    void keep_before_step(Snapshot& to);
    void restore(const Snapshot& from);
    void swap_with(Snapshot& from);
    void use(const Interval& interval);
    Interval& interval_of(std::size_t step);
    /// Sets what the program had set for a step.
    Interval& begin_step(std::size_t step);
    void move_boundary_back(std::size_t step, Interval& interval);
    void take_again(std::size_t step, Nodes* keep);
    void keep_nodes();
    /// Lets G2P leave the state before a step in a snapshot. \see keep_before_step
    void leave_states();
    void copy_nodes(const aligned_vector<S>& from, SparseGrid<S, D>& to) const;
    /// Returns the momenta and masses of the nodes before the grid update of the step that goes back.
    const aligned_vector<S>& momenta_before_update() const {
        return refines_velocities<Transfer> ? series_.refined : nodes_.momenta;
    }
    template <class Acceleration>
    void bring_nodes(double dt, const Acceleration& acceleration);
    /// Sorts the particles if the next step would, so that a state is kept sorted.
    void sort();
    void bring_state(std::size_t state);
    /// Brings the state before a state: takes the adjoints back through the stresses that were computed anew, and
    /// writes those of the particles that did not exist before.
    void bring_state_before(std::size_t state, Gradient<Simulation>& gradient);
    template <class Set>
    void stress_back(Set& set, std::size_t k);
    void back(std::size_t step);
    template <class Acceleration>
    void back_by(std::size_t step, const Acceleration& acceleration, Interval& interval);
    template <class Acceleration>
    void mirror_back(std::size_t step, const Acceleration& acceleration, const Mirrors& mirrors, Interval& interval);
    template <class Sets>
    void mirror_before_back(const Sets& sets, const Mirrors& mirrors);
    void series_back(const Mirrors& mirrors);
    void add_measures(std::size_t state);
    /// Returns the derivatives of the measures by the reactions in a step; nothing if none were measured.
    const std::vector<Reaction<D>>& by_reactions_of(std::size_t step) const;
    template <class Function>
    double add_reaction(std::size_t part, const Function& f);
    void note_norms(std::size_t state, Gradient<Simulation>& gradient);
    void fit_bars();
    /// Returns the arrays of the adjoints of a set's particles.
    template <class Set>
    static auto bars_of(Bars& bars) {
        return bars.template view<decltype(std::declval<Set&>().particles.view())>();
    }
    template <std::size_t I, class Add>
    auto adding(const Add& add);
    /// Returns a measure of the particles of a body. \see measure
    template <std::size_t I, class Function>
    Measure measure_of(const Function& f, const Body* body);
    /// \return the measure's value now; 0 if it is not known
    double add_measure(Measure measure);
    double value_along(const Gradient<Simulation>& direction, double t, std::vector<BlockCoordinate<D>>& cells);
    /// Changes the particles of ids from `first` on, one for each set, and prepares the sets.
    void shift_particles(const Gradient<Simulation>& direction, double t, const std::vector<std::uint32_t>& first);
    /// Notes for each id of the sets in which particles came or went which particles are gone for the first time.
    void note_gone(std::size_t state, std::vector<std::vector<std::size_t>>& gone) const;
    void make_room(Gradient<Simulation>& gradient);
    /// Writes the adjoints of particles. \param newcomers  only of those that do not exist in the present state
    void write_particles(Gradient<Simulation>& gradient, bool newcomers);
    void write(Gradient<Simulation>& gradient);

    Simulation& simulation_;
    std::size_t memory_;                                   // for checkpoints [bytes]
    std::unique_ptr<detail::StatesOnDisk<S, D>> on_disk_;  // none if there is no folder
    std::unique_ptr<Checkpoints<Snapshot>> kept_;
    std::vector<Moment> moments_;  // of each state
    std::vector<double> dts_;      // of each step
    Boundary left_;                // after the last step
    std::vector<Interval> intervals_;
    std::vector<Measure> measures_;
    std::vector<std::function<void()>> each_step_;                  // measures again
    std::map<std::size_t, std::vector<Reaction<D>>> by_reactions_;  // for a step: derivatives by those of each part
    std::vector<Change> changes_;
    std::size_t sources_and_sinks_;  // number of both, in all sets
    double measured_ = 0;
    std::vector<std::uint32_t> repetitions_;
    std::vector<Bars> bars_;
    std::vector<std::vector<double>> of_material_;
    std::size_t room_for_nodes_ = 0;  // for those of one checkpoint [bytes]
    Nodes nodes_;                     // of the step that goes back
    Nodes* keep_ = nullptr;           // receives the nodes of the step that is taken
    Snapshot* leave_ = nullptr;       // receives the particles before the step that is taken
    aligned_vector<S> momenta_before_;
    detail::VelocitiesBeforePush<S, D> before_push_;
    VolumeMemory<S> volume_memory_;
    detail::SeriesOfNodes<S> series_;  // of the step that goes back, if the transfer refines velocities
    SparseGrid<S, D> bar_grid_, bar_before_, before_walls_;
};

}  // namespace firn::inline FIRN_BUILD

#include <firn/adjoint/back-inl.hpp>
#include <firn/adjoint/check-inl.hpp>
#include <firn/adjoint/record-inl.hpp>
