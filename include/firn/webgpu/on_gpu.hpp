/// \file Runs the steps of a Simulation on a GPU.
///
///     firn::Simulation simulation(domain, material, walls, firn::FixedPoint<std::int32_t>{.float_steps = true});
///     simulation.add(…);
///     auto gpu = firn::webgpu::on_gpu(simulation);
///     gpu.advance(0.02);
///     firn::write_state("state.h5", firn::state_of(gpu));
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/simulation.hpp>
#include <firn/simulation/require_gpu.hpp>
#include <firn/webgpu/acceleration_on_device.hpp>
#include <firn/webgpu/check_for_gpu.hpp>
#include <firn/webgpu/failed_particle.hpp>
#include <firn/webgpu/from_corner.hpp>
#include <firn/webgpu/reactions_on_device.hpp>
#include <firn/webgpu/set_on_device.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu {

/// A simulation whose steps a GPU takes. Make one with on_gpu().
///
/// The numbers of particles have the bits of the same steps on the CPU if neither contracts products and sums, nor
/// divides otherwise than IEEE 754 says: the program on the CPU is compiled with `-ffp-contract=off`, and the device is
/// known to do so. What other devices do is in benchmarks/README.md. A zero may have another sign, and numbers below
/// 1.2e-38 may be 0.
///
/// Steps run while the program goes on; a function that returns numbers of particles waits for them. Particles are
/// copied to the CPU only for such a function.
template <class Simulation>
class OnGpu {
    static_assert(firn::detail::require_gpu<Simulation>());
    static constexpr int D = Simulation::dimension;
    static constexpr float longest_step = std::numeric_limits<float>::max();    // [s]
    static constexpr double endless = std::numeric_limits<double>::infinity();  // [s]
    using Transfer = decltype(std::declval<Simulation&>().transfer);
    using Boundary = decltype(std::declval<Simulation&>().boundary);

public:
    /// Takes a simulation to a GPU. \see on_gpu
    OnGpu(Simulation simulation, const Device& device)
        : simulation_(std::move(simulation)), device_(device), boundary_seen_(simulation_.boundary) {
        use(simulation_.gravity);
        upload();
    }

    /// Takes one step under gravity. The time step is Simulation::fixed_time_step or, if that is 0, the bound.
    /// \throws parameter_error  if a parameter of a policy is out of range; if the time step is not fixed nor chosen
    ///                          in float, see FixedPoint::float_steps; or if particles reach more blocks of nodes than
    ///                          a buffer can hold: the run is at the last step before, then
    /// \throws usage_error      if the simulation has something that the GPU cannot do, which is named
    /// \throws particle_error, overflow_error  as Simulation::step(), at the latest 256 steps later or when numbers of
    ///                                         particles are asked for
    /// \throws device_error     if the device was lost, or has not enough memory
    void step() { take_steps(simulation_.gravity, endless, simulation_.steps() + 1); }
    /// Takes one step with this acceleration in place of Simulation::gravity. An acceleration of another type needs
    /// another program: the particles go to the CPU and back, then. One with other parameters waits for the steps
    /// before.
    /// \param acceleration  a vector [m/s²] or a field, as for Simulation::step(), with the parameters that it has now.
    ///                      What its type does not list in parameters() is part of the program, and so is a function
    ///                      without captures.
    /// \throws parameter_error, usage_error, particle_error, overflow_error, device_error  in the same cases as step()
    template <class Acceleration = Vec<double, D>>
    void step(const Acceleration& acceleration) {
        take_steps(acceleration, endless, simulation_.steps() + 1);
    }
    /// Takes steps until `duration` [s] has passed. The last step is shortened to end at that time. Waits for them.
    /// \throws parameter_error  if the duration is negative or not finite
    /// \throws parameter_error, usage_error, particle_error, overflow_error, device_error  in the same cases as step()
    void advance(double duration) { advance(duration, simulation_.gravity); }
    /// Takes steps until `duration` [s] has passed, with this acceleration in place of Simulation::gravity. Waits for
    /// them.
    /// \param acceleration  a vector [m/s²] or a field, as for step()
    template <class Acceleration = Vec<double, D>>
    void advance(double duration, const Acceleration& acceleration) {
        firn::detail::check_duration(duration);
        take_steps(acceleration, duration, std::numeric_limits<std::uint64_t>::max());
        check();
    }

