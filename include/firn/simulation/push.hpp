/// \file The base of loads and of forces between particles, which push the particles of a set in every step.
///
/// The first call that adds one creates the object. A program that adds none does not compile them.
#pragma once

#include <firn/core/stepper.hpp>
#include <firn/data/particle_store.hpp>

#include <atomic>
#include <memory>

namespace firn::detail {

/// The lowest id that any worker has seen, and the number of ids seen.
class LowestId {
public:
    void see(std::uint32_t id) {
        ++count_;
        for (std::uint32_t known = lowest_; id < known && !lowest_.compare_exchange_weak(known, id);) {
        }
    }
    /// \throws particle_error  if an id was seen
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

/// All loads of a set, or all forces between its particles.
template <std::floating_point S, int D>
class Push {
public:
    virtual ~Push() = default;
    virtual std::unique_ptr<Push> copy() const = 0;
    /// Whether a force that the user wrote may open parallel regions.
    virtual bool may_open_regions() const { return false; }
    /// The largest stable step [s] of explicit integration.
    virtual double largest_step(const ParticleStore<S, D>&, double /* time */, int /* threads */) {
        return std::numeric_limits<double>::infinity();
    }
    /// Must be called when particles have moved to other slots, or something else has changed their velocities.
    virtual void forget() {}
    /// Adds the impulses of a step of dt [s] to the particles' velocities. P2G takes them to the nodes.
    /// \throws particle_error  if a velocity is not finite then, naming the first such particle
    virtual void push(ParticleStore<S, D>& particles, const Moment& now, double dt, int threads) = 0;
};

/// An optional Push that can be copied.
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
    /// The Push, created if there is none yet.
    /// \tparam Which  its type, the same in each call
    template <class Which>
    Which& made() {
        if (!held_) held_ = std::make_unique<Which>();
        return static_cast<Which&>(*held_);
    }

private:
    std::unique_ptr<Push<S, D>> held_;
};

}  // namespace firn::detail
