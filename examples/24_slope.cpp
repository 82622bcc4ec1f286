/// \file A slope of clay is raised quasi-statically, and then left to itself: one program with two time integrations.
///
/// The slope is H = 10 m high and rises by 45° from a bed of 5 m on rough rock; its sides stand between smooth walls.
/// The clay has E = 10 MPa, ν = 0.45 and 2000 kg/m³. It is undrained: no angle of friction (φ = 0), a strength c in
/// shear, by default 30 kPa. Two steps of firn::QuasiStatic put all of gravity on the elastic clay. Positions and
/// deformation gradients then begin a second simulation, of firn::VonMises with firn::FBar and explicit steps: where
/// shear is above c the clay flows, and a slope that is too weak slides down on a surface that the program draws, dark
/// where the clay has been sheared most.
///
/// What must come out: the walls bear the weight; far from the slope the vertical stress is ρ g × depth; and by Taylor
/// 1937, "Stability of earth slopes", the slope needs about c = 0.175 ρ g H = 34 kPa. With c a fifth below (`--strength
/// 26`) it must slide, with 40 % above (`--strength 50`) it must stand. The default slides, too.
#include "support/flat_picture.hpp"
#include "support/run.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include <cmath>
#include <ctime>
#include <functional>
#include <stdexcept>

namespace {

using Point = firn::Vec<double, 2>;
using Clay = firn::VonMises<double>;
using Raising = firn::SimulationWith<2, firn::Hencky<double>, firn::WeightGradientForce, firn::QuasiStatic>;
using Failing = firn::SimulationWith<2, Clay, firn::WeightGradientForce, firn::FBar>;

constexpr double height = 10, bed = 5, crest = 25, width = 60, top = bed + height;  // [m]
constexpr double young = 1e7, poisson = 0.45, density = 2000, g = 9.81;             // [Pa], [1], [kg/m³], [m/s²]
constexpr double needed = 0.175 * density * g * height;                             // strength by Taylor [Pa]

/// Returns how high the clay stands at a place along the slope [m].
double surface(double x) { return bed + std::clamp(crest + height - x, 0.0, height); }

firn::Samples<2> slope(double spacing) {
    auto samples = firn::sample_box<2>({0, 0}, {width, top}, {.spacing = spacing});
    std::erase_if(samples.positions, [](const Point& x) { return x[1] > surface(x[0]); });
    return samples;
}
firn::Walls<double, 2> sides_and_rock(const firn::Domain<2>& of) {
    auto walls = firn::Walls<double, 2>::all(of.lower, of.upper, {firn::Contact::slip, 0});
    walls.at_lower[1].contact = firn::Contact::stick;
    walls.at_upper[1].contact = firn::Contact::none;
    return walls;
}
double cpu_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

/// What a way to raise the slope costs.
struct Cost {
    long long steps = 0, newton_steps = 0, products = 0;
    double seconds = 0;  ///< of processors
};

/// Raises the slope by a load step with all of gravity, and a second one on the nodes around the settled clay.
Cost raise(Raising& simulation, const std::function<void()>& write) {
    Cost cost;
    simulation.integration.newton.tolerance = 1e-6;
    simulation.reactions.emplace();
    simulation.add_pass("count", "end g2p", [&](auto& run, const auto&) {
        ++cost.steps, cost.newton_steps += run.solution.newton_steps, cost.products += run.solution.products;
    });
    for (int k = 0; k < 2; ++k) {
        const double begin = cpu_seconds();
        simulation.advance(1);
        cost.seconds += cpu_seconds() - begin;
        write();
    }
    return cost;
}
/// Raises the slope by explicit steps with damping, until it hardly moves: what a program without QuasiStatic does.
Cost raise_explicitly(Failing& simulation) {
    const double begin = cpu_seconds();
    // Twice the lowest frequency of the slope, about that of a layer in shear.
    const double rate = 3.14 * std::sqrt(simulation.material().mu / density) / top;
    const auto moves = [&] {
        const auto totals = simulation.totals();
        return totals.kinetic_energy > 1e-7 * totals.elastic_energy;
    };
    do simulation.advance(0.1, firn::Damped<double, 2>{.field = {{0, -g}}, .rate = rate});
    while (moves());
    return {.steps = static_cast<long long>(simulation.steps()), .seconds = cpu_seconds() - begin};
}

/// Checks that the walls bear the weight, and the vertical stress where the ground is level.
bool is_in_equilibrium(const Raising& simulation) {
    double weight = 0, borne = 0, worst = 0;
    const auto& particles = simulation.particles();
    const double h = simulation.domain().cell_size, far = crest + height + 3 * bed;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        weight += g * double(particles.mass(slot));
        const Point x = particles.exact_position(slot);
        if (x[0] < far || x[0] > width - 2 * h || x[1] < 2 * h) continue;
        const double expected = -density * g * (bed - x[1]);
        worst = std::max(worst, std::abs(particles.stress(slot)(1, 1) - expected) / (density * g * bed));
    }
    for (const auto& part : simulation.reactions->parts) borne += part.impulse[1] / simulation.last_time_step();
    std::printf(
        "raised: the walls bear %.5f of the weight, %.0f kN; where the ground is level, the vertical stress is "
        "ρ g depth within %.1f %% of that on the rock\n",
        borne / weight, 1e-3 * weight, 100 * worst);
    return std::abs(borne / weight - 1) < 1e-4 && worst < 0.06;
}

