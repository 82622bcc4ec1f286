/// \file Loads: forces that a program applies to the particles of a body.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/simulation/body.hpp>
#include <firn/simulation/push.hpp>
#include <firn/stage/push.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A force on every particle of a body. To apply a traction t [Pa] to a face of area A [m²] that has n particles, let
/// the force on each of these particles be t A / n.
template <int D>
struct Load {
    Body body;  ///< The body on whose particles the force acts.
    /// A function that returns the force [N] on one particle, for its position [m] and the time [s].
    std::function<Vec<double, D>(const Vec<double, D>& position, double time)> force;
};

/// A force for add_load() that is the same on every particle of the body, which a GPU can apply:
///
///     simulation.add_load(body, firn::UniformForce<3>([](double time) { return firn::Vec<double, 3>{0, 0, 5 * time};
///     }));
template <int D>
class UniformForce {
public:
    /// Makes it from a function. \param force  force(time [s]) returns the force on one particle [N]
    explicit UniformForce(std::function<Vec<double, D>(double time)> force) : force_(std::move(force)) {}
    /// Returns the force on one particle [N] at a time [s], wherever it is.
    Vec<double, D> operator()(const Vec<double, D>&, double time) const { return force_(time); }

private:
    std::function<Vec<double, D>(double)> force_;
};

namespace detail {

/// The loads of a set of particles, in the order in which they were added.
template <std::floating_point S, int D>
class Loads final : public Push<S, D> {
public:
    /// Returns a copy, without the forces that are kept.
    std::unique_ptr<Push<S, D>> copy() const override {
        auto other = std::make_unique<Loads>();
        other->loads_ = loads_, other->numbers_ = numbers_, other->next_ = next_;
        return other;
    }
    /// Returns the number of the load.
    std::uint32_t add(Load<D> load);
    /// Removes a load. Returns whether there was one with this number.
    bool remove(std::uint32_t number);
    /// Returns the loads, whose forces may be changed before a step.
    std::vector<Load<D>>& all() { return loads_; }
    /// Returns the loads.
    const std::vector<Load<D>>& all() const { return loads_; }
    /// Returns the number of the load at index i of all().
    std::uint32_t number(std::size_t i) const { return numbers_[i]; }

    /// Keeps the forces for the push() that follows, if there is only one load.
    double largest_acceleration(const ParticleStore<S, D>& particles, double time, int threads) override;
    void forget() override { are_known_ = false; }

    void push(ParticleStore<S, D>& particles, const Moment& now, double dt, bool in_float, int threads,
              const SumsOfSet<D>& sums) override;

private:
    /// Adds up what push_all(seen) does to particles: the changes of their momenta, m Δv.
    template <class PushAll>
    static void add_up(const ParticleStore<S, D>& particles, const LoadId& load, int threads, const SumsOfSet<D>& sums,
                       const PushAll& push_all) {
        constexpr std::size_t numbers = LoadSums<D>::numbers;
        const std::size_t first = sums.all->add(load, sums.about);
        const Vec<double, D> about = sums.all->loads.back().reaction.about;
        std::vector<std::array<ExactSum, numbers>> all{std::size_t(thread_count(threads))};
        push_all([&](std::size_t slot, const Vec<S, D>& before, const Vec<S, D>& after, int thread) {
            Reaction<D> of_particle{about, {}, {}};
            add_impulse(of_particle, particles.exact_position(slot), double(particles.mass(slot)),
                        cast<double>(after) - cast<double>(before));
            ExactSum* sum = all[std::size_t(thread)].data();
            for_impulses(of_particle, [&](double impulse) { (sum++)->add(impulse); });
        });
        for (const auto& of_thread : all)
            for (std::size_t i = 0; i < numbers; ++i) sums.all->sums[first + i] += of_thread[i];
    }

    /// Calls body(slot, thread) for every particle.
    template <class Body>
    static void for_particles(const ParticleStore<S, D>& particles, int threads, const Body& body) {
        parallel_for(
            particles.slots() / pack_size, thread_count(threads),
            [&](std::size_t pack, int thread) {
                for (std::size_t slot = pack * pack_size; slot < (pack + 1) * pack_size; ++slot)
                    if (particles.is_particle(slot)) body(slot, thread);
            },
            64);
    }

    std::vector<Load<D>> loads_;
    std::vector<std::uint32_t> numbers_;    // of the loads
    std::uint32_t next_ = 0;                // number of the next load
    aligned_vector<Vec<double, D>> known_;  // the force on the particle in each slot [N]
    bool are_known_ = false;                // whether these are the forces at the particles' present positions
};

/// Returns the loads of a set; nullptr if it has none.
template <std::floating_point S, int D>
Loads<S, D>* loads_of(const MaybePush<S, D>& loads) {
    return static_cast<Loads<S, D>*>(loads.operator->());
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/simulation/load-inl.hpp>
#endif
