/// \file Bodies of Adjoint::check().
#pragma once

#include <firn/adjoint/adjoint.hpp>

namespace firn::inline FIRN_BUILD {

template <class Simulation>
void Adjoint<Simulation>::shift_particles(const Gradient<Simulation>& direction, double t,
                                          const std::vector<std::uint32_t>& first) {
    unroll<int(Simulation::material_count)>([&](auto i) {
        auto& set = simulation_.template set_at<i>();
        auto& particles = set.particles;
        if (first[i] == particles.next_id()) return;
        const auto& by = std::get<i>(direction.sets);
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || particles.id(slot) < first[i]) continue;
            const std::uint32_t id = particles.id(slot);
            particles.set_position(slot, particles.exact_position(slot) + by.position[id] * t);
            particles.set_velocity(slot, particles.velocity(slot) + cast<S>(by.velocity[id] * t));
            particles.set_affine(slot, particles.affine(slot) + cast<S>(by.affine[id] * t));
            particles.set_mass(slot, S(double(particles.mass(slot)) + by.mass[id] * t));
            particles.set_volume(slot, S(double(particles.volume(slot)) + by.volume[id] * t));
            auto state = particles.state(slot);
            detail::shift_state(state, by.state[id], t);
            particles.set_state(slot, state);
        }
        set.readiness.edit();
    });
    prepare_again();
}

template <class Simulation>
void Adjoint<Simulation>::note_gone(std::size_t state, std::vector<std::vector<std::size_t>>& gone) const {
    for (std::size_t k = 0; k < simulation_.sets_.size(); ++k) {
        const SetOf<S, D>& set = simulation_.sets_[k];
        if (!set.readiness.is(Readiness::sorted)) continue;
        const ParticleStore<S, D>& particles = set.store();
        std::vector<bool> is_here(particles.next_id());
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) is_here[particles.id(slot)] = true;
        gone[k].resize(is_here.size());
        for (std::size_t id = 0; id < is_here.size(); ++id)
            if (!is_here[id] && gone[k][id] == 0) gone[k][id] = state;
    }
}

template <class Simulation>
double Adjoint<Simulation>::value_along(const Gradient<Simulation>& direction, double t,
                                        std::vector<BlockCoordinate<D>>& cells) {
    restore(kept_->first());
    unroll<int(Simulation::material_count)>([&](auto i) {
        detail::shift_numbers(simulation_.template set_at<i>().material, std::get<i>(direction.sets).material, t);
    });
    std::vector<std::uint32_t> next_ids(simulation_.sets_.size());
    shift_particles(direction, t, next_ids);
    std::vector<std::vector<std::size_t>> gone(simulation_.sets_.size());
    note_gone(moments_.size(), gone);
    double sum = 0;
    const auto measure_at = [&](std::size_t state) {
        for (const Measure& measure : std::ranges::equal_range(measures_, state, {}, &Measure::state))
            sum += measure.value();
    };
    measure_at(0);
    for (std::size_t step = 0; step < steps(); ++step) {
        Interval& interval = interval_of(step);
        const auto& by = direction.intervals[std::size_t(&interval - intervals_.data())];
        use(interval);
        detail::shift_numbers(simulation_.transfer, by.transfer, t);
        interval.loads.give_to(simulation_.sets_, by.loads, t);
        if (interval.first == step) {
            // What has moved goes on from where it is now.
            const std::vector<double> moved = detail::numbers_of(simulation_.boundary);
            simulation_.boundary = interval.boundary;
            std::size_t k = 0;
            detail::for_reals(simulation_.boundary, [&](auto& number) {
                if (interval.carried[k]) number = std::remove_cvref_t<decltype(number)>(moved[k]);
                ++k;
            });
            detail::shift_numbers(simulation_.boundary, by.boundary, t);
        }
        for (std::size_t k = 0; k < next_ids.size(); ++k) next_ids[k] = simulation_.sets_[k].store().next_id();
        interval.step(dts_[step], &by, t);
        shift_particles(direction, t, next_ids);
        note_gone(step + 1, gone);
        simulation_.now_ = moments_[step + 1];
        measure_at(step + 1);
    }
    const Domain<D>& domain = simulation_.domain();
    cells.clear();
    simulation_.for_materials([&](const auto& set, std::size_t k) {
        const std::size_t first = cells.size();
        cells.resize(first + set.particles.next_id());
        for (std::size_t id = 0; id < gone[k].size(); ++id)
            if (gone[k][id] != 0) {  // in no cell; the second number tells since when
                cells[first + id].fill(std::numeric_limits<int>::min());
                cells[first + id][1] = int(gone[k][id]);
            }
        for (std::size_t slot = 0; slot < set.particles.slots(); ++slot) {
            if (!set.particles.is_particle(slot)) continue;
            BlockCoordinate<D>& cell = cells[first + set.particles.id(slot)];
            for (int a = 0; a < D; ++a)
                cell[std::size_t(a)] = int(std::floor(
                    (set.particles.exact_position(slot)[a] - domain.lower[a]) / domain.cell_size - Kernel::base_shift));
        }
    });
    return sum;
}

template <class Simulation>
DerivativeCheck Adjoint<Simulation>::check(const Gradient<Simulation>& gradient, const Gradient<Simulation>& direction,
                                           double h) {
    for (const Measure& measure : measures_)
        if (!measure.value)
            throw usage_error("A measure of measure_own() has no value that check() could compare: use measure().");
    if (!(h > 0) || !std::isfinite(h))
        throw parameter_error(sentence("The step of a difference is ", h, "; it must be positive and finite."));
    const auto numbers = [](const Gradient<Simulation>& of) {
        std::size_t count = 0;
        detail::for_gradient(of, [&](const auto&) { ++count; });
        return count;
    };
    if (gradient.position_norm.size() != moments_.size() || numbers(direction) != numbers(gradient))
        throw usage_error(
            "A gradient and a direction are given to check() that are not of the steps recorded so far: take what "
            "gradient() returns now, and a direction from its zero().");
    require_as_left();
    Snapshot end;
    store(end);
    const Vec<double, D> gravity = simulation_.gravity;
    const Transfer transfer = simulation_.transfer;
    const Restored restored{*this, end, gravity, transfer};
    if (!by_reactions_.empty()) simulation_.reactions = restored.reactions;
    std::vector<BlockCoordinate<D>> cells, others;
    const double at = value_along(direction, 0, cells), behind = value_along(direction, -h, others),
                 ahead = value_along(direction, h, cells);
    std::size_t other_cells = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) other_cells += std::size_t(cells[i] != others[i]);
    return {gradient.along(direction), (ahead - at) / h, (at - behind) / h, (ahead - behind) / (2 * h), other_cells};
}

}  // namespace firn::inline FIRN_BUILD
