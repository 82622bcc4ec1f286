/// \file Forces between the particles of a body, beside those of a constitutive model.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/core/run.hpp>
#include <firn/lagrangian/any_force.hpp>
#include <firn/simulation/body.hpp>

#include <atomic>

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

/// Springs, membranes, wind: what joins the particles of a body, to which particle first + i is point i. Their impulses
/// go to the particles' own velocities, from where P2G takes them to the nodes: Σ w_ip (m_p v_p + dt f_p), the momentum
/// of a Lagrangian mesh (Jiang, Schroeder, Selle, Teran, Stomakhin 2015, §9). A free mesh's frequencies bound those
/// that the grid lets through: what nodes carry is heavier.
template <std::floating_point S, int D>
class BodyForce {
public:
    BodyForce(const Body& body, AnyForce<S, D> force) : body_(body), between_(std::move(force)) {}

    AnyForce<S, D>& force() { return between_; }
    bool may_open_regions() const { return between_.may_open_regions(); }

    /// \param particles  in any order
    /// \throws particle_error  naming the first of those that would get a velocity that is not finite
    template <class Particles>
    void push(Particles& particles, const Moment& now, double dt, int threads) {
        look_at(particles, threads);
        renew(force_, position_.size(), threads);
        fill_chunks(force_, Vec<S, D>::zero(), threads);
        between_.add_forces(view(now.time), force_, threads);
        LowestId wrong;
        for_slots(particles, threads, [&](std::size_t slot, std::size_t i) {
            const Vec<S, D> after = velocity_[i] + force_[i] * (S(dt) / mass_[i]);
            particles.set_velocity(slot, after);
            if (!is_finite(after)) wrong.see(particles.id(slot));
        });
        wrong.refuse("a force between particles", now, dt);
    }

    /// Above it [s] an explicit step lets what the force joins fly apart.
    template <class Particles>
    double largest_step(const Particles& particles, double time, int threads) {
        look_at(particles, threads);
        return detail::largest_step<S, D>(std::span(&between_, 1), view(time), threads);
    }

private:
    PointView<S, D> view(double time) const { return {position_, velocity_, mass_, radius_, time}; }

    /// Calls f(slot, i) for the particles of the body.
    template <class Particles, class F>
    void for_slots(Particles& particles, int threads, const F& f) const {
        for_chunks(particles.slots(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t slot = first; slot < last; ++slot)
                if (particles.is_particle(slot) && body_.holds(particles.id(slot)))
                    f(slot, std::size_t(particles.id(slot) - body_.first));
        });
    }

    template <class Particles>
    void look_at(const Particles& particles, int threads) {
        renew(position_, body_.count, threads);
        renew(velocity_, body_.count, threads);
        renew(radius_, body_.count, threads);
        renew(mass_, body_.count, threads);
        for_chunks(body_.count, threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                position_[i] = velocity_[i] = Vec<S, D>::zero();  // of what a sink took
                radius_[i] = mass_[i] = 0;
            }
        });
        for_slots(particles, threads, [&](std::size_t slot, std::size_t i) {
            position_[i] = particles.position(slot);
            velocity_[i] = particles.velocity(slot);
            mass_[i] = particles.mass(slot);
        });
        drop_lost();
    }

    /// Particles that a sink took: whatever joined them is gone.
    void drop_lost() {
        std::size_t lost = 0;
        for (const S mass : mass_) lost += mass == 0;
        if (lost == lost_) return;
        lost_ = lost;
        std::vector<std::uint32_t> place(mass_.size());
        for (std::size_t i = 0; i < place.size(); ++i) place[i] = mass_[i] == 0 ? no_particle : std::uint32_t(i);
        between_.renumber(place);
    }

    Body body_;
    AnyForce<S, D> between_;
    aligned_vector<Vec<S, D>> position_, velocity_, force_;
    aligned_vector<S> mass_, radius_;
    std::size_t lost_ = 0;
};

}  // namespace firn::detail
