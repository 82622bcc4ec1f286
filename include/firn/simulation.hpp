/// \file Sets of particles, a grid and a boundary, stepped through time. It only composes the stages of exec/.
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
#include <span>
#include <string>
#include <tuple>

namespace firn {

/// Several constitutive models in one simulation, all of one precision: Simulation<3, Materials<Snow<float>,
/// Sand<float>>>. Each has particles of its own, with its own state; all meet on one grid.
template <class... M>
struct Materials {
    std::tuple<M...> models;

    Materials() = default;
    Materials(const M&... each) : models(each...) {}
};

namespace detail {
template <class Material>
struct material_list {
    using type = Materials<Material>;
};
template <class... M>
struct material_list<Materials<M...>> {
    using type = Materials<M...>;
};
template <class List>
struct first_material;
template <class First, class... Rest>
struct first_material<Materials<First, Rest...>> {
    using type = First;
    static_assert((std::same_as<material_scalar_t<First>, material_scalar_t<Rest>> && ...),
                  "firn: the materials of one simulation are of one precision.");
};
/// The precision of a material, or of a list of them.
template <class Material>
using precision_of_t = material_scalar_t<typename first_material<typename material_list<Material>::type>::type>;
}  // namespace detail

/// The ids [first, first + count) that one call of Simulation::add gave out among the particles of its material.
struct Body {
    std::uint32_t first = 0, count = 0;
};

/// A material's particles and what is known of them.
template <int D, class Material>
struct MaterialSet {
    static_assert(require_material<Material, D>());
    using S = material_scalar_t<Material>;

    Material material;
    Particles<S, D, material_state_t<Material, D>> particles;
    BlockPartition<D> partition{};
    std::vector<Body> bodies{};
    G2PReport report{};      ///< of the last G2P
    bool prepared = false;   ///< sorted, with stress and report up to date
    bool as_sorted = false;  ///< no step since particles were sorted
};

/// \tparam D         2 or 3
/// \tparam Material  a constitutive model in float or double, which becomes the precision of everything; or several,
///                   Materials<…>: functions that concern one of them are then told which, add<Snow<float>>(…), or by
///                   its place in the list, add<1>(…)
template <int D, class Material = FixedCorotated<float>, class Transfer = Apic, class Force = MlsForce,
          class Kernel = QuadraticBSpline, class Execution = Coloured,
          class Boundary = Walls<detail::precision_of_t<Material>, D>>
class Simulation {
    using List = typename detail::material_list<Material>::type;
    template <class L>
    struct sets_of;
    template <class... M>
    struct sets_of<Materials<M...>> {
        using type = std::tuple<MaterialSet<D, M>...>;
        static type make(const Materials<M...>& materials, const Domain<D>& domain) {
            return std::apply(
                [&](const M&... model) {
                    return type{MaterialSet<D, M>{model, decltype(MaterialSet<D, M>::particles)(domain)}...};
                },
                materials.models);
        }
        template <class Wanted>
        static constexpr std::size_t index() {
            static_assert((std::size_t(std::same_as<Wanted, M>) + ...) == 1,
                          "firn: name one material of the simulation; if it is there twice, by its place.");
            std::size_t i = 0, found = 0;
            ((std::same_as<Wanted, M> ? void(found = i) : void(), ++i), ...);
            return found;
        }
    };

public:
    static_assert(D == 2 || D == 3, "firn simulates in two or three dimensions");
    static_assert(require_kernel<Kernel>());
    static_assert(transfer<Transfer> && force<Force>);

    using scalar_type = detail::precision_of_t<Material>;
    using S = scalar_type;
    using Sets = typename sets_of<List>::type;
    static constexpr int dimension = D;
    static constexpr std::size_t material_count = std::tuple_size_v<Sets>;

    /// \throws parameter_error if the domain is empty, not finite, or has too many or too few cells
    explicit Simulation(const Domain<D>& domain, const Material& material = {}, const Execution& how = {})
        : Simulation(domain, material, how, default_boundary(domain)) {}
    Simulation(const Domain<D>& domain, const Material& material, const Execution& how, const Boundary& walls)
        : boundary(walls), execution(how), grid_(domain), sets_(sets_of<List>::make(List(material), domain)) {
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
    const SparseGrid<S, D>& grid() const { return grid_; }
    double time() const { return time_; }  ///< [s]
    std::uint64_t steps() const { return steps_; }
    double last_time_step() const { return last_time_step_; }  ///< [s]

    /// Of the material with that place in the list; the first where none is named.
    template <std::size_t I = 0>
    const auto& material() const {
        return std::get<I>(sets_).material;
    }
    template <std::size_t I = 0>
    const auto& particles() const {
        return std::get<I>(sets_).particles;
    }
    template <std::size_t I = 0>
    const std::vector<Body>& bodies() const {
        return std::get<I>(sets_).bodies;
    }
    /// Of the material M.
    template <class M>
    const M& material() const {
        return material<place_of<M>>();
    }
    template <class M>
    const auto& particles() const {
        return particles<place_of<M>>();
    }
    template <class M>
    const std::vector<Body>& bodies() const {
        return bodies<place_of<M>>();
    }

    /// Particles for editing (velocities of a body, say). The next step looks at them anew.
    template <std::size_t I = 0>
    auto& edit_particles() {
        std::get<I>(sets_).prepared = false;
        return std::get<I>(sets_).particles;
    }
    template <class M>
    auto& edit_particles() {
        return edit_particles<place_of<M>>();
    }

    /// Adds a body of uniform density [kg/m³; kg/m² in 2D] and velocity [m/s].
    /// \throws parameter_error, particle_error (nothing is added)
    template <std::size_t I = 0>
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        return add_to(std::get<I>(sets_), samples, density, velocity);
    }
    template <class M>
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        return add<place_of<M>>(samples, density, velocity);
    }

