//! # Contact between bodies
//!
//! Matter shares one field of velocities on the grid, unless you say otherwise. Bodies that come near each other then
//! stick together about a cell before they touch, do not slide, and part about a cell late. Bodies that must hit, slide
//! or part need **contact groups**: each group has nodes of its own, and groups meet by a **contact law**.
//!
//! The same holds for walls and tools: they press on matter a cell before they touch it, and a gripper measures many
//! times the force, unless the boundary is wrapped in firn::GapContact. [Boundaries](04_boundaries.cpp) has figures.
//!
//! | you simulate | contact groups |
//! | --- | --- |
//! | one body, or matter that mixes or flows | none |
//! | bodies that are glued together | none |
//! | bodies that bounce, slide, roll, pile up or pass through an opening | one group for each body |
//! | grains of two materials that slide along each other | one group for each material: `set<Sand<float>>().set_contact_group(1)` |
//! | solids that move as given, walls | none: these are [boundaries](04_boundaries.cpp), which may act by the gap, see below |
//!
//! ## The law
//!
//! Give a simulation the law firn::CoulombContact, and put bodies into groups by `set_contact_group`. All bodies are in
//! group 0 at first. Bodies of the same group still share one field.
//!
//! Let w be the velocity of one group relative to another at a node, n the normal between their surfaces, and g the gap
//! between the surfaces. If w · n + g/Δt ≥ 0, the surfaces do not meet in this step, and nothing happens. Otherwise
//! the groups exchange the impulse that lets the gap close and not more. Along the surface, friction takes away the
//! relative velocity, with an impulse of at most μ times the normal one: surfaces stick if that is enough, and slide if
//! not. Surfaces never pull at each other. Momentum is conserved, and the impulse does not raise the kinetic energy.
#include <firn/firn.hpp>

#include <cmath>
#include <cstdio>

namespace {

using Jelly = firn::FixedCorotated<double>;

/// The mean velocity of a body [m/s].
template <class Simulation>
firn::Vec<double, 2> velocity_of(const Simulation& simulation, const firn::Body& body) {
    firn::Vec<double, 2> sum{};
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && body.holds(particles.id(slot)))
            sum += particles.velocity(slot) * (1 / double(body.count));
    return sum;
}

//! ## A block slides
//!
//! A block lies on a slab, and is pushed. It slides, and friction brings it to rest: it stops in the time v₀/(μ g), and
//! sticks from then on. While it slides, the impulse along the surface is μ times the normal impulse.
//! `contact_impulses` has the impulses between groups in the last step; divided by the time step, they are forces.
bool block_slides() {
    constexpr double h = 1.0 / 32, friction = 0.3, speed = 0.6;
    const firn::Domain<2> box{.lower = {0, 0}, .upper = {2, 1}, .cell_size = h};
    const firn::CoulombContact contact{.friction = friction};
    auto walls = firn::Walls<double, 2>::all({0, 0}, {2, 1}, {firn::Contact::slip, 0});
    walls.at_lower[1] = {firn::Contact::stick, 0};
    firn::Simulation simulation(box, Jelly::from_young_poisson(4e5, 0.3), walls, contact);

    simulation.add(firn::sample_box<2>({0, 0}, {2, 8 * h}, {.spacing = h / 2}), 1000);
    const auto block = simulation.add(firn::sample_box<2>({0.3, 8 * h}, {0.8, 16 * h}, {.spacing = h / 2}), 1000);
    simulation.set_contact_group(block, 1);

    simulation.advance(0.3);  // the block settles
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && block.holds(particles.id(slot)))
            particles.set_velocity(slot, particles.velocity(slot) + firn::Vec<double, 2>{speed, 0});

    simulation.contact_impulses.emplace();
    firn::Vec<double, 2> impulse{};  // on the block, by the slab, while it slides
    double rest = 0;                 // when it has come to rest
    const double start = simulation.time(), expected = speed / (friction * 9.81);
    while (simulation.time() < start + 1.5 * expected) {
        simulation.step();
        if (simulation.time() < start + 0.7 * expected) impulse += simulation.contact_impulses->on(1, 0);
        if (rest == 0 && velocity_of(simulation, block)[0] < 0.02 * speed) rest = simulation.time() - start;
    }
    std::printf("the block slides for %.3f s, expected %.3f s; the impulse of friction is %.3f of the normal one\n",
                rest, expected, -impulse[0] / impulse[1]);
    return std::abs(rest / expected - 1) < 0.1 && std::abs(-impulse[0] / impulse[1] / friction - 1) < 0.05;
}

