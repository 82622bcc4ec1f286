/// \file Loads: forces that a program applies to the particles of a body.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/simulation/body.hpp>
#include <firn/simulation/push.hpp>

#include <functional>
#include <utility>
#include <vector>

namespace firn {

/// A force on every particle of a body. To apply a traction t [Pa] to a face of area A [m²] that has n particles, let
/// the force on each of these particles be t A / n.
template <int D>
struct Load {
    Body body;  ///< The body on whose particles the force acts.
    /// A function that returns the force [N] on one particle, for its position [m] and the time [s].
    std::function<Vec<double, D>(const Vec<double, D>& position, double time)> force;
};

namespace detail {

/// The loads of a set of particles, in the order in which they were added.
template <std::floating_point S, int D>
class Loads final : public Push<S, D> {
public:
    std::unique_ptr<Push<S, D>> copy() const override { return std::make_unique<Loads>(*this); }
    void add(Load<D> load) { loads_.push_back(std::move(load)); }

    void push(ParticleStore<S, D>& particles, const Moment& now, double dt, int threads) override {
        for (const Load<D>& load : loads_) {
            LowestId wrong;
            parallel_for(
                particles.slots() / pack_size, threads,
                [&](std::size_t pack, int) {
                    for (std::size_t slot = pack * pack_size; slot < (pack + 1) * pack_size; ++slot) {
                        if (!particles.is_particle(slot) || !load.body.holds(particles.id(slot))) continue;
                        const Vec<double, D> force = load.force(particles.exact_position(slot), now.time);
                        const Vec<S, D> after =
                            particles.velocity(slot) + cast<S>(force * (dt / double(particles.mass(slot))));
                        particles.set_velocity(slot, after);
                        if (!is_finite(after)) wrong.see(particles.id(slot));
                    }
                },
                64);
            wrong.refuse("a load", now, dt);
        }
    }

private:
    std::vector<Load<D>> loads_;
};

}  // namespace detail

}  // namespace firn
