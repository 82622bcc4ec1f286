/// \file The incremental potential of a block of particles by definition: plain loops over particles and nodes in
/// double, with Eigen's inverse, and a dense Hessian.
#pragma once

#include "support/by_definition.hpp"
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/eigen.hpp>
#include <firn/firn.hpp>
#include <firn/implicit/potential.hpp>
#include <firn/implicit/small_nodes.hpp>

#include <Eigen/Dense>

#include <map>
#include <vector>

namespace implicit_steps {

using namespace firn;
using test_support::Random;

using Numbers = Eigen::VectorXd;  ///< D numbers of each node that particles reach

/// A block of particles, n along each axis and two in each cell, strained at random.
template <class Kernel_, class Force_, class Material_, int D_, class Volume_ = OwnVolume>
struct Block {
    using Kernel = Kernel_;
    using Force = Force_;
    using Material = Material_;
    using Volume = Volume_;
    static constexpr int D = D_;
    static constexpr bool has_energy = has_potential<Material, D_> && !Volume::averages_volume;
    using S = material_scalar_t<Material>;
    using State = material_state_t<Material, D>;
    static constexpr std::size_t of_u = 1, of_v = 2;  ///< layers

    Material material;
    double dt;
    Domain<D> domain;
    Particles<S, D, State> particles;
    BlockPartition<D> partition;
    SparseGrid<S, D> grid;
    std::map<std::array<int, std::size_t(D)>, int> nodes;  ///< numbers of the nodes that particles reach
    std::vector<std::size_t> offsets;                      ///< of their numbers, among those of all nodes

    struct Particle {
        std::size_t slot;
        double volume;
        State state;
        std::vector<std::pair<int, Vec<double, D>>> weights;  ///< (number of the node, w_i)
        std::vector<double> parts;                            ///< N of each of these nodes
    };
    std::vector<Particle> of;

    static Domain<D> make_domain() { return Domain<D>(Vec<double, D>::filled(-0.3), Vec<double, D>::filled(4.5), 0.1); }

    /// \param at  the lower corner of the block, along every axis [cells]
    Block(const Material& m, double strain, int n = 4, double at = 5.3, double step = 1, std::uint64_t seed = 1,
          const Domain<D>& in = make_domain())
        : material(m), dt(step), domain(in), particles(domain), grid(domain) {
        Random random(seed);
        const double h = domain.cell_size;
        int all = 1;
        for (int a = 0; a < D; ++a) all *= n;
        for (int i = 0; i < all; ++i) {
            Vec<double, D> x{};
            for (int a = 0, rest = i; a < D; ++a, rest /= n)
                x[a] = into_domain(domain, a,
                                   domain.lower[a] + h * (at + 0.5 * (rest % n + 0.5) + random.uniform(-0.1, 0.1)));
            auto state = initial_state<D>(material);
            if constexpr (requires { state.F; })
                state.F = DeformationGradient<S, D>::from_displacement(cast<S>(random.gaussian<D>() * strain));
            else if constexpr (requires { state.J; })
                state.J = VolumeRatio<S>::from_excess(S(random.uniform(-strain, -0.1 * strain)));
            const double volume = random.uniform(0.8, 1.2) * std::pow(0.5 * h, D);
            particles.push_back(x, Vec<S, D>::zero(), S(1000 * volume), S(volume), state);
        }
        partition = sort_particles<Kernel>(particles, 1);
        grid.activate(partition, 1);
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            Particle p{slot, double(particles.volume(slot)), particles.state(slot), {}, {}};
            by_definition::for_nodes<Kernel>(domain, particles.exact_position(slot), [&](const auto& node) {
                auto index = node.index;
                for (std::size_t a = 0; a < std::size_t(D); ++a)
                    if (domain.periodic[a]) index[a] = modulo(index[a], domain.cells(int(a)));
                const auto [found, is_new] = nodes.try_emplace(index, int(nodes.size()));
                if (is_new) offsets.push_back(std::size_t(grid.find_node(index) - grid.nodes(0)));
                Vec<double, D> w = node.gradient;
                if constexpr (!Force::weight_gradients)
                    w = node.offset * (node.weight * double(inverse_inertia<Kernel>(h)));
                p.weights.emplace_back(found->second, w);
                p.parts.push_back(node.weight);
            });
            of.push_back(p);
        }
        for (const std::size_t k : {of_u, of_v}) {
            grid.exchange(k);
            std::fill_n(grid.layer(k), grid.block_count() * std::size_t(block_nodes<D> * node_width), S(0));
        }
    }