    /// Takes `count` steps of Simulation::fixed_time_step, which `run` gives to the device as Host::run() does. Waits
    /// for them. \see time_passes
    /// \param run  called with a sequence of entry points and how many times to run it; it throws nothing but errors of
    ///             the device
    /// \throws usage_error  if the time step is not fixed
    /// \throws parameter_error, usage_error, particle_error, overflow_error, device_error  in the same cases as step()
    template <class Run>
    void step_by(std::uint64_t count, const Run& run) {
        if (!(simulation_.fixed_time_step > 0))
            throw usage_error("Only steps of a fixed_time_step can be given to the device by something else.");
        run_ = std::ref(run);
        const struct Restore {
            OnGpu& gpu;
            ~Restore() { gpu.run_ = as_usual; }
        } restore{*this};
        take_steps(simulation_.gravity, endless, simulation_.steps() + count);
        check();
    }

    double time() const { return simulation_.time(); }                      ///< Time that the run has reached [s].
    std::uint64_t steps() const { return simulation_.steps(); }             ///< Number of steps so far.
    double last_time_step() const { return simulation_.last_time_step(); }  ///< Size of the last step [s].
    Moment moment() const { return simulation_.moment(); }                  ///< Time and number of steps so far.
    const Device& device() const { return device_; }                        ///< Returns the device.
    /// Returns for how many blocks of 4^D nodes the device has memory; 0 if it has all nodes of the domain. Memory for
    /// more blocks is made when particles reach them.
    std::size_t blocks() const { return is_sparse_ ? blocks_ : 0; }

    /// Returns the bound of the time step [s] for the present particles. \see Simulation::stable_time_step
    double stable_time_step() { return stable_time_step(simulation_.gravity); }
    /// Returns the bound with this acceleration in place of Simulation::gravity. After a step without a field, a field
    /// needs the particles on the CPU. \see Simulation::stable_time_step
    template <class Acceleration = Vec<double, D>>
    double stable_time_step(const Acceleration& acceleration) {
        check();
        if (!(simulation_.bound_.field_at_nodes >= 0) && !firn::detail::is_uniform<Acceleration>) bring_back();
        return simulation_.stable_time_step(acceleration);
    }
    /// Returns the report of the last G2P, of the only material. \see SetAccess::report
    const G2PReport& report() {
        check();
        return simulation_.report();
    }
    /// Returns the totals of the particles of the only material: mass, momentum, energies. \see SetAccess::totals
    Totals<D> totals() { return simulation().totals(); }

    /// Returns the impulses of the boundary and of loads on matter in the last step, which Simulation::reactions asks
    /// for; particles stay on the device. They are sums of integers: the same from run to run, and but for rounding the
    /// CPU's.
    /// \throws usage_error  if Simulation::reactions holds no value
    /// \throws parameter_error, usage_error, particle_error, overflow_error, device_error  in the same cases as step()
    const Reactions<D>& reactions() {
        check();
        if (!simulation_.reactions)
            throw usage_error("There are no reactions: call edit().reactions.emplace() before the step.");
        read_reactions();
        return *simulation_.reactions;
    }

    /// Returns the simulation on the CPU, with the present particles. A copy of it goes on without the GPU.
    const Simulation& simulation() {
        bring_back();
        return simulation_;
    }
    /// Returns the simulation on the CPU, with the present particles, to change it: its policies, its particles, or all
    /// by restore(). The next step takes it to the GPU again. After a step that failed, particles cannot be used until
    /// they are restored.
    Simulation& edit() {
        if (!has_failed_) bring_back();
        is_edited_ = true;
        return simulation_;
    }

    /// Returns the current state of the only material, or writes it to one that is given. \see firn::state_of
    template <class... State>
    auto state(State&... into) {
        bring_back();
        return state_of(simulation_, into...);
    }
    /// Returns the current state of one of several materials, or writes it to one that is given: `gpu.state_of_set<
    /// Snow<float>>()`.
    template <class Material, class... State>
    auto state_of_set(State&... into) {
        bring_back();
        return state_of(simulation_.template set<Material>(), into...);
    }

private:
    static void as_usual(const Host::Sequence& step, int times) { Host::run(step, times); }

