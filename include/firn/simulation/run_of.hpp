/// \file A run: the domain, the grid, the sets of particles and the time, as far as no policy matters.
#pragma once

#include <firn/core/stepper.hpp>
#include <firn/data/kernel_facts.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/loops/ranks_of.hpp>
#include <firn/loops/reactions.hpp>
#include <firn/simulation/bound.hpp>
#include <firn/simulation/pass.hpp>
#include <firn/simulation/set_of.hpp>
#include <firn/simulation/warnings.hpp>

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

    /// The times of the passes. They are measured only if `times` holds a value: call `simulation.times.emplace()`.
    std::optional<PassTimes> times{};

    const PassList<S, D>& passes() const { return passes_; }    ///< Returns the passes of a step.
    const Domain<D>& domain() const { return grid_.domain(); }  ///< Returns the domain.
    /// Returns the grid, with the node values of the last step.
    const SparseGrid<S, D>& grid() const { return grid_; }
    /// Returns the largest acceleration of the field at the nodes in the last step [m/s²]; −1 if that had no field.
    double largest_acceleration() const { return bound_.field_at_nodes; }
    const KernelFacts& kernel() const { return kernel_; }  ///< Returns the facts about the kernel.
    const SetList<S, D>& sets() const { return sets_; }    ///< Returns the sets of particles.

protected:
    using Stepper<D>::now_;
    using Ranks = RanksOf<S, D>;  ///< What the processes of the run tell each other.

    /// Makes a run without particles.
    RunOf(const Domain<D>& domain, const KernelFacts& kernel, SetList<S, D> sets);
    RunOf(const RunOf&);                 ///< Copies the run with its sets.
    RunOf(RunOf&&) noexcept;             ///< Takes the run over.
    RunOf& operator=(const RunOf&);      ///< Copies the run with its sets.
    RunOf& operator=(RunOf&&) noexcept;  ///< Takes the run over.
    ~RunOf();

    /// Returns the partitions of all sets.
    std::vector<BlockPartition<D>*> partitions();
    /// Returns the views of all sets that P2G and contact need.
    auto motions() {
        std::vector<ParticleSet<MotionView<S, D, BlockedSpan<S>>>> all;
        all.reserve(sets_.size());
        for (SetOf<S, D>& set : sets_) all.push_back({set.store().motion(), set.partition});
        return all;
    }
    /// Returns what the bound of the time step depends on.
    detail::StepInputs<S, D> step_inputs(const Ranks& ranks, int threads) {
        return {sets_, domain(), kernel_, now_.time, threads, ranks, bound_.in_float};
    }

    /// Gives the first particles of sources, checks and sorts the sets of particles that changed since the last step,
    /// and computes their stresses. \return whether the grid must be activated
    /// \throws particle_error  if a step failed half-way, or if a particle has a value that is not finite or lies
    ///                         outside the domain
    bool prepare_sets(const Ranks& ranks, int threads);
    /// Sorts set k; on many ranks, its particles come home first.
    void sort(std::size_t k, const Ranks& ranks, int threads);

    /// Returns the next time step [s]: the fixed time step if the program has set one, otherwise the bound.
    /// \param warning        receives a text if the program must be warned before the step; otherwise unchanged
    /// \param has_all_walls  whether every face of the domain has a wall
    /// \param tells_strain   whether the transfer is affine
    double next_time_step(double bound, bool has_all_walls, bool tells_strain, const Ranks& ranks, int threads,
                          std::string& warning);
    /// Takes a step: lets all passes act, one after the other.
    void take_passes(StepNow<S, D>& now);
    /// Returns whether the number of steps asks for a sort before the next step. \see most_steps_between_sorts
    bool is_sort_due_by_count() const {
        return most_steps_between_sorts > 0 && now_.steps % most_steps_between_sorts == 0;
    }
    /// Returns whether a set must be sorted before the next step.
    bool is_sort_due(const SetOf<S, D>& set) const {
        return set.report.sort_needed || (is_sort_due_by_count() && !set.readiness.is(Readiness::sorted));
    }
    /// Begins a step: sorts sets if it is due. \return whether the grid must be activated
    bool sort_if_due(const Ranks& ranks, int threads);
    /// Lets loads and forces between particles push the particles.
    void push(double dt, bool in_float, const Ranks& ranks, int threads);
    /// Marks all sets: until a step has ended, their particles cannot be used.
    void spoil();
    /// Activates the blocks of the grid around the sorted particles.
    /// \return the copies of blocks that this rank needs from others
    CopiesElsewhere activate(const Ranks& ranks, bool between_groups, bool acts_by_gap, int threads);
    /// Ends the G2P of a step: joins the ranks' reports, and goes on to the next moment.
    /// \throws particle_error  if on any rank a particle is not finite or has left the domain
    void end_g2p(StepNow<S, D>& now);
    /// Ends a step: sinks take particles, and sources give some.
    void end_step(const Ranks& ranks, int threads);
    /// Checks that a step of dt [s] changes the time. \see detail::throw_no_step
    /// \throws parameter_error, particle_error  if it does not
    void check_time_step(double dt, const Ranks& ranks, int threads);

    PassList<S, D> passes_;      ///< The passes of a step.
    SparseGrid<S, D> grid_;      ///< The grid.
    SetList<S, D> sets_;         ///< The sets of particles.
    KernelFacts kernel_;         ///< The facts about the kernel.
    detail::StepBound bound_;    ///< The bound of the time step.
    detail::Warnings warnings_;  ///< Which warnings were given.

private:
    void act(std::size_t pass, StepNow<S, D>& now);
    void prepare_set(std::size_t k, const Ranks& ranks, int threads);
};

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/simulation/run_of-inl.hpp>
#endif
