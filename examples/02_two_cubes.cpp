/// \file One elastic cube falls on another, and both bounce: 144,054 particles on 128³ cells of a unit box, E = 1 kPa,
/// ν = 0.3, ρ = 1 kg/m³, dt = 0.1 ms. Prints how much the lower cube is compressed and how much it bulges.
#include "support/run.hpp"

namespace {

/// Half the particles of the benchmark scene: the first 72,027 points of a lattice of 42 × 42 × 41.
constexpr std::int64_t default_particles = 144'054;
constexpr double cells_along_side = 21;  // of 128, with 8 particles per cell

/// The extent of a body along an axis, between its 2nd and 98th percentile, which ignores outliers.
template <class Simulation>
double extent(const Simulation& simulation, const firn::Body& body, int axis) {
    const auto points = example::positions(simulation);
    std::vector<double> x;
    for (std::uint32_t i = 0; i < body.count; ++i) x.push_back(points[body.first + i][axis]);
    const auto low = x.begin() + std::ptrdiff_t(x.size() / 50), high = x.end() - 1 - std::ptrdiff_t(x.size() / 50);
    std::nth_element(x.begin(), low, x.end());
    const double lowest = *low;
    std::nth_element(x.begin(), high, x.end());
    return *high - lowest;
}

template <class Simulation>
double mean_height(const Simulation& simulation, const firn::Body& body) {
    double sum = 0;
    const auto points = example::positions(simulation);
    for (std::uint32_t i = 0; i < body.count; ++i) sum += points[body.first + i][1];
    return sum / body.count;
}

int two_cubes(int argc, char** argv) {
    example::CommandLine line({.name = "two_cubes",
                               .about = "One elastic cube falls on another, and both bounce.",
                               .particles = default_particles,
                               .steps = 4000,
                               .frames = 40});
    double young = 1e3, poisson = 0.3;
    line.add("--young", young, "Young's modulus in Pa", 1.0, 1e9);
    line.add("--poisson", poisson, "Poisson's ratio", -0.99, 0.495);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    // The cubes are the same for any number of particles. The cell size changes, with eight particles per cell.
    const double side = cells_along_side / 128;
    const double finer = std::cbrt(double(options.particles) / double(default_particles));
    const int lattice = std::max(2, int(std::lround(2 * cells_along_side * finer)));
    const double spacing = side / lattice;
    firn::Simulation<3> simulation({.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 2 * spacing},
                                   firn::FixedCorotated<float>::from_young_poisson(young, poisson), {options.threads});
    simulation.fixed_time_step = 1e-4 * std::min(1.0, 2 * spacing * 128);

    const auto add_cube = [&](const firn::Vec<double, 3>& lower, std::int64_t particles) {
        const std::int64_t layers = (particles + lattice * lattice - 1) / (lattice * lattice);
        auto points =
            firn::lattice_points<3>(lower, {lattice, lattice, layers}, spacing, 0.0, 1, std::uint64_t(particles));
        for (auto& x : points) x[2] = 2 * lower[2] + side - x[2];  // put the last, unfinished layer at the back
        return simulation.add({points, spacing * spacing * spacing}, 1.0);
    };
    const double centre = 0.5 - side / 2;
    const firn::Body lower = add_cube({centre, 0.0, centre}, options.particles / 2);
    const firn::Body upper = add_cube({centre, side + 0.17, centre}, options.particles - options.particles / 2);

    const double height = extent(simulation, lower, 1), width = extent(simulation, lower, 0);
    double lowest = height, widest = width, at_time = 0;
    double upper_lowest = 1, upper_rebound = 0;
    std::int64_t done = 0;
    example::run(simulation, options, spacing, {}, [&] {
        if (++done % 10 != 0) return;
        if (const double now = extent(simulation, lower, 1); now < lowest) {
            lowest = now;
            widest = extent(simulation, lower, 0);
            at_time = simulation.time();
        }
        const double y = mean_height(simulation, upper);
        if (y < upper_lowest) upper_lowest = upper_rebound = y;
        upper_rebound = std::max(upper_rebound, y);
    });
    std::printf("lower cube at its lowest (%.3f s): compressed by %.2f %%, bulged by %.2f %%\n", at_time,
                100 * (1 - lowest / height), 100 * (widest / width - 1));
    std::printf("upper cube: centre fell to %.3f m and rose again to %.3f m\n", upper_lowest, upper_rebound);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return two_cubes(argc, argv); });
}
