//! # Your own boundary, transfer, field, contact law
//!
//! A policy is a small struct that says what happens at one node or to one particle. firn does the loops, the SIMD
//! lanes, the threads, and WGSL for a GPU. So write it for every scalar:
//!
//! - The scalar is a template parameter. Write `S(0.5)` for a number, and `firn::select(condition, a, b)` for `if`:
//!   sixteen nodes are computed at once, and may disagree. `firn::min`, `firn::max`, `firn::sqrt`, `firn::sin`,
//!   `firn::tan`, `firn::exp` take every scalar; the functions of `std` do not.
//! - A struct that is a template over its scalar lists its parameters. Then firn converts them, writes them to states,
//!   and makes them uniforms in WGSL. Give it a `name`, so that states tell it from others. **List every member**: firn
//!   converts a policy by this list alone, so a member that is not listed silently takes its default.
//! - If something is missing or of the wrong type, the compiler says what, in a sentence that begins with "firn:".
//!
//! The policies on this page act in one scene: two blocks fall onto a soft floor. Honey is between them.
#include <firn/firn.hpp>
#include <firn/io/simulation_state.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

//! ## A boundary
//!
//! A boundary has `velocity(x, v)`: the position of a node [m] and its velocity [m/s] give its velocity afterwards. If
//! it acts with a force, it takes the node's mass [kg], which is positive, and the time step [s] as well. This is a
//! penalty wall: a floor with springs and dampers. A node at the depth d below its surface feels the force A (k d − c
//! v), A = h^(D−1) being the face of a cell. It is taken at the end of the step, so it needs no small steps:
//!
//!     m (v' − v) = A (k (d − dt v') − c v') dt
//!
//! All layers of nodes below the surface feel their springs, so how deep matter sinks depends on the cell size: k is no
//! modulus of subgrade. A force per mass converges, v' = (v + κ d dt)/(1 + (c + κ dt) dt) with κ in 1/s²: a block of
//! height H sinks by √(2 g H/κ).
//!
//! The order of the arguments is mass, then time step. `reaches` says in which boxes nodes may change; firn leaves out
//! the others. If it says no where nodes change, the boundary acts on some of them only; in doubt return true, which
//! costs time alone. `on_grid` tells the cell size; without it the member keeps its default, here A = 0. What it stores
//! is a parameter, too. The top of `firn/boundary/concept.hpp` lists what else a boundary may have, such as
//! `advanced(dt)` if it moves. A boundary with velocity(x, v, mass, dt) works in Together, in a BoundaryList, with
//! contact groups (each group is a node of its own mass), and in WGSL. Inside of GapContact it is refused: there the
//! gap decides.
template <firn::scalar S>
struct SoftFloor {
    S height = S(0.2);     ///< [m]
    S stiffness = S(3e4);  ///< k [Pa/m]
    S damping = S(3e3);    ///< c [Pa s/m]
    S cell_size = S(0);    ///< h [m], set by on_grid()

    static constexpr const char* name = "soft_floor";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"height", "m", &SoftFloor::height},
                          firn::parameter{"stiffness", "Pa/m", &SoftFloor::stiffness},
                          firn::parameter{"damping", "Pa s/m", &SoftFloor::damping},
                          firn::parameter{"cell_size", "m", &SoftFloor::cell_size}};
    }
    SoftFloor on_grid(const auto& h) const {
        SoftFloor here = *this;
        here.cell_size = S(h);
        return here;
    }
    template <int D>
    firn::Vec<S, D> velocity(const firn::Vec<S, D>& x, firn::Vec<S, D> v, const S& mass, const S& dt) const {
        const S depth = firn::max(height - x[1], S(0));
        const S area = D == 3 ? cell_size * cell_size : cell_size;  // in 2D of a slice one metre thick
        const S per_mass = area * dt / mass;
        const S held = (v[1] + stiffness * depth * per_mass) / (S(1) + (damping + stiffness * dt) * per_mass);
        v[1] = firn::select(S(0) < depth, held, v[1]);
        return v;
    }
    template <int D>
    bool reaches(const firn::Vec<double, D>& lower, const firn::Vec<double, D>&) const {
        return lower[1] < double(height);
    }
};

//! ## A transfer
//!
//! A transfer says whether particles carry an affine velocity field C, and what they keep of it after a step. This one
//! blends APIC (share 1) and PIC (share 0). A transfer that also blends velocities, like FLIP, has `blended()`: see
//! `firn/transfer/flip.hpp`. For WGSL, give `wgsl::make_program` the transfer with its parameters.
template <firn::scalar S>
struct Blend {
    S share = S(0.9);  ///< share of C that a particle keeps [1]

    static constexpr const char* name = "blend";
    static constexpr bool affine = true;  // particles carry C
    static constexpr auto parameters() { return std::tuple{firn::parameter{"share", "1", &Blend::share}}; }
    void check() const { firn::check_share(share, name, "share"); }  // before every step; throws parameter_error

    template <class T, int D>
    firn::Mat<T, D> affine_field(const firn::Mat<T, D>& C) const {
        return C * share;
    }
};

//! ## A contact law
//!
//! A law gives the velocity of group a relative to group b after they meet. It is computed in double, one node at a
//! time, so it may use `if` and `std`. Here honey of the friction f [Pa s/m] lies between the groups: it brakes their
//! sliding w_t by the force A f w_t, and they do not pass through each other. Surfaces with a gap may approach by it.
struct Honey {
    double friction = 2e3;  ///< f: viscosity by thickness of the layer [Pa s/m]