    Host& grid() { return *sets_[0].chunks[0].host; }  // which has the buffers of the grid

    /// Takes the simulation to the device.
    /// \param may_differ  whether policies may be others than those of the last time, for which the programs were made
    void upload(bool may_differ = true) {
        const bool can_be_sparse = detail::can_be_sparse(simulation_);
        detail::check_for_gpu<D>(simulation_, can_be_sparse);
        simulation_.prepare();
        sets_.resize(Simulation::material_count);
        blocks_ = std::max({blocks_, simulation_.grid().block_count(), std::size_t{1}});
        is_sparse_ = can_be_sparse && (is_periodic(simulation_.domain()) ||
                                       detail::has_many_empty_blocks(simulation_, blocks_, device_.limits()));
        const auto grid_storage = is_sparse_ ? wgsl::GridStorage::sparse : wgsl::GridStorage::dense;
        simulation_.for_materials([&](const auto& set, std::size_t k) {
            if (may_differ || sets_[k].program.options.grid != grid_storage)
                sets_[k].program = acceleration_.make_program(
                    simulation_, k, detail::options_of_set(simulation_, k, grid_storage, device_.arithmetic()));
            upload(set, k);
        });
        step_ = detail::step_of_sets(sets_, device_.sums_by_block());
        std::vector<G2PReport> reports;
        for (const auto& set : simulation_.sets()) reports.push_back(set.report);
        grid().begin(simulation_.steps(), reports, simulation_.time());
        begin_reactions();
        boundary_.clear();
        forces_.clear();
        boundary_seen_ = simulation_.boundary;
        moments_.clear();
        time_step_ = 0;
        counted_ = 0;
        is_edited_ = has_failed_ = is_ahead_ = is_given_ = false;
        is_fresh_ = true;
    }

    /// Takes set k of particles to the device.
    template <class Set>
    void upload(const Set& set, std::size_t k) {
        const auto set_uniforms = [&](wgsl::Inputs& inputs) {
            inputs.set("set_number", {double(k)});
            inputs.set("momentum_scale", {simulation_.execution.momentum_scale.value_or(0)});
            inputs.set("mass_scale", {simulation_.execution.mass_scale.value_or(0)});
            detail::set_load_reactions(inputs, sets_[k].program, simulation_.domain(), simulation_.reactions);
        };
        sets_[k].take(device_, simulation_.domain(), detail::domain_from_corner<Boundary>(simulation_.domain()), set,
                      simulation_.fixed_time_step, blocks_, set_uniforms, k > 0 ? &grid() : nullptr);
    }

    /// Lets the steps that follow have an acceleration.
    template <class Acceleration>
    void use(const Acceleration& acceleration) {
        firn::detail::check_acceleration<D>(acceleration);
        const bool is_other = !acceleration_.template is_a<Acceleration>();
        if (!is_other && acceleration_.numbers == detail::numbers_of(acceleration)) return;
        check();  // may take steps again, which had the acceleration before
        if (is_other && is_ahead_ && !has_failed_) bring_particles_back();
        is_edited_ = is_edited_ || is_other;
        acceleration_ = {acceleration, [acceleration](Simulation& of) { return of.find_bound(acceleration); }};
        is_given_ = false;
        time_step_ = 0;
        if (!is_edited_ && acceleration_.size >= 0) grid().set_acceleration(float(acceleration_.size));
    }
    /// Gives the parameters of the acceleration to the device.
    void set_acceleration() {
        if (!std::exchange(is_given_, true)) acceleration_.give(simulation_, grid());
    }

    /// Takes steps until `duration` [s] has passed, or until the number of steps is `last_step`.
    template <class Acceleration>
    void take_steps(const Acceleration& acceleration, double duration, std::uint64_t last_step) {
        if constexpr (firn::detail::require_acceleration<Acceleration, native_pack<float>, D>() &&
                      firn::detail::require_gpu_acceleration<Acceleration, D>()) {
            const auto& own = firn::detail::own_acceleration<D>(acceleration);
            use(own);
            simulation_.warnings_.of_gravity(own, simulation_.gravity, simulation_.warn, true);
            take_steps(duration, last_step);
        }
    }
    void take_steps(double duration, std::uint64_t last_step) {
        if (is_edited_) upload();
        if (has_failed_) simulation_.prepare();  // throws
        if (!is_ahead_) warn();
        grid().set_time(simulation_.time());
        if (simulation_.fixed_time_step > 0)
            take_fixed_steps(duration, last_step);
        else
            take_bounded_steps(duration, last_step);
    }

