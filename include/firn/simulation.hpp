/// \file Sets of particles, a grid and a boundary, stepped through time. It only composes the stages of exec/.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/walls.hpp>
#include <firn/core/step_region.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/sampling.hpp>
#include <firn/exec/g2p.hpp>
#include <firn/exec/grid_update.hpp>
#include <firn/exec/p2g_fixed_point.hpp>
#include <firn/exec/totals.hpp>
#include <firn/exec/transfer_passes.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/check.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/simulation/bound.hpp>
#include <firn/simulation/material_set.hpp>
#include <firn/simulation/policies.hpp>
#include <firn/simulation/warnings.hpp>
#include <firn/sort/partition.hpp>
#include <firn/stage/time_step.hpp>
#include <firn/transfer/apic.hpp>

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

namespace firn {

/// It is made from a domain, a material and, in any order, the policies that are to be others than by default:
///
///     firn::Simulation simulation(domain, material, firn::Together(walls, collider), firn::Flip{});
///
/// Where its type must be written: \see SimulationWith
/// \tparam D         2 or 3
/// \tparam Material  a constitutive model in float or double, which becomes the precision of everything; or several,
///                   Materials<…>: functions that concern one of them are then told which, add<Snow<float>>(…), or by
///                   its place in the list, add<1>(…)
template <int D, class Material = FixedCorotated<float>, class Transfer = Apic, class Force = MlsForce,
          class Kernel = QuadraticBSpline, class Execution = Coloured,
          class Boundary = Walls<detail::precision_of_t<Material>, D>>
class Simulation {
    using List = detail::material_list<Material, D>;
    using Make = detail::material_sets<D, List>;

public:
    static_assert(D == 2 || D == 3, "firn simulates in two or three dimensions");
    static_assert(require_kernel<Kernel>());
    static_assert(transfer<Transfer> && force<Force>);
    static constexpr bool boundary_fits = detail::require_fitting_boundary<Boundary, detail::precision_of_t<List>, D>();

    using scalar_type = detail::precision_of_t<List>;
    using material_type = Material;
    using S = scalar_type;
    using Sets = typename Make::type;
    static constexpr int dimension = D;
    static constexpr std::size_t material_count = std::tuple_size_v<Sets>;
    static constexpr std::size_t unnamed = detail::unnamed_material;

    /// \param walls  without them, walls on all faces that let go, if the boundary is Walls; others must be given
    /// \throws parameter_error if the domain is empty, not finite, or has too many or too few cells; if a parameter of
    ///         the material is out of range. \see check_material
    explicit Simulation(const Domain<D>& domain, const Material& material = {},
                        const std::type_identity_t<Execution>& how = {})
        : Simulation(domain, material, how, detail::default_boundary<Boundary, S>(domain)) {}
    Simulation(const Domain<D>& domain, const Material& material, const std::type_identity_t<Execution>& how,
               const Boundary& walls)
        : boundary(walls), execution(how), grid_(domain), sets_(Make::make(material, domain)) {
        gravity[1] = -9.81;
        for_sets([](const auto& set) { check_material<D>(set.material); });
    }

    /// Of the policies that the type names, those that have values to give, in any order.
    template <class First, class... Rest>
    Simulation(const std::type_identity_t<Domain<D>>& domain, const Material& material, const First& first,
               const Rest&... rest)
        : Simulation(
              domain, material, detail::one_of<Execution>([] { return Execution{}; }, first, rest...),
              detail::one_of<Boundary>([&] { return detail::default_boundary<Boundary, S>(domain); }, first, rest...)) {
        constexpr bool named =
            !detail::require_policies<First, Rest...>() ||
            detail::among<Transfer, Force, Kernel, Execution, Boundary>::template are_all<First, Rest...>;
        static_assert(named,
                      "firn: this simulation is given policies that its type does not name. Leave its template "
                      "arguments out, firn::Simulation simulation(domain, material, walls), or name the policies: "
                      "firn::SimulationWith<3, Snow<float>, Walls<float, 3>, Flip<>>.");
        transfer = detail::one_of<Transfer>([] { return Transfer{}; }, first, rest...);
    }

