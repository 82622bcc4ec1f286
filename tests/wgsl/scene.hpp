/// \file Matter in motion on the CPU, and the program that goes on from it: what cases.cpp writes and host.cpp runs.
#pragma once

#include "support/scenes.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/data/sampled_distance.hpp>
#include <firn/wgsl/inputs.hpp>
#include <firn/wgsl/program.hpp>

namespace scenes {

using Integers = firn::FixedPoint<std::int32_t>;

/// The integers that a P2G of these particles adds up, on the program's dense grid.
template <class Kernel, class Transfer, class Force, class Simulation>
std::vector<std::int32_t> node_sums_of(Simulation& simulation, const std::vector<std::uint32_t>& nodes) {
    using namespace firn;
    constexpr int D = Simulation::dimension;
    SparseGrid<float, D> grid(simulation.domain());
    grid.activate(simulation.partition());
    auto particles = simulation.particles();
    detail::JoinNothing one_rank;
    const auto sum = [&](auto sets) {
        detail::sum_in_quanta<Kernel, Transfer, Force>(simulation.execution, one_rank, grid, simulation.fixed_time_step,
                                                       sets);
    };
    detail::with_sets(sum, ParticleSet<decltype(particles.view())>{particles.view(), simulation.partition()});
    using Node = std::array<std::int32_t, node_width>;
    const std::int32_t* sums = detail::integers_of<std::int32_t>(grid).sums;
    std::size_t all = 1;
    for (const std::uint32_t n : nodes) all *= n;
    std::vector<std::int32_t> dense(all * node_width);
    for (std::size_t b = 0; b < grid.block_count(); ++b)
        for (int i = 0; i < block_nodes<D>; ++i) {
            std::size_t at = 0;
            bool inside = true;
            for (int a = 0; a < D; ++a) {
                const int along = block_size * (grid.block(b)[std::size_t(a)] + 1) + (i >> 2 * (D - 1 - a) & 3);
                inside = inside && along >= 0 && along < int(nodes[std::size_t(a)]);
                at = at * nodes[std::size_t(a)] + std::size_t(along);
            }
            Node node;
            std::memcpy(node.data(), sums + (b * std::size_t(block_nodes<D>) + std::size_t(i)) * node_width,
                        sizeof node);
            if (inside)
                std::copy(node.begin(), node.end(), dense.begin() + std::ptrdiff_t(at * node_width));
            else if (node != Node{})
                throw usage_error("A particle adds to a node that the program's grid does not have.");
        }
    return dense;
}

/// The same, followed by the momenta before forces act if the transfer blends velocities: their masses are 0; or by the
/// zeros of a series that has not begun, if it refines them.
template <class Kernel, class Transfer, class Force, class Simulation>
std::vector<std::int32_t> node_sums(Simulation& simulation, const std::vector<std::uint32_t>& nodes) {
    using namespace firn;
    std::vector<std::int32_t> sums = node_sums_of<Kernel, Transfer, Force>(simulation, nodes);
    if constexpr (blends_velocities<Transfer>) {
        auto before = node_sums_of<Kernel, Transfer, detail::NoForceFor<Transfer>>(simulation, nodes);
        for (std::size_t i = 0; i < before.size(); ++i)
            if (i % node_width == node_mass) before[i] = 0;
        sums.insert(sums.end(), before.begin(), before.end());
    }
    if constexpr (refines_velocities<Transfer>)
        sums.resize(sums.size() *
                    std::size_t(wgsl::detail::records_of_node(false, wgsl::detail::refinements_of(simulation.transfer),
                                                              wgsl::detail::has_mirrored_walls(simulation.boundary))));
    return sums;
}

struct Matter {
    double side, spacing, cell_size;
    /// If not negative: the blocks lie in two opposite corners of a box that is so much smaller than the unit box [m],
    /// and move along its walls and into them.
    double in_corners = -1;
    bool periodic = false;  ///< whether all axes but the first are periodic
};

/// How the programs of all scenes round.
inline firn::wgsl::Arithmetic arithmetic = firn::wgsl::Arithmetic::plain;

/// The unit box.
template <int D>
firn::Walls<float, D> rough_walls() {
    return firn::Walls<float, D>::all(firn::Vec<float, D>::filled(0), firn::Vec<float, D>::filled(1),
                                      {firn::Contact::separate, 0.3});
}

/// The faces of the unit box across the first axis.
template <int D>
firn::Walls<float, D> walls_across_first_axis() {
    firn::Walls<float, D> walls = rough_walls<D>();
    for (std::size_t a = 1; a < std::size_t(D); ++a) walls.at_lower[a] = walls.at_upper[a] = {};
    return walls;
}

/// A box in the unit box, at a distance from its faces [m]. Its walls have all contacts, and are mirrored: at edges and
/// corners, each contact meets another one.
template <int D>
firn::Walls<float, D> mirrored_walls(double inset = 0) {
    using firn::Contact, firn::Vec, firn::Wall;
    firn::Walls<float, D> walls{.lower = Vec<double, D>::filled(inset), .upper = Vec<double, D>::filled(1 - inset)};
    walls.at_lower[0] = Wall{Contact::slip, 0.2};
    walls.at_lower[1] = Wall{Contact::separate, 0.3};
    walls.at_upper[0] = Wall{Contact::stick, 0};
    walls.at_upper[1] = Wall{Contact::slip, 0};
    if constexpr (D == 3) {
        walls.at_lower[2] = Wall{Contact::stick, 0};
        walls.at_upper[2] = Wall{Contact::separate, 0.3};
    }
    walls.nodes_behind = firn::NodesBehind::mirrored;
    return walls;
}

/// A solid by distances at nodes, whose grid it leaves on two sides; along each axis, there are other numbers of nodes.
inline firn::Collider<firn::DistanceGrid<float, 2>> lump(double radius = 0.11, double spacing = 0.03) {
    const auto distance = [&](const firn::Vec<double, 2>& x) {
        return norm(firn::Vec<double, 2>{0.8 * x[0], x[1]}) - radius + 0.02 * std::sin(40 * x[1]);
    };
    firn::Collider<firn::DistanceGrid<float, 2>> solid{
        .shape = {firn::sampled_distance<2>(distance,
                                            {.lower = {-0.2, -0.17}, .upper = {0.1, 0.09}, .spacing = spacing})},
        .friction = 0.4,
        .thickness = 0.01};
    solid.shape.origin = {0.01, 0};
    solid.position = {0.37, 0.37};
    return solid;
}

/// A mesh of eight triangles, on which the lower block lies.
inline firn::Collider<firn::DistanceGrid<float, 3>> ramp() {
    firn::TriangleMesh wedge;
    wedge.vertices = {{-0.35, 0, -0.3}, {0.4, 0, -0.3}, {0.4, 0.3, -0.3},
                      {-0.35, 0, 0.45}, {0.4, 0, 0.45}, {0.4, 0.3, 0.45}};
    wedge.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {0, 3, 5}, {0, 5, 2}};
    firn::Collider<firn::DistanceGrid<float, 3>> solid{
        .shape = {firn::mesh_distance(wedge, {.spacing = 0.05, .band = 0.06})}, .friction = 0.5};
    solid.position = {0.4, 0.1, 0.4};
    return solid;
}

