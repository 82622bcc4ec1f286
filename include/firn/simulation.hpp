/// \file The simulation: sets of particles, a grid and a boundary, stepped through time.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/walls.hpp>
#include <firn/contact/one_field.hpp>
#include <firn/core/stepper.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/sampling.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/loops/totals.hpp>
#include <firn/material/check.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/simulation/acceleration.hpp>
#include <firn/simulation/explicit.hpp>
#include <firn/simulation/material_set.hpp>
#include <firn/simulation/passes.hpp>
#include <firn/simulation/policies.hpp>
#include <firn/simulation/run_of.hpp>
#include <firn/simulation/set_handle.hpp>
#include <firn/simulation/steps_to.hpp>
#include <firn/stage/time_step.hpp>
#include <firn/transfer/apic.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace firn::inline FIRN_BUILD {

template <class Simulation>
class Adjoint;
namespace webgpu {
template <class Simulation>
class OnGpu;
}

/// A simulation by the material point method: sets of particles, a grid and a boundary, stepped through time.
///
/// Construct a simulation from a domain, a material, and the policies that differ from the defaults. The policies may
/// come in any order:
///
///     firn::Simulation simulation(domain, material, firn::Together(walls, collider), firn::Flip{});
///
/// A step is a list of passes: P2G, grid update, G2P, and those that policies and the program add. \see RunOf::passes,
/// add_pass. What passes do is in functions of the folder loops/. A program may also call these functions itself,
/// without this class.
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
/// \tparam Execution  how P2G sums the contributions to a node: Coloured or FixedPoint
/// \tparam Boundary   walls, colliders or both. \see boundary/concept.hpp
/// \tparam Volume     the volumetric policy: OwnVolume, FBar against locking, or VolumeFilter for a quiet pressure
/// \tparam Law        the contact law between groups of bodies: CoulombContact, or OneField without groups
/// \tparam Time       the time integration: Explicit, or QuasiStatic and Implicit of firn/implicit.hpp
template <int D, class Material = FixedCorotated<float>, class Transfer = Apic, class Force = MlsForce,
          class Kernel = QuadraticBSpline, class Execution = Coloured,
          class Boundary = Walls<detail::precision_of_t<Material>, D>, class Volume = OwnVolume, class Law = OneField,
          class Time = Explicit>