//! ## Pairs
//!
//! Two groups may have a contact of their own. The others have that of the law.
//!
//! ```cpp
//! firn::CoulombContact contact{.friction = 0.3};
//! contact.set_pair(1, 2, {.friction = 0.6});
//! contact.set_pair(2, 3, {.contact = firn::Contact::stick});
//! simulation.contact = contact;
//! ```
//!
//! | contact of a pair | |
//! | --- | --- |
//! | `separate`, the default | no penetration, no tension, friction |
//! | `slip` | surfaces that have come nearer than `reach` part no more; they slide, with friction |
//! | `stick` | surfaces that have come nearer than `reach` neither part nor slide |
//! | `none` | the groups pass through each other |
//!
//! ## How normals and gaps are found
//!
//! Both come from the positions of the particles around a node, and not from its masses: contact begins when surfaces
//! touch, and not when groups share nodes. The surface of a particle lies half of its spacing, ½ (J V₀)^(1/D), from its
//! position. Particles beside a node count less for its gap than those before it.
//!
//! - `ContactNormals::regression`, the default: the plane that best separates the particles of both groups, by logistic
//!   regression (Nairn, Hammerquist and Smith 2020). If the gap is wider along the normal of one group's own surface,
//!   that normal is taken.
//! - `ContactNormals::volume_gradient`: the gradients of both groups' volumes at the node (Bardenhagen et al. 2001). It
//!   is less accurate at edges and for curved surfaces. The gap is found as above.
//!
//! If more than two groups meet at a node, all pairs act on each other at once, repeatedly. The result does not depend
//! on the order of the groups.
//!
//! ## Walls and colliders by the gap
//!
//! Walls and colliders act on all matter that shares a node with them, so matter feels them about a cell early. Wrapped
//! into firn::GapContact, they act by the gap between their surface and the particles, as groups do. It takes walls,
//! colliders, and several of them as one: `firn::GapContact{firn::Together(walls, ball)}`. Everything else stays the
//! same: contacts and friction, motion, `reactions`.
//!
//! Here a block sinks slowly towards a floor, which it touches after a way of 0.8 cells.
template <class Boundary>
double way_to_floor(const Boundary& boundary) {
    constexpr double h = 1.0 / 32, way = 0.8 * h, speed = 0.1;
    const firn::Domain<2> box{.lower = {0, 0}, .upper = {1, 1}, .cell_size = h};
    firn::Simulation simulation(box, Jelly::from_young_poisson(4e5, 0.3), boundary);
    simulation.add(firn::sample_box<2>({0.25, way}, {0.75, 0.5 + way}, {.spacing = h / 2}), 1000, {0, -speed});
    simulation.gravity = {0, 0};
    simulation.reactions.emplace();
    do simulation.step();
    while (simulation.reactions->parts[0].impulse[1] == 0);
    return speed * simulation.time() / h;
}

bool floor_is_where_it_lies() {
    const auto walls = firn::Walls<double, 2>::all({0, 0}, {1, 1}, {firn::Contact::separate, 0});
    const double early = way_to_floor(walls), right = way_to_floor(firn::GapContact{walls});
    std::printf("the block feels the floor after %.2f cells, by the gap after %.2f cells\n", early, right);
    return early < 0.3 && std::abs(right - 0.8) < 0.02;
}

//! A surface that matter has touched holds it if its contact is `slip` or `stick`, as long as the gap is below a
//! quarter of a cell. At mirrored walls, matter meets its own mirror image. Of a collider, `thickness` moves the
//! surface outwards; `thickness_in_cells` says which nodes take part: with less than its default of 1.5, matter beside
//! the solid is less stiff, but comes deeper into it in a hard impact. Solids may be thin: even of 0.4 cells, they pull
//! at matter that leaves with less than 1 % of the force that pressed before. But matter on both sides of a solid
//! thinner than 2.5 cells shares nodes, and moves as one there, unless each side has a contact group of its own.
//! GapContact is the outermost boundary. A boundary of your own needs one more function for it; firn::GapContact says
//! which. A program that writes WGSL refuses it.
//!
//! ## Your own law
//!
//! A law is a struct with a constant `between_groups` and a function `relative_velocity`. The function gets the numbers
//! of two groups and a firn::Meeting: their relative velocity, the normal, the gap, the reduced mass, the cell size and
//! the time step. It returns the relative velocity after contact; firn makes the impulse of it. A law that pulls must
//! say up to which gap, by `largest_reach`. This one is glue: surfaces hold together up to a tensile traction, and slide
//! without friction.
struct Glue {
    static constexpr bool between_groups = true;
    double strength = 0;  ///< tensile traction at which the glue breaks [Pa]

