/// \file Level ground that begins at rest: 40 cells of soil between smooth walls, on a smooth floor.
#pragma once

#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include "places.hpp"

#include <cmath>
#include <vector>

namespace verification {

/// How far ground has moved that should not.
struct Unrest {
    double speed = 0;         ///< largest speed of a particle, looked at every 10 ms [m/s]
    double displacement = 0;  ///< largest displacement of a particle at the end [m]
};

/// Level ground 2 m high, with a surface on a plane of nodes. Waves of pressure run at 10 m/s.
struct LevelGround {
    static constexpr double h = 1.0 / 20, height = 2, density = 2000, poisson = 0.3, wave_speed = 10;
    /// Young's modulus for which waves have their speed [Pa].
    static constexpr double young =
        density * wave_speed * wave_speed * (1 + poisson) * (1 - 2 * poisson) / (1 - poisson);

    /// Lets the ground stand for a time [s].
    /// \param at_rest  whether it begins in the stress of its weight
    template <class Material>
    static Unrest stand(const Material& material, double time, const firn::GroundAtRest<2>& ground,
                        bool at_rest = true) {
        using namespace firn;
        using S = material_scalar_t<Material>;
        const Domain<2> domain{{0, 0}, {8 * h, height + 4 * h}, h};
        auto walls = Walls<S, 2>::all(domain.lower, domain.upper, {Contact::slip, 0});
        walls.at_upper[1] = {Contact::none, 0};
        walls.nodes_behind = NodesBehind::mirrored;
        Simulation simulation(domain, material, walls, Coloured{1});
        simulation.gravity = {0, S(-9.81)};
        const Body soil = simulation.add(sample_box<2>({0, 0}, {8 * h, height}, {.spacing = h / 2}), density);
        if (at_rest) set_at_rest(simulation.set(), soil, ground);
        const auto& particles = simulation.particles();
        const auto start = places_of(simulation);
        Unrest unrest;
        while (simulation.time() < time - 1e-9) {
            simulation.advance(0.01);
            for (std::size_t slot = 0; slot < particles.slots(); ++slot)
                if (particles.is_particle(slot))
                    unrest.speed = std::max(unrest.speed, double(norm(particles.velocity(slot))));
        }
        unrest.displacement = largest_motion(start, places_of(simulation));
        return unrest;
    }
    static firn::GroundAtRest<2> ground() {
        return {.surface = [](const firn::Vec<double, 2>&) { return height; }};
    }
};

}  // namespace verification