    void take_fixed_steps(double duration, std::uint64_t last_step) {
        firn::detail::StepsTo steps(simulation_.time(), duration, false);
        while (!steps.arrived(simulation_.time()) && simulation_.steps() != last_step) {
            steps.next(simulation_.now_.time, simulation_.fixed_time_step, [&](double dt) { take_fixed_step(dt); });
            if (waiting_ == Host::in_one_submission) submit();
            if (moments_.size() == std::size_t{Host::between_checks}) check();
        }
        submit();
    }
    void take_fixed_step(double dt) {
        simulation_.check_time_step(dt, simulation_.ranks(), simulation_.workers());
        // Where the device has stopped, its reports would no longer tell whether a particle has left its block.
        if (simulation_.is_sort_due_by_count()) check();
        if (dt != time_step_ || has_moved() || forces_of_loads() != forces_ || simulation_.is_sort_due_by_count()) {
            submit();
            set_boundary();
            set_forces();
            set_acceleration();
            grid().set("time_step", {time_step_ = dt});
            sort_if_due();
        }
        ++waiting_;
        move_on(dt);
        if (is_event_due()) end_events();
    }

    /// Takes steps at their bound, which the device chooses. The CPU finds the bound of the first step after the
    /// particles came to the device, and of those that come near a burst of a source or the end of a body.
    void take_bounded_steps(double duration, std::uint64_t last_step) {
        constexpr double long_enough = 1e30;  // [s]
        const double end = simulation_.time() + duration;
        if (!(end > simulation_.time())) return;
        check();
        auto advance = std::make_unique<Host::Advance>(step_, std::min(duration, long_enough));
        const auto renew = [&](const auto& change) {
            const TimeLeft<float> left = advance->left();
            advance.reset();  // before its Hosts go
            change();
            advance = std::make_unique<Host::Advance>(step_, left);
        };
        bool has_paused = false;
        for (float dt = 0; !advance->arrived() && simulation_.steps() != last_step;) {
            set_boundary();
            set_forces();
            set_acceleration();
            sort_if_due();
            const bool by_cpu = has_paused || is_fresh_ || !forces_.empty();
            const double left_then =
                advance->status().time_left - (detail::next_event(simulation_.sets()) - simulation_.time());
            const float least = by_cpu || !(left_then > 0) ? 0 : float(left_then * (1 + 1e-6));
            advance->take_until(least);
            advance->bound(by_cpu ? float(std::min<double>(acceleration_.find_bound(simulation_), longest_step))
                                  : longest_step);
            const std::vector<float> taken = advance->take(by_cpu ? 1 : most_steps(advance->wanted(dt), last_step));
            for (const float step : taken) move_on(double(dt = step));
            const Status status = advance->status();
            counted_ = status.steps;
            if (detail::is_interrupted(status)) {
                renew([&] { go_on_from(status, taken.size()); });
                continue;
            }
            has_paused = least > 0 && taken.empty() && status.error == 0;
            if (has_paused) continue;
            if (status.error == 0 && (taken.empty() || !(simulation_.time() > moments_.back().time)))
                firn::detail::throw_no_step(dt, simulation_.time(), simulation_.steps(),
                                            sentence("The fastest signal has ", status.signal_speed, " m/s."));
            see(status, taken.size());
            is_fresh_ = false;
            if (is_event_due()) renew([&] { end_events(); });
        }
        time_step_ = 0;
        if (advance->arrived()) simulation_.now_.time = end;
    }
    /// Returns how many steps to take at once, of those that are wanted.
    int most_steps(int wanted, std::uint64_t last_step) const {
        const std::uint64_t steps = simulation_.steps(), between_sorts = simulation_.most_steps_between_sorts;
        std::uint64_t most = std::min(last_step - steps, std::uint64_t(wanted));
        if (between_sorts > 0) most = std::min(most, between_sorts - steps % between_sorts);
        return moves() || !forces_.empty() ? 1 : int(most);
    }

