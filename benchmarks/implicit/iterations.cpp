/// \file Iterations of conjugate gradients with block Jacobi in the first Newton step of an elastic block under its own
/// weight, to a residual of 1e-8: 2D, 2 × 2 particles a cell, ν = 0.3, held below.
///
///     firn_implicit_iterations [THRESHOLD [CELLS…]]
///
/// THRESHOLD: part of the largest node's volume below which nodes follow others; 0: none does.
#include <firn/firn.hpp>
#include <firn/implicit/block_jacobi.hpp>
#include <firn/implicit/diagonal.hpp>
#include <firn/implicit/linear_system.hpp>

#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

using namespace firn;
using Kernel = QuadraticBSpline;
using Force = WeightGradientForce;
using Material = FixedCorotated<double>;

double cpu() { return double(std::clock()) / CLOCKS_PER_SEC; }

void solve(int cells, double threshold) {
    const double h = 1.0 / cells;
    const Domain<2> domain(Vec<double, 2>::filled(-8 * h), Vec<double, 2>::filled(1 + 8 * h), h);
    Particles<double, 2> particles(domain);
    for (const auto& x : sample_box<2>({0.0, 0.0}, {1.0, 1.0}, {.spacing = h / 2}).positions)
        particles.push_back(x, Vec<double, 2>::zero(), 250 * h * h, h * h / 4);
    const auto partition = sort_particles<Kernel>(particles, 1);
    SparseGrid<double, 2> grid(domain);
    grid.activate(partition, 1);
    const ParticleSet set{particles.view(), partition};
    const std::array motion{firn::detail::motion_of_set(set)};
    using View = std::remove_cvref_t<decltype(motion[0].view)>;
    scatter_volumes<Kernel>(grid, 1, ParticleSets<View>(motion));
    const SmallNodes<double, 2> small(grid, {threshold}, 1);
    auto walls = Walls<double, 2>::all({-7 * h, 0.01 * h}, {1 + 7 * h, 1 + 7 * h}, {Contact::slip, 0});
    walls.at_lower[1].contact = Contact::stick;
    const NodeConstraints<double, 2> constraints(grid, walls, 1);
    DisplacedSet<Kernel, Force, decltype(particles.view()), Material> displaced(set,
                                                                                Material::from_young_poisson(1e7, 0.3));
    IncrementalPotential potential(grid, 1, 1, displaced);
    LinearSystem system(potential, small, constraints);
    const auto vectors = system.vectors();
    constexpr std::size_t u = 1, x = 2, r = 3, p = 4, z = 5;
    vectors.make(r);
    for (std::size_t i = 0; i < vectors.size(); i += node_width)
        vectors.numbers(r)[i + 1] = -9.81 * 1000 * grid.nodes(0)[i + node_mass];
    vectors.make(u);
    potential.displace(u);
    system.to_forces(r);
    const double begin = cpu();
    aligned_vector<double> blocks;
    hessian_diagonal(potential, blocks);
    const BlockJacobi<double, 2> jacobi(blocks, 1);
    const double made = cpu();
    const SolverReport report = conjugate_gradients(
        system, [&](std::size_t to, std::size_t from) { jacobi.apply(vectors, to, from); }, {x, r, p, z}, {});
    const double end = cpu();
    std::printf(
        "%4d cells: %zu small nodes, %d iterations, residual %.1e; diagonal %.0f ns a particle, iteration %.0f\n",
        cells, small.count(), report.iterations, report.residual, 1e9 * (made - begin) / double(particles.size()),
        1e9 * (end - made) / double(particles.size()) / report.iterations);
}

}  // namespace

int main(int argc, char** argv) {
    const double threshold = argc > 1 ? std::atof(argv[1]) : 0.1;
    if (argc <= 2)
        for (const int cells : {32, 64, 128}) solve(cells, threshold);
    for (int i = 2; i < argc; ++i) solve(std::atoi(argv[i]), threshold);
}
