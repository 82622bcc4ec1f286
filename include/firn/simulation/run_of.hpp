/// \file A run: the domain, the grid, the sets of particles and the time, as far as no policy matters.
#pragma once

#include <firn/core/stepper.hpp>
#include <firn/data/kernel_facts.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/exec/reactions.hpp>
#include <firn/simulation/bound.hpp>
#include <firn/simulation/ranks_of.hpp>
#include <firn/simulation/set_of.hpp>
#include <firn/simulation/warnings.hpp>
#include <firn/sort/partition.hpp>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A run: everything of a simulation that depends only on its precision and dimension. What a step does here is
/// compiled once for each S and D, whatever the materials and policies. \see Simulation
template <std::floating_point S, int D>
class RunOf : public Stepper<D> {
public:
    /// The impulse and the angular impulse that each part of the boundary, and each load, exerted on matter in the last
    /// step. They are computed only if `reactions` holds a value when the step begins: call
    /// `simulation.reactions.emplace()`.
    std::optional<Reactions<D>> reactions{};
    double fixed_time_step = 0;  ///< The time step [s]; 0: every step takes stable_time_step().
    /// The largest number of steps between two sorts of the particles; 0: no such limit. If this number is not 0,
    /// particles are sorted whenever the number of steps taken is a multiple of it. In any case, they are sorted when a
    /// particle may be too far from the block into which it was sorted.
    std::uint64_t most_steps_between_sorts = 0;

    const Domain<D>& domain() const { return grid_.domain(); }  ///< Returns the domain.
    /// Returns the grid, with the node values of the last step.
    const SparseGrid<S, D>& grid() const { return grid_; }
    /// Returns the largest acceleration of the field at the nodes in the last step [m/s²]; −1 if that had no field.
    double largest_acceleration() const { return bound_.field_at_nodes; }
    const KernelFacts& kernel() const { return kernel_; }  ///< Returns the facts about the kernel.
    const SetList<S, D>& sets() const { return sets_; }    ///< Returns the sets of particles.

protected:
    using Stepper<D>::now_;
    using Ranks = RanksOf<S, D>;

    RunOf(const Domain<D>& domain, const KernelFacts& kernel, SetList<S, D> sets)
        : grid_(domain), sets_(std::move(sets)), kernel_(kernel) {}

    /// Returns the partitions of all sets.
    std::vector<BlockPartition<D>*> partitions() {
        std::vector<BlockPartition<D>*> all;
        for (SetOf<S, D>& set : sets_) all.push_back(&set.partition);
        return all;
    }
    /// Returns the views of all sets that P2G and contact need.
    auto motions() {
        std::vector<ParticleSet<MotionView<S, D, BlockedSpan<S>>>> all;
        for (SetOf<S, D>& set : sets_) all.push_back({set.store().motion(), set.partition});
        return all;
    }
    detail::StepInputs<S, D> step_inputs(const Ranks& ranks, int threads) {
        return {sets_, domain(), kernel_, now_.time, threads, ranks};
    }

    /// Gives the first particles of sources, checks and sorts the sets of particles that changed since the last step,
    /// and computes their stresses. \return whether the grid must be activated
    /// \throws particle_error  if a step failed half-way, or if a particle has a value that is not finite or lies
    ///                         outside the domain
    bool prepare_sets(const Ranks& ranks, int threads);
    void sort(std::size_t k, const Ranks& ranks, int threads) {
        ranks.bring_home(kernel_, sets_, k);
        sets_[k].partition = sort_particles(kernel_, sets_[k].store(), threads);
        sets_[k].forget_pushes();
    }