    bool is_event_due() const { return detail::next_event(simulation_.sets()) <= simulation_.time(); }
    /// Lets bodies end and sources give particles, on the CPU, after the steps so far.
    void end_events() {
        check();
        // If check() met a sink, the step has ended: what sources gave then may live for less than a step, and stays.
        if (!is_ahead_ || !is_event_due()) return;
        bring_particles_back();
        for (auto& set : simulation_.sets_) set.places_before.clear();  // no sink was met
        simulation_.end_step(simulation_.ranks(), simulation_.workers());
        is_edited_ = true;
        upload(false);
    }

    void sort_if_due() {
        if (!simulation_.is_sort_due_by_count()) return;
        for (std::size_t k = 0; k < sets_.size(); ++k) grid().sort_next(k);
    }
    /// Returns the parameters of a boundary, as the device has it.
    std::vector<double> parameters_of(const Boundary& boundary) const {
        return detail::numbers_of(detail::boundary_from_corner(boundary, simulation_.domain()));
    }
    /// Returns whether the boundary is another one than that of the device.
    bool has_moved() const { return parameters_of(simulation_.boundary) != boundary_; }
    /// Returns whether steps move the boundary.
    bool moves() const { return parameters_of(advanced(simulation_.boundary, 1.0)) != boundary_; }
    /// Gives the boundary to the device.
    void set_boundary() {
        std::vector<double> present = parameters_of(simulation_.boundary);
        if (present == boundary_) return;
        boundary_ = std::move(present);
        grid().set_parameters(detail::boundary_from_corner(simulation_.boundary, simulation_.domain()), "boundary");
        begin_reactions();
        grid().set("boundary_speed",
                   {firn::detail::speed_of_boundary<float>(simulation_.boundary, simulation_.domain())});
    }
    /// Returns the forces of all loads at the present time [N].
    std::vector<Vec<double, D>> forces_of_loads() const {
        return detail::forces_of_loads(simulation_.sets(), simulation_.time());
    }
    /// Gives the forces of loads to the device.
    void set_forces() {
        std::vector<Vec<double, D>> present = forces_of_loads();
        if (present != forces_) detail::set_forces(sets_, forces_ = std::move(present));
    }
    /// Gives the device the points about which angular impulses are taken in the next step.
    void begin_reactions() {
        if (simulation_.reactions)
            reactions_.begin(grid(), *simulation_.reactions, simulation_.boundary, simulation_.domain());
    }
    /// Reads the reactions of the last step, if the device has taken one.
    void read_reactions() {
        if (simulation_.reactions && is_ahead_)
            reactions_.read(simulation_.sets(), sets_, simulation_.domain(), *simulation_.reactions);
    }
    /// Moves time and boundary on by a step that the device takes.
    void move_on(double dt) {
        moments_.push_back(simulation_.now_);
        is_ahead_ = true;
        simulation_.now_ = {simulation_.time() + dt, simulation_.steps() + 1, dt};
        simulation_.boundary = advanced(simulation_.boundary, dt);
    }

    /// Gives the steps that wait to the device.
    void submit() {
        if (waiting_ > 0) run_(step_, std::exchange(waiting_, 0));
    }

