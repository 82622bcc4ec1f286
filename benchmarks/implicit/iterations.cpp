/// \file Iterations of conjugate gradients in the first Newton step of elastic matter under its own weight, and what
/// they cost: two particles a cell along each axis, ν = 0.3, held below, with one thread unless said.
///
///     firn_implicit_iterations [NAME=VALUE…] [CELLS…]
///
/// scene=block (a cube of CELLS) or slope (CELLS × CELLS/2, with a ragged surface; in 3D CELLS/4 deep between slip
/// walls); dimension=2; form=quadratic, mls (the force form), cubic (the kernel, with MLS) or float; with=multigrid or
/// jacobi; degree=2 (of the smoother), range=8, first=8, coarsest=40, safety=1.15 (see MultigridRule); threshold=0.1
/// (part of the largest node's volume below which nodes follow others); tolerance=1e-8; inertia=0 (a step of so many
/// seconds); threads=1; behind=held or mirrored (how nodes behind walls move).
///
/// newton=1 counts no iterations: it prints the residuals of the Newton steps of one load step of five scenes, with
/// exact linear solves, and the order at which they fall. CELLS (32) are those of the scenes' heights; the cantilever
/// has a quarter.
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include "slope.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <map>
#include <string>

namespace {

using namespace firn;

std::map<std::string, std::string> option{
    {"scene", "block"}, {"dimension", "2"},   {"form", "quadratic"}, {"with", "multigrid"}, {"degree", "2"},
    {"range", "8"},     {"threshold", "0.1"}, {"tolerance", "1e-8"}, {"inertia", "0"},      {"threads", "1"},
    {"first", "8"},     {"coarsest", "40"},   {"safety", "1.15"},    {"behind", "held"},    {"newton", "0"}};
double number(const char* name) { return std::atof(option.at(name).c_str()); }

double now() {
    timespec t{};
    clock_gettime(number("threads") > 1 ? CLOCK_MONOTONIC : CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}
/// Returns the time of a call [s]: the shortest of some.
template <class F>
double time_of(const F& f) {
    double best = 1e9;
    for (int k = 0; k < 3; ++k) {
        const double begin = now();
        f();
        best = std::min(best, now() - begin);
    }
    return best;
}

template <class Kernel, class Force, class S, int D>
void solve(int cells) {
    using Material = FixedCorotated<S>;
    const bool is_slope = option.at("scene") == "slope";
    const int threads = int(number("threads"));
    const double h = 1.0 / cells;
    Vec<double, D> size = Vec<double, D>::filled(1);
    if (is_slope) {
        size[1] = 0.5;
        if constexpr (D == 3) size[2] = 0.25;
    }
    const Domain<D> domain(Vec<double, D>::filled(-8 * h), size + Vec<double, D>::filled(8 * h), h);
    Particles<S, D> particles(domain);
    SamplingOptions how{.spacing = h / 2};
    if (is_slope) how.pattern = Pattern::jittered, how.jitter = 0.25;
    for (const auto& x : sample_box<D>(Vec<double, D>::zero(), size, how).positions)
        if (!is_slope || x[1] < surface(x[0]))
            particles.push_back(x, Vec<S, D>::zero(), S(1000 * std::pow(h / 2, D)), S(std::pow(h / 2, D)));
    const auto partition = sort_particles<Kernel>(particles, threads);
    SparseGrid<S, D> grid(domain);
    grid.activate(partition, threads);
    const ParticleSet set{particles.view(), partition};
    const std::array motion{firn::detail::motion_of_set(set)};
    using View = std::remove_cvref_t<decltype(motion[0].view)>;
    p2g<Kernel, Pic, NoForce>(Coloured{threads}, grid, 0, ParticleSets<View>(motion));
    std::optional<NodalInertia<S>> inertia;
    const auto masses = masses_of_nodes(grid);
    constexpr std::size_t u = 1, x = 2, r = 3, p = 4, z = 5, loads = 6, of_multigrid = 7;
    if (number("inertia") > 0) inertia = NodalInertia<S>{masses, number("inertia"), u};
    scatter_volumes<Kernel>(grid, threads, ParticleSets<View>(motion));
    const bool is_mirrored = option.at("behind") == "mirrored";
    const double off = is_mirrored ? 0 : 0.01 * h;
    Vec<double, D> low = Vec<double, D>::filled(is_slope ? off : -7 * h), high = size + Vec<double, D>::filled(7 * h);
    if (is_slope) {
        high[0] = size[0] - off;
        if constexpr (D == 3) high[2] = size[2] - off;
    }
    low[1] = off;
    auto walls = Walls<S, D>::all(low, high, {Contact::slip, 0});
    walls.at_lower[1].contact = Contact::stick;
    if (is_mirrored) walls.nodes_behind = NodesBehind::mirrored;
    const Mirrors mirrors = mirrors_of<Kernel>(walls, domain);
    MirroredNodes<S, D> mirrored(grid, mirrors, threads);
    mirrored.mirror_volumes(grid.nodes(0), threads);
    const SmallNodes<S, D> small(grid, {number("threshold")}, threads);
    const NodeConstraints<S, D> constraints(grid, walls, mirrored, threads);
    DisplacedSet<Kernel, Force, decltype(particles.view()), Material> displaced(set,
                                                                                Material::from_young_poisson(1e7, 0.3));
    IncrementalPotential potential(grid, 1, threads, displaced);
    StepProblem problem(potential, small, constraints, loads, inertia);
    const auto vectors = problem.vectors();
    for (const std::size_t k : {u, x, r, p, z, loads}) vectors.make(k);
    const auto weigh = [&] {
        vectors.fill(r, S(0));
        for (std::size_t i = 0; i < masses.size(); ++i) vectors.numbers(r)[i * node_width + 1] = S(-9.81) * masses[i];
        problem.to_forces(r);
    };
    potential.displace(u);
    SolverReport report;
    const double n = double(particles.size()), ns = 1e9 / n;
    weigh();
    vectors.copy(p, r);
    const double product = time_of([&] { problem.multiply(p); });
    std::printf("%-5s %dD %-9s %4d cells, %8.0f particles, %5zu small nodes, ", option.at("scene").c_str(), D,
                option.at("form").c_str(), cells, n, small.count());
    const auto run = [&](const auto& precondition, double made, double applied) {
        weigh();
        const double begin = now();
        report = conjugate_gradients(problem, precondition, {x, r, p, z}, {number("tolerance"), 20'000});
        const double end = now();
        std::printf("%4d iterations%s, %7.0f ns a particle: renew %6.0f, apply %5.0f, product %4.0f", report.iterations,
                    report.has_converged ? "" : " (stopped)", (end - begin + made) * ns, made * ns, applied * ns,
                    product * ns);
    };
    if (option.at("with") == "jacobi") {
        aligned_vector<S> blocks;
        const double begin = now();
        hessian_diagonal(potential, blocks);
        problem.add_diagonal(blocks);
        const BlockJacobi<S, D> jacobi(blocks, threads);
        const double made = now() - begin;
        weigh();
        run([&](std::size_t to, std::size_t from) { jacobi.apply(vectors, to, from); }, made,
            time_of([&] { jacobi.apply(vectors, z, r); }));
    } else {
        Multigrid<decltype(problem)> multigrid({.degree = int(number("degree")),
                                                .range = number("range"),
                                                .safety = number("safety"),
                                                .first_iterations = int(number("first")),
                                                .coarsest = std::size_t(number("coarsest"))},
                                               of_multigrid);
        const double begin = now();
        multigrid.renew(problem);
        const double made = now() - begin, again = time_of([&] { multigrid.renew(problem); });
        weigh();
        run([&](std::size_t to, std::size_t from) { multigrid.apply(problem, to, from); }, made,
            time_of([&] { multigrid.apply(problem, z, r); }));
        std::printf(", renew again %5.0f; levels", again * ns);
        const MultigridReport of = multigrid.report();
        for (const std::size_t nodes : of.nodes) std::printf(" %zu", nodes);
        std::printf(", eigenvalues");
        for (const double one : of.eigenvalues) std::printf(" %.2f", one);
        if (!of.is_definite) std::printf(" NOT DEFINITE");
    }
    // An explicit step of no time: the particles stay as they are.
    const double step = time_of([&] {
        p2g<Kernel, Apic, Force>(Coloured{threads}, particles.view(), partition, grid, 0);
        grid_update(Coloured{threads}, grid, 0.0, Vec<S, D>::zero(), walls, mirrors);
        g2p<Kernel, Apic, Force>(Coloured{threads}, particles.view(), partition, grid,
                                 Material::from_young_poisson(1e7, 0.3), 0.0);
    });
    std::printf("; explicit step %.0f\n", step * ns);
    std::fflush(stdout);
}

template <int D>
void choose(int cells) {
    [[maybe_unused]] const std::string& form = option.at("form");
#ifndef FIRN_QUICK
    if (form == "mls") return solve<QuadraticBSpline, MlsForce, double, D>(cells);
    if (form == "cubic") return solve<CubicBSpline, MlsForce, double, D>(cells);
    if (form == "float") return solve<QuadraticBSpline, WeightGradientForce, float, D>(cells);
#endif
    solve<QuadraticBSpline, WeightGradientForce, double, D>(cells);
}

/// Matter at rest that gravity loads in one step, from no load at all.
struct Load {
    const char* name;
    Vec<double, 2> size;    ///< of the box that the matter is cut from [m]
    int cells;              ///< along the height of the box
    bool is_slope = false;  ///< Surface and particles are ragged, and slip walls hold the sides.
    int held = 1;           ///< The matter sticks to a wall before this axis.
};

/// Prints numbers, and the order at which they fall: log(r₃/r₂)/log(r₂/r₁) of each three that follow each other.
void print_orders(const char* name, const std::vector<double>& r) {
    std::printf("  %s:", name);
    for (const double one : r) std::printf(" %.1e", one);
    std::printf("; orders:");
    for (std::size_t k = 2; k < r.size(); ++k)
        std::printf(" %.2f", std::log(r[k] / r[k - 1]) / std::log(r[k - 1] / r[k - 2]));
    std::printf("\n");
}
/// Takes a load step, and prints the residuals of its Newton steps; of matter with a potential Φ, that, too.
template <class Material, class... Policies>
void load_step(const Load& of, const Material& material, const Policies&... policies) {
    const double h = of.size[1] / of.cells;
    const Vec<double, 2> room = Vec<double, 2>::filled(of.is_slope ? 8 * h : of.size[0]);
    const Vec<double, 2> low = Vec<double, 2>::filled(-1) * room[0], high = of.size + room;
    auto walls = Walls<double, 2>::all(low, high, {Contact::none, 0});
    if (of.is_slope) walls = Walls<double, 2>::all({0, 0}, {of.size[0], high[1]}, {Contact::slip, 0});
    walls.lower[of.held] = 0;
    walls.at_lower[std::size_t(of.held)].contact = Contact::stick;
    Simulation simulation(Domain<2>{low, high, h}, material, walls, WeightGradientForce{}, Coloured{1}, QuasiStatic{},
                          policies...);
    simulation.warn = {};
    SamplingOptions how{.spacing = h / 2};
    if (of.is_slope) how.pattern = Pattern::jittered, how.jitter = 0.25;
    auto samples = sample_box<2>({0, 0}, of.size, how);
    if (of.is_slope) std::erase_if(samples.positions, [](const auto& x) { return x[1] >= surface(x[0]); });
    simulation.add(samples, 1000);

    auto& time = simulation.integration;
    time.most_halvings = 0;
    time.newton = {.tolerance = 1e-12, .forcing = 1e-9, .solver_iterations = 20'000, .restart = 200, .restarts = 100};
    // A step that is not solved leaves the particles as they are: so Φ is found after one Newton step, two, …
    const NewtonReport& report = simulation.solution.newton;
    std::vector<double> energies;
    for (time.newton.iterations = 1; time.newton.iterations <= 100; ++time.newton.iterations) {
        try {
            simulation.advance(1);
        } catch (const convergence_error&) {
        }
        energies.push_back(report.last.energy);
        if (report.end != NewtonEnd::too_many_steps) break;
    }
    std::printf("%s, %zu particles: %s, moves by %.2g cells, %d products\n", of.name, simulation.particles().size(),
                report.has_converged ? "converged" : "NOT converged", simulation.solution.largest_motion,
                report.products);
    print_orders("residuals", report.residuals);
    if constexpr (has_potential<Material, 2> && sizeof...(Policies) == 0) {
        const double least = energies.back(), rounding = 64 * std::numeric_limits<double>::epsilon() * std::abs(least);
        std::erase_if(energies, [&](double energy) { return energy - least <= rounding; });
        for (double& energy : energies) energy -= least;
        print_orders("energies above the last [J]", energies);
    }
    if constexpr (requires { simulation.particles().state(0).plastic_strain; }) {
        const auto& particles = simulation.particles();
        std::size_t flowing = 0;
        double largest = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const double strain = particles.state(slot).plastic_strain;
            flowing += strain > 0, largest = std::max(largest, strain);
        }
        std::printf("  %zu particles have flowed, by %.1e at most\n", flowing, largest);
    }
    std::fflush(stdout);
}

void newton_steps(int cells) {
    load_step({"elastic block", {1, 1}, cells}, FixedCorotated<double>::from_young_poisson(1e5, 0.3));
    load_step({.name = "cantilever", .size = {1, 1.0 / 16}, .cells = cells / 4, .held = 0},
              FixedCorotated<double>::from_young_poisson(4e6, 0.3));
    load_step({"F-bar", {1, 1}, cells}, FixedCorotated<double>::from_young_poisson(5e4, 0.49), FBar{});
    load_step({"von Mises", {1, 1}, cells},
              VonMises<double>::from_properties({.young = 1e6, .poisson = 0.3, .yield_stress = 3e3, .hardening = 1e5}));
    load_step({.name = "sand", .size = {1, 0.5}, .cells = cells, .is_slope = true},
              Sand<double>::from_properties({.young = 1e6, .friction_angle = degrees(40)}));
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<int> cells;
    for (int i = 1; i < argc; ++i) {
        const std::string text = argv[i];
        const std::size_t at = text.find('=');
        if (at == std::string::npos)
            cells.push_back(std::atoi(argv[i]));
        else if (!option.contains(text.substr(0, at)))
            return std::fprintf(stderr, "There is no option %s.\n", text.c_str()), 1;
        else
            option[text.substr(0, at)] = text.substr(at + 1);
    }
    const int dimension = int(number("dimension"));
    if (number("newton") != 0) return newton_steps(cells.empty() ? 32 : cells.front()), 0;
    if (cells.empty()) cells = dimension == 2 ? std::vector{32, 64, 128} : std::vector{16, 32};
    for (const int n : cells) dimension == 2 ? choose<2>(n) : choose<3>(n);
}
