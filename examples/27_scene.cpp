/// \file Runs a scene that a JSON file describes: bodies, materials, walls and solids, sources. Nothing of it is known
/// when the program is compiled, except which materials there are. examples/data/scenes has scenes, and a schema that
/// editors check them by.
#include "support/run_schedule.hpp"
#include "support/scene_file.hpp"
#include "support/scene_solids.hpp"
#include <firn/any/run_of.hpp>
#include <firn/any_simulation.hpp>
#include <firn/io/states.hpp>

#include <memory>

namespace {

using Offered = firn::Offer<firn::CommonMaterials, firn::OfferedTransfers<firn::Apic>, firn::OfferedPrecisions<float>>;
using Simulation = firn::AnySimulation<3>;
using Series = firn::BackgroundSeries<float>;

/// The particles as they are drawn. Each material has its colour or, if there is only one, each body.
example::Cloud cloud_of(const Simulation& simulation, double spacing) {
    example::Cloud cloud;
    cloud.radius = float(0.6 * spacing);
    for (std::size_t k = 0; k < simulation.sets(); ++k) {
        const std::vector<std::uint32_t> ids = simulation.ids(k);
        std::vector<float> positions(3 * ids.size()), gradients(9 * ids.size(), 0);
        simulation.read(k, "position", std::span(positions));
        const std::string& name = simulation.material_name(k);
        const bool deforms = name != "fluid";
        if (deforms) simulation.read(k, "deformation_gradient", std::span(gradients));
        const auto& bodies = simulation.bodies(k);
        for (std::size_t i = 0; i < ids.size(); ++i) {
            const float* const x = positions.data() + 3 * i;
            cloud.positions.push_back({x[0], x[1], x[2]});
            const auto next = std::upper_bound(bodies.begin(), bodies.end(), ids[i],
                                               [](auto id, const firn::Body& body) { return id < body.first; });
            cloud.colour.push_back(std::uint8_t(simulation.sets() > 1 ? k : std::size_t(next - bodies.begin() - 1)));
            cloud.look.push_back(example::look_of(name, deforms));
            auto shape = example::Mat3::identity();
            for (int row = 0; deforms && row < 3; ++row)
                for (int column = 0; column < 3; ++column)
                    shape(row, column) = gradients[9 * i + std::size_t(3 * row + column)];
            cloud.shape.push_back(shape);
        }
    }
    return cloud;
}

/// Lets the solids whose time has come go on with other velocities.
void move_solids(Simulation& simulation, const std::vector<example::Motion>& motions, std::size_t& next) {
    for (; next < motions.size() && motions[next].time <= simulation.time(); ++next) {
        const example::Motion& motion = motions[next];
        auto part = simulation.boundary_part(motion.part);
        std::visit(
            [&](auto& solid) {
                if constexpr (requires { solid.linear_velocity; }) {
                    solid.linear_velocity = motion.linear_velocity;
                    solid.angular_velocity = motion.angular_velocity;
                }
            },
            part);
        simulation.set_boundary_part(motion.part, part);
    }
}

int scene(int argc, char** argv) {
    example::CommandLine line({.name = "scene",
                               .about = "Runs the scene of a JSON file.",
                               .particles = 0,
                               .steps = 0,
                               .frames = 0,
                               .writes_obj = false});
    std::string file = FIRN_EXAMPLES_DATA_DIR "/scenes/two_bunnies.json";
    line.add_file("--scene", file, "The scene", "SCENE.json");
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    example::Options options = line.options();
    example::Scene scene = example::read_scene(file, line.is_given("--particles") ? options.particles : 0);
    scene.choice.threads = options.threads;

    Simulation simulation(scene.choice, Offered{});
    for (const auto& body : scene.bodies) simulation.add(body.material, body.samples, body.density, body.velocity);
    for (const auto& source : scene.sources) simulation.add_source(source.material, source.source);
    for (const auto& sink : scene.sinks) simulation.add_sink(sink.material, sink.sink);

    std::vector<std::unique_ptr<Series>> series;
    std::vector<std::filesystem::path> lists;
    for (const auto& material : scene.choice.materials) {
        const std::string ending = scene.choice.materials.size() > 1 ? "_" + material.name : "";
        series.push_back(std::make_unique<Series>(options.output, options.name + ending));
        lists.push_back(series.back()->path());
    }
    // The progress bar multiplies this by its steps, each of which takes so many of the simulation's.
    std::uint64_t steps_at_once = 1;
    const auto particles = [&] {
        std::size_t count = 0;
        for (std::size_t k = 0; k < simulation.sets(); ++k) count += simulation.particles(k);
        return std::int64_t(count * steps_at_once);
    };
    const auto write = [&] {
        for (std::size_t k = 0; k < series.size(); ++k)
            series[k]->write(std::get<firn::State<float>>(simulation.state(k)));
    };
    const auto finish = [&] {
        for (auto& one : series) one->finish();
    };

    example::View view;
    view.domain.emplace();
    view.frame.emplace();  // the bodies at the start and the floor under them
    for (const auto& body : scene.bodies)
        for (const auto& x : body.samples.positions) view.frame->include(firn::cast<float>(x));
    for (int a = 0; a < 3; ++a) {
        view.domain->lower[a] = float(scene.choice.domain.lower[a]);
        view.domain->upper[a] = float(scene.choice.domain.upper[a]);
    }
    if (scene.bodies.empty()) view.frame = view.domain;
    view.frame->lower[1] = view.domain->lower[1];
    // With --steps, so many steps; else the scene's time, and each "step" of the progress bar lasts until a state.
    const bool steps_given = line.is_given("--steps");
    const std::int64_t frames = line.is_given("--frames") ? options.frames : scene.frames;
    if (!steps_given) options.schedule = example::spread(frames, frames);
    std::size_t next = 0;
    const auto advance = [&] {
        if (steps_given) {
            move_solids(simulation, scene.motions, next);
            return simulation.step();
        }
        const double until =
            scene.end * double(std::lround(simulation.time() / scene.end * double(frames)) + 1) / double(frames);
        const std::uint64_t before = simulation.steps();
        while (simulation.time() < until) {
            move_solids(simulation, scene.motions, next);
            const double stop = next < scene.motions.size() ? std::min(until, scene.motions[next].time) : until;
            simulation.advance(stop - simulation.time());
        }
        steps_at_once = simulation.steps() - before;
    };
    const auto picture = [&] {
        example::Cloud cloud = cloud_of(simulation, scene.spacing);
        const auto colour = simulation.sets() > example::slate ? example::snow : example::slate;
        if (const auto boundary = simulation.choice().boundary)
            example::add_solids(cloud.surface, *boundary, scene.meshes, simulation.domain(), view.direction, colour);
        return example::render(cloud, view);
    };
    return example::run_schedule(options, particles, {}, write, finish, advance, picture, lists).exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return scene(argc, argv); });
}
