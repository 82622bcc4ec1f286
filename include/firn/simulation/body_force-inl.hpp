/// \file Bodies of body_force.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/simulation/body_force.hpp>

namespace firn::inline FIRN_BUILD::detail {

template <std::floating_point S, int D>
AnyForce<S, D>& BodyForces<S, D>::add(const Body& body, AnyForce<S, D> force) {
    if (force.may_tear())
        throw parameter_error(
            "Springs between particles of a grid do not tear. Give them no tear factor, or use a ParticleSystem.");
    const auto is_of = [&](const JoinedPoints<S, D>& points) {
        return points.body().first == body.first && points.body().count == body.count;
    };
    const auto of = std::size_t(std::find_if(points_.begin(), points_.end(), is_of) - points_.begin());
    if (of == points_.size()) points_.emplace_back(body);
    forces_.push_back({of, std::move(force)});
    return forces_.back().between;
}

template <std::floating_point S, int D>
double BodyForces<S, D>::largest_step(const ParticleStore<S, D>& particles, double time, int threads) {
    read(particles, threads);
    double bound = std::numeric_limits<double>::infinity();
    for (BodyForce<S, D>& force : forces_) {
        const double step =
            detail::largest_step<S, D>(std::span(&force.between, 1), points_[force.points].view(time), threads);
        force.limits_step = std::isfinite(step);
        bound = std::min(bound, step);
    }
    return bound;
}

template <std::floating_point S, int D>
double BodyForces<S, D>::largest_acceleration(const ParticleStore<S, D>& particles, double time, int threads) {
    if (!is_read_) static_cast<void>(largest_step(particles, time, threads));
    double most = 0;
    for (BodyForce<S, D>& force : forces_) {
        if (force.limits_step) continue;
        const PointView<S, D> points = points_[force.points].view(time);
        add_up(force, time, threads);
        for (std::size_t i = 0; i < points.size(); ++i)
            if (const double a = norm(cast<double>(sum_[i])) / double(points.mass[i]); std::isfinite(a))
                most = std::max(most, a);
    }
    return most;
}

template <std::floating_point S, int D>
void BodyForces<S, D>::push(ParticleStore<S, D>& particles, const Moment& now, double dt, bool /* in_float */,
                            int threads, const SumsOfSet<D>&) {
    if (!is_read_) read(particles, threads);
    for (BodyForce<S, D>& force : forces_) {
        add_up(force, now.time, threads);
        LowestId wrong;
        points_[force.points].push(particles, sum_, dt, wrong, threads);
        wrong.refuse("a force between particles", now, dt);
    }
    forget();
}

template <std::floating_point S, int D>
void BodyForces<S, D>::add_up(BodyForce<S, D>& force, double time, int threads) {
    const JoinedPoints<S, D>& points = points_[force.points];
    renew(sum_, points.size(), threads);
    fill_chunks(sum_, Vec<S, D>::zero(), threads);
    force.between.add_forces(points.view(time), sum_, threads);
}

template <std::floating_point S, int D>
void BodyForces<S, D>::read(const ParticleStore<S, D>& particles, int threads) {
    for (JoinedPoints<S, D>& points : points_) points.read(particles, threads);
    for (BodyForce<S, D>& force : forces_) force.drop_lost(points_[force.points]);
    is_read_ = true;
}

}  // namespace firn::inline FIRN_BUILD::detail