    /// Returns the next time step [s]: the fixed time step if the program has set one, otherwise the bound.
    /// \param warning        receives a text if the program must be warned before the step; otherwise unchanged
    /// \param has_all_walls  whether every face of the domain has a wall
    /// \param tells_strain   whether the transfer is affine
    double next_time_step(double bound, bool has_all_walls, bool tells_strain, const Ranks& ranks, int threads,
                          std::string& warning);
    /// Begins a step: sorts sets if it is due.
    /// \return whether the grid must be activated
    bool begin_step(const Ranks& ranks, int threads);
    /// Lets loads and forces between particles push the particles.
    void push(double dt, const Ranks& ranks, int threads);
    /// Marks all sets: until a step has ended, their particles cannot be used.
    void spoil() {
        for (SetOf<S, D>& set : sets_) set.readiness.spoil();
    }
    /// Activates the blocks of the grid around the sorted particles.
    /// \return the copies of blocks that this rank needs from others
    CopiesElsewhere activate(const Ranks& ranks, bool between_groups, bool acts_by_gap, int threads) {
        const std::vector<BlockPartition<D>*> all = partitions();
        grid_.activate(all, threads);
        ranks.meet(kernel_, grid_, all, threads);
        return ranks.copies_elsewhere(grid_, all, between_groups, acts_by_gap, threads);
    }
    /// Ends the G2P of a step: joins the ranks' reports.
    /// \param right    whether all particles are finite and in the domain
    /// \param largest  the largest acceleration of a field at nodes [m/s²]
    /// \param cause    returns a sentence about the likely cause of particles that are not
    /// \throws particle_error  if on any rank some are not
    void end_g2p(double dt, bool right, double& largest, const std::function<std::string()>& cause, const Ranks& ranks);
    /// Ends a step: sinks take particles, and sources give some.
    void end_step(const Ranks& ranks, int threads);
    /// Returns what is wrong with a time step that does not change the time. \see detail::throw_no_step
    void check_time_step(double dt, const Ranks& ranks, int threads);

    SparseGrid<S, D> grid_;
    SetList<S, D> sets_;
    KernelFacts kernel_;
    detail::StepBound bound_;
    detail::Warnings warnings_;

private:
    void prepare_set(std::size_t k, const Ranks& ranks, int threads);
};

template <std::floating_point S, int D>
bool RunOf<S, D>::prepare_sets(const Ranks& ranks, int threads) {
    bool all_prepared = true;
    for (const SetOf<S, D>& set : sets_)
        if (!set.readiness.is(Readiness::changed)) detail::throw_spoiled(now_.steps);
    if (now_.steps == 0)
        for (SetOf<S, D>& set : sets_) set.give(now_.time, threads, ranks.share());
    for (const SetOf<S, D>& set : sets_) all_prepared = all_prepared && set.readiness.is(Readiness::prepared);
    if (all_prepared) return false;
    double fastest = 0;
    parallel_region(threads, [&] {
        for (std::size_t k = 0; k < sets_.size(); ++k)
            if (!sets_[k].readiness.is(Readiness::prepared)) prepare_set(k, ranks, threads);
        ranks.join_reports(sets_);
        for (const SetOf<S, D>& set : sets_)
            if (!(set.report.signal_speed <= fastest)) fastest = set.report.signal_speed;
    });
    if (!std::isfinite(fastest) || !(fastest > 0 || detail::may_have_particles(sets_, ranks))) {
        for (SetOf<S, D>& set : sets_) set.readiness.unprepare();
        detail::throw_wrong_signal(fastest);
    }
    return true;
}

template <std::floating_point S, int D>
void RunOf<S, D>::prepare_set(std::size_t k, const Ranks& ranks, int threads) {
    SetOf<S, D>& set = sets_[k];
    const bool is_empty = ranks.sum(set.store().size()) == 0;
    if (is_empty && detail::may_have_particles(sets_, ranks)) {
        set.partition = {};
        set.report = {};
        set.readiness.prepare();
        return;
    }
    if (is_empty || set.store().size() > 0) set.check_positions();
    sort(k, ranks, threads);
    const detail::PassReport pass = set.update_stress(threads);
    ranks.require(pass.right, [&] {
        detail::throw_wrong_particles(
            sets_, sentence("Before step ", now_.steps, ", at ", now_.time, " s: "), 0,
            "No step has done this: look at set_states(), edit_particles(), a restored state and the moduli.");
    });
    set.report = pass.report;
    set.readiness.prepare();
}

