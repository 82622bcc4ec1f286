/// \file Runs whose hash is stored: of 200 steps of two colliding blocks, built without contraction and FMA, where
/// every compiler and processor gives the same bits.
#pragma once

#include "support/scenes.hpp"

namespace golden {

template <int D, class S, class Transfer, class Force, class Execution>
auto simulation(const Execution& execution) {
    const firn::Domain<D> domain{firn::Vec<double, D>::zero(), firn::Vec<double, D>::filled(1.0), 1.0 / 32};
    return firn::Simulation<D, firn::FixedCorotated<S>, Transfer, Force, firn::QuadraticBSpline, Execution>(
        domain, firn::FixedCorotated<S>::from_young_poisson(1e5, 0.3), execution);
}

template <int D, class S, class Transfer, class Force, class Execution>
std::uint64_t hash_of_run(const Execution& execution) {
    auto simulation = golden::simulation<D, S, Transfer, Force>(execution);
    scenes::add_two_blocks<D>(simulation, D == 2 ? 0.3 : 0.2);
    for (int step = 0; step < 200; ++step) simulation.step();  // automatic time steps: they, too, must agree
    return scenes::hash(simulation);
}

inline std::uint64_t coloured_3d(int threads) {
    return hash_of_run<3, float, firn::Apic, firn::MlsForce>(firn::Coloured{threads});
}
inline std::uint64_t coloured_2d(int threads) {
    return hash_of_run<2, double, firn::Pic, firn::WeightGradientForce>(firn::Coloured{threads});
}
inline std::uint64_t fixed_point_3d(int threads) {
    return hash_of_run<3, float, firn::Apic, firn::MlsForce>(firn::FixedPoint<std::int32_t>{threads});
}

// g++ 12 and clang 19 agree on them, on x86-64 and on AArch64.
inline constexpr std::uint64_t of_coloured_3d = 0x8402823f12f9a0b4, of_coloured_2d = 0x9d8a722059f57864,
                               of_fixed_point_3d = 0x918b7c289aeef1f8;

}  // namespace golden
