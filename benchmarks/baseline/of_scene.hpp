/// \file A scene in the unit box, for the baseline.
#pragma once

#include <firn/core/eigen.hpp>

#include "../scenes.hpp"
#include "mls_mpm.hpp"

namespace baseline {

/// All bodies of the scene are of one density, and their particles of one volume.
inline MlsMpm of_scene(const scenes::Scene<3>& scene) {
    const double volume = scene.matter.front().samples.volume;
    MlsMpm simulation(scene.domain.cells(0), volume, volume, scene.young, scene.poisson);
    for (const auto& body : scene.matter)
        scenes::for_particles(body, [&](const auto& x, const auto& v, const auto& C, const auto& F) {
            simulation.particles.push_back(
                {firn::as_eigen(x).template cast<float>(), firn::as_eigen(v).template cast<float>(),
                 firn::as_eigen(C).template cast<float>(), firn::as_eigen(F).template cast<float>()});
        });
    return simulation;
}

/// From where a simulation of the scene has come to; particles in the order of the scene.
template <class Simulation>
MlsMpm of_simulation(const Simulation& simulation, const scenes::Scene<3>& scene) {
    MlsMpm copy = of_scene(scene);
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            copy.particles[particles.id(slot)] = {
                firn::as_eigen(particles.position(slot)), firn::as_eigen(particles.velocity(slot)),
                firn::as_eigen(particles.affine(slot)), firn::as_eigen(particles.state(slot).F)};
    return copy;
}

}  // namespace baseline
