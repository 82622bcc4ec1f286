/// \file The simulation: sets of particles, a grid and a boundary, stepped through time.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/walls.hpp>
#include <firn/contact/one_field.hpp>
#include <firn/core/stepper.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/sampling.hpp>
#include <firn/exec/contact.hpp>
#include <firn/exec/g2p.hpp>
#include <firn/exec/gap_contact.hpp>
#include <firn/exec/grid_update.hpp>
#include <firn/exec/p2g_fixed_point.hpp>
#include <firn/exec/p2g_with_velocities.hpp>
#include <firn/exec/shifting.hpp>
#include <firn/exec/totals.hpp>
#include <firn/exec/volume_passes.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/check.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/simulation/bound.hpp>
#include <firn/simulation/material_set.hpp>
#include <firn/simulation/policies.hpp>
#include <firn/simulation/set_handle.hpp>
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

namespace firn::inline FIRN_BUILD {

/// A simulation by the material point method: sets of particles, a grid and a boundary, stepped through time.
///
/// Construct a simulation from a domain, a material, and the policies that differ from the defaults. The policies may
/// come in any order:
///
///     firn::Simulation simulation(domain, material, firn::Together(walls, collider), firn::Flip{});
///
/// A step calls the stages P2G, grid update and G2P (functions in the folder exec/) one after the other. A program may
/// also call these functions itself, without this class.
///
/// In 2D a simulation is a slice of matter one metre thick, in plane strain: densities are in kg/m³ as in 3D, masses in
/// kg, forces in N, energies in J. The volume of a particle is given as its area [m²].
/// \see SimulationWith, which names the type of a simulation
/// \tparam D          2 or 3
/// \tparam Material   a constitutive model, whose scalar type (float or double) is the precision of the simulation; or
///                    several models as `Materials<…>`. Each model has its own set of particles: `set<Snow<float>>()`
/// \tparam Transfer   how velocities are transferred to the grid and back: Apic, Pic, Flip, …
/// \tparam Force      how stresses become forces on nodes: MlsForce or WeightGradientForce
/// \tparam Kernel     the weights of nodes: QuadraticBSpline, CubicBSpline, CompactQuartic or Linear
/// \tparam Execution  how P2G sums the contributions to a node: Coloured, Serial or FixedPoint
/// \tparam Boundary   walls, colliders or both. \see boundary/concept.hpp
/// \tparam Volume     the volumetric policy: OwnVolume, FBar against locking, or VolumeFilter for a quiet pressure
/// \tparam Law        the contact law between groups of bodies: CoulombContact, or OneField without groups
template <int D, class Material = FixedCorotated<float>, class Transfer = Apic, class Force = MlsForce,
          class Kernel = QuadraticBSpline, class Execution = Coloured,
          class Boundary = Walls<detail::precision_of_t<Material>, D>, class Volume = OwnVolume, class Law = OneField>
class Simulation
    : public Stepper<D>,
      public SetAccess<Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law>, D> {
    using List = detail::material_list<Material, D>;
    using Make = detail::material_sets<D, List>;
    using Stepper<D>::now_;
    template <std::size_t I>
    static constexpr std::size_t at = detail::named_material<I, std::tuple_size_v<typename Make::type>>();
    template <class, int>
    friend class SetAccess;
    template <class, std::size_t>
    friend class SetHandle;

public:
    static_assert(D == 2 || D == 3, "firn simulates in two or three dimensions");
    static_assert(detail::require_each<Kernel, Transfer, Force, Volume, Law>());
    /// Always true. If the boundary has another precision or dimension than the simulation, the compiler stops with a
    /// message.
    static constexpr bool boundary_fits = detail::require_boundary<Boundary, detail::precision_of_t<List>, D>();

    using scalar_type = detail::precision_of_t<List>;
    using material_type = Material;    ///< The type of the material, or `Materials<…>`.
    using kernel_type = Kernel;        ///< The interpolation kernel.
    using S = scalar_type;             ///< The scalar type: float or double.
    using Sets = typename Make::type;  ///< A tuple with one MaterialSet for each material.
    static constexpr int dimension = D;
    static constexpr std::size_t material_count = std::tuple_size_v<Sets>;  ///< Number of materials.
    static constexpr bool has_contact_groups = Law::between_groups;  ///< Whether bodies may be in contact groups.
    /// Passed to set() instead of an index, it stands for the material of a simulation that has only one.
    static constexpr std::size_t unnamed = detail::unnamed_material;

    /// Makes a simulation without particles. If `Boundary` is Walls, walls are put on all faces of the domain, except
    /// those of periodic axes. Matter can separate from these walls (Contact::separate). Any other boundary is
    /// default-constructed.
    /// \param how  the execution: how P2G sums, and with how many threads
    /// \throws parameter_error  if the domain is empty, is not finite, or has too many or too few cells; or if a
    ///                          parameter of the material is out of range. \see check_material
    explicit Simulation(const Domain<D>& domain, const Material& material = {},
                        const std::type_identity_t<Execution>& how = {})
        : Simulation(domain, material, how, detail::default_boundary<Boundary, S>(domain)) {}
    /// Makes a simulation without particles, with the boundary `walls`.
    /// \param how    the execution: how P2G sums, and with how many threads
    /// \param walls  the boundary: walls, colliders or both
    /// \throws parameter_error  if the domain or a parameter of the material is out of range
    Simulation(const Domain<D>& domain, const Material& material, const std::type_identity_t<Execution>& how,
               const std::type_identity_t<Boundary>& walls)
        : boundary(walls), execution(how), grid_(domain), sets_(Make::make(material, domain)) {
        for_sets([](const auto& set) { check_material<D>(set.material); });
        this->speaks_ = ranks().speaks();
    }

    /// Makes a simulation without particles, with the given policies, in any order. The type of each policy must be a
    /// template argument of the simulation. A policy that is not given is default-constructed. If the boundary is not
    /// given and its type is Walls, walls are put on all faces of the domain, except those of periodic axes.
    /// \throws parameter_error  if the domain or a parameter of the material is out of range
    template <class First, class... Rest>
    Simulation(const std::type_identity_t<Domain<D>>& domain, const Material& material, const First& first,
               const Rest&... rest)
        : Simulation(
              domain, material, detail::one_of<Execution>([] { return Execution{}; }, first, rest...),
              detail::one_of<Boundary>([&] { return detail::default_boundary<Boundary, S>(domain); }, first, rest...)) {
        constexpr bool named =
            !detail::require_policies<First, Rest...>() ||
            detail::among<Transfer, Force, Kernel, Execution, Boundary, Volume, Law>::template are_all<First, Rest...>;
        static_assert(named,
                      "firn: this simulation is given policies that its type does not name. Leave its template "
                      "arguments out, firn::Simulation simulation(domain, material, walls), or name the policies: "
                      "firn::SimulationWith<3, Snow<float>, Walls<float, 3>, Flip<>>.");
        transfer = detail::one_of<Transfer>([] { return Transfer{}; }, first, rest...);
        volume = detail::one_of<Volume>([] { return Volume{}; }, first, rest...);
        contact = detail::one_of<Law>([] { return Law{}; }, first, rest...);
    }

    /// This overload does not compile: the compiler prints a message that the domain does not have the dimension of the
    /// simulation.
    template <int N, class... Rest>
        requires(N != D)
    explicit Simulation(const Domain<N>&, const Rest&...) : Simulation(Domain<D>{}) {
        static_assert(N == D, "firn: this domain has another dimension than the simulation.");
    }
    /// This overload does not compile: the compiler prints a message that the type of the simulation does not name the
    /// material.
    template <class Given, class... Rest>
        requires(!std::convertible_to<const Given&, const Material&>)
    Simulation(const std::type_identity_t<Domain<D>>&, const Given&, const Rest&...) : Simulation(Domain<D>{}) {
        static_assert(std::same_as<Given, Material>,
                      "firn: after the domain, a simulation is given a material of the type that it names; "
                      "Simulation<3> names FixedCorotated<float>. Leave its template arguments out, firn::Simulation "
                      "simulation(domain, Sand<float>{}), or name the material: firn::Simulation<3, Sand<float>>.");
    }

    using Stepper<D>::gravity;
    /// A function that receives the text of each warning. Each of these warnings is given once:
    /// - the fixed time step is above stable_time_step() (this warning is given again whenever the ratio of the two has
    ///   grown by a fifth);
    /// - stable_time_step() has fallen below 1/1000 of its largest value, or is below 10⁻⁶ s;
    /// - the particles of a body lie further apart than a cell, two bodies overlap, or a body lies inside a solid of
    ///   the boundary;
    /// - the domain is so far from 0 that positions, as in states, are rounded to a twentieth of a cell;
    /// - the walls do not coincide with the faces of the domain, or stand between planes of nodes;
    /// - an acceleration field such as Damped takes the place of gravity, and its own gravity is zero;
    /// - matter has reached a face of the domain that has no wall;
    /// - matter under tension is stretched farther than the kernel joins its particles.
    ///
    /// By default, warnings are printed to stderr. If the function is empty, no warnings are given.
    using Stepper<D>::warn;
    Boundary boundary;    ///< Walls and colliders. A step moves the ones with a velocity.
    Execution execution;  ///< How P2G sums contributions, and the number of threads of all stages.
    Transfer transfer{};  ///< The transfer policy, with its parameters.
    Volume volume{};      ///< The volumetric policy, with its parameters.
    Law contact{};        ///< The contact law, with its parameters.
    /// The impulses between contact groups in the last step. They are computed only if `contact_impulses` holds a value
    /// when the step begins: call `simulation.contact_impulses.emplace()`.
    std::optional<ContactImpulses<D>> contact_impulses{};
    /// The impulse and the angular impulse that each part of the boundary, and each load, exerted on matter in the last
    /// step. They are computed only if `reactions` holds a value when the step begins: call
    /// `simulation.reactions.emplace()`.
    std::optional<Reactions<D>> reactions{};
    double fixed_time_step = 0;  ///< The time step [s]; 0: every step takes stable_time_step().
    /// The largest number of steps between two sorts of the particles; 0: no such limit. If this number is not 0,
    /// particles are sorted whenever the number of steps taken is a multiple of it. In any case, they are sorted when a
    /// particle may be too far from the block into which it was sorted.
    std::uint64_t most_steps_between_sorts = 0;

    const Domain<D>& domain() const { return grid_.domain(); }  ///< Returns the domain.
    /// Returns the grid, with the node values of the last step.
    const SparseGrid<S, D>& grid() const { return grid_; }
    /// Returns the largest acceleration of the field at the nodes in the last step [m/s²]; −1 if that had no field.
    double largest_acceleration() const { return bound_.field_at_nodes; }

    /// \name Sets of particles
    /// @{

    /// Returns a handle to the set of particles of one material: `set<Snow<float>>().add(…)`. If the list of materials
    /// contains a material twice, give the index of the material in the list instead, counted from 0: `set<1>()`. A
    /// simulation with one material has the functions of a handle itself: `simulation.add(…)`.
    template <std::size_t I = unnamed>
    SetHandle<Simulation, at<I>> set() {
        return SetHandle<Simulation, at<I>>(*this);
    }
    template <std::size_t I = unnamed>
    SetHandle<const Simulation, at<I>> set() const {
        return SetHandle<const Simulation, at<I>>(*this);
    }
    template <class M>
    auto set() {
        return set<Make::template place<M>()>();
    }
    template <class M>
    auto set() const {
        return set<Make::template place<M>()>();
    }
    /// @}

    /// Returns the largest stable time step for the present particles under gravity [s], also called the bound of the
    /// time step. It follows from the speeds of particles, of waves and of the boundary, from accelerations, and from
    /// the stiffness of forces between particles. \see firn::stable_time_step
    /// \throws particle_error  if a particle has a value that is not finite or lies outside the domain, or if nothing
    ///                         moves, nothing accelerates, and the material has no stiffness
    double stable_time_step() { return stable_time_step(gravity); }
    /// Returns the bound [s] with this acceleration in place of `gravity`: a vector [m/s²] or a field. What counts of a
    /// field is the largest acceleration at nodes in the last step, or at particles if the last step had no field.
    template <class Acceleration = Vec<double, D>>
    double stable_time_step(const Acceleration& acceleration) {
        if constexpr (detail::require_acceleration<Acceleration, native_pack<S>, D>()) {
            const double bound = find_bound(detail::own_acceleration<D>(acceleration));
            return std::isfinite(bound) ? bound : detail::throw_at_rest();
        }
        return 0;
    }

    /// Takes one step under gravity. The time step is `fixed_time_step`, or stable_time_step() if `fixed_time_step` is
    /// 0.
    /// \throws parameter_error  if the fixed time step, gravity or a parameter of a policy is out of range
    /// \throws particle_error   if, before or after the step, a particle has a value that is not finite or has left the
    ///                          domain
    /// \throws overflow_error   if fixed-point sums could overflow
    void step();

    /// Takes one step with this acceleration in place of `gravity`.
    /// \param acceleration  a vector [m/s²], or a field a(x) [m/s²]: a callable that takes a position Vec<P, D> [m],
    ///                      for any scalar type P. \see acceleration_at
    /// \throws parameter_error, particle_error, overflow_error  in the same cases as step()
    template <class Acceleration = Vec<double, D>>
    void step(const Acceleration& acceleration) {
        if constexpr (detail::require_acceleration<Acceleration, native_pack<S>, D>())
            take_steps(detail::own_acceleration<D>(acceleration), std::numeric_limits<double>::infinity(),
                       now_.steps + 1);
    }

    /// Takes steps until `duration` [s] has passed. The last step is shortened to end at that time.
    /// \throws parameter_error  if the duration is negative or not finite
    /// \throws parameter_error, particle_error, overflow_error  in the same cases as step()
    void advance(double duration);
    /// Takes steps until `duration` [s] has passed, with this acceleration in place of `gravity`.
    /// \param acceleration  a vector [m/s²] or a field, as for step()
    template <class Acceleration = Vec<double, D>>
    void advance(double duration, const Acceleration& acceleration) {
        if (!(duration >= 0) || !std::isfinite(duration))
            throw parameter_error(
                sentence("The time to advance is ", duration, " s; it must be finite and not negative."));
        if constexpr (detail::require_acceleration<Acceleration, native_pack<S>, D>())
            take_steps(detail::own_acceleration<D>(acceleration), now_.time + duration,
                       std::numeric_limits<std::uint64_t>::max());
    }

    /// Replaces the particles of a material by stored ones, and sets the time and the number of steps taken to those of
    /// `moment`. In a simulation with several materials, call restore() once for each material.
    ///
    /// If the stored set was prepared for a step (Readiness::prepared), the order of the particles in memory, the
    /// partition into blocks and the report of the last G2P are kept, too. The continued run then has the same bits as
    /// a run without a break.
    /// \param set     the stored particles. \see Restart
    /// \param moment  the time and the number of steps taken when the particles were stored
    /// \param largest_acceleration  what largest_acceleration() returned then [m/s²]
    /// \throws io_error  if another material was restored to a different moment, and no step was taken since then
    template <std::size_t I = unnamed>
    void restore(std::tuple_element_t<at<I>, Sets>&& set, const Moment& moment, double largest_acceleration = -1) {
        for_sets([&](const auto& other) {
            if (static_cast<const void*>(&other) != &set_at<at<I>>() && other.restored && *other.restored != moment)
                throw io_error(sentence("The state is of step ", moment.steps, " at ", moment.time,
                                        " s; that of another material was of step ", other.restored->steps, " at ",
                                        other.restored->time, " s. Give states of one moment."));
        });
        auto& mine = set_at<at<I>>();
        mine.restore(std::move(set), moment);
        now_ = moment;
        bound_.field_at_nodes = largest_acceleration;
        if (mine.readiness.is(Readiness::prepared)) activate();
    }

private:
    // SetAccess calls these functions on a simulation with one material.
    Simulation& simulation() { return *this; }
    const Simulation& simulation() const { return *this; }
    template <std::size_t I = unnamed>
    auto& mine() {
        return set_at<at<I>>();
    }
    template <std::size_t I = unnamed>
    const auto& mine() const {
        return set_at<at<I>>();
    }
    template <std::size_t I = unnamed>
    static constexpr std::size_t number_of_mine() {
        return at<I>;
    }
    Body add_to(std::size_t number, const Samples<D>& samples, double density, const Vec<double, D>& velocity);
    template <std::size_t I>
    auto& set_at() {
        return std::get<I>(sets_);
    }
    template <std::size_t I>
    const auto& set_at() const {
        return std::get<I>(sets_);
    }
    void warn_of_spacing(const Samples<D>& samples) { warnings_.of_spacing(samples, domain(), warn, this->speaks_); }

    decltype(auto) ranks() const { return ranks_of(execution); }
    int workers() const { return thread_count(requested_threads(execution)); }

    /// Takes steps until the time is `end` [s], or until the number of steps taken since the start is `last_step`. The
    /// last step is shortened to end at `end`.
    template <class Acceleration>
    void take_steps(const Acceleration& acceleration, double end, std::uint64_t last_step) {
        if (ranks().share().parts > 1) prepare();  // near particles are then mostly on one rank, and each sees overlaps
        if (now_.steps == 0) warnings_.of_start(sets_, domain(), boundary, has_contact_groups, warn, ranks());
        warnings_.of_gravity(acceleration, gravity, warn, this->speaks_);
        const bool leaves_regions =
            any_set([](const auto& set) { return set.forces && set.forces->may_open_regions(); });
        Stepper<D>::take_steps(
            leaves_regions ? 1 : workers(), last_step, [&] { return !(now_.time < end) || now_.steps == last_step; },
            [&](std::string& warning) {
                const double dt = next_time_step(find_bound(acceleration), warning), left = end - now_.time;
                if (!warning.empty()) return;
                const bool is_last = left < dt * (1 + 1e-9);
                step_by(is_last ? left : dt, acceleration);
                if (is_last) now_.time = end;
            });
    }

    /// Prepares the particles and returns the bound of the time step [s]; infinite if nothing limits it.
    template <class Acceleration>
    double find_bound(const Acceleration& acceleration) {
        detail::check_acceleration<D>(acceleration);
        prepare();
        return bound_.find(step_inputs(), acceleration);
    }
    auto step_inputs() {
        return detail::step_inputs<Kernel, S>(sets_, domain(), boundary, now_.time, workers(), ranks());
    }
    /// Returns whether the time step dt is the bound of the time step, rather than a step that the program chose.
    bool is_the_bound(double dt) const { return fixed_time_step == 0 && bound_.step > 0 && !(dt < bound_.step); }
    /// Returns the next time step [s]: the fixed time step if the program has set one, otherwise the bound.
    /// \param warning  receives a text if the program must be warned before the step; otherwise unchanged
    double next_time_step(double bound, std::string& warning) {
        if (fixed_time_step < 0 || !std::isfinite(fixed_time_step))
            throw parameter_error(
                sentence("The fixed time step is ", fixed_time_step, " s; it must be positive, or 0 for the bound."));
        if (fixed_time_step == 0 && !std::isfinite(bound)) detail::throw_at_rest();
        const bool accelerated = bound_.is_of_acceleration(domain().cell_size);
        if (fixed_time_step > bound) warning = warnings_.of_step(fixed_time_step, bound, accelerated, now_.steps, warn);
        if (warn && warning.empty() && detail::fastest_signal(sets_) > 0)
            warning = warnings_.of_bound(bound, now_.steps, now_.time, [&] { return bound_.reason(step_inputs()); });
        if (warn && warning.empty())
            warning = warnings_.of_matter<Kernel, Transfer>(sets_, domain(), boundary, now_, workers(), ranks());
        return fixed_time_step > 0 ? fixed_time_step : bound;
    }

    template <class Acceleration>
    void step_by(double dt, const Acceleration& acceleration) {
        if (!(now_.time + dt > now_.time) || !std::isfinite(now_.time + dt))
            detail::throw_no_step(dt, now_.time, now_.steps, is_the_bound(dt) ? bound_.reason(step_inputs()) : "");
        if constexpr (requires { transfer.check(); }) transfer.check();
        if constexpr (requires { contact.check(); }) contact.check();
        if constexpr (boundary_fits) static_cast<void>(lift<native_pack<S>>(boundary));  // checks it before any change
        const Mirrors mirrors = mirrors_of<Kernel>(boundary, domain());
        ranks().use_mirrors(mirrors.planes);
        const bool due = most_steps_between_sorts > 0 && now_.steps % most_steps_between_sorts == 0;
        bool sorted = false;
        for_sets([&](auto& set) {
            const bool was_sorted = set.readiness.is(Readiness::sorted);
            set.restored.reset();
            set.readiness.begin_step();
            if (set.report.sort_needed || (due && !was_sorted)) {
                sort(set);
                sorted = true;
            }
        });
        if (sorted) activate();
        detail::LoadSums<D> of_loads;
        for_sets([&](auto& set) {
            set.push(now_, dt, workers(),
                     {std::uint32_t(number_of(set)), reactions ? reactions->about : std::nullopt,
                      reactions ? &of_loads : nullptr});
        });
        if (reactions) of_loads.tell(*reactions, ranks());
        if constexpr (filters_volume<Volume>) filter_all_volumes(dt, mirrors);
        double largest = 0;
        if constexpr (acts_by_gap<Boundary>) {
            largest = update_by_gap(dt, acceleration);
        } else {
            scatter(dt, [&](const auto&... sets) { make_grid(dt, mirrors, sets...); });
            if constexpr (boundary_fits)
                largest = grid_update(execution, grid_, dt, acceleration, boundary, mirrors,
                                      reactions ? &*reactions : nullptr);
        }
        bool right = true;
        for_sets([](auto& set) { set.readiness.spoil(); });  // particles cannot be used before G2P has moved them all
        for_sets([&](auto& set) {
            if constexpr (Volume::averages_volume)
                scatter(dt, [&, k = number_of(set)](const auto&... sets) {
                    average_volume<Kernel, Transfer, Force>(execution, grid_, volume_memory_, mirrors, k, sets...);
                });
            const auto pass = detail::g2p_pass<Kernel, Transfer, Force, Volume>(
                execution, set.particles.view(), set.partition, grid_, set.material, dt, transfer);
            set.report = pass.report;
            right = right && pass.right;
            if constexpr (Volume::averages_volume) restore_masses<Transfer>(execution, grid_);
        });
        ranks().end_g2p(sets_, now_.time + dt, right, largest, [&] {
            detail::throw_wrong_particles(
                sets_, domain(), sentence("At step ", now_.steps, ", of ", dt, " s from ", now_.time, " s on: "), dt,
                detail::likely_cause(grid_, dt, bound_.step, acceleration) +
                    " The simulation can neither go on nor be written: restore() its last state.");
        });
        bound_.field_at_nodes = detail::is_uniform<Acceleration> ? -1 : largest;
        for_sets([](auto& set) { set.readiness.end_step(); });
        now_ = {now_.time + dt, now_.steps + 1, dt};
        boundary = advanced(boundary, dt);
        for_sets([&](auto& set) {
            set.take(now_.time);
            if (ranks().has_lost(number_of(set))) set.readiness.unprepare();
            set.give(now_.time, workers(), ranks().share());
        });
    }

    /// Does and returns what make_grid() and grid_update() do, where the boundary acts by the gap of particles.
    template <class Acceleration>
    double update_by_gap(double dt, const Acceleration& acceleration)
        requires(acts_by_gap<Boundary> && boundary_fits)
    {
        double largest = 0;
        scatter(dt, [&](const auto&... sets) {
            const auto mirrors = mirrors_by_gap<Kernel>(execution, grid_, boundary, dt, gap_memory_, sets...);
            make_grid(dt, mirrors, sets...);
            largest = grid_update(execution, grid_, dt, acceleration, NoBoundary{});
            act_by_gap<Kernel>(execution, grid_, boundary, dt, mirrors, gap_memory_, reactions ? &*reactions : nullptr,
                               sets...);
        });
        return largest;
    }
    void filter_all_volumes(double dt, const Mirrors& mirrors)
        requires filters_volume<Volume>
    {
        volume.check();
        if (!volume.is_due(now_.steps)) return;
        const auto copies = [&](auto& grid, int threads) {
            if constexpr (Law::between_groups) sum_copies(ranks(), grid, contact_memory_.meetings, threads);
        };
        std::array<bool, material_count> strays{};
        const S crossed = S(dt / domain().cell_size) * S(detail::fastest_signal(sets_));
        scatter(dt, [&](const auto&... sets) {
            strays = act_on_volumes<Kernel>(execution, grid_, filter_memory_, mirrors, boundary, volume, crossed,
                                            copies, sets_, sets...);
        });
        if (!shifts_particles<Volume> || ranks().sum(std::size_t(std::ranges::count(strays, true))) == 0) return;
        for_sets([&](auto& set) { sort(set); });
        activate();
    }
    /// Calls body(sets...) with the sets. Adds the step to the message of an overflow_error.
    template <class Body>
    void scatter(double dt, const Body& body) {
        try {
            std::apply([&](auto&... set) { body(ParticleSet{set.particles.view(), set.partition}...); }, sets_);
        } catch (const overflow_error& failure) {
            detail::throw_overflow(failure, now_.steps, dt, now_.time, dt / bound_.step);
        }
    }
    template <class M, class... Views>
    void make_grid(double dt, const M& mirrors, const ParticleSet<Views>&... sets) {
        p2g_with_velocities<Kernel, Transfer, Force>(execution, grid_, mirrors, dt, sets...);
        after_p2g<Kernel>(execution, grid_, transfer, transfer_memory_, mirrors, sets...);
        if constexpr (Law::between_groups)
            meet_groups<Kernel>(execution, grid_, contact, dt, mirrors, contact_memory_,
                                contact_impulses ? &*contact_impulses : nullptr, sets...);
    }

    /// Prepares the sets of particles that changed since the last step: checks and sorts the particles, and computes
    /// their stresses.
    /// \throws particle_error  if a step failed half-way, or if a particle has a value that is not finite or lies
    ///                         outside the domain
    void prepare();
    template <class Set>
    void prepare(Set& set) {
        const bool is_empty = ranks().sum(set.particles.size()) == 0;
        if (is_empty && detail::may_have_particles(sets_, ranks())) {
            set.partition = {};
            set.report = {};
            set.readiness.prepare();
            return;
        }
        if (is_empty || set.particles.size() > 0) set.check_positions();
        sort(set);
        const auto pass = detail::update_stress_pass(execution, set.particles.view(), set.partition, set.material,
                                                     domain().cell_size);
        ranks().require(pass.right, [&] {
            detail::throw_wrong_particles(
                sets_, domain(), sentence("Before step ", now_.steps, ", at ", now_.time, " s: "), 0,
                "No step has done this: look at set_states(), edit_particles(), a restored state and the moduli.");
        });
        set.report = pass.report;
        set.readiness.prepare();
    }

    bool any_set(const auto& is) const {
        return std::apply([&](const auto&... set) { return (is(set) || ...); }, sets_);
    }
    /// Returns the index of the material of a set in the list of materials.
    template <class Set>
    std::size_t number_of(const Set& set) const {
        std::size_t number = 0, i = 0;
        const auto look = [&](const auto& other) {
            if (static_cast<const void*>(&other) == &set) number = i;
            ++i;
        };
        std::apply([&](const auto&... each) { (look(each), ...); }, sets_);
        return number;
    }
    template <class Set>
    void sort(Set& set) {
        ranks().template bring_home<Kernel>(sets_, number_of(set));
        set.partition = sort_particles<Kernel>(set.particles, requested_threads(execution));
        set.forget_pushes();
    }
    void activate() {
        std::array<BlockPartition<D>*, material_count> all{};
        std::size_t i = 0;
        for_sets([&](auto& set) { all[i++] = &set.partition; });
        grid_.activate(all, workers());
        ranks().template meet<Kernel>(grid_, all, workers());
        [[maybe_unused]] const auto& elsewhere =
            ranks().copies_elsewhere(grid_, all, Law::between_groups, acts_by_gap<Boundary>, workers());
        if constexpr (acts_by_gap<Boundary>) gap_memory_.forget();
        if constexpr (Law::between_groups) contact_memory_.meetings.find(grid_, all, elsewhere);
    }

    void for_sets(const auto& f) {
        std::apply([&](auto&... set) { (f(set), ...); }, sets_);
    }
    SparseGrid<S, D> grid_;
    Sets sets_;
    TransferMemory<S> transfer_memory_;
    VolumeMemory<S> volume_memory_;
    FilterMemory<S> filter_memory_;
    [[no_unique_address]] std::conditional_t<Law::between_groups, ContactMemory<Kernel, D>, OneField> contact_memory_;
    [[no_unique_address]] std::conditional_t<acts_by_gap<Boundary>, GapMemory<Kernel, D>, NoBoundary> gap_memory_;
    detail::StepBound bound_;
    detail::Warnings warnings_;
};

/// Deduces the type of the simulation from its policies, given in any order: `Simulation simulation(domain, material,
/// Flip{})`.
template <int D, class Material, class... Policies>
Simulation(const Domain<D>&, const Material&, const Policies&...)
    -> Simulation<D, Material, typename detail::chosen<D, Material, Policies...>::transfer,
                  typename detail::chosen<D, Material, Policies...>::force,
                  typename detail::chosen<D, Material, Policies...>::kernel,
                  typename detail::chosen<D, Material, Policies...>::execution,
                  typename detail::chosen<D, Material, Policies...>::boundary,
                  typename detail::chosen<D, Material, Policies...>::volume,
                  typename detail::chosen<D, Material, Policies...>::contact>;

}  // namespace firn::inline FIRN_BUILD

#include <firn/simulation/compiled.hpp>