    template <int N, class... Rest>
        requires(N != D)
    explicit Simulation(const Domain<N>&, const Rest&...) : Simulation(Domain<D>{}) {
        static_assert(N == D, "firn: this domain has another dimension than the simulation.");
    }

    Vec<double, D> gravity = Vec<double, D>::zero();  ///< [m/s²]; −9.81 along y unless changed
    Boundary boundary;  ///< by default: walls on all faces that let go, without friction. What moves is moved by steps.
    Execution execution;
    Transfer transfer{};
    /// Given, it is filled by every step: the impulse and torque of each part of the boundary on matter.
    std::optional<Reactions<D>> reactions{};
    double fixed_time_step = 0;  ///< [s]; 0: the bound of the time step, anew for every step
    /// Particles are sorted when one may leave the reach of its block; and whenever the number of steps is a multiple
    /// of this, unless it is 0.
    std::uint64_t most_steps_between_sorts = 0;
    /// Takes warnings, each once: of a fixed time step above the bound (again whenever that gets worse), of a bound
    /// that has fallen by 10³ or needs more than 10⁶ steps a second, of bodies whose particles lie further apart than a
    /// cell, overlap or lie in a solid, of walls that are not the domain's, of matter at an end without a wall. By
    /// default they go to stderr; empty: nowhere. It is called outside any parallel region, before the step.
    std::function<void(const std::string&)> warn = detail::warn_on_stderr;

    const Domain<D>& domain() const { return grid_.domain(); }
    const SparseGrid<S, D>& grid() const { return grid_; }
    double time() const { return time_; }  ///< [s]
    std::uint64_t steps() const { return steps_; }
    double last_time_step() const { return last_time_step_; }  ///< [s]

    /// Of the material with that place in the list, which must be named where there are several.
    template <std::size_t I = unnamed>
    const auto& material() const {
        return std::get<at<I>>(sets_).material;
    }
    template <std::size_t I = unnamed>
    const auto& particles() const {
        return std::get<at<I>>(sets_).particles;
    }
    template <std::size_t I = unnamed>
    const std::vector<Body>& bodies() const {
        return std::get<at<I>>(sets_).bodies;
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
    template <std::size_t I = unnamed>
    auto& edit_particles() {
        auto& set = std::get<at<I>>(sets_);
        set.prepared = set.checked = false;
        return set.particles;
    }
    template <class M>
    auto& edit_particles() {
        return edit_particles<place_of<M>>();
    }

    /// Changes the states of a body's particles: change(position [m], state of the material). The next step computes
    /// their stress anew.
    /// \throws parameter_error  if there is no such body
    template <std::size_t I = unnamed, class Change>
    void set_states(const Body& body, const Change& change) {
        std::get<at<I>>(sets_).change_states(body, change);
    }
    template <class M, class Change>
    void set_states(const Body& body, const Change& change) {
        set_states<place_of<M>>(body, change);
    }

    /// What a material's particles have in all, now.
    template <std::size_t I = unnamed>
    Totals<D> totals() const {
        const auto& set = std::get<at<I>>(sets_);
        return firn::totals<Kernel>(set.particles, domain(), set.material, requested_threads(execution));
    }
    template <class M>
    Totals<D> totals() const {
        return totals<place_of<M>>();
    }

    /// Adds a body of uniform density [kg/m³; kg/m² in 2D] and velocity [m/s].
    /// \throws parameter_error, particle_error (nothing is added)
    template <std::size_t I = unnamed>
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        return add_to(at<I>, samples, density, velocity);
    }
    template <class M>
    Body add(const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        return add<place_of<M>>(samples, density, velocity);
    }

    template <std::size_t I = unnamed, int N, int M = D>
        requires(N != D || M != D)
    Body add(const Samples<N>&, double, const Vec<double, M>& = {}) {
        static_assert(N == D, "firn: these samples have another dimension than the simulation.");
        static_assert(M == D, "firn: this velocity has another dimension than the simulation.");
        return {};
    }

