/// \file One particle among the support^D nodes around it: weights and offsets by the plain definition.
#pragma once

#include "support/random_numbers.hpp"
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/stage/p2g.hpp>

#include <vector>

namespace test_support {

template <int D>
struct Node {
    std::array<int, std::size_t(D)> index;  ///< 0, 1, 2 along each axis
    firn::Vec<double, D> offset;            ///< from the centre node, in cells
    double weight;                          ///< N, the product over the axes
    firn::Vec<double, D> gradient;          ///< ∇N, per cell
};

template <class Kernel, int D>
struct OneParticle {
    static constexpr int K = Kernel::support;
    std::array<std::array<double, std::size_t(K)>, std::size_t(D)> w, g;
    firn::Vec<double, D> d;  ///< from the centre node, in cells
    std::vector<Node<D>> nodes;

    explicit OneParticle(const firn::Vec<double, D>& fraction) {
        for (int a = 0; a < D; ++a) {
            w[std::size_t(a)] = Kernel::weights(fraction[a]);
            g[std::size_t(a)] = Kernel::gradients(fraction[a]);
            d[a] = fraction[a] - firn::centre_node<Kernel>;
        }
        int count = 1;
        for (int a = 0; a < D; ++a) count *= K;
        for (int n = 0; n < count; ++n) {
            Node<D> node{};
            for (int a = D - 1, rest = n; a >= 0; --a, rest /= K) node.index[std::size_t(a)] = rest % K;
            node.weight = 1;
            for (int a = 0; a < D; ++a) {
                node.offset[a] = node.index[std::size_t(a)] - firn::centre_node<Kernel>;
                node.weight *= w[std::size_t(a)][std::size_t(node.index[std::size_t(a)])];
                node.gradient[a] = 1;
                for (int b = 0; b < D; ++b)
                    node.gradient[a] *= (a == b ? g : w)[std::size_t(b)][std::size_t(node.index[std::size_t(b)])];
            }
            nodes.push_back(node);
        }
    }
};

template <int D>
firn::Mat<double, D> random_symmetric(Random& random) {
    const firn::Mat<double, D> a = random.gaussian<D>();
    return (a + firn::transpose(a)) * 0.5;
}

template <int D>
firn::P2GParticle<double, D> random_particle(Random& random) {
    return {random.uniform(0.5, 2), random.uniform(0.5, 2), random.vector<D>(-2, 2), random.gaussian<D>(),
            random_symmetric<D>(random)};
}

}  // namespace test_support
