/// \file A short run whose start and parameters depend on one number t, so that the derivative of what it measures can
/// be compared with difference quotients.
#pragma once

#include "support/random_numbers.hpp"
#include <firn/adjoint.hpp>
#include <firn/firn.hpp>

#include <functional>
#include <stdexcept>

namespace derivatives {

using namespace firn;
using test_support::Random;

/// Returns the 5-point difference quotient of at(t) at t = 0, for steps of size h.
template <class Value>
double difference_quotient(const Value& at, double h) {
    return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
}

/// How much inputs change with t, relative to their usual sizes.
struct Along {
    double position = 0, velocity = 0, affine = 0, state = 0, mass = 0, volume = 0, material = 0, transfer = 0,
           gravity = 0, boundary = 0;
};

/// A run of a few steps of a block of matter, strained and moving at random. What changes with t does so in random
/// directions.
template <class Simulation>
struct Run {
    static constexpr int D = Simulation::dimension;
    using Material = typename Simulation::material_type;
    using Transfer = decltype(Simulation::transfer);
    using Boundary = decltype(Simulation::boundary);
    static constexpr double h = 1. / 16;

    Material material;
    Boundary boundary;
    int steps = 3;
    double dt = 2e-4;
    double strain = 0.03;   ///< of the first states
    double stretch = 1;     ///< of the first states
    double speed = 1;       ///< of particles [m/s]
    double downwards = -2;  ///< of the block [m/s]
    Along along{1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    std::array<bool, std::size_t(D)> periodic{};
    bool boundary_changes = true;
    Transfer transfer{};

    /// The simulation at t. \param change  change(number, size) is called for each number that depends on t
    template <class Change>
    Simulation made(const Change& change) const {
        Random random(3);
        Material own = material;
        firn::detail::for_numbers<double>(own, [&](double& p) { change(p, along.material * p); });
        Boundary walls = boundary;
        if (boundary_changes)
            firn::detail::for_numbers<double>(walls, [&](double& p) { change(p, along.boundary * 0.1); });
        Domain<D> domain(Vec<double, D>::zero(), Vec<double, D>::filled(1), h);
        domain.periodic = periodic;
        Simulation s(domain, own, {}, walls);
        s.transfer = transfer;
        firn::detail::for_numbers<double>(s.transfer, [&](double& p) {
            p = 0.2 + 0.6 * p;  // away from the ends of the range from 0 to 1
            change(p, along.transfer * p);
        });
        for (int a = 0; a < D; ++a) change(s.gravity[a], along.gravity * 10);
        s.fixed_time_step = dt;
        s.warn = {};
        // In reach of the walls.
        const Vec<double, D> low = Vec<double, D>::filled(0.03), high = Vec<double, D>::filled(D == 2 ? 0.35 : 0.17);
        s.add(sample_box(low, high, {.spacing = h / 2, .pattern = Pattern::lattice}), 1000, Vec<double, D>::zero());
        auto& particles = s.edit_particles();
        for (const std::uint32_t slot : slots_by_id(particles, 1)) {
            auto x = particles.exact_position(slot);
            auto v = particles.velocity(slot);
            auto C = particles.affine(slot);
            double m = particles.mass(slot), V = particles.volume(slot);
            auto state = particles.state(slot);
            for (int a = 0; a < D; ++a) x[a] += random.uniform(-0.2, 0.2) * h / 2, change(x[a], along.position * h / 2);
            for (int a = 0; a < D; ++a) v[a] = random.uniform(-speed, speed), change(v[a], along.velocity);
            v[1] += downwards;
            for (double& c : C.m)
                if (Transfer::affine) c = random.uniform(-10, 10), change(c, along.affine * 10);
            m *= random.uniform(0.8, 1.2), change(m, along.mass * m);
            V *= random.uniform(0.8, 1.2), change(V, along.volume * V);
            if constexpr (requires { state.F; })
                state.F =
                    DeformationGradient<double, D>(Mat<double, D>::diagonal(stretch) + random.gaussian<D>() * strain);
            else
                state.J = VolumeRatio<double>::from_excess(random.uniform(-strain, 0) + (stretch - 1));
            std::apply(
                [&](const auto&... field) {
                    const auto change_one = [&](auto& member) {
                        using Stored = firn::detail::Stored<std::remove_cvref_t<decltype(member)>>;
                        auto numbers = Stored::numbers(member);
                        for (double& number : numbers) {
                            if (!Stored::less_one) number += 0.01;  // off the kink at 0 that plastic numbers have
                            change(number, 0.1 * along.state);
                        }
                        member = Stored::made(numbers);
                    };
                    (change_one(state.*field.member), ...);
                },
                std::remove_cvref_t<decltype(state)>::fields());
            particles.set_position(slot, x);
            particles.set_velocity(slot, v);
            particles.set_affine(slot, C);
            particles.set_mass(slot, m);
            particles.set_volume(slot, V);
            particles.set_state(slot, state);
        }
        return s;
    }
    /// The simulation at t: each number changes by t, its size, and a random number.
    Simulation at(double t) const {
        Random direction(11);
        return made([&](double& number, double size) { number += t * size * direction.uniform(-1, 1); });
    }

    /// What is measured of a particle: numbers of all kinds, with weights that depend on its id.
    static constexpr auto measure = [](const auto& p) {
        using T = std::remove_cvref_t<decltype(p.mass)>;
        double weight = 0.3017;  // no multiple of 0.01: sums near whole numbers would jump by how they are rounded
        const auto next = [&] {
            weight = weight * 2.3 + 0.01 * double(p.id % 97);
            weight -= std::floor(weight);
            return T(weight - 0.5);
        };
        T sum = T(0);
        const auto add_term = [&](const T& term) { sum = sum + next() * term; };
        for (int a = 0; a < D; ++a) {
            add_term(p.position[a]);
            add_term(p.position[a] * p.velocity[a]);
            add_term(p.velocity[a] * p.velocity[a]);
        }
        std::apply(
            [&](const auto&... field) {
                const auto add = [&](const auto& member) {
                    for (const T& x : firn::detail::Stored<std::remove_cvref_t<decltype(member)>>::numbers(member))
                        add_term(x + x * x);
                };
                (add(p.state.*field.member), ...);
            },
            std::remove_cvref_t<decltype(p.state)>::fields());
        return sum;
    };
    /// What is measured after the steps.
    double value(double t) const {
        Simulation s = at(t);
        for (int k = 0; k < steps; ++k) s.step();
        Adjoint adjoint(s);
        return adjoint.measure(measure);
    }
    /// The derivative of value(t) at 0, by the gradient.
    double slope(const AdjointOptions& options = {}) const {
        Simulation s = at(0);
        Adjoint adjoint(s, options);
        for (int k = 0; k < steps; ++k) adjoint.step();
        adjoint.measure(measure);
        const auto gradient = adjoint.gradient();
        // The numbers of the gradient in the order in which made() changes them.
        std::vector<double> all;
        const auto add = [&](const auto& policy) {
            auto copy = policy;
            firn::detail::for_numbers<double>(copy, [&](const double& p) { all.push_back(p); });
        };
        const auto& set = gradient.set();
        add(set.material);
        auto total = gradient.intervals[0];
        for (std::size_t k = 1; k < gradient.intervals.size(); ++k) {
            total.gravity += gradient.intervals[k].gravity;
            const auto sum = [](auto& to, auto from) {
                std::vector<double> numbers;
                firn::detail::for_numbers<double>(from, [&](const double& p) { numbers.push_back(p); });
                std::size_t next = 0;
                firn::detail::for_numbers<double>(to, [&](double& p) { p += numbers[next++]; });
            };
            sum(total.boundary, gradient.intervals[k].boundary);
            sum(total.transfer, gradient.intervals[k].transfer);
        }
        if (boundary_changes) add(total.boundary);
        add(total.transfer);
        for (int a = 0; a < D; ++a) all.push_back(total.gravity[a]);
        for (std::size_t id = 0; id < set.position.size(); ++id) {
            for (int a = 0; a < D; ++a) all.push_back(set.position[id][a]);
            for (int a = 0; a < D; ++a) all.push_back(set.velocity[id][a]);
            for (const double c : set.affine[id].m)
                if (Transfer::affine) all.push_back(c);
            all.push_back(set.mass[id]);
            all.push_back(set.volume[id]);
            firn::detail::for_state(set.state[id], [&](double number) { all.push_back(number); });
        }
        Random direction(11);
        double sum = 0;
        std::size_t next = 0;
        static_cast<void>(made([&](double&, double size) { sum += all.at(next++) * size * direction.uniform(-1, 1); }));
        if (next != all.size()) throw std::logic_error("The gradient has other numbers than the run.");
        return sum;
    }
    /// The smallest relative difference of the gradient from a central difference; infinite if the gradient is 0.
    double error() const {
        const double got = slope();
        double least = std::numeric_limits<double>::infinity();
        if (got == 0) return least;
        for (const double t : {1e-4, 1e-5, 1e-6}) {
            const double wanted = difference_quotient([&](double change) { return value(change); }, t);
            least = std::min(least, std::abs(got - wanted) / std::max(std::abs(wanted), 1e-300));
        }
        return least;
    }
};

/// Walls around the domain of a Run.
template <int D>
Walls<double, D> walls_of_run(Contact contact = Contact::separate, double friction = 0.3) {
    return Walls<double, D>::all(Vec<double, D>::zero(), Vec<double, D>::filled(1), {contact, friction});
}

/// An elastic material for runs in which other policies matter.
inline const FixedCorotated<double> jelly = FixedCorotated<double>::from_young_poisson(1e5, 0.3);

}  // namespace derivatives