    /// Adds the points of a net, which carry mass [kg] and no volume, at one velocity [m/s]: to the material NoStress.
    /// \param masses  of each [kg]
    /// \throws parameter_error, particle_error (nothing is added)
    template <std::size_t I = unnamed>
    Body add(const Net<D>& net, std::span<const double> masses, const Vec<double, D>& velocity = {}) {
        return std::get<at<I>>(sets_).add(net, masses, velocity, workers());
    }
    template <class M>
    Body add(const Net<D>& net, std::span<const double> masses, const Vec<double, D>& velocity = {}) {
        return add<place_of<M>>(net, masses, velocity);
    }

    /// The facets of the nets, by ids of particles. Some of those may have been taken out.
    template <std::size_t I = unnamed>
    const std::vector<Facet<D>>& facets() const {
        return std::get<at<I>>(sets_).facets;
    }
    template <class M>
    const std::vector<Facet<D>>& facets() const {
        return facets<place_of<M>>();
    }

    /// Forces between the particles of a body in every step from now on: springs, membranes, wind. As points they count
    /// from 0 in the order they were added, have no radius, and positions in S. Their stiffness bounds the time step.
    /// What joined particles that are taken out is gone with them.
    /// \return the force as it is kept: its parameters may be changed
    /// \throws parameter_error  if there is no such body
    /// \see element_forces.hpp
    template <std::size_t I = unnamed, class BetweenPoints>
    BetweenPoints& add_force(const Body& body, BetweenPoints force) {
        std::get<at<I>>(sets_).check_body(body);
        auto& forces = std::get<at<I>>(sets_).forces;
        forces.emplace_back(body, detail::AnyForce<S, D>(std::move(force)));
        return forces.back().force().template as<BetweenPoints>();
    }
    template <class M, class BetweenPoints>
    BetweenPoints& add_force(const Body& body, BetweenPoints force) {
        return add_force<place_of<M>>(body, std::move(force));
    }

    /// Gives particles of a material from now on; every burst is a body.
    /// \throws parameter_error  if a number is out of range
    template <std::size_t I = unnamed>
    void add_source(const Source<D>& source) {
        source.check();
        warnings_.of_spacing(source.samples, domain(), warn);
        Source<D> added = source;
        if (steps_ > 0) added.skip(time_);
        std::get<at<I>>(sets_).sources.push_back(std::move(added));
    }
    template <class M>
    void add_source(const Source<D>& source) {
        add_source<place_of<M>>(source);
    }
    /// Takes out a material's particles, after every step, where they are in the sink.
    /// \throws parameter_error  if upper is below lower
    template <std::size_t I = unnamed>
    void add_sink(const Sink<D>& sink) {
        sink.check();
        std::get<at<I>>(sets_).sinks.push_back(sink);
    }
    template <class M>
    void add_sink(const Sink<D>& sink) {
        add_sink<place_of<M>>(sink);
    }
    /// Pushes the particles of a body, in every step from now on: force(position [m], time [s]) on each [N], called
    /// from several threads at once.
    /// \throws parameter_error  if there is no such body, or the force is an empty function
    template <std::size_t I = unnamed, class OfParticle>
    void add_load(const Body& body, const OfParticle& force) {
        static_assert(
            detail::returns_numbers<OfParticle, Vec<double, D>, double>,
            "firn: this load returns an expression, which refers to values that are gone when it has returned. "
            "Give it a return type that holds the numbers: -> Eigen::Vector3d.");
        Load<D> load{body, force};
        if (!load.force) throw parameter_error("A load is an empty function; give one that returns a force.");
        std::get<at<I>>(sets_).check_body(body);
        std::get<at<I>>(sets_).loads.push_back(std::move(load));
    }
    template <class M, class OfParticle>
    void add_load(const Body& body, const OfParticle& force) {
        add_load<place_of<M>>(body, force);
    }
    /// Takes out the particles for which wanted(position [m], id) says so. Ids of others stay.
    /// \return how many that were
    template <std::size_t I = unnamed, class Wanted>
    std::size_t remove_if(const Wanted& wanted) {
        return std::get<at<I>>(sets_).remove_if(wanted);
    }
    template <class M, class Wanted>
    std::size_t remove_if(const Wanted& wanted) {
        return remove_if<place_of<M>>(wanted);
    }

