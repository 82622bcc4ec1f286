/// \file P2G and G2P as the papers write them: plain loops in double over particles and the nodes around each, from the
/// kernel's own functions.
#pragma once

#include "support/catch.hpp"
#include "support/scenes.hpp"

namespace by_definition {

using namespace firn;

template <class S_, int D_, class Transfer_, class Force_, class Kernel_ = QuadraticBSpline>
struct Case {
    using S = S_;
    static constexpr int D = D_;
    using Transfer = Transfer_;
    using Force = Force_;
    using Kernel = Kernel_;
};

/// A node as a particle at x sees it.
template <int D>
struct Node {
    std::array<int, std::size_t(D)> index;
    double weight;
    Vec<double, D> gradient;  ///< of the weight, by x [1/m]
    Vec<double, D> offset;    ///< x_i − x [m]
};

/// Calls f(node) for the nodes around x.
template <class Kernel, int D, class F>
void for_nodes(const Domain<D>& domain, const Vec<double, D>& x, const F& f) {
    constexpr int K = Kernel::support;
    const double h = domain.cell_size;
    std::array<int, std::size_t(D)> base{};
    std::array<std::array<double, std::size_t(K)>, std::size_t(D)> w{}, g{};
    for (int a = 0; a < D; ++a) {
        const double cells = (x[a] - domain.lower[a]) / h;
        base[std::size_t(a)] = int(std::floor(cells - Kernel::base_shift));
        w[std::size_t(a)] = Kernel::weights(cells - base[std::size_t(a)]);
        g[std::size_t(a)] = Kernel::gradients(cells - base[std::size_t(a)]);
    }
    for (int n = 0; n < (D == 2 ? K * K : K * K * K); ++n) {
        Node<D> node{base, 1, Vec<double, D>::filled(1 / h), {}};
        for (int a = 0, rest = n; a < D; ++a, rest /= K) {
            const std::size_t k = std::size_t(rest % K);
            node.index[std::size_t(a)] += int(k);
            node.weight *= w[std::size_t(a)][k];
            node.offset[a] = domain.lower[a] + h * node.index[std::size_t(a)] - x[a];
            for (int b = 0; b < D; ++b) node.gradient[b] *= (a == b ? g : w)[std::size_t(a)][k];
        }
        f(node);
    }
}

template <int D, class S>
Vec<double, D> vector(const std::vector<S>& numbers, std::size_t p) {
    Vec<double, D> v{};
    for (int a = 0; a < D; ++a) v[a] = double(numbers[p * std::size_t(D) + std::size_t(a)]);
    return v;
}
template <int D, class S>
Mat<double, D> matrix(const std::vector<S>& by_rows, std::size_t p) {
    Mat<double, D> m{};
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) m(i, j) = double(by_rows[p * D * D + std::size_t(D * i + j)]);
    return m;
}

/// The number of the grid that a node begins with.
template <class S, int D>
std::size_t place_of(const SparseGrid<S, D>& grid, const Node<D>& node) {
    const S* of_node = grid.find_node(node.index);
    if (!of_node) FAIL("The grid does not hold a node that a particle reaches.");
    return std::size_t(of_node - grid.nodes(0));
}

/// Momentum and mass of all nodes of the grid.
template <class C>
std::vector<double> p2g(const scenes::RandomCloud<typename C::S, C::D>& cloud,
                        const SparseGrid<typename C::S, C::D>& grid, double dt) {
    constexpr int D = C::D;
    std::vector<double> sums(grid.block_count() * std::size_t(block_nodes<D> * node_width), 0.0);
    const double h = cloud.domain.cell_size;
    for (std::size_t p = 0; p < cloud.size(); ++p) {
        const double m = double(cloud.mass[p]), V = double(cloud.volume[p]);
        const Vec<double, D> v = vector<D>(cloud.v, p);
        const Mat<double, D> C_p = matrix<D>(cloud.C, p), stress = matrix<D>(cloud.stress, p);
        for_nodes<typename C::Kernel>(cloud.domain, vector<D>(cloud.x, p), [&](const Node<D>& node) {
            double* sum = sums.data() + place_of(grid, node);
            Vec<double, D> velocity = v, direction = node.gradient;
            if (C::Transfer::affine) velocity += C_p * node.offset;
            if constexpr (!C::Force::weight_gradients)
                direction = node.offset * (node.weight * C::Kernel::inverse_inertia / (h * h));
            const Vec<double, D> momentum = velocity * (m * node.weight) - stress * direction * (dt * V);
            for (int i = 0; i < D; ++i) sum[i] += momentum[i];
            sum[node_mass] += m * node.weight;
        });
    }
    return sums;
}

/// What a particle takes back.
template <int D>
struct Taken {
    Vec<double, D> velocity;          ///< Σ N v_i
    Mat<double, D> affine;            ///< B D⁻¹, D summed up as it is defined
    Mat<double, D> gradient;          ///< Σ v_i ⊗ ∇N_i
    double smallest_inertia = 1e300;  ///< along an axis, in h²
};
template <class Kernel, class S, int D>
Taken<D> g2p(const SparseGrid<S, D>& grid, const Vec<double, D>& x) {
    Taken<D> taken{Vec<double, D>::zero(), Mat<double, D>::zero(), Mat<double, D>::zero()};
    Vec<double, D> inertia = Vec<double, D>::zero();  // all these kernels' D is diagonal
    for_nodes<Kernel>(grid.domain(), x, [&](const Node<D>& node) {
        const S* of_node = grid.nodes(0) + place_of(grid, node);
        Vec<double, D> v{};
        for (int a = 0; a < D; ++a) v[a] = double(of_node[a]);
        taken.velocity += v * node.weight;
        taken.affine += outer(v, node.offset) * node.weight;
        taken.gradient += outer(v, node.gradient);
        for (int a = 0; a < D; ++a) inertia[a] += node.weight * node.offset[a] * node.offset[a];
    });
    const double h = grid.domain().cell_size;
    for (int j = 0; j < D; ++j) {
        taken.smallest_inertia = std::min(taken.smallest_inertia, inertia[j] / (h * h));
        for (int i = 0; i < D; ++i) taken.affine(i, j) /= inertia[j];
    }
    return taken;
}

template <class S, int D>
std::vector<double> numbers(const SparseGrid<S, D>& grid) {
    std::vector<double> all;
    for (std::size_t b = 0; b < grid.block_count(); ++b)
        all.insert(all.end(), grid.nodes(b), grid.nodes(b) + block_nodes<D> * node_width);
    return all;
}

/// Largest difference of momentum and of mass, each relative to the largest on the grid.
inline double difference(const std::vector<double>& a, const std::vector<double>& b) {
    double momentum = 0, mass = 0, momentum_scale = 0, mass_scale = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        double &worst = i % 4 == 3 ? mass : momentum, &scale = i % 4 == 3 ? mass_scale : momentum_scale;
        worst = std::max(worst, std::abs(a[i] - b[i]));
        scale = std::max(scale, std::abs(b[i]));
    }
    return std::max(momentum / momentum_scale, mass / mass_scale);
}

}  // namespace by_definition