class Simulation
    : public RunOf<detail::precision_of_t<detail::material_list<Material, D>>, D>,
      public SetAccess<Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law, Time>, D> {
    using List = detail::material_list<Material, D>;
    using Make = detail::material_sets<D, List>;
    using Run = RunOf<detail::precision_of_t<List>, D>;
    using Run::bound_;
    using Run::grid_;
    using Run::now_;
    using Run::sets_;
    using Run::warnings_;
    template <std::size_t I>
    static constexpr std::size_t at = detail::named_material<I, Make::count>();
    template <class, int>
    friend class SetAccess;
    template <class, std::size_t>
    friend class SetHandle;
    using Passes = typename Time::template Passes<Simulation, Kernel, Transfer, Force, Boundary, Volume, Law>;
    friend Passes;
    friend detail::PassesOf<Simulation, Kernel, Transfer, Force, Boundary, Volume, Law>;
    template <class>
    friend class Adjoint;
    template <class>
    friend class webgpu::OnGpu;

public:
    static_assert(D == 2 || D == 3, "firn simulates in two or three dimensions");
    static_assert(detail::require_each<Kernel, Transfer, Force, Volume, Law>());
    /// Always true. If the boundary has another precision or dimension than the simulation, the compiler stops with a
    /// message.
    static constexpr bool boundary_fits = detail::require_boundary<Boundary, detail::precision_of_t<List>, D>();

    using scalar_type = detail::precision_of_t<List>;
    using material_type = Material;  ///< The type of the material, or `Materials<…>`.
    using kernel_type = Kernel;      ///< The interpolation kernel.
    using force_type = Force;        ///< The force form.
    using integration_type = Time;   ///< The time integration.
    using S = scalar_type;           ///< The scalar type: float or double.
    template <std::size_t I>
    using SetAt = typename Make::template set<I>;  ///< The type of the set of material I.
    static constexpr int dimension = D;
    static constexpr std::size_t material_count = Make::count;       ///< Number of materials.
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
               const std::type_identity_t<Boundary>& walls);

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
        constexpr bool named = !detail::require_policies<First, Rest...>() ||
                               detail::among<Transfer, Force, Kernel, Execution, Boundary, Volume, Law,
                                             Time>::template are_all<First, Rest...>;
        static_assert(named,
                      "firn: this simulation is given policies that its type does not name. Leave its template "
                      "arguments out, firn::Simulation simulation(domain, material, walls), or name the policies: "
                      "firn::SimulationWith<3, Snow<float>, Walls<float, 3>, Flip<>>.");
        transfer = detail::one_of<Transfer>([] { return Transfer{}; }, first, rest...);
        volume = detail::one_of<Volume>([] { return Volume{}; }, first, rest...);
        contact = detail::one_of<Law>([] { return Law{}; }, first, rest...);
        integration = detail::one_of<Time>([] { return Time{}; }, first, rest...);
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

    using Run::gravity;
    using Run::reactions;
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
    using Run::warn;
    Boundary boundary;                         ///< Walls and colliders. A step moves the ones with a velocity.
    Execution execution;                       ///< How P2G sums contributions, and the number of threads of all stages.
    Transfer transfer{};                       ///< The transfer policy, with its parameters.
    Volume volume{};                           ///< The volumetric policy, with its parameters.
    Law contact{};                             ///< The contact law, with its parameters.
    [[no_unique_address]] Time integration{};  ///< The time integration, with its parameters.
    /// How the last step was solved; with Explicit an empty object.
    [[no_unique_address]] typename Time::Solution solution{};
    /// The impulses between contact groups in the last step. They are computed only if `contact_impulses` holds a value
    /// when the step begins: call `simulation.contact_impulses.emplace()`.
    std::optional<ContactImpulses<D>> contact_impulses{};

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
        return set<Make::template index_of<M>()>();
    }
    template <class M>
    auto set() const {
        return set<Make::template index_of<M>()>();
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
        detail::check_duration(duration);
        if constexpr (detail::require_acceleration<Acceleration, native_pack<S>, D>())
            take_steps(detail::own_acceleration<D>(acceleration), duration, std::numeric_limits<std::uint64_t>::max());
    }

    /// Adds a pass to every following step: a function of the program that acts behind the pass of the name `after`.
    ///
    ///     simulation.add_pass("probe", "grid update", [](auto& simulation, const auto& now) { … });
    ///
    /// A copy of the simulation has the pass, too. \see RunOf::passes
    /// \param act   act(simulation, now) gets the simulation and the present step (StepNow), and may change both
    /// \param kind  what the pass works on;  \param reads, writes  what it reads and writes
    /// \throws parameter_error  if a pass has this name already, if there is no pass `after`, or if the pass reads what
    ///                          no pass before it writes
    template <class Act>
    void add_pass(const std::string& name, std::string_view after, Act act, PassKind kind = PassKind::run,
                  Data reads = Data::none, Data writes = Data::none) {
        this->passes_.add(
            {name, kind, reads, writes, false,
             [act = std::move(act)](Run& run, StepNow<S, D>& now) { act(static_cast<Simulation&>(run), now); }},
            after);
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
    void restore(SetAt<at<I>>&& set, const Moment& moment, double largest_acceleration = -1) {
        for (std::size_t k = 0; k < sets_.size(); ++k)
            if (const auto& other = sets_[k].restored; k != at<I> && other && *other != moment)
                throw io_error(sentence("The state is of step ", moment.steps, " at ", moment.time,
                                        " s; that of another material was of step ", other->steps, " at ", other->time,
                                        " s. Give states of one moment."));
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
        return static_cast<SetAt<I>&>(sets_[I]);
    }
    template <std::size_t I>
    const auto& set_at() const {
        return static_cast<const SetAt<I>&>(sets_[I]);
    }
    /// Calls f(set, k) for the set of each material, in the order of the materials, k = 0, 1, …
    void for_materials(const auto& f) {
        [&]<std::size_t... I>(std::index_sequence<I...>) {
            (f(set_at<I>(), I), ...);
        }(std::make_index_sequence<material_count>{});
    }
    void warn_of_spacing(const Samples<D>& samples) {
        warnings_.of_spacing(samples, this->domain(), warn, this->speaks_);
    }

    auto ranks() const { return detail::all_ranks<S, D>(execution); }
    int workers() const { return detail::threads_of(execution); }

    /// Returns whether time steps are chosen in float.
    bool in_float() const { return requested_float_steps(execution) && this->fixed_time_step == 0; }

    /// Takes steps until `duration` [s] has passed, or until the number of steps taken since the start is `last_step`.
    /// The last step is shortened to end after `duration`.
    template <class Acceleration>
    void take_steps(const Acceleration& acceleration, double duration, std::uint64_t last_step) {
        if (ranks().share().parts > 1) prepare();  // near particles are then mostly on one rank, and each sees overlaps
        if (now_.steps == 0) warnings_.of_start(sets_, this->domain(), boundary, has_contact_groups, warn, ranks());
        warnings_.of_gravity(acceleration, gravity, warn, this->speaks_);
        if constexpr (Volume::averages_volume)
            for_materials([&](const auto& set, std::size_t) {
                warnings_.template of_locking<D>(set.material, warn, this->speaks_);
            });
        bool leaves_regions = false;
        for (const SetOf<S, D>& set : sets_)
            leaves_regions = leaves_regions || (set.forces && set.forces->may_open_regions());
        detail::StepsTo steps(now_.time, duration, in_float());
        Stepper<D>::take_steps(
            leaves_regions ? 1 : workers(), last_step,
            [&] { return steps.arrived(now_.time) || now_.steps >= last_step; },
            [&](std::string& warning) {
                const double dt = choose_time_step(acceleration, duration, warning);
                if (!warning.empty()) return;
                steps.next(now_.time, dt, [&](const TimeStep& step) { step_by(step, acceleration); });
            });
    }

    /// Prepares the particles and returns the next time step [s]. \param warning  \see RunOf::next_time_step
    template <class Acceleration>
    double choose_time_step(const Acceleration& acceleration, [[maybe_unused]] double duration, std::string& warning) {
        if constexpr (Time::is_explicit) {
            const double bound = find_bound(acceleration);
            return Run::next_time_step(bound, detail::has_all_walls(boundary, this->domain()), Transfer::affine,
                                       ranks(), workers(), warning);
        } else {
            return Passes::next_time_step(*this, acceleration, duration);
        }
    }

    /// Prepares the particles and returns the bound of the time step [s]; infinite if nothing limits it.
    template <class Acceleration>
    double find_bound(const Acceleration& acceleration) {
        detail::check_acceleration<D>(acceleration);
        prepare();
        double largest = 0;
        if constexpr (detail::is_uniform<Acceleration>)
            largest = detail::size_of_uniform(acceleration, in_float());
        else
            largest = bound_.field_at_nodes >= 0 ? bound_.field_at_nodes
                                                 : ranks().largest(detail::acceleration_at_particles(
                                                       sets_, this->domain(), acceleration, workers()));
        bound_.in_float = in_float();
        return bound_.find(this->step_inputs(ranks(), workers()),
                           detail::speed_of_boundary<S>(boundary, this->domain()), largest);
    }

    /// Takes a step of dt [s]: its passes, one after the other. \see PassesOf
    template <class Acceleration>
    void step_by(const TimeStep& dt, const Acceleration& acceleration) {
        if constexpr (Time::is_explicit) {
            with_step(dt, acceleration, [&](StepNow<S, D>& now) { this->take_passes(now); });
        } else {  // a step that does not converge is taken in parts
            double left = dt, part = dt;
            do {
                prepare();
                with_step(part, acceleration, [&](StepNow<S, D>& now) {
                    now.asked = dt;
                    now.left = left;
                    this->take_passes(now);
                    left -= now.dt;
                    part = 2 * now.dt < (1 - 1e-9) * left ? 2 * now.dt : left;
                });
            } while (left > 0);
        }
    }
    /// Calls body(now) with what passes need to know of a step of dt [s].
    template <class Acceleration, class Body>
    void with_step(const TimeStep& dt, const Acceleration& acceleration, const Body& body) {
        const auto all_ranks = ranks();
        this->check_time_step(dt, all_ranks, workers());
        if constexpr (requires { transfer.check(); }) transfer.check();
        if constexpr (requires { contact.check(); }) contact.check();
        if constexpr (boundary_fits) static_cast<void>(lift<native_pack<S>>(boundary));  // checks it before any change
        StepNow<S, D> now{dt, workers(), all_ranks, mirrors_of<Kernel>(boundary, this->domain())};
        all_ranks.use_mirrors(now.mirrors.planes);
        now.is_uniform = detail::is_uniform<Acceleration>;
        if constexpr (detail::is_uniform<Acceleration>) now.acceleration = cast<double>(acceleration);
        now.in_float = dt.in_float;
        now.start = this->now_.time;
        const auto update = [&] { return update_grid(now, acceleration); };
        const auto cause = [&] { return detail::likely_cause(grid_, dt, bound_.step, acceleration); };
        now.update_grid = std::ref(update);
        now.likely_cause = std::ref(cause);
        body(now);
    }
    template <class Acceleration>
    double update_grid(const StepNow<S, D>& now, const Acceleration& acceleration) {
        double largest = 0;
        if constexpr (acts_by_gap<Boundary> || !Time::is_explicit)
            largest = detail::update_grid(now.threads, now.ranks, grid_, now.dt, acceleration, NoBoundary{});
        else if constexpr (boundary_fits)
            largest = detail::update_grid_and_mirrors(now.threads, now.ranks, grid_, now.dt, acceleration, boundary,
                                                      now.mirrors, reactions ? &*reactions : nullptr);
        return requested_float_steps(execution) ? double(float(largest)) : largest;  // a GPU tells it in float
    }

    /// Prepares the sets of particles that changed since the last step: checks and sorts the particles, and computes
    /// their stresses.
    /// \throws particle_error  if a step failed half-way, or if a particle has a value that is not finite or lies
    ///                         outside the domain
    void prepare();
    void activate() {
        const CopiesElsewhere elsewhere = Run::activate(ranks(), Law::between_groups, acts_by_gap<Boundary>, workers());
        if constexpr (acts_by_gap<Boundary>) gap_memory_.forget();
        if constexpr (Law::between_groups) contact_memory_.meetings.find(grid_, this->partitions(), elsewhere);
    }

    TransferMemory<S> transfer_memory_;
    VolumeMemory<S> volume_memory_;
    FilterMemory<S> filter_memory_;
    [[no_unique_address]] std::conditional_t<Law::between_groups, ContactMemory<Kernel, D>, OneField> contact_memory_;
    [[no_unique_address]] std::conditional_t<acts_by_gap<Boundary>, GapMemory<Kernel, S, D>, NoBoundary> gap_memory_;
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
                  typename detail::chosen<D, Material, Policies...>::contact,
                  typename detail::chosen<D, Material, Policies...>::time>;

}  // namespace firn::inline FIRN_BUILD

#include <firn/simulation/compiled.hpp>
