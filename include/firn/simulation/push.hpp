/// \file The base class of loads and of forces between particles, which change the velocities of a set's particles in
/// every step.
///
/// The object is created when the first load or force is added. If a program adds none, their code is not compiled.
#pragma once

#include <firn/core/stepper.hpp>
#include <firn/data/particle_store.hpp>

#include <atomic>
#include <memory>

namespace firn::detail {

/// Collects ids that several threads report: the lowest of them, and their number.
class LowestId {
public:
    void see(std::uint32_t id) {
        ++count_;
        for (std::uint32_t known = lowest_; id < known && !lowest_.compare_exchange_weak(known, id);) {
        }
    }
    /// Throws if an id was reported.
    /// \throws particle_error  if an id was reported; the message gives the lowest one, and their number
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

/// The base class of two kinds of objects: all loads of a particle set, and all forces between its particles.
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
    /// Discards the copies of particles. Must be called when particles were moved to other slots, or when other code
    /// has changed their velocities.
    virtual void forget() {}
    /// Changes the particles' velocities by the impulses of a step of dt [s]. P2G then transfers the velocities to the
    /// nodes.
    /// \throws particle_error  if a velocity is not finite afterwards; the message names the first such particle
    virtual void push(ParticleStore<S, D>& particles, const Moment& now, double dt, int threads) = 0;
};

/// Owns one Push or none. A copy owns a copy of the Push.
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
    /// Returns the Push. Creates it first if there is none.
    /// \tparam Which  the class of the Push; it must be the same in each call
    template <class Which>
    Which& made() {
        if (!held_) held_ = std::make_unique<Which>();
        return static_cast<Which&>(*held_);
    }

private:
    std::unique_ptr<Push<S, D>> held_;
};

}  // namespace firn::detail