    /// The largest stable time step for the particles as they are [s].
    double stable_time_step() {
        prepare();
        const double fastest = detail::fastest_signal(sets_);
        const double on_grid =
            fastest > 0 ? firn::stable_time_step<Kernel>(
                              domain().cell_size, std::max(fastest, detail::speed_of_boundary<S>(boundary, domain())))
                        : next_burst() - time_;
        const double bound = std::min(on_grid, detail::force_bound(sets_, time_, workers()));
        if (!std::isfinite(bound) && !is_waiting()) detail::throw_at_rest(fastest);
        return bound;
    }

    /// One step of the fixed time step, or of the bound.
    void step();

    /// \param acceleration  a field a(x) [m/s²] in place of gravity: callable with Vec<P, D> for any scalar P, or a
    /// vector
    template <class Acceleration>
    void step(const Acceleration& acceleration) {
        take_steps(detail::own_acceleration<D>(acceleration), std::numeric_limits<double>::infinity(), steps_ + 1);
    }

    /// Steps until `duration` [s] has passed; the last step is shortened to end there.
    void advance(double duration);
    template <class Acceleration>
    void advance(double duration, const Acceleration& acceleration) {
        if (!(duration >= 0) || !std::isfinite(duration))
            throw parameter_error(sentence("The time to advance is ", duration, " s; it must not be negative."));
        take_steps(detail::own_acceleration<D>(acceleration), time_ + duration,
                   std::numeric_limits<std::uint64_t>::max());
    }

    /// The partition in use: which blocks a material's particles are sorted into.
    template <std::size_t I = unnamed>
    const BlockPartition<D>& partition() {
        prepare();
        return std::get<at<I>>(sets_).partition;
    }

    /// What the last G2P saw: the bound of the next step comes from it.
    template <std::size_t I = unnamed>
    const G2PReport& report() {
        prepare();
        return std::get<at<I>>(sets_).report;
    }

    /// Goes back to a stored moment: the particles of then; if the set is prepared, in the order of then with partition
    /// and report, so that the run goes on to the same bits. With several materials: of each.
    /// \throws io_error  if another material has been restored to another moment, and no step was made since
    template <std::size_t I = 0>
    void restore(std::tuple_element_t<I, Sets>&& set, double time, std::uint64_t steps, double last_time_step) {
        for (std::size_t other = 0; other < material_count; ++other)
            if (other != I && restored_[other] && (time != time_ || steps != steps_))
                throw io_error(sentence("The state is of step ", steps, " at ", time, " s, that of material ", other,
                                        " was of step ", steps_, " at ", time_, " s. Give states of one moment."));
        restored_[I] = true;
        auto& mine = std::get<I>(sets_);
        mine.restore(std::move(set), time);
        time_ = time;
        steps_ = steps;
        last_time_step_ = last_time_step;
        is_spoiled_ = false;
        if (mine.prepared) activate();
    }

private:
    Body add_to(std::size_t set, const Samples<D>& samples, double density, const Vec<double, D>& velocity);

    int workers() const { return thread_count(requested_threads(execution)); }

    /// Steps until the time `end` [s], where the last one is shortened to end, or up to a number of steps. They share
    /// one parallel region, which is left where something of the user's is to be called.
    template <class Acceleration>
    void take_steps(const Acceleration& acceleration, double end, std::uint64_t last_step) {
        if (steps_ == 0) warnings_.of_start(sets_, domain(), boundary, warn);
        std::string warning;
        const bool leaves_regions = any_set([](const auto& set) { return set.may_open_regions(); });
        const auto is_done = [&] { return !(time_ < end) || steps_ == last_step; };
        while (!is_done()) {
            const std::uint64_t most = detail::regions_span_steps() ? last_step - steps_ : 1;
            detail::steps_region(leaves_regions ? 1 : workers(), most, helpers_, [&](std::uint64_t wanted) {
                std::uint64_t taken = 0;
                for (; taken < wanted && !is_done(); ++taken) {
                    const double dt = next_time_step(warning), left = end - time_;
                    if (!warning.empty()) break;
                    const bool is_last = left < dt * (1 + 1e-9);
                    step_by(is_last ? left : dt, acceleration);
                    if (is_last) time_ = end;
                }
                return taken;
            });
            if (!warning.empty()) warn(std::exchange(warning, {}));
        }
    }

