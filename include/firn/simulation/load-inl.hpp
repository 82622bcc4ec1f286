/// \file Bodies of load.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/simulation/load.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

template <std::floating_point S, int D>
std::uint32_t Loads<S, D>::add(Load<D> load) {
    loads_.push_back(std::move(load));
    numbers_.push_back(next_);
    forget();
    return next_++;
}

template <std::floating_point S, int D>
bool Loads<S, D>::remove(std::uint32_t number) {
    const auto found = std::ranges::find(numbers_, number);
    if (found == numbers_.end()) return false;
    loads_.erase(loads_.begin() + (found - numbers_.begin()));
    numbers_.erase(found);
    forget();
    return true;
}

template <std::floating_point S, int D>
double Loads<S, D>::largest_acceleration(const ParticleStore<S, D>& particles, double time, int threads) {
    are_known_ = loads_.size() == 1;
    if (are_known_) renew(known_, particles.slots(), threads);
    struct alignas(64) OfThread {
        double largest = 0;
    };
    std::vector<OfThread> all{std::size_t(thread_count(threads))};
    for_particles(particles, threads, [&](std::size_t slot, int thread) {
        Vec<double, D> sum{};
        for (const Load<D>& load : loads_)
            if (load.body.holds(particles.id(slot))) sum += load.force(particles.exact_position(slot), time);
        if (are_known_) known_[slot] = sum;
        double& largest = all[std::size_t(thread)].largest;
        const double acceleration = norm(sum) / double(particles.mass(slot));
        if (std::isfinite(acceleration)) largest = std::max(largest, acceleration);
    });
    double largest = 0;
    for (const OfThread& of_thread : all) largest = std::max(largest, of_thread.largest);
    return largest;
}

template <std::floating_point S, int D>
void Loads<S, D>::push(ParticleStore<S, D>& particles, const Moment& now, double dt, bool in_float, int threads,
                       const SumsOfSet<D>& sums) {
    for (std::size_t k = 0; k < loads_.size(); ++k) {
        LowestId wrong;
        const auto push_all = [&](const auto& seen) {
            for_particles(particles, threads, [&](std::size_t slot, int thread) {
                if (!loads_[k].body.holds(particles.id(slot))) return;
                const Vec<double, D> force =
                    are_known_ ? known_[slot] : loads_[k].force(particles.exact_position(slot), now.time);
                const Vec<S, D> before = particles.velocity(slot);
                const S mass = particles.mass(slot);
                const Vec<S, D> after = before + (in_float ? pushed_by(cast<S>(force), S(dt), mass)
                                                           : cast<S>(pushed_by(force, dt, double(mass))));
                particles.set_velocity(slot, after);
                if (!is_finite(after)) wrong.see(particles.id(slot));
                seen(slot, before, after, thread);
            });
        };
        if (sums.all)
            add_up(particles, LoadId{sums.material, numbers_[k]}, threads, sums, push_all);
        else
            push_all([](auto&&...) {});
        wrong.refuse("a load", now, dt);
    }
    forget();
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