    double largest_reach() const { return 0.25; }  // [cells]

    template <std::floating_point S, int D>
    firn::Vec<S, D> relative_velocity(int, int, const firn::Meeting<S, D>& at) const {
        const S apart = dot(at.velocity, at.normal);
        if (apart < 0) {  // they approach: no more than the gap allows
            const S most = -firn::max(at.gap, S(0)) / at.dt;
            return at.velocity + at.normal * firn::max(most - apart, S(0));
        }
        const S area = std::pow(at.cell_size, S(D - 1));
        const S traction = at.reduced_mass * apart / (area * at.dt);  // that would keep them together
        if (at.gap > S(0.25) * at.cell_size || traction > S(strength)) return at.velocity;
        return at.velocity - at.normal * apart;
    }
};

/// Returns how far a block that is glued under another, held one falls in 0.3 s [m].
double falls(double strength) {
    constexpr double h = 1.0 / 32;
    const firn::Domain<2> box{.lower = {0, 0}, .upper = {1, 1}, .cell_size = h};
    auto walls = firn::Walls<double, 2>::all({0, 0}, {1, 1}, {firn::Contact::slip, 0});
    walls.at_upper[1] = {firn::Contact::stick, 0};
    firn::Simulation simulation(box, Jelly::from_young_poisson(4e5, 0.3), walls, Glue{strength});
    simulation.add(firn::sample_box<2>({0.25, 1 - 8 * h}, {0.75, 1}, {.spacing = h / 2}), 1000);
    const auto hangs =
        simulation.add(firn::sample_box<2>({0.25, 1 - 16 * h}, {0.75, 1 - 8 * h}, {.spacing = h / 2}), 1000);
    simulation.set_contact_group(hangs, 1);
    double fallen = 0;
    while (simulation.time() < 0.3) {
        simulation.step();
        fallen -= velocity_of(simulation, hangs)[1] * simulation.last_time_step();
    }
    return fallen;
}

//! The block weighs 2.5 kPa on its glue, and twice as much when it is let go at once. It hangs on glue of 20 kPa, and
//! falls from glue of 0.2 kPa.
bool glue_holds() {
    const double strong = falls(2e4), weak = falls(2e2);
    std::printf("on strong glue the block sinks by %.3f m in 0.3 s, on weak glue it falls by %.3f m\n", strong, weak);
    return strong < 0.03 && weak > 0.9 * 0.5 * 9.81 * 0.3 * 0.3;
}

}  // namespace

int main() {
    const bool slides = block_slides(), lies = floor_is_where_it_lies(), holds = glue_holds();
    return slides && lies && holds ? 0 : 1;
}

//! ## Costs
//!
//! What is alone costs what it costs without groups. A step takes longer where groups are so near that they share nodes.
//! On one thread, in processor time:
//!
//! | scene of `benchmarks/step_contact.cpp` | time of a step with groups / in one field |
//! | --- | ---: |
//! | two cubes before they touch | 1.0 |
//! | two cubes of 21 cells that press on each other | 1.2 |
//! | a heap of 64 balls, R = 6 cells, each in a group of its own | 3.2 |
//!
//! In the heap, most matter is near a surface. Larger bodies cost less.
//!
//! ## Limits
//!
//! - Each group has nodes of its own, in a copy of the domain's blocks. A long domain leaves room for fewer copies:
//!   `firn::most_contact_groups(domain)` is their number, several thousand in a domain of 1000 cells.
//! - The thinnest part of a body, and the gap between two parts of one group, should be some cells wide. Parts of one
//!   group still stick together.
//! - A layer of particles at the surface carries contact: a surface of stretched or few particles is rough. Take 2 × 2
//!   particles per cell or more.
//! - A law has no memory: glue that has broken holds again if the surfaces come near each other again.
//! - A program that writes WGSL refuses contact groups.
//! - Contact with walls and colliders is that of [boundaries](04_boundaries.cpp), unless they act by the gap.
//!
//! `examples/19_stones.cpp` lets 64 stones fall into a funnel, with groups and without.