    /// Not a step that was chosen.
    bool is_the_bound(double dt) const { return fixed_time_step == 0 && bound_ > 0 && !(dt < bound_); }
    [[gnu::cold]] std::string reason_of_bound() {
        return detail::reason_of_bound<Kernel>(sets_, domain(), detail::speed_of_boundary<S>(boundary, domain()),
                                               detail::force_bound(sets_, time_, workers()));
    }

    /// The fixed time step, or the bound.
    /// \param warning  what is to be warned of before the step, if there is such
    double next_time_step(std::string& warning) {
        const double bound = bound_ = stable_time_step();
        if (fixed_time_step < 0 || !std::isfinite(fixed_time_step))
            throw parameter_error(
                sentence("The fixed time step is ", fixed_time_step, " s; it must be positive, or 0 for the bound."));
        if (fixed_time_step > bound) warning = warnings_.of_step(fixed_time_step, bound, steps_, warn);
        if (warn && warning.empty() && detail::fastest_signal(sets_) > 0)
            warning = warnings_.of_bound(bound, steps_, time_, [&] { return reason_of_bound(); });
        if (warn && warning.empty()) warning = warnings_.of_the_end(sets_, domain(), boundary, steps_);
        return fixed_time_step > 0 ? fixed_time_step : bound;
    }

    template <class Acceleration>
    void step_by(double dt, const Acceleration& acceleration) {
        detail::check_acceleration<D>(acceleration);
        if (!(time_ + dt > time_) || !std::isfinite(time_ + dt))
            detail::throw_no_step(dt, time_, steps_, is_the_bound(dt) ? reason_of_bound() : "");
        if constexpr (requires { transfer.check(); }) transfer.check();
        static_cast<void>(lift<native_pack<S>>(boundary));  // it looks at its parameters, before anything is changed
        restored_.fill(false);
        const bool due = most_steps_between_sorts > 0 && steps_ % most_steps_between_sorts == 0;
        bool sorted = false;
        for_sets([&](auto& set) {
            set.prepared = set.checked = false;
            if (set.report.sort_needed || (due && !set.as_sorted)) {
                sort(set);
                sorted = true;
            }
            set.as_sorted = false;
        });
        if (sorted) activate();
        is_spoiled_ = any_set([](const auto& set) { return set.is_pushed(); });
        for_sets([&](auto& set) { set.push(time_, dt, steps_, workers()); });
        make_grid(dt);
        if constexpr (boundary_fits) {
            if (reactions)
                grid_update(execution, grid_, dt, acceleration, boundary, *reactions);
            else
                grid_update(execution, grid_, dt, acceleration, boundary);
        }
        is_spoiled_ = true;  // until all sets are where they should be
        bool right = true;
        for_sets([&](auto& set) {
            const auto pass = detail::g2p_pass<Kernel, Transfer, Force>(execution, set.particles.view(), set.partition,
                                                                        grid_, set.material, dt, transfer);
            set.report = pass.report;
            right = right && pass.right;
        });
        if (!right)
            detail::throw_wrong_particles(
                sets_, domain(), sentence("At step ", steps_, ", of ", dt, " s from ", time_, " s on: "), dt,
                detail::likely_cause(grid_, dt, bound_, acceleration) +
                    " The simulation cannot go on, nor be written: restore() its last state.");
        is_spoiled_ = false;
        for_sets([](auto& set) { set.prepared = set.checked = true; });
        time_ += dt;
        last_time_step_ = dt;
        ++steps_;
        boundary = advanced(boundary, dt);
        for_sets([&](auto& set) {
            set.take(time_);
            set.give(time_, workers());
        });
    }

    void make_grid(double dt) {
        try {
            std::apply([&](auto&... set) { make_grid(dt, ParticleSet{set.particles.view(), set.partition}...); },
                       sets_);
        } catch (const overflow_error& failure) {
            detail::throw_overflow(failure, steps_, dt, time_, dt / bound_);
        }
    }
    template <class... Views>
    void make_grid(double dt, const ParticleSet<Views>&... sets) {
        before_p2g<Kernel, Transfer>(execution, grid_, sets...);
        p2g<Kernel, Transfer, Force>(execution, grid_, dt, sets...);
        after_p2g<Kernel>(execution, grid_, transfer, transfer_memory_, sets...);
    }

