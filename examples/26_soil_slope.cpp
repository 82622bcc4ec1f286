/// \file A slope of soil begins in the stress of its weight; its strength is reduced until it fails.
///
/// The slope is H = 10 m high and falls by 1 over 2, to its toe on rough rock. The soil is firn::MohrCoulomb in
/// firn::PlaneStrain, with firn::FBar: c = 9.81 kPa, φ = 20°, no dilatancy, E = 10 MPa, ν = 0.3 and 2000 kg/m³. It
/// begins in the stress that firn::set_at_rest() gives it, and comes to rest with damping. firn::factor_of_safety()
/// then finds by which factor c and tan φ can be divided until the crest moves by more than 0.02 H in 20 √(H/g): copies
/// of the simulation try that. At last the strength is reduced beyond it, and the slope slides down. The picture is
/// dark where the soil has been sheared most.
///
/// What must come out: a factor of 1.4, give or take 0.1 (Griffiths and Lane 1999, "Slope stability analysis by finite
/// elements", example 1).
#include "support/flat_picture.hpp"
#include "support/run.hpp"
#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include <cmath>
#include <stdexcept>

namespace {

using Point = firn::Vec<double, 2>;
using Soil = firn::PlaneStrain<firn::MohrCoulomb<double>>;
using Slope = firn::SimulationWith<2, Soil, firn::FBar>;

constexpr double height = 10, crest = 12, toe = crest + 2 * height, width = toe + 8;  // [m]
constexpr double density = 2000, g = 9.81, young = 1e7;                               // [kg/m³], [m/s²], [Pa]

/// Returns how high the soil stands at a place along the slope [m].
double surface(const Point& x) { return std::clamp((toe - x[0]) / 2, 0.0, height); }

Slope made(double h, int threads) {
    const firn::Domain<2> room{{0, 0}, {width, 1.2 * height}, h};
    auto walls = firn::Walls<double, 2>::all(room.lower, room.upper, {firn::Contact::slip, 0});
    walls.at_lower[1].contact = firn::Contact::stick;
    walls.at_upper[1].contact = firn::Contact::none;
    Slope slope(room,
                Soil{firn::MohrCoulomb<double>::from_properties({.young = young,
                                                                 .poisson = 0.3,
                                                                 .cohesion = 0.05 * density * g * height,
                                                                 .friction_angle = firn::degrees(20)})},
                firn::Coloured{threads}, walls);
    slope.gravity = {0, -g};
    auto samples = firn::sample_box<2>({0, 0}, {toe, height}, {.spacing = 0.5 * h});
    std::erase_if(samples.positions, [](const Point& x) { return x[1] > surface(x); });
    const firn::Body soil = slope.add(samples, density);
    // Under a slope the stress is another: K₀ = 1 yields nowhere, and damping does the rest.
    firn::set_at_rest(slope.set(), soil, {.surface = surface, .earth_pressure = 1});
    return slope;
}
/// Lets the slope come to rest: the slowest waves take about 4 H/c for a period.
void settle(Slope& slope) {
    const double period = 4 * height / std::sqrt(young / density);
    slope.advance(20 * period, firn::Damped<double, 2>{.field = {{0, -g}}, .rate = 2 / period});
    auto& particles = slope.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) particles.set_velocity(slot, {}), particles.set_affine(slot, {});
}
/// Returns how far the soil at the crest has moved [m].
double moved(const Slope& slope, const std::vector<Point>& start) {
    const auto now = example::positions(slope);
    double most = 0;
    for (std::size_t id = 0; id < now.size(); ++id)
        if (start[id][1] > height - 1 && std::abs(start[id][0] - crest) < 1)
            most = std::max(most, norm(now[id] - start[id]));
    return most;
}
/// Advances until the slope has failed, or 20 √(H/g) are over.
bool fails(Slope& slope) {
    const auto start = example::positions(slope);
    const double unit = std::sqrt(height / g);
    for (int k = 0; k < 20; ++k) {
        slope.advance(unit);
        if (moved(slope, start) > 0.02 * height) return true;
    }
    return false;
}

example::Image drawn(const Slope& slope, double spacing) {
    const auto& particles = slope.particles();
    std::vector<double> sheared(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) sheared[particles.id(slot)] = particles.state(slot).plastic_strain;
    example::FlatPicture picture({0, -1}, {float(width), float(1.1 * height)}, 1600, 560);
    picture.paint(std::vector<example::Stroke>{{{0, -0.5F}, {float(width), -0.5F}, 0.5F, example::slate, false}});
    picture.paint(example::discs(example::positions(slope), 0.7 * spacing, [&](std::size_t id) {
        return sheared[id] > 0.5    ? example::plum
               : sheared[id] > 0.15 ? example::coral
               : sheared[id] > 0.03 ? example::amber
                                    : example::sand;
    }));
    const std::array<std::array<float, 2>, 3> corners{{{0, float(height)}, {crest, float(height)}, {float(toe), 0}}};
    for (std::size_t k = 0; k < 2; ++k)
        picture.paint(std::vector<example::Stroke>{{corners[k], corners[k + 1], 0.06F, example::indigo, false}});
    return picture.image();
}

int reduce(int argc, char** argv) {
    example::CommandLine line({.name = "soil_slope",
                               .about = "A slope of soil stands, and slides down when its strength is reduced.",
                               .particles = 3500,
                               .steps = 4000,
                               .frames = 40,
                               .takes_time = true});
    double factor = 1.5;
    line.add("--factor", factor, "Factor by which the strength is reduced at last", 1, 10);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();
    const double area = height * (crest + toe) / 2;
    const double h = height / std::max(4.0, std::round(0.5 * height * std::sqrt(double(options.particles) / area)));

    Slope slope = made(h, options.threads);
    settle(slope);
    const auto weaken = [](Soil& soil, double by) { soil.weaken(by); };
    const firn::FactorOfSafety safety = firn::factor_of_safety(slope, weaken, fails, {.highest = 2, .tolerance = 0.03});
    std::printf("factor of safety: between %.3f and %.3f, with cells of %.2f m\n", safety.stands, safety.fails, h);

    slope.edit_material([&](Soil& soil) { weaken(soil, factor); });
    slope.fixed_time_step = 0.8 * slope.stable_time_step();
    example::Options timed = options;
    if (options.time) timed.schedule = options.schedule_of_time(0, 0, slope.fixed_time_step);
    const auto start = example::positions(slope);
    example::StatesOfAll states(slope, options);
    const auto count = [&] { return std::int64_t(example::particle_count(slope)); };
    const example::Outcome outcome = example::run_schedule(
        timed, count, {}, [&] { states.write(slope); }, [&] { states.finish(); }, [&] { slope.step(); },
        [&] { return drawn(slope, 0.5 * h); }, states.files());
    std::printf("%swith its strength divided by %.2f, the crest has moved by %.2f m\n", outcome.part().c_str(), factor,
                moved(slope, start));
    // Coarse cells are stronger: the bars are for 20 cells and more over the height.
    const bool agrees = h > 0.051 * height || std::abs(safety.value() - 1.4) < 0.1;
    if (!agrees) throw std::runtime_error("That is not what must come out.");
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return reduce(argc, argv); });
}
