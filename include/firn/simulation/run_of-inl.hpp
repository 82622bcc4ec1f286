/// \file Bodies of run_of.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/simulation/blow_up.hpp>
#include <firn/simulation/run_of.hpp>
#include <firn/sort/partition.hpp>

namespace firn::inline FIRN_BUILD {

template <std::floating_point S, int D>
[[gnu::cold]] RunOf<S, D>::RunOf(const Domain<D>& domain, const KernelFacts& kernel, SetList<S, D> sets)
    : grid_(domain), sets_(std::move(sets)), kernel_(kernel) {}
template <std::floating_point S, int D>
[[gnu::cold]] RunOf<S, D>::RunOf(const RunOf&) = default;
template <std::floating_point S, int D>
[[gnu::cold]] RunOf<S, D>::RunOf(RunOf&&) noexcept = default;
template <std::floating_point S, int D>
[[gnu::cold]] RunOf<S, D>& RunOf<S, D>::operator=(const RunOf&) = default;
template <std::floating_point S, int D>
[[gnu::cold]] RunOf<S, D>& RunOf<S, D>::operator=(RunOf&&) noexcept = default;
template <std::floating_point S, int D>
[[gnu::cold]] RunOf<S, D>::~RunOf() = default;

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
[[gnu::cold]] void RunOf<S, D>::prepare_set(std::size_t k, const Ranks& ranks, int threads) {
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
    const detail::PassReport pass = set.update_stress(threads, now_.time);
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
    const bool accelerated = bound_.is_of_acceleration(), warns = bool(this->warn);
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
bool RunOf<S, D>::sort_if_due(const Ranks& ranks, int threads) {
    bool sorted = false;
    for (std::size_t k = 0; k < sets_.size(); ++k) {
        SetOf<S, D>& set = sets_[k];
        const bool due = is_sort_due(set);
        set.restored.reset();
        set.readiness.begin_step();
        if (due) {
            sort(k, ranks, threads);
            sorted = true;
        }
    }
    return sorted;
}

template <std::floating_point S, int D>
void RunOf<S, D>::push(double dt, bool in_float, const Ranks& ranks, int threads) {
    detail::LoadSums<D> of_loads;
    for (std::size_t k = 0; k < sets_.size(); ++k)
        sets_[k].push(now_, dt, in_float, threads,
                      {std::uint32_t(k), reactions ? reactions->about : std::nullopt, reactions ? &of_loads : nullptr});
    if (reactions) of_loads.tell(*reactions, ranks);
}

template <std::floating_point S, int D>
void RunOf<S, D>::take_passes(StepNow<S, D>& now) {
    for (std::size_t i = 0, end = 0; i < passes_.size(); i = end) {
        end = i + 1;
        if (!passes_[i].each_set) {
            act(i, now);
            continue;
        }
        while (end < passes_.size() && passes_[end].each_set) ++end;
        for (now.set = 0; now.set < sets_.size(); ++now.set)
            for (std::size_t pass = i; pass < end; ++pass) act(pass, now);
    }
}

template <std::floating_point S, int D>
void RunOf<S, D>::act(std::size_t pass, StepNow<S, D>& now) {
    const double start = times ? detail::seconds_now() : 0;
    try {
        passes_[pass].act(*this, now);
    } catch (const overflow_error& failure) {
        detail::throw_overflow(failure, now_.steps, now.dt, now_.time, now.dt / bound_.step);
    }
    if (times) times->add(passes_[pass].name, detail::seconds_now() - start);
}

template <std::floating_point S, int D>
void RunOf<S, D>::end_g2p(StepNow<S, D>& now) {
    now.ranks.end_g2p(sets_, now_.time + now.dt, now.right, now.largest_acceleration, [&] {
        detail::throw_wrong_particles(
            sets_, sentence("At step ", now_.steps, ", of ", now.dt, " s from ", now_.time, " s on: "), now.dt,
            now.likely_cause() + " The simulation can neither go on nor be written: restore() its last state.");
    });
    bound_.field_at_nodes = now.is_uniform ? -1 : now.largest_acceleration;
    for (SetOf<S, D>& set : sets_) set.readiness.end_step();
    now_ = {now_.time + now.dt, now_.steps + 1, now.dt};
}

template <std::floating_point S, int D>
void RunOf<S, D>::end_step(const Ranks& ranks, int threads) {
    for (std::size_t k = 0; k < sets_.size(); ++k) {
        sets_[k].take(now_.time);
        if (ranks.has_lost(k)) sets_[k].readiness.unprepare();
        sets_[k].give(now_.time, threads, ranks.share());
    }
}

template <std::floating_point S, int D>
std::vector<BlockPartition<D>*> RunOf<S, D>::partitions() {
    std::vector<BlockPartition<D>*> all;
    all.reserve(sets_.size());
    for (SetOf<S, D>& set : sets_) all.push_back(&set.partition);
    return all;
}

template <std::floating_point S, int D>
void RunOf<S, D>::sort(std::size_t k, const Ranks& ranks, int threads) {
    ranks.bring_home(kernel_, sets_, k);
    sets_[k].partition = sort_particles(kernel_, sets_[k].store(), threads);
    sets_[k].forget_pushes();
}

template <std::floating_point S, int D>
void RunOf<S, D>::spoil() {
    for (SetOf<S, D>& set : sets_) set.readiness.spoil();
}

template <std::floating_point S, int D>
CopiesElsewhere RunOf<S, D>::activate(const Ranks& ranks, bool between_groups, bool acts_by_gap, int threads) {
    const std::vector<BlockPartition<D>*> all = partitions();
    grid_.activate(all, threads);
    ranks.meet(kernel_, grid_, all, threads);
    return ranks.copies_elsewhere(grid_, all, between_groups, acts_by_gap, threads);
}

}  // namespace firn::inline FIRN_BUILD
