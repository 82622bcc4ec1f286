/// \file One elastic cube falls on another, and both bounce: 144,054 particles on 128³ cells of a unit box, E = 1 kPa,
/// ν = 0.3, ρ = 1 kg/m³, dt = 0.1 ms. Prints how much the lower cube is compressed and how much it bulges, and sets two
/// runs with other constants side by side.
#include "support/elastic.hpp"

namespace {

using Point = firn::Vec<double, 3>;

/// Half the particles of the benchmark scene: the first 72,027 points of a lattice of 42 × 42 × 41.
constexpr std::int64_t default_particles = 144'054;
constexpr double cells_along_side = 21;  // of 128, with 8 particles per cell
constexpr double side = cells_along_side / 128, gap = 0.17;

const std::vector<example::Quantity> quantities{{"lower cube compressed by", "%", 2},
                                                {"lower cube bulged by", "%", 2},
                                                {"lower cube's strain", "%", 2},
                                                {"height of the upper cube's centre", "m", 3}};
enum : std::size_t { compression, bulge, strain, height };

/// The extent of a body along an axis, between its 2nd and 98th percentile, which ignores outliers.
double extent(std::span<const Point> points, int axis) {
    std::vector<double> x;
    for (const Point& point : points) x.push_back(point[axis]);
    const auto low = x.begin() + std::ptrdiff_t(x.size() / 50), high = x.end() - 1 - std::ptrdiff_t(x.size() / 50);
    std::nth_element(x.begin(), low, x.end());
    const double lowest = *low;
    std::nth_element(x.begin(), high, x.end());
    return *high - lowest;
}

double mean_height(std::span<const Point> points) {
    double sum = 0;
    for (const Point& x : points) sum += x[1];
    return sum / double(points.size());
}

template <class Force>
example::Record fall(const example::Options& options, const example::Elastic& elastic) {
    // The cubes are the same for any number of particles. The cell size changes, with eight particles per cell.
    const double finer = std::cbrt(double(options.particles) / double(default_particles));
    const int lattice = std::max(2, int(std::lround(2 * cells_along_side * finer)));
    const double spacing = side / lattice;
    firn::SimulationWith<3, firn::FixedCorotated<float>, Force> simulation(
        {.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 2 * spacing},
        firn::FixedCorotated<float>::from_young_poisson(elastic.young, elastic.poisson), {options.threads});
    simulation.fixed_time_step = 1e-4 * std::min(1.0, 2 * spacing * 128);

    const auto add_cube = [&](const Point& lower, std::int64_t particles) {
        const std::int64_t layers = (particles + lattice * lattice - 1) / (lattice * lattice);
        auto points =
            firn::lattice_points<3>(lower, {lattice, lattice, layers}, spacing, 0.0, 1, std::uint64_t(particles));
        for (auto& x : points) x[2] = 2 * lower[2] + side - x[2];  // put the last, unfinished layer at the back
        return simulation.add({points, spacing * spacing * spacing}, 1.0);
    };
    const double centre = 0.5 - side / 2;
    const firn::Body lower = add_cube({centre, 0.0, centre}, options.particles / 2);
    const firn::Body upper = add_cube({centre, side + gap, centre}, options.particles - options.particles / 2);

    example::Record record =
        example::record_of(simulation, elastic, spacing, example::Box{{{0.38F, 0, 0.38F}}, {{0.62F, 0.5F, 0.62F}}});
    record.every = 10;
    record.exaggeration = 6;
    record.brought = {{}, {0.0, 2 * spacing - gap, 0.0}};  // one cube on the other, with a cell between them
    const double height_before = extent(record.start.of(lower), 1), width_before = extent(record.start.of(lower), 0);
    example::run_recorded(simulation, options, record, compression, [&](const example::Shape& shape) {
        std::vector<double> values(quantities.size());
        values[compression] = 100 * (1 - extent(shape.of(lower), 1) / height_before);
        values[bulge] = 100 * (extent(shape.of(lower), 0) / width_before - 1);
        values[strain] = 100 * shape.strain[0];
        values[height] = mean_height(shape.of(upper));
        return values;
    });
    return record;
}

void report(const example::Record& record) {
    const example::Sample& lowest = record.samples[record.greatest];
    const auto fallen =
        std::min_element(record.samples.begin(), record.samples.end(),
                         [](const auto& a, const auto& b) { return a.values[height] < b.values[height]; });
    const auto risen = std::max_element(
        fallen, record.samples.end(), [](const auto& a, const auto& b) { return a.values[height] < b.values[height]; });
    const std::string part = record.part();
    std::printf("%slower cube at its lowest (%.3f s): compressed by %.2f %%, bulged by %.2f %%\n", part.c_str(),
                lowest.time, lowest.values[compression], lowest.values[bulge]);
    std::printf("%supper cube: centre fell to %.3f m and rose again to %.3f m\n", part.c_str(), fallen->values[height],
                risen->values[height]);
}

int two_cubes(int argc, char** argv) {
    example::CommandLine line({.name = "two_cubes",
                               .about = "One elastic cube falls on another, and both bounce.",
                               .particles = default_particles,
                               .steps = 4000,
                               .frames = 40,
                               .can_go_on = true,
                               .takes_time = true});
    example::ElasticOptions elastic(line);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    return elastic.with_force([&](auto force) {
        return example::run_and_compare(line.options(), elastic, fall<decltype(force)>, report, quantities);
    });
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return two_cubes(argc, argv); });
}
