/// \file A set of particles, a grid and a boundary, stepped through time. It only composes the stages of exec/.
#pragma once

#include <firn/boundary/walls.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/sampling.hpp>
#include <firn/exec/g2p.hpp>
#include <firn/exec/grid_update.hpp>
#include <firn/exec/p2g_fixed_point.hpp>
#include <firn/exec/partition.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/stage/time_step.hpp>
#include <firn/transfer/apic.hpp>

#include <functional>
#include <iostream>
#include <string>

namespace firn {

/// The ids [first, first + count) that one call of Simulation::add gave out.
struct Body {
    std::uint32_t first = 0, count = 0;
};

/// \tparam D         2 or 3
/// \tparam Material  a constitutive model in float or double, which becomes the precision of everything
template <int D, class Material = FixedCorotated<float>, class Transfer = Apic, class Force = MlsForce,
          class Kernel = QuadraticBSpline, class Execution = Coloured,
          class Boundary = Walls<material_scalar_t<Material>, D>>
class Simulation {
public:
    static_assert(D == 2 || D == 3, "firn simulates in two or three dimensions");
    static_assert(require_material<Material, D>() && require_kernel<Kernel>());
    static_assert(transfer<Transfer> && force<Force>);

    using scalar_type = material_scalar_t<Material>;
    using S = scalar_type;
    using State = material_state_t<Material, D>;
    static constexpr int dimension = D;

    /// \throws parameter_error if the domain is empty, not finite, or has too many or too few cells
    explicit Simulation(const Domain<D>& domain, const Material& material = {}, const Execution& how = {})
        : Simulation(domain, material, how, default_boundary(domain)) {}
    Simulation(const Domain<D>& domain, const Material& material, const Execution& how, const Boundary& walls)
        : boundary(walls), execution(how), material_(material), grid_(domain), particles_(domain) {
        gravity[1] = -9.81;
    }

    Vec<double, D> gravity = Vec<double, D>::zero();  ///< [m/s²]; −9.81 along y unless changed
    Boundary boundary;                                ///< by default: walls on all faces that let go, without friction
    Execution execution;
    double fixed_time_step = 0;  ///< [s]; 0: the bound of the time step, anew for every step
    /// Particles are sorted when one may leave the reach of its block; and whenever the number of steps is a multiple
    /// of this, unless it is 0.
    std::uint64_t most_steps_between_sorts = 0;
    /// Takes warnings: a fixed time step above the bound. By default they go to std::cerr.
    std::function<void(const std::string&)> warn = [](const std::string& text) {
        std::cerr << "firn: " << text << '\n';
    };

    const Domain<D>& domain() const { return grid_.domain(); }
    const Material& material() const { return material_; }
    const SparseGrid<S, D>& grid() const { return grid_; }
    const Particles<S, D, State>& particles() const { return particles_; }
    const std::vector<Body>& bodies() const { return bodies_; }
    double time() const { return time_; }  ///< [s]
    std::uint64_t steps() const { return steps_; }
    double last_time_step() const { return last_time_step_; }  ///< [s]

    /// Particles for editing (velocities of a body, say). The next step looks at them anew.
    Particles<S, D, State>& edit_particles() {
        prepared_ = false;
        return particles_;
    }

    /// Adds a body of uniform density [kg/m³; kg/m² in 2D] and velocity [m/s].
    /// \throws parameter_error, particle_error (nothing is added)
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        if (!(density > 0) || !std::isfinite(density))
            throw parameter_error(
                sentence("The density is ", density, " kg/m^", D, "; it must be positive and finite."));
        if (!(samples.volume > 0) || !std::isfinite(samples.volume))
            throw parameter_error(sentence("The volume of a particle is ", samples.volume, " m^", D,
                                           "; it must be positive and finite."));
        for (int a = 0; a < D; ++a)
            if (!std::isfinite(velocity[a]))
                throw parameter_error(
                    sentence("Component ", a, " of the velocity is ", velocity[a], "; it must be finite."));
        const S volume = S(samples.volume), mass = S(density * samples.volume);
        if (!(volume > 0) || !(mass > 0) || !std::isfinite(volume) || !std::isfinite(mass))
            throw parameter_error(sentence("A particle of ", samples.volume, " m^", D, " and ",
                                           density * samples.volume,
                                           " kg is too small or too large for the simulation's precision. Use "
                                           "double."));
        const auto& x = samples.positions;
        check_positions<double, D>(x.size(), domain(), [&](std::size_t i, int a) { return x[i][a]; });
        const Body body{std::uint32_t(particles_.size()), std::uint32_t(x.size())};
        particles_.reserve(particles_.size() + x.size());
        for (const auto& point : x) particles_.push_back(point, cast<S>(velocity), mass, volume);
        bodies_.push_back(body);
        prepared_ = false;
        return body;
    }

    /// The largest stable time step for the particles as they are [s].
    double stable_time_step() {
        prepare();
        return firn::stable_time_step<Kernel>(domain().cell_size, report_.signal_speed);
    }

    /// One step of the fixed time step, or of the bound.
    void step() { step(gravity); }