    /// Waits for all steps, and takes note of what they report.
    void check() {
        for (submit(); !moments_.empty(); submit()) {
            const Status status = grid().status();
            const std::uint32_t taken = status.steps - std::exchange(counted_, status.steps);
            if (!detail::is_interrupted(status)) return see(status, taken);
            const Moment reached = simulation_.now_;
            for (const double dt : go_on_from(status, taken)) {
                take_fixed_step(dt);
                if (waiting_ == Host::in_one_submission) submit();
            }
            simulation_.now_ = reached;  // the end of an advance is no sum of steps
        }
    }
    /// Does what the device has stopped for: gives the grid memory for more blocks, or removes what has met a sink.
    /// \param taken  number of steps since the last look
    /// \return the steps [s] that were begun after them, and which are to be taken again
    std::vector<double> go_on_from(const Status& status, std::size_t taken) {
        std::vector<double> again;
        for (std::size_t k = taken; k < moments_.size(); ++k) again.push_back(step_behind(k));
        if (!again.empty()) go_back_to(taken);
        take_reports(status, taken);
        moments_.clear();
        is_edited_ = true;
        bring_particles_back();
        if (status.error == wgsl::detail::blocks_error) blocks_ *= 2;
        if (status.meets_sink) {
            for (std::size_t k = 0; k < sets_.size(); ++k) sets_[k].read_places_before(simulation_.sets_[k]);
            simulation_.end_step(simulation_.ranks(), simulation_.workers());
        }
        upload(false);
        return again;
    }
    /// Returns the size of the k-th step since the last look at the status [s].
    double step_behind(std::size_t k) const {
        return k + 1 < moments_.size() ? moments_[k + 1].last_time_step : simulation_.last_time_step();
    }
    /// Sets time and boundary to those before the k-th step since the last look at the status.
    void go_back_to(std::size_t k) {
        simulation_.boundary = boundary_seen_;
        for (std::size_t i = 0; i < k; ++i) simulation_.boundary = advanced(simulation_.boundary, step_behind(i));
        simulation_.now_ = moments_.at(k);
    }
    /// Takes note of the status after steps.
    /// \param taken  number of steps since the last look, with one that has failed
    void see(const Status& status, std::size_t taken) {
        if (status.error != 0) fail(status, taken);
        take_reports(status, taken);
        moments_.clear();
        boundary_seen_ = simulation_.boundary;
        const double dt = simulation_.fixed_time_step, bound = acceleration_.find_bound(simulation_);
        if (!(dt > bound)) return;
        const std::string text = simulation_.warnings_.of_step(dt, bound, simulation_.bound_.is_of_acceleration(),
                                                               simulation_.steps(), bool(simulation_.warn));
        if (!text.empty()) simulation_.warn(text);
    }

    /// Takes note of what the last steps have measured. \param taken  their number
    void take_reports(const Status& status, std::size_t taken) {
        for (std::size_t k = 0; k < sets_.size(); ++k) simulation_.sets_[k].report = status.sets.at(k);
        const double largest = double(status.largest_acceleration);
        if (taken > 0)
            simulation_.bound_.field_at_nodes = acceleration_.size >= 0 ? -1 : std::isfinite(largest) ? largest : 0;
    }

    /// Gives the warnings about the particles that the CPU has.
    void warn() {
        if (simulation_.steps() == 0)
            simulation_.warnings_.of_start(simulation_.sets_, simulation_.domain(), simulation_.boundary, false,
                                           simulation_.warn, simulation_.ranks());
        for (std::string text = "a first look"; !text.empty();) {
            text.clear();
            simulation_.next_time_step(acceleration_.find_bound(simulation_),
                                       firn::detail::has_all_walls(simulation_.boundary, simulation_.domain()),
                                       Transfer::affine, simulation_.ranks(), simulation_.workers(), text);
            if (!text.empty()) simulation_.warn(text);
        }
    }

    /// Throws the error that a step reports, with the step, the particle and the likely cause.
    [[noreturn, gnu::cold]] void fail(const Status& status, std::size_t taken) {
        const double bound = acceleration_.find_bound(simulation_);
        const std::size_t failed = std::max<std::size_t>(taken, 1) - 1;
        const Moment at = moments_.at(failed);
        const double dt = step_behind(failed);
        std::string text = sentence("At step ", at.steps, ", of ", dt, " s from ", at.time,
                                    " s on: ", wgsl::error_sentences.at(status.error - 1));
        if (status.particle != no_particle) {
            const auto& set = simulation_.sets_[status.set];
            text += " " + detail::text_of_particle(sets_.at(status.set), status.particle, simulation_.domain(),
                                                   sets_.size() > 1 ? set.name_of_material() : "");
        }
        text += " " + acceleration_.likely_cause(simulation_, dt, bound) +
                " The simulation can neither go on nor be written: restore() its last state.";
        go_back_to(failed);
        simulation_.spoil();
        has_failed_ = true;
        moments_.clear();
        detail::throw_error(status.error, text);
    }

