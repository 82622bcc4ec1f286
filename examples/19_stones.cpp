/// \file 64 stones fall into a funnel whose opening is as wide as two stones, three times beside each other: as contact
/// groups with friction, as contact groups without friction, and in one field of velocities between walls with
/// friction, where the stones stick together and clog the funnel. Prints how many stones have passed, and what the
/// three runs cost.
#include "support/run.hpp"

#include <array>
#include <chrono>

namespace {

template <int D>
using Point = firn::Vec<double, D>;
template <int D>
using Plank = firn::Collider<firn::Box<float, D>>;
template <int D>
using Boundary = firn::Together<firn::Walls<float, D>, firn::BoundaryList<Plank<D>>>;
template <int D, class Law>
using Simulation = firn::SimulationWith<D, firn::FixedCorotated<float>, Boundary<D>, Law>;

constexpr std::size_t stones = 64;
constexpr double pi = 3.14159265358979, radius = 0.05;  // of a stone [m]
constexpr firn::Angle slope = firn::degrees(50);        // of the funnel

/// The box with the funnel [m]. In the plane, eight stones lie beside each other, in space four by four.
template <int D>
struct Box {
    static constexpr std::int64_t columns = D == 2 ? 8 : 4, rows = 64 / (D == 2 ? 8 : 16);
    static constexpr double distance = 2.15 * radius;  // of stones at the start
    static constexpr double width = (D == 2 ? 24 : 12) * radius;
    static constexpr double opening = 4 * radius;                 // width of the opening
    static constexpr double bottom = (D == 2 ? 14 : 9) * radius;  // height of the opening
    /// Height of the lowest stones' centres: the outermost of them are just above the planks.
    static double lowest() {
        return bottom + 1.5 * radius +
               std::tan(slope.in_radians()) * (0.5 * (double(columns - 1) * distance - opening) + radius);
    }
    static double height() { return lowest() + double(rows - 1) * distance + 2 * radius; }
};

struct Settings {
    double young, friction, density;
};

/// Returns the planks of the funnel: two, or four in space. A plank keeps matter away from it by half a cell.
template <int D>
std::vector<Plank<D>> funnel(double friction, double cell_size) {
    const double angle = slope.in_radians(), c = std::cos(angle), s = std::sin(angle);
    const double half_length = 0.25 * (Box<D>::width - Box<D>::opening) / c + radius, half_thickness = 0.5 * radius;
    std::vector<Plank<D>> planks;
    for (const int axis : D == 2 ? std::vector{0} : std::vector{0, 2})
        for (const int side : {1, -1}) {
            // The edge at the opening lies at (out, bottom) in the plane of `axis` and the height.
            const double deep = half_thickness + 0.5 * cell_size;
            const double out = 0.5 * Box<D>::opening + half_length * c + deep * s;
            Plank<D> plank{.friction = friction, .thickness_in_cells = 0.5};
            plank.position = Point<D>::filled(0.5 * Box<D>::width);
            plank.position[axis] += side * out;
            plank.position[1] = Box<D>::bottom + half_length * s - deep * c;
            plank.shape.half_extents = firn::Vec<float, D>::filled(float(Box<D>::width));
            plank.shape.half_extents[axis] = float(half_length);
            plank.shape.half_extents[1] = float(half_thickness);
            if constexpr (D == 2)
                plank.rotation = firn::rotor(firn::radians(side * angle));
            else if (axis == 0)
                plank.rotation = firn::rotor({0.0, 0.0, 1.0}, firn::radians(side * angle));
            else
                plank.rotation = firn::rotor({1.0, 0.0, 0.0}, firn::radians(-side * angle));
            planks.push_back(plank);
        }
    return planks;
}

/// Makes a simulation of the stones above the funnel. With contact groups, each stone has a group of its own.
template <int D, class Law>
Simulation<D, Law> make(const example::Options& options, const Settings& settings, double spacing, const Law& law) {
    const double width = Box<D>::width, cell_size = 2 * spacing;
    firn::Domain<D> domain{Point<D>{}, Point<D>::filled(width), cell_size};
    domain.upper[1] = Box<D>::height();
    const auto walls = firn::Walls<float, D>::all(firn::cast<float>(domain.lower), firn::cast<float>(domain.upper),
                                                  {firn::Contact::separate, settings.friction});
    Simulation<D, Law> simulation(domain, firn::FixedCorotated<float>::from_young_poisson(float(settings.young), 0.3F),
                                  {options.threads}, {walls, {funnel<D>(settings.friction, cell_size)}});
    simulation.contact = law;
    firn::RandomSequence random(5);
    for (std::int64_t n = 0; n < std::int64_t(stones); ++n) {
        const std::int64_t columns = Box<D>::columns, along = n % columns;
        const std::int64_t across = D == 2 ? 0 : n / columns % columns,
                           row = D == 2 ? n / columns : n / columns / columns;
        Point<D> centre;
        for (int a = 0; a < D; ++a) {
            const double place =
                a == 1 ? Box<D>::lowest() + Box<D>::distance * double(row)
                       : 0.5 * width + Box<D>::distance * (double(a == 0 ? along : across) - 0.5 * double(columns - 1));
            centre[a] = place + 0.05 * radius * (2 * firn::unit_interval(random.bits()) - 1);
        }
        const firn::Body stone =
            simulation.add(firn::sample_sphere<D>(centre, radius, {.spacing = spacing}), settings.density);
        if constexpr (Law::between_groups) simulation.set_contact_group(stone, int(n));
    }
    return simulation;
}

/// The number of stones whose centres are below the opening.
template <class Simulation>
int passed(const Simulation& simulation) {
    const auto points = example::positions(simulation);
    int count = 0;
    for (const firn::Body& stone : simulation.bodies()) {
        double height = 0;
        for (const auto& x : std::span(points).subspan(stone.first, stone.count)) height += x[1] / double(stone.count);
        count += height < Box<Simulation::dimension>::bottom;
    }
    return count;
}

/// What pictures show besides the stones: the planks; in space, not the one in front.
template <int D>
example::Scenery<D> planks(double spacing) {
    example::Scenery<D> scenery;
    constexpr example::Colour colours[] = {example::coral, example::teal, example::amber, example::indigo,
                                           example::moss,  example::plum, example::sand};
    for (std::size_t n = 0; n < stones; ++n) scenery.colours.push_back(colours[(n + n / 8) % std::size(colours)]);
    auto all = funnel<D>(0, 2 * spacing);
    if (D == 3) all.erase(all.begin() + 2);
    for (const Plank<D>& plank : all) {
        auto half = firn::cast<double>(plank.shape.half_extents);
        const auto turned = firn::matrix_of(plank.rotation);
        if constexpr (D == 2) {
            const auto is_inside = [&](const Point<2>& x) { return x[0] > 0 && x[0] < Box<2>::width; };
            for (const auto& x : firn::sample_box<2>(half * -1.0, half, {.spacing = spacing}).positions)
                if (const auto placed = plank.position + turned * x; is_inside(placed))
                    scenery.points.push_back(placed);
        } else {
            (half[0] > half[2] ? half[0] : half[2]) = 0.5 * Box<D>::width;  // planks reach into the walls
            auto mesh = example::box_mesh(half * -1.0, half);
            for (auto& x : mesh.vertices) x = plank.position + turned * x;
            example::add_mesh(scenery.surface, mesh, example::slate);
        }
    }
    return scenery;
}

template <int D>
int fall(const example::Options& options, const Settings& settings, std::int64_t particles) {
    const double volume = double(stones) * (D == 2 ? pi * radius * radius : 4 * pi / 3 * radius * radius * radius);
    const double spacing = std::pow(volume / double(particles), 1.0 / D);
    Settings smooth = settings;
    smooth.friction = 0;
    const firn::CoulombContact rubbing{.friction = settings.friction};
    auto rough = make<D>(options, settings, spacing, rubbing);
    auto slippery = make<D>(options, smooth, spacing, firn::CoulombContact{});
    auto stuck = make<D>(options, settings, spacing, firn::OneField{});

    const double dt = 0.5 * rough.stable_time_step();  // stones that are compressed need shorter steps
    example::Options runs[] = {options, options, options};
    const char* const names[] = {"_friction", "_smooth", "_one_field"};
    for (int i = 0; i < 3; ++i) runs[i].name += names[i];
    example::StatesOfAll first(rough, runs[0]);
    example::StatesOfAll second(slippery, runs[1]);
    example::StatesOfAll third(stuck, runs[2]);
    const auto for_all = [&](const auto& f) { f(rough, first), f(slippery, second), f(stuck, third); };
    std::vector<std::filesystem::path> series;
    for_all([&](auto& simulation, const auto& states) {
        simulation.fixed_time_step = dt;
        series.insert(series.end(), states.files().begin(), states.files().end());
    });

    example::View view{.direction = {{-0.15F, -0.2F, -1.0F}}};
    view.frame = example::Box{{}, {{float(Box<D>::width), float(Box<D>::height()), D == 2 ? 0 : float(Box<D>::width)}}};
    view.width = 600;
    view.height = 1000;
    view.smoothing = 0.5F;
    const auto scenery = planks<D>(spacing);
    const auto drawn = [&] {
        using example::beside, example::picture;
        return beside(beside(picture(rough, spacing, view, scenery), picture(slippery, spacing, view, scenery)),
                      picture(stuck, spacing, view, scenery));
    };
    example::Options timed = options;
    if (options.time) timed.schedule = options.schedule_of_time(0, 0, dt);
    const auto count = [&] {
        return std::int64_t(example::particle_count(rough) + example::particle_count(slippery) +
                            example::particle_count(stuck));
    };
    std::array<std::chrono::duration<double>, 3> spent{};  // in the steps of each run
    const auto step = [&] {
        std::size_t run = 0;
        for_all([&](auto& simulation, auto&) {
            const auto start = std::chrono::steady_clock::now();
            simulation.step();
            spent[run++] += std::chrono::steady_clock::now() - start;
        });
    };
    const example::Outcome outcome = example::run_schedule(
        timed, count, {}, [&] { for_all([](auto& simulation, auto& states) { states.write(simulation); }); },
        [&] { for_all([](auto&, auto& states) { states.finish(); }); }, step, drawn, series);
    std::printf("%sof %zu stones have passed after %.2f s: with friction %d, without friction %d, in one field %d\n",
                outcome.part().c_str(), stones, rough.time(), passed(rough), passed(slippery), passed(stuck));
    std::printf("their steps took %.1f, %.1f and %.1f s\n", spent[0].count(), spent[1].count(), spent[2].count());
    return outcome.exit_code();
}

int stones_in_funnel(int argc, char** argv) {
    example::CommandLine line({.name = "stones",
                               .about = "64 stones fall into a funnel: contact groups with and without friction, and "
                                        "one field of velocities, beside each other. --particles is met approximately.",
                               .particles = 29'000,
                               .steps = 30'000,
                               .frames = 60,
                               .takes_time = true});
    Settings settings{.young = 2e5, .friction = 0.2, .density = 1000};
    std::int64_t dimensions = 2;
    line.add("--young", settings.young, "Young's modulus in Pa", 1e3, 1e9);
    line.add("--friction", settings.friction, "Friction between stones and at walls, in the first run", 0, 10);
    line.add("--density", settings.density, "Density of the stones in kg/m^3", 1, 1e5);
    line.add("--dimensions", dimensions, "2: disks in the plane; 3: balls, by default of 463,000 particles", 2, 3);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();
    if (dimensions == 2) return fall<2>(options, settings, options.particles);
    return fall<3>(options, settings, line.is_given("--particles") ? options.particles : 463'000);
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return stones_in_funnel(argc, argv); });
}