template <std::floating_point S, int D>
double RunOf<S, D>::next_time_step(double bound, bool has_all_walls, bool tells_strain, const Ranks& ranks, int threads,
                                   std::string& warning) {
    if (fixed_time_step < 0 || !std::isfinite(fixed_time_step))
        throw parameter_error(
            sentence("The fixed time step is ", fixed_time_step, " s; it must be positive, or 0 for the bound."));
    if (fixed_time_step == 0 && !std::isfinite(bound)) detail::throw_at_rest();
    const bool accelerated = bound_.is_of_acceleration(domain().cell_size), warns = bool(this->warn);
    if (fixed_time_step > bound) warning = warnings_.of_step(fixed_time_step, bound, accelerated, now_.steps, warns);
    if (warns && warning.empty() && detail::fastest_signal(sets_) > 0)
        warning = warnings_.of_bound(bound, now_.steps, now_.time,
                                     [&] { return bound_.reason(step_inputs(ranks, threads)); });
    if (warns && warning.empty())
        warning = warnings_.of_matter(sets_, domain(), kernel_, has_all_walls, tells_strain, now_, threads, ranks);
    return fixed_time_step > 0 ? fixed_time_step : bound;
}

template <std::floating_point S, int D>
void RunOf<S, D>::check_time_step(double dt, const Ranks& ranks, int threads) {
    if (now_.time + dt > now_.time && std::isfinite(now_.time + dt)) return;
    const bool is_the_bound = fixed_time_step == 0 && bound_.step > 0 && !(dt < bound_.step);
    detail::throw_no_step(dt, now_.time, now_.steps,
                          is_the_bound ? bound_.reason(step_inputs(ranks, threads)) : std::string());
}

template <std::floating_point S, int D>
bool RunOf<S, D>::begin_step(const Ranks& ranks, int threads) {
    const bool due = most_steps_between_sorts > 0 && now_.steps % most_steps_between_sorts == 0;
    bool sorted = false;
    for (std::size_t k = 0; k < sets_.size(); ++k) {
        SetOf<S, D>& set = sets_[k];
        const bool was_sorted = set.readiness.is(Readiness::sorted);
        set.restored.reset();
        set.readiness.begin_step();
        if (set.report.sort_needed || (due && !was_sorted)) {
            sort(k, ranks, threads);
            sorted = true;
        }
    }
    return sorted;
}

template <std::floating_point S, int D>
void RunOf<S, D>::push(double dt, const Ranks& ranks, int threads) {
    detail::LoadSums<D> of_loads;
    for (std::size_t k = 0; k < sets_.size(); ++k)
        sets_[k].push(now_, dt, threads,
                      {std::uint32_t(k), reactions ? reactions->about : std::nullopt, reactions ? &of_loads : nullptr});
    if (reactions) of_loads.tell(*reactions, ranks);
}

template <std::floating_point S, int D>
void RunOf<S, D>::end_g2p(double dt, bool right, double& largest, const std::function<std::string()>& cause,
                          const Ranks& ranks) {
    ranks.end_g2p(sets_, now_.time + dt, right, largest, [&] {
        detail::throw_wrong_particles(
            sets_, sentence("At step ", now_.steps, ", of ", dt, " s from ", now_.time, " s on: "), dt,
            cause() + " The simulation can neither go on nor be written: restore() its last state.");
    });
    for (SetOf<S, D>& set : sets_) set.readiness.end_step();
    now_ = {now_.time + dt, now_.steps + 1, dt};
}

template <std::floating_point S, int D>
void RunOf<S, D>::end_step(const Ranks& ranks, int threads) {
    for (std::size_t k = 0; k < sets_.size(); ++k) {
        sets_[k].take(now_.time);
        if (ranks.has_lost(k)) sets_[k].readiness.unprepare();
        sets_[k].give(now_.time, threads, ranks.share());
    }
}

}  // namespace firn::inline FIRN_BUILD
