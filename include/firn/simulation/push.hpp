/// \file The base class of loads and of forces between particles, which change the velocities of a set's particles in
/// every step.
///
/// An object of a derived class is created when the first load or force is added. If a program adds neither, the code
/// of loads and forces is not compiled.
#pragma once

#include <firn/core/stepper.hpp>
#include <firn/data/particle_store.hpp>
#include <firn/loops/reactions.hpp>

#include <atomic>
#include <memory>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Collects particle ids that several threads report: keeps the lowest id, and how many ids were reported.
class LowestId {
public:
    void see(std::uint32_t id) {
        ++count_;
        for (std::uint32_t known = lowest_; id < known && !lowest_.compare_exchange_weak(known, id);) {
        }
    }
    /// Throws an error if an id was reported; otherwise does nothing.
    /// \throws particle_error  if an id was reported; the message gives the lowest id and the number of ids
    void refuse(const char* what, const Moment& now, double dt) const {
        if (count_ > 0)
            throw particle_error(sentence("At step ", now.steps, ", at ", now.time, " s, ", what, " gives ", count_,
                                          count_ == 1 ? " particle" : " particles",
                                          " a velocity that is not finite; the first is particle ", lowest_,
                                          ". Look at the force that was given, and at the step of ", dt, " s."));
    }

private:
    std::atomic<std::uint32_t> lowest_ = no_particle;
    std::atomic<std::size_t> count_ = 0;
};

/// The impulses of the loads of all sets in a step, before they are rounded.
template <int D>
struct LoadSums {
    static constexpr std::size_t numbers = D + (D == 2 ? 1 : D);  // of a Reaction

    std::vector<LoadReaction<D>> loads{};  ///< the loads, with the points of their angular impulses
    std::vector<ExactSum> sums{};          ///< `numbers` for each load

    /// Adds a load. \return the place of its first sum
    std::size_t add(const LoadId& load, const std::optional<Vec<double, D>>& about) {
        loads.push_back({load, {about.value_or(Vec<double, D>::zero()), {}, {}}});
        sums.resize(loads.size() * numbers);
        return sums.size() - numbers;
    }
    /// Sums over all ranks, rounds, and tells the reactions.
    template <class Ranks>
    void tell(Reactions<D>& reactions, const Ranks& ranks) {
        ranks.merge(sums);
        const ExactSum* sum = sums.data();
        for (LoadReaction<D>& load : loads)
            for_impulses(load.reaction, [&](double& impulse) { impulse = (sum++)->value(); });
        reactions.loads = std::move(loads);
    }
};

/// Where a push adds up what loads exert on the particles of a set, if this is wanted.
template <int D>
struct SumsOfSet {
    std::uint32_t material = 0;             ///< index of the material
    std::optional<Vec<double, D>> about{};  ///< the point about which angular impulses are taken [m]; else the origin
    LoadSums<D>* all = nullptr;             ///< the sums; nullptr if they are not wanted
};

/// The base class of Loads (all loads on the particles of a set) and BodyForces (all forces between the particles of a
/// set).
template <std::floating_point S, int D>
class Push {
public:
    virtual ~Push() = default;
    virtual std::unique_ptr<Push> copy() const = 0;
    /// Returns whether a force written by the user may start parallel regions.
    virtual bool may_open_regions() const { return false; }
    /// Returns the largest time step [s] that is stable with explicit integration; infinite if there is no limit.
    virtual double largest_step(const ParticleStore<S, D>&, double /* time */, int /* threads */) {
        return std::numeric_limits<double>::infinity();
    }
    /// Returns the largest acceleration [m/s²] that a particle gets from loads, and from forces that do not limit the
    /// time step by their stiffness or damping.
    virtual double largest_acceleration(const ParticleStore<S, D>& particles, double time, int threads) = 0;
    /// Discards the copies of particles. Call it when particles were moved to other slots, or when other code has
    /// changed the velocities of particles.
    virtual void forget() {}
    /// Changes the velocities of the particles by the impulses of the loads or forces over a step of dt [s]. P2G then
    /// transfers the velocities to the nodes.
    /// \param in_float  whether loads are rounded to float as on a GPU. \see FixedPoint::float_steps
    /// \param sums      receives what loads exert on the particles
    /// \throws particle_error  if a velocity is not finite afterwards; the message gives the lowest id of such a
    ///                         particle
    virtual void push(ParticleStore<S, D>& particles, const Moment& now, double dt, bool in_float, int threads,
                      const SumsOfSet<D>& sums) = 0;
};

/// Owns one Push object or none. A copy of a MaybePush owns a copy of the Push object.
template <std::floating_point S, int D>
class MaybePush {
public:
    MaybePush() = default;
    MaybePush(const MaybePush& other) : held_(other.held_ ? other.held_->copy() : nullptr) {}
    MaybePush(MaybePush&&) noexcept = default;
    MaybePush& operator=(MaybePush other) noexcept {
        held_ = std::move(other.held_);
        return *this;
    }

    explicit operator bool() const { return held_ != nullptr; }
    Push<S, D>* operator->() const { return held_.get(); }
    /// Returns the Push object. Creates it first if there is none.
    /// \tparam Which  the class of the Push object; it must be the same class in every call of made()
    template <class Which>
    Which& made() {
        if (!held_) held_ = std::make_unique<Which>();
        return static_cast<Which&>(*held_);
    }

private:
    std::unique_ptr<Push<S, D>> held_;
};

}  // namespace firn::inline FIRN_BUILD::detail