    static constexpr const char* name = "honey";
    static constexpr bool between_groups = true;

    template <int D>
    firn::Vec<double, D> relative_velocity(int, int, const firn::Meeting<double, D>& meeting) const {
        const double along = dot(meeting.velocity, meeting.normal);
        const double entering = along + std::max(meeting.gap, 0.0) / meeting.dt;
        if (entering >= 0) return meeting.velocity;
        const auto sliding = meeting.velocity - meeting.normal * along;
        const double area = std::pow(meeting.cell_size, D - 1);
        const double kept = 1 / (1 + friction * area * meeting.dt / meeting.reduced_mass);
        return meeting.normal * (along - entering) + sliding * kept;
    }
};

//! ## A field of the particles
//!
//! firn::With gives the particles of any material further numbers. They move, are sorted, are removed and are written
//! to states with the particle, and a run goes on from them.
using Jelly = firn::With<firn::NeoHookean<float>, firn::Carried<"temperature", "K">>;
//! If the material depends on the number, write a material with a parameter `temperature`, and make this parameter one
//! of each particle: `firn::PerParticle<MyMaterial<float>, "temperature">`. If the number changes with the deformation,
//! as heat from plastic work does, it is part of the material's `state<D>`: firn::Dissipating is an example.

double mean_temperature(const auto& particles) {
    double sum = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) sum += double(firn::of<"temperature">(particles.state(slot)));
    return sum / double(particles.size());
}

int main() {
    const double h = 1.0 / 32;
    const firn::Domain<2> box{.lower = {0, 0}, .upper = {2, 1}, .cell_size = h};
    const Jelly jelly{{firn::NeoHookean<float>::from_young_poisson(4e5F, 0.3F), {293}}};  // the model, the temperature
    const auto walls = firn::Walls<float, 2>::all({0, 0}, {2, 1}, {});
    firn::Simulation simulation(box, jelly, firn::Together(walls, SoftFloor<float>{}), Blend<float>{0.9F}, Honey{});
    const auto lower = simulation.add(firn::sample_box<2>({0.5, 0.25}, {1.25, 0.5}, {.spacing = h / 2}), 1000);
    const auto upper =
        simulation.add(firn::sample_box<2>({0.5, 0.5}, {1.0, 0.75}, {.spacing = h / 2}), 1000, {0.5, 0.0});
    simulation.set_contact_group(upper, 1);

    //! Set the numbers of a body by `set_states`, at any time. The next step then computes the stresses of all
    //! particles anew, so do it every now and then, not in every step.
    simulation.set_states(lower, [](const firn::Vec<double, 2>& x, auto& state) {
        firn::of<"temperature">(state) = float(300 + 40 * x[0]);
    });
    const double before = mean_temperature(simulation.particles());

    //! ## An acceleration field
    //!
    //! An acceleration field is any function of a position, or of a position, a velocity and the time step, for every
    //! scalar type. It acts in place of `simulation.gravity`. If it has parameters to be changed on a GPU, make it a
    //! struct with a list of parameters, like the boundary above: `firn/field/attraction.hpp` is short.
    const auto pull = []<class P>(const firn::Vec<P, 2>& x) {
        return firn::Vec<P, 2>{P(0.2) * firn::sin(P(3.0) * x[1]), P(-9.81)};
    };
    simulation.advance(1.5, pull);

    //! `parts` of Together is a `std::tuple`: `std::get<1>(simulation.boundary.parts)` is the floor. If GapContact
    //! wraps the boundaries, `simulation.boundary.boundary` is what it wraps. Reactions count the parts in the same
    //! order.
    std::get<1>(simulation.boundary.parts).damping = 6e3F;
    simulation.reactions.emplace();
    double lift = 0, time = 0;
    for (int step = 0; step < 200; ++step) {
        simulation.step();
        lift += simulation.reactions->parts[1].impulse[1];
        time += simulation.last_time_step();
    }
    const auto sums = simulation.totals();
    const double bears = lift / time / (sums.mass * 9.81);
    std::printf("the soft floor bears %.3f of the weight\n", bears);

    const auto mean_velocity = [&](const firn::Body& body) {
        double sum = 0;
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot) && body.holds(particles.id(slot)))
                sum += double(particles.velocity(slot)[0]);
        return sum / body.count;
    };
    const double slides = mean_velocity(upper) - mean_velocity(lower);
    std::printf("the upper block slides at %.3f m/s, at first 0.5 m/s\n", slides);

    //! A state holds the temperature like every other field; ParaView shows it, and restore() sets it.
    const auto state = firn::state_of(simulation);
    const auto field = std::ranges::find(state.fields, "temperature", &firn::StateField<float>::name);
    const double after = mean_temperature(simulation.particles());
    std::printf("%s [%s]: %.4f on average, at first %.4f\n", field->name.c_str(), field->unit.c_str(), after, before);

    //! ## Then
    //!
    //! Compare a new policy with its formula for one node or one particle, in double, before you run a scene:
    //! `firn::node_velocity` and `firn::take_from_grid` are the functions that call them. Dual numbers find wrong
    //! derivatives: see [Your own material](03_own_material.cpp). A simulation itself computes with float or double.
    return std::abs(bears - 1) < 0.02 && std::abs(slides) < 0.05 && std::abs(after - before) < 1e-3 ? 0 : 1;
}