    int size() const { return D * int(nodes.size()); }
    Numbers random_numbers(double size_of_each, std::uint64_t seed) const {
        Random random(seed);
        Numbers u(size());
        for (int i = 0; i < size(); ++i) u[i] = random.uniform(-size_of_each, size_of_each);
        return u;
    }
    void put(const Numbers& u, std::size_t layer) {
        for (std::size_t q = 0; q < offsets.size(); ++q)
            for (int a = 0; a < D; ++a) grid.layer(layer)[offsets[q] + std::size_t(a)] = S(u[D * int(q) + a]);
    }
    /// The present numbers of the nodes. All others must be zero.
    Numbers get() const {
        Numbers r(size());
        std::size_t others = 0;
        for (std::size_t i = 0; i < grid.block_count() * std::size_t(block_nodes<D> * node_width); ++i)
            others += grid.nodes(0)[i] != 0;
        for (std::size_t q = 0; q < offsets.size(); ++q)
            for (int a = 0; a < D; ++a) {
                const S number = grid.nodes(0)[offsets[q] + std::size_t(a)];
                others -= number != 0;
                r[D * int(q) + a] = double(number);
            }
        REQUIRE(others == 0);
        return r;
    }

    auto set() { return ParticleSet{particles.view(), partition}; }
    /// The small nodes. The present numbers of the nodes are then their volumes.
    SmallNodes<S, D> small_nodes(int threads = 1, const SmallNodeRule& rule = {}) {
        const std::array sets{firn::detail::motion_of_set(set())};
        using View = std::remove_cvref_t<decltype(sets[0].view)>;
        scatter_volumes<Kernel>(grid, threads, ParticleSets<View>(sets));
        return SmallNodes<S, D>(grid, rule, threads);
    }
    auto potential(int threads = 1) {
        using View = typename Particles<S, D, State>::View;
        return IncrementalPotential(grid, dt, threads,
                                    DisplacedSet<Kernel, Force, View, Material, Volume>(set(), material));
    }

    // By definition.