/// Returns F of all particles, in the order of ids.
auto deformations(const Raising& simulation) {
    const auto& particles = simulation.particles();
    std::vector<std::remove_cvref_t<decltype(particles.state(0).F)>> all(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) all[particles.id(slot)] = particles.state(slot).F;
    return all;
}
/// Gives positions and stresses to clay that can flow.
void begin(Failing& simulation, const Raising& raised, double volume) {
    simulation.add({example::positions(raised), volume}, density);
    const auto of = deformations(raised);
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        auto state = particles.state(slot);
        state.F = of[particles.id(slot)];
        particles.set_state(slot, state);
    }
}

example::Image drawn(const Failing& simulation, double spacing) {
    using Pixels = std::array<float, 2>;
    const auto& particles = simulation.particles();
    std::vector<double> sheared(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) sheared[particles.id(slot)] = particles.state(slot).plastic_strain;
    example::FlatPicture picture({0, -1}, {float(width), float(1.1 * top)}, 1600, 560);
    picture.paint(std::vector<example::Stroke>{{{0, -0.5F}, {float(width), -0.5F}, 0.5F, example::slate, false}});
    picture.paint(example::discs(example::positions(simulation), 0.7 * spacing, [&](std::size_t id) {
        return sheared[id] > 0.5    ? example::plum
               : sheared[id] > 0.25 ? example::coral
               : sheared[id] > 0.1  ? example::amber
                                    : example::sand;
    }));
    std::vector<example::Stroke> before;
    const Pixels corners[] = {{0, float(top)}, {crest, float(top)}, {crest + height, bed}, {width, bed}};
    for (int k = 0; k < 3; ++k) before.push_back({corners[k], corners[k + 1], 0.06F, example::indigo, false});
    picture.paint(before);
    return picture.image();
}

int slide(int argc, char** argv) {
    example::CommandLine line({.name = "slope",
                               .about = "A slope of clay is raised quasi-statically, and slides down if it is too "
                                        "weak.",
                               .particles = 20'000,
                               .steps = 4000,
                               .frames = 40,
                               .takes_time = true});
    double strength = 30;
    std::int64_t explicitly = 0;
    line.add("--strength", strength, "Strength of the clay in shear, in kPa", 1, 1000);
    line.add("--explicit", explicitly, "1: raise the slope by explicit steps, too, to compare the costs", 0, 1);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    const double area = width * bed + height * (crest + 0.5 * height);
    // Cells with two particles along an edge, a whole number of them in the bed.
    const double h = bed / std::max(4.0, std::round(0.5 * bed * std::sqrt(double(options.particles) / area)));
    const double spacing = 0.5 * h;
    const firn::Domain<2> room{{0, 0}, {width, 1.2 * top}, h};
    const auto walls = sides_and_rock(room);
    const firn::Samples<2> samples = slope(spacing);
    const firn::Coloured threads{options.threads};

    Raising raised(room, firn::Hencky<double>::from_young_poisson(young, poisson), threads, walls);
    raised.add(samples, density);
    example::Options of_raised = options;
    of_raised.name += "_raised";
    example::StatesOfAll states_of_raised(raised, of_raised);
    states_of_raised.write(raised);
    const Cost cost = raise(raised, [&] { states_of_raised.write(raised); });
    states_of_raised.finish();
    const bool balances = is_in_equilibrium(raised);

    Clay clay = Clay::from_properties(
        {.young = young, .poisson = poisson, .yield_stress = std::sqrt(3.0) * 1e3 * strength, .hardening = 0});
    Failing simulation(room, clay, threads, walls);
    begin(simulation, raised, samples.volume);
    simulation.fixed_time_step = 0.8 * simulation.stable_time_step();
    std::printf("quasi-static: %lld steps, %lld Newton steps, %lld products, %.2f s of processor time\n", cost.steps,
                cost.newton_steps, cost.products, cost.seconds);
    if (explicitly != 0) {
        clay.yield_stress = 1e12;
        Failing settling(room, clay, threads, walls);
        settling.add(samples, density);
        const Cost other = raise_explicitly(settling);
        std::printf("explicit, with damping: %lld steps of %.2g s, %.2f s of processor time\n", other.steps,
                    settling.last_time_step(), other.seconds);
    }

    const auto start = example::positions(simulation);
    example::Options timed = options;
    if (options.time) timed.schedule = options.schedule_of_time(0, 0, simulation.fixed_time_step);
    example::StatesOfAll states(simulation, options);
    auto files = states_of_raised.files();
    files.insert(files.end(), states.files().begin(), states.files().end());
    const auto count = [&] { return std::int64_t(example::particle_count(simulation)); };
    const example::Outcome outcome = example::run_schedule(
        timed, count, {}, [&] { states.write(simulation); }, [&] { states.finish(); }, [&] { simulation.step(); },
        [&] { return drawn(simulation, spacing); }, files);

    double furthest = 0;
    const auto end = example::positions(simulation);
    for (std::size_t id = 0; id < end.size(); ++id) furthest = std::max(furthest, norm(end[id] - start[id]));
    const double ratio = 1e3 * strength / needed;
    const bool fails = furthest > 0.1 * height;
    std::printf(
        "%sof %.0f kPa, %.2f of what Taylor's chart asks for, the slope %s: in %.2f s it has moved by up to "
        "%.2f m, %.1f cells\n",
        outcome.part().c_str(), strength, ratio, fails ? "slides" : "stands", simulation.time(), furthest,
        furthest / h);
    // A slide takes a while to show, and near the needed strength the size of cells decides. Strong clay hardly moves,
    // for it begins in equilibrium.
    const bool agrees = ratio > 1.3 ? furthest < 0.005 * height : fails || ratio > 0.8 || simulation.time() < 3;
    if (!balances || !agrees) throw std::runtime_error("That is not what must come out.");
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return slide(argc, argv); });
}
