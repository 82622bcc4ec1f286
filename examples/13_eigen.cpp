/// \file Uses only Eigen's vectors, and a material written with Eigen (eigen_material.hpp). A block spins as it falls.
#include <firn/data/eigen.hpp>
#include <firn/firn.hpp>

#include "eigen_material.hpp"
#include <Eigen/Dense>

#include <iostream>

int main() {
    using Eigen::Vector3d;
    const Vector3d lower(0, 0, 0), upper(1, 1, 1), centre = (lower + upper) / 2, half(0.1, 0.2, 0.1);
    firn::Simulation<3, EigenNeoHookean<float>> simulation({.lower = lower, .upper = upper, .cell_size = 1.0 / 32}, {});
    simulation.gravity = Vector3d::UnitY() * -9.81;

    const auto block = firn::sample_box<3>(centre - half, centre + half, {.spacing = 1.0 / 64});
    const firn::Body body = simulation.add(block, 1000.0, Vector3d(0, -1, 0));
    simulation.add_load(body, [&](const Vector3d& x, double time) -> Vector3d {  // about the block's axis [N]
        return std::exp(-20 * time) * Vector3d::UnitY().cross(x - centre);
    });
    for (int frame = 1; frame <= 5; ++frame) {
        simulation.advance(0.04);
        const firn::Totals<3> totals = simulation.totals();
        const Vector3d middle = as_eigen(totals.first_moment) / totals.mass;
        const Vector3d spin = as_eigen(totals.angular_momentum) - middle.cross(as_eigen(totals.momentum));
        const Eigen::Matrix3Xd x = firn::copy_of_positions(simulation.particles());
        std::cout << simulation.time() << " s: middle at " << middle.transpose() << " m, lowest particle at "
                  << x.row(1).minCoeff() << " m, spin " << spin.y() << " kg m²/s\n";
    }
}
