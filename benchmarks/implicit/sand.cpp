/// \file Newton steps and products with the Hessian that a slope of sand needs under its own weight: 2D, a slope of 35°
/// with a ragged surface, 2 × 2 particles a cell, GMRES with a multigrid or block Jacobi.
///
///     firn_implicit_sand [NAME=VALUE…]
///
/// cells=64 (2 : 1), phi=40 [degrees], parts=1 (the load is applied in so many parts, each beginning at the last
/// displacement), tolerance=1e-3, forcing=0.1, restart=50, restarts=0 (of GMRES in one linear solve), multigrid=1 (0:
/// block Jacobi)
#include <firn/firn.hpp>
#include <firn/implicit/multigrid.hpp>
#include <firn/implicit/newton.hpp>

#include "slope.hpp"

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <string>

namespace {

using namespace firn;
using Kernel = QuadraticBSpline;
using Force = WeightGradientForce;
using Material = Sand<double>;

double cpu() { return double(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

int main(int argc, char** argv) {
    std::map<std::string, double> options{{"cells", 64},    {"phi", 40},     {"parts", 1},    {"tolerance", 1e-3},
                                          {"forcing", 0.1}, {"restart", 50}, {"restarts", 0}, {"multigrid", 1}};
    for (int i = 1; i < argc; ++i) {
        const std::string text = argv[i];
        const std::size_t equal = text.find('=');
        if (equal == std::string::npos || !options.contains(text.substr(0, equal))) {
            std::fprintf(stderr, "Unknown option: %s\n", argv[i]);
            return 1;
        }
        options[text.substr(0, equal)] = std::atof(text.c_str() + equal + 1);
    }
    const double h = 1 / options["cells"], height = 0.5;
    const Domain<2> domain({-8 * h, -8 * h}, {1 + 8 * h, height + 8 * h}, h);
    Particles<double, 2, Material::state<2>> particles(domain);
    for (const auto& x :
         sample_box<2>({0.0, 0.0}, {1.0, height}, {.spacing = h / 2, .pattern = Pattern::jittered, .jitter = 0.25})
             .positions)
        if (x[1] < surface(x[0]))
            particles.push_back(x, Vec<double, 2>::zero(), 250 * h * h, h * h / 4, Material::state<2>{});
    const auto partition = sort_particles<Kernel>(particles, 1);
    SparseGrid<double, 2> grid(domain);
    grid.activate(partition, 1);
    const ParticleSet set{particles.view(), partition};
    const std::array motion{firn::detail::motion_of_set(set)};
    using View = std::remove_cvref_t<decltype(motion[0].view)>;
    scatter_volumes<Kernel>(grid, 1, ParticleSets<View>(motion));
    const SmallNodes<double, 2> small(grid, {}, 1);
    auto walls = Walls<double, 2>::all({0.01 * h, 0.01 * h}, {1 - 0.01 * h, height + 7 * h}, {Contact::slip, 0});
    walls.at_lower[1].contact = Contact::stick;
    const NodeConstraints<double, 2> constraints(grid, walls, 1);
    DisplacedSet<Kernel, Force, decltype(particles.view()), Material> displaced(
        set, Material::from_properties({.young = 1e7, .friction_angle = degrees(options["phi"])}));
    IncrementalPotential potential(grid, 1, 1, displaced);

    constexpr std::size_t u = 1, loads = 2, weight = 3;
    const NewtonLayers layers{u, {4, 5, 6, 7}, 8, 9};
    const std::optional<NodalInertia<double>> no_inertia;
    StepProblem problem(potential, small, constraints, loads, no_inertia);
    const auto vectors = problem.vectors();
    for (const std::size_t k : {u, loads, weight}) vectors.make(k);
    for (std::size_t i = 0; i < vectors.size(); i += node_width)
        vectors.numbers(weight)[i + 1] = -9.81 * 1000 * grid.nodes(0)[i + node_mass];
    std::printf("%zu particles, %zu small nodes\n", particles.size(), small.count());
    NewtonLimits limits;
    limits.tolerance = options["tolerance"], limits.forcing = options["forcing"];
    limits.restart = int(options["restart"]), limits.restarts = int(options["restarts"]);
    const int parts = int(options["parts"]);
    for (int k = 1; k <= parts; ++k) {
        vectors.set(loads, double(k) / parts, weight);
        const double begin = cpu();
        Multigrid<decltype(problem)> multigrid({}, 200);
        const NewtonReport report =
            options["multigrid"] > 0 ? newton(problem, layers, limits, multigrid) : newton(problem, layers, limits);
        std::printf("load %.2f: %s after %d steps, %d products, %d cuts, %.2f s; residuals", double(k) / parts,
                    report.has_converged ? "converged" : "NOT converged", report.steps(), report.products, report.cuts,
                    cpu() - begin);
        for (const double residual : report.residuals) std::printf(" %.1e", residual);
        std::printf("; worst at (%.3f, %.3f)\n", report.worst[0], report.worst[1]);
        std::fflush(stdout);
    }
}
