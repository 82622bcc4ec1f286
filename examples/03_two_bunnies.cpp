/// \file Two elastic bunnies, read from an OBJ file: a mesh, which is filled with particles, or a cloud of points. One
/// falls on the other; they tumble and bounce. Prints how far each has turned, and sets two runs with other constants
/// side by side.
#include "support/bunnies.hpp"
#include "support/elastic.hpp"
#include <firn/data/point_spacing.hpp>
#include <firn/io/surface.hpp>
#include <firn/simulation/surface.hpp>

#include <cmath>

namespace {

using example::Bunnies, example::bunny_size;
using Point = firn::Vec<double, 3>;

const std::vector<example::Quantity> quantities{{"lower bunny turned by", "°", 1},
                                                {"upper bunny turned by", "°", 1},
                                                {"lower bunny's strain", "%", 2},
                                                {"upper bunny's strain", "%", 2}};
enum : std::size_t { turned, lower_strain = 2, upper_strain };

std::vector<Point> bare_points(const std::string& file) {
    try {
        return firn::read_obj_points(file);
    } catch (const firn::io_error& problem) {
        const std::string what = problem.what();
        throw firn::io_error(what + (what.find("sample_mesh") == std::string::npos ? "" : " Here --mesh fills it."));
    }
}

/// Takes points as particles, as they are: those of a body that another program has filled.
Bunnies from_points(const std::string& file) {
    const std::vector<Point> points = bare_points(file);
    const double spacing = firn::point_spacing(points);
    firn::Bounds<3> box{points[0], points[0]};
    for (const Point& x : points)
        for (int a = 0; a < 3; ++a) {
            box.lower[a] = std::min(box.lower[a], x[a]);
            box.upper[a] = std::max(box.upper[a], x[a]);
        }
    const Point extent = box.upper - box.lower, middle = (box.lower + box.upper) * 0.5;
    // Half a spacing of matter lies around the outermost points.
    const double factor = bunny_size / (std::max({extent[0], extent[1], extent[2]}) + spacing);
    const firn::Mat<double, 3> turn = firn::rotation({0.0, 1.0, 0.0}, 2.2);
    Bunnies bunnies{factor * spacing, {}, {}};
    for (const Point& x : points) {
        bunnies.below.positions.push_back(Point{0.47, 0.5 * bunny_size, 0.5} + (x - middle) * factor);
        bunnies.above.positions.push_back(Point{0.56, 0.62, 0.53} + turn * ((x - middle) * factor));
    }
    bunnies.below.volume = bunnies.above.volume = std::pow(bunnies.spacing, 3);
    return bunnies;
}

template <class Force>
example::Record collide(const example::Options& options, const example::Elastic& elastic, const Bunnies& bunnies,
                        std::int64_t steps_between_samples) {
    auto simulation = example::bunnies_in_a_box<Force>(
        bunnies, firn::FixedCorotated<float>::from_young_poisson(elastic.young, elastic.poisson), options.threads);
    example::Record record = example::record_of(simulation, elastic, bunnies.spacing,
                                                example::Box{{{0.3F, 0, 0.3F}}, {{0.88F, 0.5F, 0.7F}}});
    record.every = steps_between_samples;
    std::array<example::Turning, 2> turnings;
    example::run_recorded(simulation, options, record, upper_strain, [&](const example::Shape& shape) {
        std::vector<double> values(quantities.size());
        for (std::size_t b = 0; b < 2; ++b) {
            values[turned + b] = 180 / std::numbers::pi *
                                 turnings[b].angle(record.start.of(record.bodies[b]), shape.of(record.bodies[b]));
            values[lower_strain + b] = 100 * shape.strain[b];
        }
        return values;
    });
    if (options.ply && record.outcome.has_moved()) {  // beside the particles, the skins that pictures show
        for (const std::size_t b : {0U, 1U}) {
            const auto surface = firn::surface_of(simulation, record.bodies[b], {}, {"velocity"});
            firn::write_ply(options.file(b == 0 ? "_lower_surface.ply" : "_upper_surface.ply"), surface,
                            simulation.time());
        }
    }
    return record;
}

void report(const example::Record& record) {
    const example::Sample& last = record.samples.back();
    const char* whole = record.begun > 0 ? ", up to whole turns," : "";  // the turns before a restart are not known
    for (std::size_t b = 0; b < 2; ++b)
        std::printf("%s%s bunny: turned by %.1f degrees%s in %.3f s\n", record.outcome.part().c_str(),
                    b == 0 ? "lower" : "upper", last.values[turned + b], whole, last.time);
}

int two_bunnies(int argc, char** argv) {
    example::CommandLine line({.name = "two_bunnies",
                               .about = "Two elastic bunnies from an OBJ file collide.",
                               .particles = 150'000,
                               .steps = 2400,
                               .frames = 30,
                               .can_go_on = true,
                               .takes_time = true});
    std::string mesh_file = FIRN_EXAMPLES_DATA_DIR "/bunny.obj", point_file;
    example::ElasticOptions elastic(line);
    line.add_file("--mesh", mesh_file, "A closed triangle mesh", "FILE.obj");
    line.add_file("--points", point_file, "The particles of a body, as vertices of an OBJ file without faces",
                  "FILE.obj");
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    if (!point_file.empty() && (line.is_given("--mesh") || line.is_given("--particles")))
        throw firn::parameter_error(
            "The points of --points are the particles, as they are: leave out --mesh and --particles.");
    const example::Options& options = line.options();
    const Bunnies bunnies =
        point_file.empty() ? example::bunnies_from_mesh(mesh_file, options.particles) : from_points(point_file);

    return elastic.with_force([&](auto force) {
        const auto run = [&](const example::Options& of_run, const example::Elastic& constants) {
            return collide<decltype(force)>(of_run, constants, bunnies, elastic.other() ? 10 : 200);
        };
        return example::run_and_compare(options, elastic, run, report, quantities);
    });
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return two_bunnies(argc, argv); });
}
