/// \file What the gradient of the incremental potential and its Hessian × vector cost, in explicit steps on the same
/// particles (P2G, grid update, G2P), with one thread.
///
///     firn_implicit_products [CELLS_2D [CELLS_3D]]
#include <firn/firn.hpp>
#include <firn/implicit/potential.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

using namespace firn;

double cpu() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// Returns the time of a call [s]: the shortest of several.
template <class F>
double time_of(const F& f) {
    f();
    double best = 1e9;
    for (int k = 0; k < 7; ++k) {
        const double begin = cpu();
        int calls = 0;
        do f(), ++calls;
        while (cpu() - begin < 0.1);
        best = std::min(best, (cpu() - begin) / calls);
    }
    return best;
}

template <class Kernel, class Force, int D, class Material>
void measure(const Material& material, int cells) {
    using S = material_scalar_t<Material>;
    const double h = 1.0 / cells;
    const Domain<D> domain(Vec<double, D>::filled(-8 * h), Vec<double, D>::filled(1 + 8 * h), h);
    Particles<S, D, material_state_t<Material, D>> particles(domain);
    for (const auto& x : sample_box<D>(Vec<double, D>::zero(), Vec<double, D>::filled(1), {.spacing = h / 2}).positions)
        particles.push_back(x, Vec<S, D>::zero(), S(1000 * std::pow(h / 2, D)), S(std::pow(h / 2, D)));
    const auto partition = sort_particles<Kernel>(particles, 1);
    SparseGrid<S, D> grid(domain);
    grid.activate(partition, 1);
    const std::size_t numbers = grid.block_count() * std::size_t(block_nodes<D> * node_width);
    for (const std::size_t k : {1, 2}) {
        grid.exchange(k);
        for (std::size_t i = 0; i < numbers; ++i)
            grid.layer(k)[i] = i % node_width < D ? S((k == 1 ? 0.02 * h : 1) * std::sin(0.37 * double(i))) : S(0);
    }
    const ParticleSet set{particles.view(), partition};
    DisplacedSet<Kernel, Force, decltype(particles.view()), Material> displaced(set, material);
    IncrementalPotential potential(grid, 1, 1, displaced);
    if (!potential.displace(1).is_regular()) std::puts("inverted");
    const double product = time_of([&] { potential.product(2); });
    const double displace = time_of([&] { potential.displace(1); });
    const double scatter = time_of([&] { potential.gradient(); });
    // An explicit step of no time: the particles stay as they are.
    const double step = time_of([&] {
        p2g<Kernel, Apic, Force>(Coloured{1}, particles.view(), partition, grid, 0);
        grid_update(Coloured{1}, grid, 0.0, Vec<S, D>::zero(), Walls<S, D>::all(domain.lower, domain.upper, {}));
        g2p<Kernel, Apic, Force>(Coloured{1}, particles.view(), partition, grid, material, 0.0);
    });
    const double n = double(particles.size()), ns = 1e9 / n;
    std::printf("%dD %-6s %-16s %-16s %8.0f  step %5.1f ns, displace %5.1f, scatter %5.1f, product %5.1f: %.2f steps\n",
                D, sizeof(S) == 4 ? "float" : "double", Material::name, Force::name, n, step * ns, displace * ns,
                scatter * ns, product * ns, product / step);
}

template <class S, int D>
void measure_all(int cells) {
    measure<QuadraticBSpline, WeightGradientForce, D>(FixedCorotated<S>::from_young_poisson(1e6, 0.3), cells);
    measure<QuadraticBSpline, MlsForce, D>(FixedCorotated<S>::from_young_poisson(1e6, 0.3), cells);

    measure<QuadraticBSpline, MlsForce, D>(Hencky<S>::from_young_poisson(1e6, 0.3), cells);
    measure<QuadraticBSpline, MlsForce, D>(Sand<S>::from_properties({}), cells);
}

}  // namespace

int main(int argc, char** argv) {
    const int cells_2d = argc > 1 ? std::atoi(argv[1]) : 128, cells_3d = argc > 2 ? std::atoi(argv[2]) : 24;
    measure_all<double, 2>(cells_2d);
    measure_all<double, 3>(cells_3d);
    measure_all<float, 3>(cells_3d);
}
