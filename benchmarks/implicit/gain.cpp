/// \file What quasi-static steps gain over explicit ones that come to rest: CPU time to the same error, in one run.
///
///     firn_implicit_gain [cantilever | slope] [CELLS [YOUNG]]
///
/// cantilever: a beam of 16 : 1 under its own weight, CELLS long (128). slope: a ragged elastic slope of CELLS ×
/// CELLS/2 cells (256). The explicit run has kinetic damping: all velocities become 0 whenever the kinetic energy has
/// passed a maximum (Otter, Cassell and Hobbs 1966; Barnes 1999), with steps of 1.3 times the bound, which is still
/// stable here. All matter is equally stiff, so mass scaling changes nothing. Errors of the mean deflection or
/// settlement are those against where each run ends.
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include "slope.hpp"

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

namespace {

using namespace firn;
using Material = FixedCorotated<double>;
using Point = Vec<double, 2>;

double cpu() { return double(std::clock()) / CLOCKS_PER_SEC; }

struct Scene {
    bool is_beam;
    int cells;
    double young;
    Domain<2> domain{};
    Samples<2> samples{};
    Walls<double, 2> walls{};
    double density = 1000, tip = 0;

    Scene(bool beam, int n, double E) : is_beam(beam), cells(n), young(E) {
        const double h = 1.0 / n;
        if (beam) {
            const double low = 0.25;
            domain = {{0, 0}, {1 + 4 * h, low + 1.0 / 16 + 8 * h}, h};
            samples = sample_box<2>({0, low}, {1, low + 1.0 / 16}, {.spacing = h / 2});
            walls = Walls<double, 2>::all(domain.lower, domain.upper, {Contact::slip, 0});
            walls.at_lower[0].contact = Contact::stick;
        } else {
            domain = {{0, 0}, {1, 0.5}, h};
            samples = sample_box<2>({0, 0}, {1, 0.5}, {.spacing = h / 2, .pattern = Pattern::jittered, .jitter = 0.25});
            std::erase_if(samples.positions, [](const Point& x) { return x[1] >= surface(x[0]); });
            walls = Walls<double, 2>::all(domain.lower, domain.upper, {Contact::slip, 0});
            walls.at_lower[1].contact = Contact::stick;
        }
        for (const Point& x : samples.positions) tip = std::max(tip, x[0]);
    }
    template <class... Policies>
    auto simulation(const Policies&... policies) const {
        Simulation made(domain, Material::from_young_poisson(young, 0.3), walls, WeightGradientForce{}, Coloured{1},
                        policies...);
        made.warn = {};
        made.add(samples, density);
        return made;
    }
    /// The mean deflection of the beam's end, or settlement of the slope [m].
    template <class Simulation>
    double measured(const Simulation& simulation) const {
        double sum = 0, count = 0;
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const Point& from = samples.positions[particles.id(slot)];
            if (is_beam && from[0] < tip - 0.1 / cells) continue;
            sum += from[1] - particles.exact_position(slot)[1], ++count;
        }
        return sum / count;
    }
};

/// The first time from which on the error stays below `error`. \return  (CPU time [s], steps); none: (−1, 0)
struct Row {
    double cpu, value;
    std::uint64_t steps;
};
Row reached(const std::vector<Row>& rows, double error) {
    std::size_t k = rows.size();
    while (k > 0 && std::abs(rows[k - 1].value - rows.back().value) < error * std::abs(rows.back().value)) --k;
    return k < rows.size() ? rows[k] : Row{-1, 0, 0};
}

void compare(const Scene& scene) {
    auto still = scene.simulation(QuasiStatic{});
    std::vector<Row> rows;
    double spent = 0, first = 0;
    for (int k = 0; k < 4; ++k) {
        const double begin = cpu();
        still.advance(1);
        spent += cpu() - begin;
        if (k == 0) first = spent;
        rows.push_back({spent, scene.measured(still), still.steps()});
        std::printf("  load step %d: %d Newton steps, %d products, %.3f s of CPU, moves %.4f cells, %.8e m\n", k,
                    still.solution.newton_steps, still.solution.products, spent, still.solution.largest_motion,
                    rows.back().value);
    }

    auto moving = scene.simulation();
    const double bound = moving.stable_time_step();
    moving.fixed_time_step = 1.3 * bound;
    std::vector<Row> steps;
    double last = 0, taken = 0;
    std::uint64_t peak = 0;
    int peaks = 0;
    const std::uint64_t every = scene.is_beam ? 20 : 5;
    for (double settled = 0; settled < 6 && moving.steps() < 200'000;) {
        const double begin = cpu();
        for (std::uint64_t k = 0; k < every; ++k) moving.step();
        const double now = moving.totals().kinetic_energy;
        if (now < last && moving.steps() - peak > 3 * every) {
            auto& particles = moving.edit_particles();
            for (std::size_t slot = 0; slot < particles.slots(); ++slot)
                if (particles.is_particle(slot)) {
                    particles.set_velocity(slot, {});
                    particles.set_affine(slot, Mat<double, 2>::zero());
                }
            last = 0, peak = moving.steps(), ++peaks;
        } else {
            last = now;
        }
        taken += cpu() - begin;
        steps.push_back({taken, scene.measured(moving), moving.steps()});
        // At rest when the last third of the run has changed the measure by less than 1e-6.
        const std::size_t third = steps.size() * 2 / 3;
        const bool still_changes = std::abs(steps[third].value - steps.back().value) > 1e-6 * steps.back().value;
        settled = peaks > 6 && !still_changes ? 6 : 0;
    }
    std::printf("  explicit, 1.3 bounds of %.3e s, kinetic damping: %llu steps, %.1f ns a particle and step, %.8e m\n",
                bound, static_cast<unsigned long long>(moving.steps()),
                1e9 * taken / double(moving.steps()) / double(moving.particles().size()), steps.back().value);
    for (const double error : {1e-2, 1e-3, 1e-4}) {
        const Row row = reached(steps, error), mine = reached(rows, error);
        std::printf("  to %.0e: explicit %.3f s (%llu steps), quasi-static %.3f s: %.1f times\n", error, row.cpu,
                    static_cast<unsigned long long>(row.steps), mine.cpu, row.cpu / mine.cpu);
    }
    std::printf("  one load step alone: %.3f s, %.1f times to 1e-3\n", first, reached(steps, 1e-3).cpu / first);
}

}  // namespace

int main(int argc, char** argv) {
    const std::string which = argc > 1 ? argv[1] : "";
    const int cells = argc > 2 ? std::atoi(argv[2]) : 0;
    const double young = argc > 3 ? std::atof(argv[3]) : 0;
    for (const bool beam : {true, false}) {
        if (!which.empty() && (which == "cantilever") != beam) continue;
        const Scene scene(beam, cells > 0 ? cells : beam ? 128 : 256, young > 0 ? young : beam ? 2.2e8 : 1e7);
        std::printf("%s, %d cells, %zu particles:\n", beam ? "cantilever" : "slope", scene.cells,
                    scene.samples.positions.size());
        compare(scene);
    }
}