    /// Makes ready for a step particles that were added or changed by hand.
    /// \throws particle_error  if a step has failed half-way, or particles are not as they must be
    void prepare();
    template <class Set>
    void prepare(Set& set) {
        if (set.particles.size() == 0 && (has_particles() || is_waiting())) {  // there may be some later
            set.partition = {};
            set.report = {};
            set.prepared = true;
            return;
        }
        set.check_positions();
        sort(set);
        const auto pass = detail::update_stress_pass(execution, set.particles.view(), set.partition, set.material,
                                                     domain().cell_size);
        if (!pass.right)
            detail::throw_wrong_particles(
                sets_, domain(), sentence("Before step ", steps_, ", at ", time_, " s: "), 0,
                "They were set so: look at set_states(), edit_particles(), what a state held, and the moduli.");
        set.report = pass.report;
        set.prepared = true;
    }

    template <class Is>
    bool any_set(const Is& is) const {
        return std::apply([&](const auto&... set) { return (is(set) || ...); }, sets_);
    }
    bool has_particles() const {
        return any_set([](const auto& set) { return set.particles.size() > 0; });
    }
    /// Are there no particles, but sources that will give some?
    bool is_waiting() const { return !has_particles() && std::isfinite(next_burst()); }
    /// When the next particles come [s]; infinite: never.
    double next_burst() const {
        return std::apply([](const auto&... set) { return std::min({set.next_burst()...}); }, sets_);
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
        grid_.activate(all, workers());
    }

    template <class F>
    void for_sets(const F& f) {
        std::apply([&](auto&... set) { (f(set), ...); }, sets_);
    }
    template <class M>
    static constexpr std::size_t place_of = Make::template place<M>();

    template <std::size_t I>
    static constexpr std::size_t at = detail::named_material<I, material_count>();

    SparseGrid<S, D> grid_;
    Sets sets_;
    std::array<bool, material_count> restored_{};  // since the last step
    TransferMemory<S> transfer_memory_;
    detail::StepHelpers helpers_;
    double time_ = 0, last_time_step_ = 0, bound_ = 0;  // the bound of the step that is taken
    detail::Warnings warnings_;
    std::uint64_t steps_ = 0;
    bool is_spoiled_ = false;  // by a step that failed half-way
};

template <int D, class Material, class... Policies>
Simulation(const Domain<D>&, const Material&, const Policies&...)
    -> Simulation<D, Material, typename detail::chosen<D, Material, Policies...>::transfer,
                  typename detail::chosen<D, Material, Policies...>::force,
                  typename detail::chosen<D, Material, Policies...>::kernel,
                  typename detail::chosen<D, Material, Policies...>::execution,
                  typename detail::chosen<D, Material, Policies...>::boundary>;

// What takes long to compile is defined out of the class, and so not inline: where a program declares a simulation
// `extern template class`, its other files do not compile it again.

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary>::step() {
    step(gravity);
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary>::advance(double duration) {
    advance(duration, gravity);
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary>::prepare() {
    if (is_spoiled_) detail::throw_spoiled(steps_);
    if (steps_ == 0) for_sets([&](auto& set) { set.give(time_, workers()); });
    if (!any_set([](const auto& set) { return !set.prepared; })) return;
    double fastest = 0;
    parallel_region(workers(), [&] {
        for_sets([&](auto& set) {
            if (!set.prepared) prepare(set);
            if (!(set.report.signal_speed <= fastest)) fastest = set.report.signal_speed;
        });
    });
    if (!std::isfinite(fastest) ||
        (!(fastest > 0) && !is_waiting() && !any_set([](const auto& set) { return !set.forces.empty(); }))) {
        for_sets([](auto& set) { set.prepared = false; });
        detail::throw_at_rest(fastest);
    }
    activate();
}

}  // namespace firn

#include <firn/simulation/compiled.hpp>
