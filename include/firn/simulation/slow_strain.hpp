/// \file A warning about matter that strains so slowly that a float cannot add the strain of a step.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/stepper.hpp>
#include <firn/simulation/ranks_of.hpp>
#include <firn/simulation/set_of.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Watches a sample of the particles for strain that is lost.
///
/// Of matter that has not turned, F − I is as small as its strain, and a float adds what a step strains. Matter that
/// has turned by an angle θ has numbers of the size θ in F − I, which cannot hold less than θ · 3e-8. The strain of
/// steps that strain by less is lost, or rounded up. This matters if it goes on: a body at rest strains to and fro.
class SlowStrain {
public:
    /// Looks at the particles in every 64th step. Returns a warning if most particles of a set have strained, since the
    /// watch began and in one direction, by steps that their numbers cannot hold; otherwise, and after the first
    /// warning, an empty string.
    /// \param now  after a step
    /// \param is_known  whether the transfer tells the rate of strain: it is affine
    template <std::floating_point S, int D>
    std::string look(const SetList<S, D>& sets, const Moment& now, bool is_known, const RanksOf<S, D>& ranks) {
        if (said_ || now.steps % 64 != 0 || now.steps == 0) return {};
        std::string text;
        for (std::size_t k = 0; is_known && sizeof(S) == sizeof(float) && k < sets.size() && text.empty(); ++k)
            text = look_at(sets[k], k, now);
        last_ = now.time;
        text = ranks.text_of_first(text);
        said_ = !text.empty();
        return text;
    }

private:
    struct Sample {
        int seen = 0, below = 0;         // looks; those in which the step's strain was lost
        double strain[6] = {}, way = 0;  // ∫ of the rate of strain, by components, and of its size
        bool loses = false;              // whether what was lost matters
    };
    struct Watch {
        std::uint32_t stride = 0;  // the particles with the ids 0, stride, 2 · stride, … are watched
        std::vector<Sample> samples{};
    };

    template <std::floating_point S, int D>
    [[gnu::cold]] std::string look_at(const SetOf<S, D>& set, std::size_t number, const Moment& now) {
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
    void update(Sample& of, const GradientFacts<S, D>& gradient, const Mat<S, D>& C, const Moment& now) const {
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
        of.below +=
            rate * now.last_time_step < 0.5 * double(std::numeric_limits<S>::epsilon()) * gradient.largest_number;
        // To and fro at random, n looks lead as far as √n in one direction.
        const double far = of.way * std::max(2.5 / std::sqrt(double(of.seen)), 0.2);
        const bool goes_on = change > far * far && change > 1e-12 && change > 1e-4 * elastic;
        of.loses = of.seen >= 16 && 2 * of.below > of.seen && goes_on;
    }

    std::vector<Watch> watches_{};
    double last_ = 0;  // time of the last look [s]
    bool said_ = false;
};

}  // namespace firn::inline FIRN_BUILD::detail