    /// Copies the particles back, if the device has taken steps since.
    void bring_back() {
        check();
        if (has_failed_) simulation_.prepare();  // throws
        if (is_ahead_) bring_particles_back();
    }
    void bring_particles_back() {
        read_reactions();
        for (std::size_t k = 0; k < sets_.size(); ++k)
            sets_[k].bring_back(simulation_.sets_[k], simulation_.kernel(), simulation_.workers());
        simulation_.activate();
        is_ahead_ = false;
    }

    Simulation simulation_;
    Device device_;
    std::vector<detail::SetOnDevice<D>> sets_;  // the first one has the buffers of the grid
    Host::Sequence step_;                       // the entry points of a step
    std::vector<double> boundary_;              // the parameters of the boundary that the device has
    std::vector<Vec<double, D>> forces_;        // the forces of loads that the device has [N]
    bool is_sparse_ = true;                     // whether the device has only the blocks of nodes that particles reach
    std::size_t blocks_ = 0;                    // for which it has memory then
    double time_step_ = 0;                      // that the device has; 0: not known
    std::uint32_t counted_ = 0;                 // the device's number of steps at the last look at the status
    std::vector<Moment> moments_;               // before each step since the last look at the status
    Boundary boundary_seen_;                    // at the last look at the status
    detail::ReactionsOnDevice<D> reactions_{};  // of the last step given
    int waiting_ = 0;                           // steps that were not yet given to the device
    std::function<void(const Host::Sequence&, int)> run_ = as_usual;  // gives them to it
    detail::AnyAcceleration<Simulation> acceleration_{};              // of the last steps, and of the programs
    bool is_given_ = false;                                           // whether the device has its parameters
    bool is_edited_ = false, has_failed_ = false;
    bool is_fresh_ = true;   // whether the device has taken no step since it got the particles
    bool is_ahead_ = false;  // whether the device has taken steps that the particles on the CPU have not
};

/// Takes a copy of a simulation to a GPU, which goes on with its steps. States of the GPU's run are written and read as
/// the CPU's; a run may go from the CPU to a GPU and back.
///
/// Simulations may have up to eight materials, any transfer, kernel, force form and boundary (with colliders that move,
/// also of meshes and other grids of distances in float), FBar and VolumeFilter (its particle shifting with one
/// material), and loads of a UniformForce, which then are added in float: see FixedPoint::float_steps. Sources, sinks
/// and lifespans of bodies act on the CPU: where a burst is due, a body ends or a particle may have met a sink, the
/// particles come there and back. Steps have any acceleration that firn can record, see OnGpu::step(). Reactions are
/// summed for up to eight parts of the boundary and for loads, see OnGpu::reactions(). Materials may ask for the
/// surroundings of particles: for the time, see Surroundings. Sums must be
/// FixedPoint<std::int32_t>, and steps fixed or chosen in float. What a GPU cannot do is refused in a sentence.
///
/// The device has memory for the blocks of nodes that particles reach, wherever they are, and finds these blocks
/// itself. It has all nodes of the domain if those are at most twice as many, and for particle shifting, which a
/// periodic domain cannot have here. Particles that do not fit into one buffer of the device are kept in several.
/// \param device  the GPU
/// \throws usage_error      if the simulation has something that the GPU cannot do, which is named
/// \throws parameter_error  if steps are neither fixed nor chosen in float, or if a buffer for the nodes exceeds the
///                          device's limits
/// \throws particle_error   if a particle is not finite or outside the domain, or too light for sums in integers
/// \throws device_error     if there is no GPU, or if it refuses the program
template <class Simulation>
OnGpu<Simulation> on_gpu(Simulation simulation, const Device& device = Device()) {
    return OnGpu<Simulation>(std::move(simulation), device);
}

}  // namespace firn::inline FIRN_BUILD::webgpu

namespace firn::inline FIRN_BUILD {

/// Returns the current state of a simulation on a GPU, as that of a simulation on the CPU; or writes it to a state that
/// is given, too. Include firn/io/simulation_state.hpp.
template <class Of, class... State>
auto state_of(webgpu::OnGpu<Of>& gpu, State&... into) {
    return gpu.state(into...);
}

}  // namespace firn::inline FIRN_BUILD
