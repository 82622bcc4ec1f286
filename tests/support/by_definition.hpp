/// \file P2G and G2P as the papers write them: plain loops over particles and the nodes around each, in double or in
/// dual numbers, from the kernel's own functions.
#pragma once

#include "support/scenes.hpp"

#include <stdexcept>

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

inline double value_of(double x) { return x; }
inline double value_of(const dual<double>& x) { return x.value; }

/// A node as a particle at x sees it. \tparam T  the scalar of x: double, or dual<double>
template <int D, class T = double>
struct Node {
    std::array<int, std::size_t(D)> index;
    T weight;
    Vec<T, D> gradient;  ///< of the weight, by x [1/m]
    Vec<T, D> offset;    ///< x_i − x [m]
};

/// Calls f(node) for the nodes around x.
template <class Kernel, int D, class T, class F>
void for_nodes(const Domain<D>& domain, const Vec<T, D>& x, const F& f) {
    constexpr int K = Kernel::support;
    const double h = domain.cell_size;
    std::array<int, std::size_t(D)> base{};
    std::array<std::array<T, std::size_t(K)>, std::size_t(D)> w{}, g{};
    for (int a = 0; a < D; ++a) {
        const T cells = (x[a] - T(domain.lower[a])) / T(h);
        base[std::size_t(a)] = int(std::floor(value_of(cells) - Kernel::base_shift));
        w[std::size_t(a)] = Kernel::weights(cells - T(base[std::size_t(a)]));
        g[std::size_t(a)] = Kernel::gradients(cells - T(base[std::size_t(a)]));
    }
    for (int n = 0; n < (D == 2 ? K * K : K * K * K); ++n) {
        Node<D, T> node{base, T(1), Vec<T, D>::filled(T(1 / h)), {}};
        for (int a = 0, rest = n; a < D; ++a, rest /= K) {
            const std::size_t k = std::size_t(rest % K);
            node.index[std::size_t(a)] += int(k);
            node.weight = node.weight * w[std::size_t(a)][k];
            node.offset[a] = T(domain.lower[a] + h * node.index[std::size_t(a)]) - x[a];
            for (int b = 0; b < D; ++b) node.gradient[b] = node.gradient[b] * (a == b ? g : w)[std::size_t(a)][k];
        }
        f(node);
    }
}

/// The momentum that a particle gives to a node.
/// \param m, V, v, C, stress  mass, volume, velocity, affine field and Kirchhoff stress of the particle
template <class C, int D, class T>
Vec<T, D> momentum_to(const Node<D, T>& node, double h, double dt, const T& m, const T& V, const Vec<T, D>& v,
                      const Mat<T, D>& affine, const Mat<T, D>& stress) {
    Vec<T, D> velocity = v, direction = node.gradient;
    if constexpr (C::Transfer::affine) velocity += affine * node.offset;
    if constexpr (!C::Force::weight_gradients)
        direction = node.offset * (node.weight * T(C::Kernel::inverse_inertia / (h * h)));
    return velocity * (m * node.weight) - stress * direction * (T(dt) * V);
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
    if (!of_node) throw std::logic_error("The grid does not hold a node that a particle reaches.");
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
            const Vec<double, D> momentum = momentum_to<C>(node, h, dt, m, V, v, C_p, stress);
            for (int i = 0; i < D; ++i) sum[i] += momentum[i];
            sum[node_mass] += m * node.weight;
        });
    }
    return sums;
}

/// What a particle takes back.
template <int D, class T = double>
struct Taken {
    Vec<T, D> velocity;               ///< Σ N v_i
    Mat<T, D> affine;                 ///< B D⁻¹, D summed up as it is defined
    Mat<T, D> gradient;               ///< Σ v_i ⊗ ∇N_i
    double smallest_inertia = 1e300;  ///< along an axis, in h²
};
/// \param velocity_at  velocity_at(node) returns the node's velocity
template <class Kernel, int D, class T, class VelocityAt>
Taken<D, T> taken_from(const Domain<D>& domain, const Vec<T, D>& x, const VelocityAt& velocity_at) {
    Taken<D, T> taken{Vec<T, D>::zero(), Mat<T, D>::zero(), Mat<T, D>::zero()};
    Vec<T, D> inertia = Vec<T, D>::zero();  // all these kernels' D is diagonal
    for_nodes<Kernel>(domain, x, [&](const Node<D, T>& node) {
        const Vec<T, D> v = velocity_at(node);
        taken.velocity += v * node.weight;
        taken.affine += outer(v, node.offset) * node.weight;
        taken.gradient += outer(v, node.gradient);
        for (int a = 0; a < D; ++a) inertia[a] = inertia[a] + node.weight * node.offset[a] * node.offset[a];
    });
    const double h = domain.cell_size;
    for (int j = 0; j < D; ++j) {
        taken.smallest_inertia = std::min(taken.smallest_inertia, value_of(inertia[j]) / (h * h));
        for (int i = 0; i < D; ++i) taken.affine(i, j) = taken.affine(i, j) / inertia[j];
    }
    return taken;
}
template <class Kernel, class S, int D>
Taken<D> g2p(const SparseGrid<S, D>& grid, const Vec<double, D>& x) {
    return taken_from<Kernel>(grid.domain(), x, [&](const Node<D>& node) {
        const S* of_node = grid.nodes(0) + place_of(grid, node);
        Vec<double, D> v{};
        for (int a = 0; a < D; ++a) v[a] = double(of_node[a]);
        return v;
    });
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
