/// \file A free surface at an angle to the grid, with a stress along it: the forces on nodes that should be zero.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/stage/p2g.hpp>
#include <firn/transfer/pic.hpp>

#include <cmath>
#include <map>

namespace verification {

/// A half-space under a surface of the given slope, made of layers of particles along it, and in it the stress t tᵀ
/// with t along the surface, which leaves the surface free. Returns Σ |f_i|²/m_i over the nodes within three cells of
/// the surface, per cell of its length: the power with which forces that should be zero change F. In units of cells,
/// of the stress and of the density.
/// \param particles  a cell and axis
template <class Kernel, class Force>
double power_at_free_surface(double slope, int particles) {
    using V = firn::Vec<double, 2>;
    constexpr std::size_t K = Kernel::support;
    constexpr int length = 20;
    const double norm_of_t = std::hypot(1, slope), spacing = 1.0 / particles;
    const V t{1 / norm_of_t, slope / norm_of_t}, n{-t[1], t[0]};
    struct Sum {
        V impulse = V::zero();
        double mass = 0;
    };
    std::map<std::array<int, 2>, Sum> nodes;
    for (int i = -6 * particles; i < int((length * norm_of_t + 6) * particles); ++i)
        for (int j = 0; j < 6 * particles; ++j) {
            const V x = t * ((i + 0.5) * spacing) - n * ((j + 0.5) * spacing) + V{0.0, 0.37};
            V base{}, d{};
            std::array<std::array<double, K>, 2> w{}, g{};
            for (int a = 0; a < 2; ++a) {
                base[a] = firn::base_node<Kernel>(x[a]);
                d[a] = x[a] - base[a] - firn::centre_node<Kernel>;
                w[std::size_t(a)] = Kernel::weights(x[a] - base[a]);
                g[std::size_t(a)] = Kernel::gradients(x[a] - base[a]);
            }
            const firn::P2GParticle<double, 2> particle{spacing * spacing, spacing * spacing, {}, {}, outer(t, t)};
            const auto record = firn::make_record<Kernel, firn::Pic, Force>(particle, d, 1.0, 1.0);
            for (std::size_t k = 0; k < K * K; ++k) {
                const std::size_t p = k / K, q = k % K;
                const V offset{double(p) - firn::centre_node<Kernel>, double(q) - firn::centre_node<Kernel>};
                const V gradient{g[0][p] * w[1][q], w[0][p] * g[1][q]};
                Sum& node = nodes[{int(base[0]) + int(p), int(base[1]) + int(q)}];
                node.impulse +=
                    (record.momentum + record.affine * offset) * (w[0][p] * w[1][q]) + record.gradient * gradient;
                node.mass += record.mass * w[0][p] * w[1][q];
            }
        }
    double power = 0;
    for (const auto& [at, node] : nodes)
        if (at[0] >= 0 && at[0] < length && at[1] - at[0] * slope > -3 && node.mass > 1e-12)
            power += dot(node.impulse, node.impulse) / node.mass;
    return power / length;
}

}  // namespace verification
