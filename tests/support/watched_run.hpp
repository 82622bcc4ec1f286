/// \file Steps made of the stages, with the reactions of the boundary.
#pragma once

#include <firn/firn.hpp>

#include <vector>

namespace scenes {

/// A set of particles of one material under gravity, and a boundary that moves by itself.
template <int D, class S, class Boundary, class Execution = firn::Coloured>
class WatchedRun {
public:
    using Material = firn::FixedCorotated<S>;
    using State = firn::material_state_t<Material, D>;

    Boundary boundary;
    Execution execution;
    firn::Vec<double, D> gravity{};
    firn::Reactions<D> reactions;

    WatchedRun(const firn::Domain<D>& domain, const Material& material, const Boundary& solid)
        : boundary(solid), material_(material), grid_(domain), particles_(domain) {}

    void add(const std::vector<firn::Vec<double, D>>& positions, double volume, double density,
             const firn::Vec<double, D>& velocity = {}) {
        for (const auto& x : positions)
            particles_.push_back(x, firn::cast<S>(velocity), S(density * volume), S(volume));
        is_ready_ = false;
    }

    /// The boundary is moved on after the step, if it moves by itself.
    void step(double dt) {
        if (!is_ready_) {
            sort();
            report_ = update_stress(execution, particles_.view(), partition_, material_, grid_.domain().cell_size);
            is_ready_ = true;
        }
        if (report_.sort_needed) sort();
        const auto view = particles_.view();
        firn::p2g<firn::QuadraticBSpline, firn::Apic, firn::MlsForce>(execution, view, partition_, grid_, dt);
        firn::grid_update(execution, grid_, dt, gravity, boundary, reactions);
        report_ = firn::g2p<firn::QuadraticBSpline, firn::Apic, firn::MlsForce>(execution, view, partition_, grid_,
                                                                                material_, dt);
        boundary = firn::advanced(boundary, dt);
    }

    double stable_time_step() {
        sort();
        report_ = update_stress(execution, particles_.view(), partition_, material_, grid_.domain().cell_size);
        is_ready_ = true;
        return firn::stable_time_step<firn::QuadraticBSpline>(grid_.domain().cell_size, report_.signal_speed);
    }

    const firn::Particles<S, D, State>& particles() const { return particles_; }
    const firn::SparseGrid<S, D>& grid() const { return grid_; }
    template <class F>
    void for_particles(const F& f) const {
        for (std::size_t slot = 0; slot < particles_.slots(); ++slot)
            if (particles_.is_particle(slot)) f(slot);
    }
    double mass() const {
        double sum = 0;
        for_particles([&](std::size_t slot) { sum += double(particles_.mass(slot)); });
        return sum;
    }
    firn::Vec<double, D> momentum() const {
        firn::Vec<double, D> sum{};
        for_particles([&](std::size_t slot) {
            sum += firn::cast<double>(particles_.velocity(slot)) * double(particles_.mass(slot));
        });
        return sum;
    }
    firn::Vec<double, D> centre() const {
        firn::Vec<double, D> sum{};
        for_particles(
            [&](std::size_t slot) { sum += particles_.exact_position(slot) * double(particles_.mass(slot)); });
        return sum * (1 / mass());
    }

private:
    void sort() {
        partition_ = firn::sort_particles<firn::QuadraticBSpline>(particles_, firn::requested_threads(execution));
        grid_.activate(partition_);
    }

    Material material_;
    firn::SparseGrid<S, D> grid_;
    firn::Particles<S, D, State> particles_;
    firn::BlockPartition<D> partition_;
    firn::G2PReport report_;
    bool is_ready_ = false;
};

}  // namespace scenes
