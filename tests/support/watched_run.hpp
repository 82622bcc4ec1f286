/// \file A simulation whose boundary's reactions are asked for, and what is summed over its particles.
#pragma once

#include <firn/firn.hpp>

namespace scenes {

template <int D, class S, class Boundary>
class WatchedRun : public firn::Simulation<D, firn::FixedCorotated<S>, firn::Apic, firn::MlsForce,
                                           firn::QuadraticBSpline, firn::Coloured, Boundary> {
public:
    /// No gravity.
    WatchedRun(const firn::Domain<D>& domain, const firn::FixedCorotated<S>& material, const Boundary& solid)
        : WatchedRun::Simulation(domain, material, {}, solid) {
        this->gravity = {};
        this->reactions.emplace();
    }

    void step(double dt) {
        this->fixed_time_step = dt;
        WatchedRun::Simulation::step();
    }
    /// What part k of the boundary gave to matter in the last step.
    const firn::Reaction<D>& reaction(std::size_t k = 0) const { return this->reactions->parts[k]; }

    template <class F>
    void for_particles(const F& f) const {
        for (std::size_t slot = 0; slot < this->particles().slots(); ++slot)
            if (this->particles().is_particle(slot)) f(slot);
    }
    double mass() const {
        double sum = 0;
        for_particles([&](std::size_t slot) { sum += double(this->particles().mass(slot)); });
        return sum;
    }
    firn::Vec<double, D> momentum() const {
        firn::Vec<double, D> sum{};
        for_particles([&](std::size_t slot) {
            sum += firn::cast<double>(this->particles().velocity(slot)) * double(this->particles().mass(slot));
        });
        return sum;
    }
    firn::Vec<double, D> centre() const {
        firn::Vec<double, D> sum{};
        for_particles([&](std::size_t slot) {
            sum += this->particles().exact_position(slot) * double(this->particles().mass(slot));
        });
        return sum * (1 / mass());
    }
};

}  // namespace scenes