/// The state of a particle, strained at random. \param size  of a component of F, if the state has F
template <int D, class State>
State strained(State state, std::size_t slot, float size) {
    if constexpr (requires { state.F; })
        for (int k = 0; k < D * D; ++k)  // in the plane, if the state is three-dimensional
            state.F(k % D, k / D) += size * float(noise(slot * std::size_t(D * D) + std::size_t(k)) - 0.5);
    else
        state.J += 0.01F * float(noise(slot) - 0.5);
    return state;
}

/// Two blocks after ten steps, strained at random; and the program for what comes next.
template <int D, class Transfer, class Force, class Material, class Kernel = firn::QuadraticBSpline,
          class Boundary = firn::Walls<float, D>, class Volume = firn::OwnVolume>
struct MovingBlocks {
    firn::Domain<D> domain;
    firn::Simulation<D, Material, Transfer, Force, Kernel, Integers, Boundary, Volume> simulation;
    firn::wgsl::Program program;

    MovingBlocks(const Matter& matter, const Material& material, const Boundary& boundary = rough_walls<D>(),
                 const Volume& volume = {}, firn::wgsl::GridStorage grid = firn::wgsl::GridStorage::dense,
                 const Transfer& transfer = {})
        : domain(box(matter.cell_size, matter.periodic)), simulation(domain, material, {}, boundary) {
        simulation.volume = volume;
        simulation.transfer = transfer;
        simulation.fixed_time_step = 0.1 * matter.cell_size / 20;  // waves: 12 m/s
        if (matter.in_corners > 0) simulation.warn = {};           // of walls that lie inside of the domain
        if (matter.in_corners < 0)
            add_two_blocks<D>(simulation, matter.side, matter.spacing);
        else
            add_blocks_in_corners(matter);
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            auto state = strained<D>(particles.state(slot), slot, 0.1F);
            if constexpr (std::same_as<Material, firn::FixedCorotated<float>>)
                if (slot % 997 == 0) state.F(0, 0) = -0.6F;  // inverted: served by Jacobi rotations
            particles.set_state(slot, state);
        }
        for (int i = 0; i < 10; ++i) simulation.step();
        simulation.edit_particles();  // so that they are sorted anew now, and not in the next step
        simulation.partition();
        program = firn::wgsl::make_program<Kernel, Transfer, Force, D>(
            material, simulation.boundary, firn::Gravity<float, D>{firn::cast<float>(simulation.gravity)}, volume,
            {.grid = grid, .periodic = matter.periodic, .arithmetic = arithmetic}, transfer);
    }

    /// The simulation as it is now.
    firn::wgsl::Inputs inputs(const firn::wgsl::Limits& limits = {}) const {
        return firn::wgsl::make_inputs<D>(program, domain, simulation.particles(), simulation.fixed_time_step, limits);
    }

private:
    void add_blocks_in_corners(const Matter& matter) {
        using V = firn::Vec<double, D>;
        const firn::SamplingOptions filling{
            .spacing = matter.spacing, .pattern = firn::Pattern::jittered, .jitter = 0.1};
        const V low = V::filled(matter.in_corners), high = V::filled(1 - matter.in_corners);
        V velocity = V::filled(-0.4);
        velocity[0] = 1.5;
        simulation.add(firn::sample_box<D>(low, low + V::filled(matter.side), filling), 1000, velocity);
        simulation.add(firn::sample_box<D>(high - V::filled(matter.side), high, filling), 1000, -velocity);
    }
    static firn::Domain<D> box(double cell_size, bool periodic) {
        firn::Domain<D> unit;
        unit.cell_size = cell_size;
        for (std::size_t a = 1; a < std::size_t(D); ++a) unit.periodic[a] = periodic;
        return unit;
    }
};

}  // namespace scenes
