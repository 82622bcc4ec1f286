/// \file A jelly as stiff as hard rubber, E = 1 GPa, falls onto a floor by implicit steps, each as long as matter needs
/// to move by half a cell: hundreds of times the bound of explicit steps, which follows from the speed of sound.
///
/// Backward Euler takes the energy out of waves that a step does not resolve, so the jelly does not bounce as rubber
/// would: take implicit steps where the impact itself is not what is looked for. It must end at rest on the floor, its
/// centre half its side above, but for the layer of about a cell in which the grid joins it to the floor. The program
/// prints what a step costs, and beside it what explicit steps would cost for the same motion: some of them are
/// measured, in a copy of the jelly, and their cost is scaled to the time of the run.
#include "support/flat_picture.hpp"
#include "support/run.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include <cmath>
#include <ctime>
#include <stdexcept>

namespace {

using Point = firn::Vec<double, 2>;
using Jelly = firn::FixedCorotated<double>;
template <class Time>
using With = firn::SimulationWith<2, Jelly, firn::WeightGradientForce, Time>;

constexpr double side = 0.4, fall = 0.2, density = 1000, g = 9.81, width = 1;  // [m], [kg/m³], [m/s²], [m]

double cpu_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

/// Returns the jelly above the floor, with a corner down.
template <class Time>
With<Time> jelly(const example::Options& options, double young, double tilt) {
    const double spacing = side / std::max(std::round(std::sqrt(double(options.particles))), 8.0);
    const firn::Domain<2> room{{0, 0}, {width, width}, width / std::max(std::round(0.5 * width / spacing), 4.0)};
    With<Time> simulation(room, Jelly::from_young_poisson(young, 0.3), firn::Coloured{options.threads});
    auto samples = firn::sample_box<2>({0, 0}, {side, side}, {.spacing = spacing});
    const double c = std::cos(tilt), s = std::sin(tilt), half = 0.5 * side;
    for (Point& x : samples.positions) {
        const Point arm = x - Point{half, half};
        x = Point{0.5 * width + c * arm[0] - s * arm[1], fall + half * (c + s) + s * arm[0] + c * arm[1]};
    }
    simulation.add(samples, density);
    simulation.warn = {};
    return simulation;
}
template <class Simulation>
Point centre(const Simulation& simulation) {
    const auto totals = simulation.totals();
    return totals.first_moment * (1 / totals.mass);
}

/// What the steps of a run were like, and how matter in free fall moves by them.
struct Record {
    long long steps = 0, newton_steps = 0, products = 0;
    double bounds = 0;           ///< sum of the lengths of steps, in bounds of an explicit step
    double seconds = 0;          ///< of processors
    double speed = 0, way = 0;   ///< of free fall in those steps [m/s], [m]
    double fallen = 0, off = 0;  ///< how far the jelly has fallen, and how far that is off, before it lands [m]
};

/// Counts steps. \param bound  of an explicit step [s]
template <class Simulation>
void count_steps(Simulation& simulation, Record& record, double bound) {
    simulation.add_pass("count", "end g2p", [&record, bound](auto& run, const auto& now) {
        ++record.steps, record.bounds += now.dt / bound;
        record.speed += g * now.dt, record.way += record.speed * now.dt;
        if constexpr (requires { run.solution.products; }) {
            record.newton_steps += run.solution.newton_steps;
            record.products += run.solution.products;
        }
    });
}
/// Returns the processor time of explicit steps that last as long as a run [s]: some steps are measured, and scaled.
double explicit_seconds(const example::Options& options, double young, double tilt, double duration) {
    auto simulation = jelly<firn::Explicit>(options, young, tilt);
    for (int k = 0; k < 20; ++k) simulation.step();  // the first ones allocate memory
    const double since = simulation.time(), begin = cpu_seconds();
    do
        for (int k = 0; k < 50; ++k) simulation.step();
    while (cpu_seconds() - begin < 0.1);
    return (cpu_seconds() - begin) * duration / (simulation.time() - since);
}

template <class Simulation>
example::Image drawn(const std::vector<Point>& start, const Simulation& simulation, double spacing) {
    example::FlatPicture picture({0, -0.05F}, {float(width), 0.85F}, 1280, 1000);
    picture.paint(std::vector<example::Stroke>{{{0, -0.02F}, {float(width), -0.02F}, 0.02F, example::slate, false}});
    picture.paint(example::discs(start, 0.72 * spacing, [](std::size_t) { return example::sand; }));
    // Layers show how the jelly lies.
    const double row = std::sqrt(double(start.size()));
    picture.paint(example::discs(example::positions(simulation), 0.72 * spacing, [&](std::size_t id) {
        return std::int64_t(double(id) / (5 * row)) % 2 == 0 ? example::teal : example::coral;
    }));
    return picture.image();
}

template <class Time>
int drop(const example::Options& options, double young, double tilt, double step) {
    auto simulation = jelly<Time>(options, young, tilt);
    simulation.fixed_time_step = step;
    const double spacing = side / std::round(std::sqrt(double(example::particle_count(simulation))));
    const double h = simulation.domain().cell_size, from = centre(simulation)[1];
    const double bound = jelly<firn::Explicit>(options, young, tilt).stable_time_step();
    Record record;
    count_steps(simulation, record, bound);
    const auto start = example::positions(simulation);

    example::StatesOfAll states(simulation, options);
    const auto count = [&] { return std::int64_t(example::particle_count(simulation)); };
    const auto take = [&] {
        const double begin = cpu_seconds();
        simulation.step();
        record.seconds += cpu_seconds() - begin;
        if (record.way > fall - 2 * h) return;
        record.fallen = from - centre(simulation)[1];
        record.off = std::max(record.off, std::abs(record.fallen - record.way));
    };
    const example::Outcome outcome = example::run_schedule(
        options, count, {}, [&] { states.write(simulation); }, [&] { states.finish(); }, take,
        [&] { return drawn(start, simulation, spacing); }, states.files());
    if (!outcome.has_moved()) return outcome.exit_code();

    const double n = double(record.steps), time = simulation.time();
    std::printf(
        "%s%lld %s steps to %.3f s, each of %.0f times the bound of %.2g s of explicit steps; %.1f Newton steps "
        "and %.0f products a step\n",
        outcome.part().c_str(), record.steps, Time::name, time, record.bounds / n, bound,
        double(record.newton_steps) / n, double(record.products) / n);
    if constexpr (!Time::is_explicit)
        std::printf("%.2f s of processor time; explicit steps would take %.2f s, some of them measured and scaled\n",
                    record.seconds, explicit_seconds(options, young, tilt, time));
    const double above = centre(simulation)[1] - 0.5 * side,
                 speed = norm(simulation.totals().momentum) / simulation.totals().mass;
    std::printf(
        "before it lands the jelly falls by %.4f m, as steps say to %.1g m; at the end its centre is %.4f m, "
        "%.2f cells, above half its side, and moves at %.2g m/s\n",
        record.fallen, record.off, above, above / h, speed);
    const bool rests = time < 1 || (above > -0.1 * h && above < 1.5 * h && speed < 0.02);
    if (record.off > 1e-6 || (!rests && !Time::is_explicit))
        throw std::runtime_error("That is not what must come out.");
    return outcome.exit_code();
}

int choose(int argc, char** argv) {
    example::CommandLine line({.name = "stiff_jelly",
                               .about =
                                   "A jelly as stiff as hard rubber falls onto a floor by implicit steps of half a "
                                   "cell's motion.",
                               .particles = 1600,
                               .steps = 60,
                               .frames = 40});
    double young = 1e9, tilt = 0.2, step = 0;
    std::string integration = firn::Implicit::name;
    line.add("--young", young, "Young's modulus in Pa", 1e3, 1e12);
    line.add("--tilt", tilt, "How far the jelly is turned at the start, in rad", 0, 0.78);
    line.add("--step", step, "Length of a step in s; 0: half a cell's motion, or the bound of explicit steps", 0, 1);
    line.add("--integration", integration, "Time integration; explicit steps are short: give more --steps, too",
             {firn::Implicit::name, firn::Explicit::name});
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();
    return integration == firn::Implicit::name ? drop<firn::Implicit>(options, young, tilt, step)
                                               : drop<firn::Explicit>(options, young, tilt, step);
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return choose(argc, argv); });
}