    Mat<double, D> gradient_at(const Particle& p, const Numbers& u) const {
        Mat<double, D> L = Mat<double, D>::zero();
        for (const auto& [q, w] : p.weights)
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) L(a, b) += u[D * q + a] * w[b];
        return L;
    }
    Numbers random_displacement(double size_of_gradients, std::uint64_t seed) const {
        return random_numbers(size_of_gradients * domain.cell_size, seed);
    }
    double energy(const Numbers& u) const {
        double sum = 0;
        const Mat<double, D> I = Mat<double, D>::identity();
        for (const Particle& p : of) {
            State after = p.state;
            after.F = DeformationGradient<double, D>((I + gradient_at(p, u)) * p.state.F);
            sum += p.volume * energy_density(material, after);
        }
        return sum;
    }
    /// The matrix whose product with numbers of particles is their average at the nodes, brought back to the particles:
    /// Σ_i N_ip (Σ_q N_iq V_q a_q) / Σ_q N_iq V_q.
    Eigen::MatrixXd averaging() const {
        const int count = int(of.size());
        Eigen::MatrixXd N = Eigen::MatrixXd::Zero(int(nodes.size()), count);
        Eigen::VectorXd V(count);
        for (int p = 0; p < count; ++p) {
            V[p] = of[std::size_t(p)].volume;
            for (std::size_t k = 0; k < of[std::size_t(p)].parts.size(); ++k)
                N(of[std::size_t(p)].weights[k].first, p) = of[std::size_t(p)].parts[k];
        }
        const Eigen::MatrixXd NV = N * V.asDiagonal();
        return N.transpose() * NV.rowwise().sum().cwiseInverse().asDiagonal() * NV;
    }
    /// det(I + ∇u) − 1 of each particle, averaged; none if volumes are not averaged.
    Eigen::VectorXd volume_changes(const Numbers& u) const {
        if (!Volume::averages_volume) return {};
        Eigen::VectorXd changes(int(of.size()));
        for (std::size_t p = 0; p < of.size(); ++p)
            changes[int(p)] = determinant(Mat<double, D>::identity() + gradient_at(of[p], u)) - 1;
        return averaging() * changes;
    }
    /// ∇u that strains a particle's matter: of the shape of L, but with det(I + ∇u) = 1 + average if volumes are
    /// averaged.
    template <class T>
    static Mat<T, D> of_matter(const Mat<T, D>& L, const T& average) {
        const Mat<T, D> I = Mat<T, D>::identity();
        if (!Volume::averages_volume) return L;
        return (I + L) * exp(log((T(1) + average) / determinant(I + L)) * T(1.0 / D)) - I;
    }
    /// V0 τ′ (I + ∇u)⁻ᵀ. \param L  ∇u;  \param strain  ∇u that strains the matter
    Mat<double, D> matrix(const Particle& p, const Mat<double, D>& L, const Mat<double, D>& strain) const {
        const Mat<double, D> rate = strain * (1 / dt), G = Mat<double, D>::identity() + L;
        const State after = updated(material, p.state, rate, dt);
        const Eigen::Matrix<double, D, D> inverse = as_eigen(G).inverse();
        const Mat<double, D> tau = stress_of(material, after, rate);
        return Mat<double, D>(Eigen::Matrix<double, D, D>(as_eigen(tau) * inverse.transpose())) * p.volume;
    }
    Numbers gradient(const Numbers& u) const {
        Numbers sum = Numbers::Zero(size());
        const Eigen::VectorXd averages = volume_changes(u);
        for (std::size_t index = 0; index < of.size(); ++index) {
            const Mat<double, D> L = gradient_at(of[index], u);
            const Mat<double, D> M =
                matrix(of[index], L, of_matter(L, Volume::averages_volume ? averages[int(index)] : 0.0));
            for (const auto& [q, w] : of[index].weights) {
                const Vec<double, D> f = M * w;
                for (int a = 0; a < D; ++a) sum[D * q + a] += f[a];
            }
        }
        return sum;
    }
    /// The dense Hessian. The derivatives of each particle's stress by ∇u and by the average are by dual numbers.
    Eigen::MatrixXd hessian(const Numbers& u) const {
        using T = dual<double>;
        using Square = Eigen::Matrix<double, D, D>;
        const auto lifted = lift<T>(material);
        Eigen::MatrixXd K = Eigen::MatrixXd::Zero(size(), size());
        const Eigen::VectorXd averages = volume_changes(u);
        Eigen::MatrixXd by_displacements;  // the derivatives of the averages
        if (Volume::averages_volume) {
            by_displacements = Eigen::MatrixXd::Zero(int(of.size()), size());
            for (std::size_t p = 0; p < of.size(); ++p) {
                const Square G = as_eigen(gradient_at(of[p], u)) + Square::Identity(),
                             C = G.determinant() * G.inverse();
                for (const auto& [j, v] : of[p].weights)
                    for (int a = 0; a < D; ++a)
                        for (int b = 0; b < D; ++b) by_displacements(int(p), D * j + b) += C(a, b) * v[a];
            }
            by_displacements = averaging() * by_displacements;
        }
        for (std::size_t index = 0; index < of.size(); ++index) {
            const Particle& p = of[index];
            const Mat<double, D> L = gradient_at(p, u);
            const Square inverse = (as_eigen(L) + Square::Identity()).inverse();
            const auto before = firn::detail::converted_state<material_state_t<with_scalar_t<Material, T>, D>>(p.state);
            const double average = Volume::averages_volume ? averages[int(index)] : 0;
            for (int k = 0; k < D * D + int(Volume::averages_volume); ++k) {  // the last one is by the average
                Mat<T, D> along = cast<T>(L);
                Square value, change, dL = Square::Zero();
                if (k < D * D) along.m[k].derivative = dL(k % D, k / D) = 1;
                const Mat<T, D> rate = of_matter(along, T{average, k < D * D ? 0.0 : 1.0}) * T(1 / dt);
                const auto after = updated(lifted, before, rate, T(dt));
                const Mat<T, D> tau = stress_of(lifted, after, rate);
                for (int i = 0; i < D; ++i)
                    for (int j = 0; j < D; ++j) value(i, j) = tau(i, j).value, change(i, j) = tau(i, j).derivative;
                const Square dM = (change - value * (dL * inverse).transpose()) * inverse.transpose() * p.volume;
                const int column_axis = k % D, by = k / D;
                for (const auto& [i, w] : p.weights)
                    for (int a = 0; a < D; ++a)
                        for (int b = 0; b < D; ++b) {
                            if (k == D * D) K.row(D * i + a) += dM(a, b) * w[b] * by_displacements.row(int(index));
                            if (k == D * D) continue;
                            for (const auto& [j, v] : p.weights)
                                K(D * i + a, D * j + column_axis) += dM(a, b) * w[b] * v[by];
                        }
            }
        }
        return K;
    }
};

