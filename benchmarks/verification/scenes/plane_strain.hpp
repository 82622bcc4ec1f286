/// \file A block of matter in plane strain, in two dimensions and as a slab three cells thick in three: the slab stands
/// between mirrored walls, and moves as the block.
#pragma once

#include <firn/firn.hpp>

#include <cmath>
#include <vector>

namespace verification {

/// How far the block and the slab are from each other.
struct PlaneStrainErrors {
    double position = 0;  ///< largest distance between a particle of the block and one of the slab [cells]
    double plane = 0;     ///< largest difference of stresses in the plane, over the largest stress [1]
    double across = 0;    ///< largest difference of τ_zz, over the largest stress [1]
    double share = 0;     ///< largest |τ_zz|, over the largest stress [1]
    double flown = 0;     ///< share of particles whose state has flown plastically [1]
};

/// The block is 12 × 8 cells with 2 × 2 particles a cell. It stands on a floor to which it sticks, and its upper part
/// moves sideways and down.
/// \param model   the material in 3D
/// \param steps   number of equal steps
/// \param flown   flown(state) tells whether a particle has flown
template <class Model, class Flown>
PlaneStrainErrors compare_with_slab(const Model& model, int steps, double dt, double speed, const Flown& flown) {
    using namespace firn;
    constexpr double h = 1.0 / 16, spacing = h / 2, density = 1000;
    constexpr int across = 24, up = 16, layers = 6;
    const auto place_of = [&](int i, int j) { return Vec<double, 2>{(i + 0.5) * spacing, (j + 0.5) * spacing}; };

    const Domain<2> plane{{-8 * h, 0}, {20 * h, 12 * h}, h};
    auto floor = Walls<double, 2>::all(plane.lower, plane.upper, {Contact::none, 0});
    floor.at_lower[1] = {Contact::stick, 0};
    floor.nodes_behind = NodesBehind::mirrored;
    Simulation block(plane, PlaneStrain<Model>{model}, floor, Coloured{1});
    const Domain<3> space{{-8 * h, 0, 0}, {20 * h, 12 * h, 3 * h}, h};
    auto sides = Walls<double, 3>::all(space.lower, space.upper, {Contact::none, 0});
    sides.at_lower[1] = {Contact::stick, 0};
    sides.at_lower[2] = sides.at_upper[2] = {Contact::slip, 0};
    sides.nodes_behind = NodesBehind::mirrored;
    Simulation slab(space, model, sides, Coloured{1});
    block.gravity = {};
    slab.gravity = {};
    block.fixed_time_step = slab.fixed_time_step = dt;

    Samples<2> in_plane{{}, spacing * spacing};
    Samples<3> in_space{{}, spacing * spacing * spacing};
    for (int i = 0; i < across; ++i)
        for (int j = 0; j < up; ++j) {
            const Vec<double, 2> x = place_of(i, j);
            in_plane.positions.push_back(x);
            for (int k = 0; k < layers; ++k) in_space.positions.push_back({x[0], x[1], (k + 0.5) * spacing});
        }
    block.add(in_plane, density);
    slab.add(in_space, density);
    const auto set_velocities = [&]<int D, class State>(Particles<double, D, State>& particles) {
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const double height = particles.exact_position(slot)[1];
            Vec<double, D> v{};
            v[0] = speed * height;
            v[1] = -speed * height / 2;
            particles.set_velocity(slot, v);
        }
    };
    set_velocities(block.edit_particles());
    set_velocities(slab.edit_particles());
    for (int i = 0; i < steps; ++i) {
        block.step();
        slab.step();
    }

    PlaneStrainErrors errors;
    const auto& two = block.particles();
    const auto& three = slab.particles();
    std::vector<std::size_t> slot_of(in_space.positions.size());
    double largest = 0;
    for (std::size_t slot = 0; slot < three.slots(); ++slot) {
        if (!three.is_particle(slot)) continue;
        slot_of[three.id(slot)] = slot;
        for (int k = 0; k < 9; ++k) largest = std::max(largest, std::abs(three.stress(slot).m[k]));
    }
    for (std::size_t slot = 0; slot < two.slots(); ++slot) {
        if (!two.is_particle(slot)) continue;
        const auto tau = two.stress(slot);
        const double zz = block.material().output(two.state(slot))[0];
        errors.share = std::max(errors.share, std::abs(zz) / largest);
        errors.flown += flown(two.state(slot)) / double(in_plane.positions.size());
        for (int k = 0; k < layers; ++k) {
            const std::size_t other = slot_of[std::size_t(two.id(slot)) * layers + std::size_t(k)];
            const auto x = two.exact_position(slot);
            const auto y = three.exact_position(other);
            const auto of_slab_stress = three.stress(other);
            errors.position = std::max({errors.position, std::abs(x[0] - y[0]) / h, std::abs(x[1] - y[1]) / h});
            for (int a = 0; a < 2; ++a)
                for (int b = 0; b < 2; ++b)
                    errors.plane = std::max(errors.plane, std::abs(tau(a, b) - of_slab_stress(a, b)) / largest);
            errors.across = std::max(errors.across, std::abs(zz - of_slab_stress(2, 2)) / largest);
        }
    }
    return errors;
}

}  // namespace verification
