/// \file What pushes a set's particles in every step. It is made when a program adds the first such: a program that
/// adds none does not compile it.
#pragma once

#include <firn/core/stepper.hpp>
#include <firn/data/particle_store.hpp>

#include <atomic>
#include <memory>

namespace firn::detail {

/// The lowest of the ids that any thread has seen.
class LowestId {
public:
    void see(std::uint32_t id) {
        ++count_;
        for (std::uint32_t known = lowest_; id < known && !lowest_.compare_exchange_weak(known, id);) {
        }
    }
    /// \throws particle_error  if one was seen
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
    /// Does something of the user's open parallel regions of its own?
    virtual bool may_open_regions() const { return false; }
    /// Above it [s] an explicit step lets what is pushed fly apart.
    virtual double largest_step(const ParticleStore<S, D>&, double /* time */, int /* threads */) {
        return std::numeric_limits<double>::infinity();
    }
    /// Particles have moved to other slots, or something else has changed their velocities.
    virtual void forget() {}
    /// Adds the impulses of a step of dt [s] to the particles' own velocities, from where P2G takes them to the nodes.
    /// \throws particle_error  naming the first of the particles that would get a velocity that is not finite
    virtual void push(ParticleStore<S, D>& particles, const Moment& now, double dt, int threads) = 0;
};

/// A push, or none yet.
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
    /// The one that is held, made now if it is the first. \tparam Which  always the same
    template <class Which>
    Which& made() {
        if (!held_) held_ = std::make_unique<Which>();
        return static_cast<Which&>(*held_);
    }

private:
    std::unique_ptr<Push<S, D>> held_;
};

}  // namespace firn::detail