    /// The largest stable time step for the particles as they are [s].
    double stable_time_step() {
        prepare();
        double fastest = 0;
        for_sets([&](const auto& set) { fastest = std::max(fastest, set.report.signal_speed); });
        return firn::stable_time_step(domain().cell_size, fastest);
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

    /// The partition in use: which blocks a material's particles are sorted into.
    template <std::size_t I = 0>
    const BlockPartition<D>& partition() {
        prepare();
        return std::get<I>(sets_).partition;
    }

    /// What the last G2P saw: the bound of the next step comes from it.
    template <std::size_t I = 0>
    const G2PReport& report() {
        prepare();
        return std::get<I>(sets_).report;
    }

    /// Goes back to a stored moment: the particles, partition and report of then, in the order of then, so that the run
    /// goes on to the same bits. With several materials: of each.
    template <std::size_t I = 0>
    void restore(std::tuple_element_t<I, Sets>&& set, double time, std::uint64_t steps, double last_time_step) {
        std::get<I>(sets_) = std::move(set);
        time_ = time;
        steps_ = steps;
        last_time_step_ = last_time_step;
        activate();
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
        const bool due = most_steps_between_sorts > 0 && steps_ % most_steps_between_sorts == 0;
        bool sorted = false;
        for_sets([&](auto& set) {
            set.prepared = false;  // should the step fail, the next one looks at the particles anew
            if (set.report.sort_needed || (due && !set.as_sorted)) {
                sort(set);
                sorted = true;
            }
            set.as_sorted = false;
        });
        if (sorted) activate();
        std::apply(
            [&](auto&... set) {
                p2g<Kernel, Transfer, Force>(execution, grid_, dt, ParticleSet{set.particles.view(), set.partition}...);
            },
            sets_);
        grid_update(execution, grid_, dt, acceleration, boundary);
        for_sets([&](auto& set) {
            set.report =
                g2p<Kernel, Transfer, Force>(execution, set.particles.view(), set.partition, grid_, set.material, dt);
        });
        for_sets([](auto& set) { set.prepared = true; });
        time_ += dt;
        last_time_step_ = dt;
        ++steps_;
    }

    /// Makes ready for a step particles that were added or changed by hand.
    void prepare() {
        bool changed = false;
        double fastest = 0;
        for_sets([&](auto& set) {
            changed = changed || !set.prepared;
            if (!set.prepared) prepare(set);
            if (!(set.report.signal_speed <= fastest)) fastest = set.report.signal_speed;
        });
        if (!changed) return;
        if (!std::isfinite(fastest) || !(fastest > 0)) {
            for_sets([](auto& set) { set.prepared = false; });
            throw particle_error(sentence(
                "The fastest signal among the particles (their speed, plus the material's wave speed) is ", fastest,
                " m/s; velocities and deformation gradients must be finite, and the moduli positive."));
        }
        activate();
    }
    template <class Set>
    void prepare(Set& set) {
        const auto& particles = set.particles;
        std::size_t of_all = 0;
        for_sets([&](const auto& other) { of_all += other.particles.size(); });
        if (particles.size() == 0 && of_all > 0) {  // there may be some later
            set.partition = {};
            set.report = {};
            set.prepared = true;
            return;
        }
        check_positions<double, D>(particles.slots(), domain(), [&](std::size_t i, int a) {
            return particles.is_particle(i) ? particles.exact_position(i)[a] : domain().lower[a];
        });
        sort(set);
        set.report = update_stress(execution, set.particles.view(), set.partition, set.material);
        set.prepared = true;
    }

    template <class Set>
    void sort(Set& set) {
        set.partition = sort_particles<Kernel>(set.particles, requested_threads(execution));
        set.as_sorted = true;
    }
    void activate() {
        std::array<BlockPartition<D>*, material_count> all{};
        std::size_t i = 0;
        for_sets([&](auto& set) { all[i++] = &set.partition; });
        grid_.activate(all);
    }

    template <class F>
    void for_sets(const F& f) {
        std::apply([&](auto&... set) { (f(set), ...); }, sets_);
    }

    template <class Set>
    Body add_to(Set& set, const Samples<D>& samples, double density, const Vec<double, D>& velocity) {
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
        const Body body{set.particles.next_id(), std::uint32_t(x.size())};
        set.particles.reserve(set.particles.size() + x.size());
        for (const auto& point : x) set.particles.push_back(point, cast<S>(velocity), mass, volume);
        set.bodies.push_back(body);
        set.prepared = false;
        return body;
    }

    void warn_of(double ratio) {
        if (ratio < 1.2 * warned_ratio_) return;
        warned_ratio_ = ratio;
        warn(sentence("the fixed time step of ", fixed_time_step, " s is ", ratio, " times the bound of ",
                      fixed_time_step / ratio, " s at step ", steps_, "; the simulation may become unstable."));
    }

    template <class M>
    static constexpr std::size_t place_of = sets_of<List>::template index<M>();

    SparseGrid<S, D> grid_;
    Sets sets_;
    double time_ = 0, last_time_step_ = 0, warned_ratio_ = 1 / 1.2;
    std::uint64_t steps_ = 0;
};

}  // namespace firn
