/// \file Bodies of slow_strain.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/simulation/slow_strain.hpp>

namespace firn::inline FIRN_BUILD::detail {

template <std::floating_point S, int D>
std::string SlowStrain::look(const SetList<S, D>& sets, const Moment& now, bool is_known, const RanksOf<S, D>& ranks) {
    if (said_ || now.steps % 64 != 0 || now.steps == 0) return {};
    std::string text;
    for (std::size_t k = 0; is_known && sizeof(S) == sizeof(float) && k < sets.size() && text.empty(); ++k)
        text = look_at(sets[k], k, now);
    last_ = now.time;
    text = ranks.text_of_first(text);
    said_ = !text.empty();
    return text;
}

template <std::floating_point S, int D>
[[gnu::cold]] std::string SlowStrain::look_at(const SetOf<S, D>& set, std::size_t number, const Moment& now) {
    const ParticleStore<S, D>& particles = set.store();
    if (watches_.size() <= number) watches_.resize(number + 1);
    Watch& watch = watches_[number];
    if (watch.stride == 0) watch.stride = particles.next_id() / 64 + 1;
    std::size_t seen = 0, losing = 0;
    for (std::size_t slot = 0; slot < particles.used_slots(); ++slot) {
        if (!particles.is_particle(slot) || particles.id(slot) % watch.stride != 0) continue;
        const std::size_t i = particles.id(slot) / watch.stride;
        if (watch.samples.size() <= i) watch.samples.resize(i + 1);
        const std::optional<GradientFacts<S, D>> gradient = set.gradient_of(slot);
        if (!gradient) return {};
        update(watch.samples[i], *gradient, particles.affine(slot), now);
        ++seen;
        losing += watch.samples[i].loses;
    }
    if (2 * losing <= seen || losing == 0) return {};
    return sentence("at step ", now.steps, ", at ", now.time, " s: steps of ", now.last_time_step,
                    " s strain most particles of material ", number,
                    " by less than a float can add to their deformation gradient, because they have turned. Their "
                    "stress falls behind. Take double, or longer steps: a smaller speed of sound, larger cells.");
}

template <std::floating_point S, int D>
[[gnu::cold]] void SlowStrain::update(Sample& of, const GradientFacts<S, D>& gradient, const Mat<S, D>& C,
                                      const Moment& now) const {
    double rate = 0, size = 0, change = 0, elastic = 0;
    const Mat<S, D>& E = gradient.left_strain;
    for (int i = 0, k = 0; i < D; ++i)
        for (int j = i; j < D; ++j, ++k) {
            const double own = 0.5 * (double(C(i, j)) + double(C(j, i)));
            rate = std::max(rate, std::abs(own));
            size += own * own;
            of.strain[k] += own * (now.time - last_);
            change += of.strain[k] * of.strain[k];
            elastic += 0.25 * double(E(i, j)) * double(E(i, j));
        }
    of.way += std::sqrt(size) * (now.time - last_);
    ++of.seen;
    of.below += rate * now.last_time_step < 0.5 * double(std::numeric_limits<S>::epsilon()) * gradient.largest_number;
    // To and fro at random, n looks lead as far as √n in one direction.
    const double far = of.way * std::max(2.5 / std::sqrt(double(of.seen)), 0.2);
    const bool goes_on = change > far * far && change > 1e-12 && change > 1e-4 * elastic;
    of.loses = of.seen >= 16 && 2 * of.below > of.seen && goes_on;
}

}  // namespace firn::inline FIRN_BUILD::detail
