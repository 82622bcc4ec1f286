/// \file Bodies of Adjoint::check().
#pragma once

#include <firn/adjoint/adjoint.hpp>

namespace firn::inline FIRN_BUILD {

template <class Simulation>
void Adjoint<Simulation>::shift_start(const Gradient<Simulation>& direction, double t) {
    unroll<int(Simulation::material_count)>([&](auto i) {
        auto& set = simulation_.template set_at<i>();
        auto& particles = set.particles;
        const auto& by = std::get<i>(direction.sets);
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
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
        detail::shift_numbers(set.material, by.material, t);
        set.readiness.edit();
    });
    simulation_.prepare();
}

template <class Simulation>
double Adjoint<Simulation>::value_along(const Gradient<Simulation>& direction, double t,
                                        std::vector<BlockCoordinate<D>>& cells) {
    restore(kept_->first());
    shift_start(direction, t);
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
        interval.step(dts_[step], &by, t);
        simulation_.now_ = moments_[step + 1];
        measure_at(step + 1);
    }
    const Domain<D>& domain = simulation_.domain();
    cells.clear();
    simulation_.for_materials([&](const auto& set, std::size_t) {
        for (const std::uint32_t slot : slots_by_id(set.particles, 1)) {
            BlockCoordinate<D>& cell = cells.emplace_back();
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
    require_as_left();
    Snapshot end;
    store(end);
    const Vec<double, D> gravity = simulation_.gravity;
    const Transfer transfer = simulation_.transfer;
    const Restored restored{*this, end, gravity, transfer};
    std::vector<BlockCoordinate<D>> cells, others;
    const double at = value_along(direction, 0, cells), behind = value_along(direction, -h, others),
                 ahead = value_along(direction, h, cells);
    std::size_t other_cells = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) other_cells += std::size_t(cells[i] != others[i]);
    return {gradient.along(direction), (ahead - at) / h, (at - behind) / h, (ahead - behind) / (2 * h), other_cells};
}

}  // namespace firn::inline FIRN_BUILD