/// Checks the gradient and the products of a block at u, against what the definition and differences say.
/// \param is_smooth  whether differences of the gradient say something: not where stresses jump
template <class Block>
void check_block(Block& block, double displacement, bool is_smooth = true) {
    constexpr int D = Block::D;
    const Numbers u = block.random_displacement(displacement, 5), v = block.random_displacement(1, 6);
    block.put(u, Block::of_u);
    block.put(v, Block::of_v);
    auto potential = block.potential();
    const DisplacementReport report = potential.displace(Block::of_u);
    REQUIRE(report.is_regular());
    potential.gradient();
    const Numbers gradient = block.get(), expected = block.gradient(u);
    REQUIRE(expected.norm() > 0);
    CHECK((gradient - expected).norm() <= 1e-12 * expected.norm());
    if constexpr (Block::has_energy) {
        CHECK(std::abs(report.energy - block.energy(u)) <= 1e-13 * std::abs(report.energy));
        const double e = 1e-6;
        const auto at = [&](double t) { return block.energy(u + t * v); };
        const double slope = (8 * (at(e) - at(-e)) - (at(2 * e) - at(-2 * e))) / (12 * e);
        CHECK(std::abs(slope - gradient.dot(v)) <= 1e-7 * std::abs(slope));
    } else if (!has_potential<typename Block::Material, D>) {
        CHECK(std::isnan(report.energy));
    }
    potential.product(Block::of_v);
    const Numbers product = block.get();
    const Eigen::MatrixXd K = block.hessian(u);
    CHECK((product - K * v).norm() <= 1e-10 * (K * v).norm());
    if (Block::has_energy) CHECK((K - K.transpose()).norm() <= 1e-13 * K.norm());
    if (is_smooth) {
        const double e = 1e-6;
        const auto at = [&](double t) { return block.gradient(u + t * v); };
        const Numbers change = (8 * (at(e) - at(-e)) - (at(2 * e) - at(-2 * e))) / (12 * e);
        CHECK((product - change).norm() <= 1e-7 * change.norm());
    }
    // The same product from other lanes: symmetric.
    if (Block::has_energy) {
        const Numbers w = block.random_displacement(1, 9);
        block.put(w, Block::of_v);
        potential.product(Block::of_v);
        const double one = product.dot(w), other = block.get().dot(v);
        CHECK(std::abs(one - other) <= 1e-12 * product.norm() * w.norm());
    }
}

}  // namespace implicit_steps
