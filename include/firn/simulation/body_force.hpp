/// \file Forces between the particles of a body, in addition to those of the constitutive model.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/lagrangian/any_force.hpp>
#include <firn/simulation/body.hpp>
#include <firn/simulation/push.hpp>

#include <algorithm>
#include <limits>
#include <vector>

namespace firn::detail {

/// The particles of a body as the points that forces act between: particle first + i is point i. All forces of the body
/// share them. They are read once a step, in the order of memory.
template <std::floating_point S, int D>
class JoinedPoints {
public:
    explicit JoinedPoints(const Body& body) : body_(body) {}

    const Body& body() const { return body_; }
    PointView<S, D> view(double time) const { return {position_, velocity_, mass_, radius_, time}; }
    std::size_t size() const { return position_.size(); }

    /// Reads all points, and notes their slots.
    void read(const ParticleStore<S, D>& particles, int threads) {
        renew(position_, body_.count, threads);
        renew(velocity_, body_.count, threads);
        renew(radius_, body_.count, threads);
        renew(mass_, body_.count, threads);
        renew(slot_, body_.count, threads);
        for_chunks(body_.count, threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                position_[i] = velocity_[i] = Vec<S, D>::zero();  // stays for particles that were taken out
                radius_[i] = mass_[i] = 0;
                slot_[i] = no_particle;
            }
        });
        for_chunks(particles.slots(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t slot = first; slot < last; ++slot) {
                const std::uint32_t id = particles.id(slot);
                if (id == no_particle || !body_.holds(id)) continue;
                const std::size_t i = id - body_.first;
                position_[i] = particles.position(slot);
                velocity_[i] = particles.velocity(slot);
                mass_[i] = particles.mass(slot);
                slot_[i] = std::uint32_t(slot);
            }
        });
        lost_ = std::size_t(std::count(slot_.begin(), slot_.end(), no_particle));
    }

    /// Adds the impulses of the forces [N] to the particles' velocities.
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

    /// Number of points that have been taken out.
    std::size_t lost() const { return lost_; }
    /// The number of every point, or no_particle if it has been taken out.
    std::vector<std::uint32_t> places() const {
        std::vector<std::uint32_t> places(size());
        for (std::size_t i = 0; i < size(); ++i) places[i] = slot_[i] == no_particle ? no_particle : std::uint32_t(i);
        return places;
    }

private:
    Body body_;
    aligned_vector<Vec<S, D>> position_, velocity_;
    aligned_vector<S> mass_, radius_;
    aligned_vector<std::uint32_t> slot_;
    std::size_t lost_ = 0;
};

/// A force between the particles of a body: springs, membranes, wind.
///
/// Its impulses go to the particles' velocities, and P2G takes them to the nodes: Σ w_ip (m_p v_p + dt f_p), the
/// momentum of a Lagrangian mesh (Jiang, Schroeder, Selle, Teran, Stomakhin 2015, §9). On the grid the mesh's
/// frequencies are no higher than those of a free mesh, because nodes are heavier. So the bound of a free mesh holds.
template <std::floating_point S, int D>
struct BodyForce {
    std::size_t points;  ///< number of the JoinedPoints that it acts on
    AnyForce<S, D> between;
    std::size_t lost = 0;  ///< number of points taken out when it was last renumbered

    /// Removes springs and elements whose points have been taken out.
    void drop_lost(const JoinedPoints<S, D>& of) {
        if (lost != of.lost()) between.renumber(of.places());
        lost = of.lost();
    }
};

/// The forces between the particles of a set, in the order they were added.
template <std::floating_point S, int D>
class BodyForces final : public Push<S, D> {
public:
    std::unique_ptr<Push<S, D>> copy() const override { return std::make_unique<BodyForces>(*this); }
    bool may_open_regions() const override {
        return std::any_of(forces_.begin(), forces_.end(), [](const auto& f) { return f.between.may_open_regions(); });
    }

    AnyForce<S, D>& add(const Body& body, AnyForce<S, D> force) {
        const auto is_of = [&](const JoinedPoints<S, D>& points) {
            return points.body().first == body.first && points.body().count == body.count;
        };
        const auto of = std::size_t(std::find_if(points_.begin(), points_.end(), is_of) - points_.begin());
        if (of == points_.size()) points_.emplace_back(body);
        forces_.push_back({of, std::move(force)});
        return forces_.back().between;
    }

    /// Reads the points, which have moved since the last step.
    double largest_step(const ParticleStore<S, D>& particles, double time, int threads) override {
        read(particles, threads);
        double bound = std::numeric_limits<double>::infinity();
        for (BodyForce<S, D>& force : forces_)
            bound = std::min(bound, detail::largest_step<S, D>(std::span(&force.between, 1),
                                                               points_[force.points].view(time), threads));
        return bound;
    }

    void forget() override { is_read_ = false; }

    /// The forces act in order: each sees the velocities that the ones before it have left.
    void push(ParticleStore<S, D>& particles, const Moment& now, double dt, int threads) override {
        if (!is_read_) read(particles, threads);
        for (BodyForce<S, D>& force : forces_) {
            JoinedPoints<S, D>& points = points_[force.points];
            renew(sum_, points.size(), threads);
            fill_chunks(sum_, Vec<S, D>::zero(), threads);
            force.between.add_forces(points.view(now.time), sum_, threads);
            LowestId wrong;
            points.push(particles, sum_, dt, wrong, threads);
            wrong.refuse("a force between particles", now, dt);
        }
        forget();
    }

private:
    void read(const ParticleStore<S, D>& particles, int threads) {
        for (JoinedPoints<S, D>& points : points_) points.read(particles, threads);
        for (BodyForce<S, D>& force : forces_) force.drop_lost(points_[force.points]);
        is_read_ = true;
    }

    std::vector<JoinedPoints<S, D>> points_;
    std::vector<BodyForce<S, D>> forces_;
    aligned_vector<Vec<S, D>> sum_;
    bool is_read_ = false;
};

}  // namespace firn::detail