    /// \param acceleration  a field a(x) [m/s²] in place of gravity: callable with Vec<P, D> for any scalar P, or a
    /// vector
    template <class Acceleration>
    void step(const Acceleration& acceleration) {
        step_by(next_time_step(), acceleration);
    }

    /// Steps until `duration` [s] has passed; the last step is shortened to end there.
    void advance(double duration) { advance(duration, gravity); }
    template <class Acceleration>
    void advance(double duration, const Acceleration& acceleration) {
        if (!(duration >= 0) || !std::isfinite(duration))
            throw parameter_error(sentence("The time to advance is ", duration, " s; it must not be negative."));
        const double end = time_ + duration;
        while (time_ < end) {
            const double dt = next_time_step();
            const double left = end - time_;
            step_by(left < dt * (1 + 1e-9) ? left : dt, acceleration);
            if (left < dt * (1 + 1e-9)) time_ = end;
        }
    }

    /// The partition in use: which blocks particles are sorted into.
    const BlockPartition<D>& partition() {
        prepare();
        return partition_;
    }

    /// What the last G2P saw: the bound of the next step comes from it.
    const G2PReport& report() {
        prepare();
        return report_;
    }

    /// Goes back to a stored moment: the particles, partition and report of then, in the order of then, so that the run
    /// goes on to the same bits.
    void restore(Particles<S, D, State>&& particles, BlockPartition<D>&& partition, std::vector<Body> bodies,
                 const G2PReport& report, double time, std::uint64_t steps, double last_time_step) {
        grid_.activate(partition);
        particles_ = std::move(particles);
        partition_ = std::move(partition);
        bodies_ = std::move(bodies);
        report_ = report;
        time_ = time;
        steps_ = steps;
        last_time_step_ = last_time_step;
        prepared_ = true;
        as_sorted_ = false;
    }

private:
    static Boundary default_boundary(const Domain<D>& domain) {
        if constexpr (std::same_as<Boundary, Walls<S, D>>)
            return Boundary::all(cast<S>(domain.lower), cast<S>(domain.upper), {});
        else
            return {};
    }

    /// The fixed time step, with a warning where it is above the bound; or the bound.
    double next_time_step() {
        const double bound = stable_time_step();
        if (fixed_time_step < 0 || !std::isfinite(fixed_time_step))
            throw parameter_error(
                sentence("The fixed time step is ", fixed_time_step, " s; it must be positive, or 0 for the bound."));
        if (fixed_time_step > bound) warn_of(fixed_time_step / bound);
        return fixed_time_step > 0 ? fixed_time_step : bound;
    }

    template <class Acceleration>
    void step_by(double dt, const Acceleration& acceleration) {
        prepared_ = false;  // should the step fail, the next one looks at the particles anew
        const bool due = most_steps_between_sorts > 0 && steps_ % most_steps_between_sorts == 0 && !as_sorted_;
        if (report_.sort_needed || due) sort();
        as_sorted_ = false;
        const auto view = particles_.view();
        p2g<Kernel, Transfer, Force>(execution, view, partition_, grid_, dt);
        grid_update(execution, grid_, dt, acceleration, boundary);
        report_ = g2p<Kernel, Transfer, Force>(execution, view, partition_, grid_, material_, dt);
        time_ += dt;
        last_time_step_ = dt;
        ++steps_;
        prepared_ = true;
    }

    /// Makes ready for a step particles that were added or changed by hand.
    void prepare() {
        if (prepared_) return;
        check_positions<double, D>(particles_.slots(), domain(), [&](std::size_t i, int a) {
            return particles_.is_particle(i) ? particles_.exact_position(i)[a] : domain().lower[a];
        });
        sort();
        report_ = update_stress(execution, particles_.view(), partition_, material_);
        if (!std::isfinite(report_.signal_speed) || !(report_.signal_speed > 0))
            throw particle_error(
                sentence("The fastest signal among the particles (their speed, plus the material's wave speed) is ",
                         report_.signal_speed,
                         " m/s; velocities and deformation gradients must be finite, and the moduli positive."));
        prepared_ = true;
    }

    void sort() {
        partition_ = sort_particles<Kernel>(particles_, requested_threads(execution));
        grid_.activate(partition_);
        as_sorted_ = true;
    }

    void warn_of(double ratio) {
        if (ratio < 1.2 * warned_ratio_) return;
        warned_ratio_ = ratio;
        warn(sentence("the fixed time step of ", fixed_time_step, " s is ", ratio, " times the bound of ",
                      fixed_time_step / ratio, " s at step ", steps_, "; the simulation may become unstable."));
    }

    Material material_;
    SparseGrid<S, D> grid_;
    Particles<S, D, State> particles_;
    BlockPartition<D> partition_;
    std::vector<Body> bodies_;
    G2PReport report_;
    double time_ = 0, last_time_step_ = 0, warned_ratio_ = 1 / 1.2;
    std::uint64_t steps_ = 0;
    bool prepared_ = false;
    bool as_sorted_ = false;  // no step since particles were sorted
};

}  // namespace firn
