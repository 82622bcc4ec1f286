/// \file Forces between the particles of a body, in addition to the forces of the constitutive model.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/lagrangian/any_force.hpp>
#include <firn/simulation/body.hpp>
#include <firn/simulation/push.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Copies of the particles of a body: the points between which forces act. The particle of point i has the id
/// body().first + i. All forces between the particles of this body use the same points. The points are read once per
/// step, in the order of the particles in memory.
template <std::floating_point S, int D>
class JoinedPoints {
public:
    explicit JoinedPoints(const Body& body) : body_(body) {}

    const Body& body() const { return body_; }
    PointView<S, D> view(double time) const { return {position_, velocity_, mass_, radius_, time}; }
    std::size_t size() const { return position_.size(); }

    /// Copies the particles of the body to the points, and stores the slot (place in memory) of each particle.
    void read(const ParticleStore<S, D>& particles, int threads) {
        renew(position_, body_.count, threads);
        renew(velocity_, body_.count, threads);
        renew(radius_, body_.count, threads);
        renew(mass_, body_.count, threads);
        renew(slot_, body_.count, threads);
        for_chunks(body_.count, threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                position_[i] = Vec<double, D>::zero();  // the point keeps zeros if its particle was removed
                velocity_[i] = Vec<S, D>::zero();
                radius_[i] = mass_[i] = 0;
                slot_[i] = no_particle;
            }
        });
        for_chunks(particles.slots(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t slot = first; slot < last; ++slot) {
                const std::uint32_t id = particles.id(slot);
                if (id == no_particle || !body_.holds(id)) continue;
                const std::size_t i = id - body_.first;
                position_[i] = particles.exact_position(slot);
                velocity_[i] = particles.velocity(slot);
                mass_[i] = particles.mass(slot);
                slot_[i] = std::uint32_t(slot);
            }
        });
        lost_ = std::size_t(std::count(slot_.begin(), slot_.end(), no_particle));
    }

    /// Changes the particles' velocities by the impulses of the forces over a step of dt [s].
    /// \param force  the force on each point [N]
    /// \param wrong  receives the ids of particles whose velocity is not finite afterwards
    void push(ParticleStore<S, D>& particles, std::span<const Vec<S, D>> force, double dt, LowestId& wrong,
              int threads) {
        for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                if (slot_[i] == no_particle) continue;
                velocity_[i] = velocity_[i] + force[i] * (S(dt) / mass_[i]);
                particles.set_velocity(slot_[i], velocity_[i]);
                if (!is_finite(velocity_[i])) wrong.see(std::uint32_t(body_.first + i));
            }
        });
    }

    /// Returns how many points of the body are without a particle, because the particle was removed.
    std::size_t lost() const { return lost_; }
    /// Returns a list with one entry for each point: the index of the point, or no_particle if the particle of the
    /// point was removed.
    std::vector<std::uint32_t> places() const {
        std::vector<std::uint32_t> places(size());
        for (std::size_t i = 0; i < size(); ++i) places[i] = slot_[i] == no_particle ? no_particle : std::uint32_t(i);
        return places;
    }

private:
    Body body_;
    aligned_vector<Vec<double, D>> position_;
    aligned_vector<Vec<S, D>> velocity_;
    aligned_vector<S> mass_, radius_;
    aligned_vector<std::uint32_t> slot_;
    std::size_t lost_ = 0;
};

/// A force between the particles of a body: springs, membranes, wind.
///
/// The impulse dt f_p of the force f_p on particle p is added to its momentum m_p v_p. P2G then gives node i the
/// momentum Σ_p w_ip (m_p v_p + dt f_p), with weights w_ip, as for a Lagrangian mesh (Jiang, Schroeder, Selle, Teran,
/// Stomakhin 2015, §9). With the grid, the frequencies of the mesh are not higher than without the grid, because nodes
/// are heavier than particles. So a time step that is stable for the mesh without a grid is stable here, too.
template <std::floating_point S, int D>
struct BodyForce {
    std::size_t points;  ///< index, in the list of JoinedPoints, of the points on which the force acts
    AnyForce<S, D> between;
    std::size_t lost = 0;      ///< number of points without a particle at the last call of drop_lost()
    bool limits_step = false;  ///< whether the force has stiffness or damping, which limit the time step

    /// Removes the springs and elements that have a point whose particle was removed.
    /// \param of  the points on which the force acts
    void drop_lost(const JoinedPoints<S, D>& of) {
        if (lost != of.lost()) between.renumber(of.places());
        lost = of.lost();
    }
};

/// The forces between the particles of a set, in the order in which they were added.
template <std::floating_point S, int D>
class BodyForces final : public Push<S, D> {
public:
    std::unique_ptr<Push<S, D>> copy() const override { return std::make_unique<BodyForces>(*this); }
    bool may_open_regions() const override {
        return std::any_of(forces_.begin(), forces_.end(), [](const auto& f) { return f.between.may_open_regions(); });
    }

    /// \throws parameter_error  if the force has springs that may tear; on the grid, springs do not tear
    AnyForce<S, D>& add(const Body& body, AnyForce<S, D> force);

    /// Returns the largest stable time step for these forces [s]. Reads the points from the particles first, because
    /// the particles have moved since the last step.
    double largest_step(const ParticleStore<S, D>& particles, double time, int threads) override;

    double largest_acceleration(const ParticleStore<S, D>& particles, double time, int threads) override;

    void forget() override { is_read_ = false; }

    /// Applies the forces one after the other, in the order in which they were added. Each force acts on velocities
    /// that the previous forces have already changed.
    void push(ParticleStore<S, D>& particles, const Moment& now, double dt, bool in_float, int threads,
              const SumsOfSet<D>&) override;

private:
    /// Computes the forces on the points of a body force.
    void add_up(BodyForce<S, D>& force, double time, int threads);
    void read(const ParticleStore<S, D>& particles, int threads);

    std::vector<JoinedPoints<S, D>> points_;
    std::vector<BodyForce<S, D>> forces_;
    aligned_vector<Vec<S, D>> sum_;
    bool is_read_ = false;
};

}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_HAS_BODIES
#include <firn/simulation/body_force-inl.hpp>
#endif
