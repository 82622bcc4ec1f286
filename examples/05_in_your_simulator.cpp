/// \file firn's stages in a program with its own particles. The particles stay in the program's structures; firn reads
/// and writes them through a view. The program keeps its time step, its loop and its output.
#include "support/film.hpp"
#include "support/options.hpp"
#include "support/png.hpp"
#include "support/progress.hpp"
#include "support/renderer.hpp"
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include <cstdio>
#include <iostream>

namespace {

/// The program's own particles: an array of structures, with matrices row by row and members that firn does not need.
struct YourParticle {
    double position[3];
    double velocity[3];
    double temperature;
    double deformation[3][3];
    double affine[3][3];
    double stress[3][3];
    double mass, volume;
};
constexpr std::ptrdiff_t stride = sizeof(YourParticle) / sizeof(double);

firn::ForeignParticles<double, 3> view_of(std::vector<YourParticle>& all) {
    using Span = firn::StridedSpan<double>;
    YourParticle& first = all.front();
    return {.position = Span::vectors<3>(first.position, stride),
            .velocity = Span::vectors<3>(first.velocity, stride),
            .affine = Span::matrices<3>(&first.affine[0][0], true, stride),
            .stress = firn::symmetric_matrices<3>(&first.stress[0][0], stride),
            .mass = Span::scalars(&first.mass, stride),
            .volume = Span::scalars(&first.volume, stride),
            .state = {Span::matrices<3>(&first.deformation[0][0], true, stride)}};
}

std::vector<YourParticle> your_scene(double spacing) {
    std::vector<YourParticle> all;
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered};
    for (const auto& x : firn::sample_sphere<3>({0.5, 0.6, 0.5}, 0.2, filling).positions) {
        YourParticle p{};
        for (int a = 0; a < 3; ++a) {
            p.position[a] = x[a];
            p.deformation[a][a] = 1;
        }
        p.velocity[1] = -3;
        p.volume = spacing * spacing * spacing;
        p.mass = 1000 * p.volume;
        p.temperature = 293;
        all.push_back(p);
    }
    return all;
}

/// Your own output, here a state for ParaView.
firn::State<double> your_state(const std::vector<YourParticle>& all, std::uint64_t step, double time, double dt) {
    firn::State<double> state;
    state.step = step;
    state.time = time;
    state.last_time_step = dt;
    firn::StateField<double> position{"position", "m", 3, {}}, velocity{"velocity", "m/s", 3, {}},
        temperature{"temperature", "K", 1, {}};
    for (const YourParticle& p : all) {
        position.values.insert(position.values.end(), p.position, p.position + 3);
        velocity.values.insert(velocity.values.end(), p.velocity, p.velocity + 3);
        temperature.values.push_back(p.temperature);
        state.id.push_back(std::int64_t(state.id.size()));
    }
    state.body.resize(all.size());
    state.fields = {position, velocity, temperature};
    return state;
}

int your_simulator(int argc, char** argv) {
    example::CommandLine line({.name = "in_your_simulator",
                               .about = "firn's stages on a program's own arrays.",
                               .particles = 20'000,
                               .steps = 600,
                               .frames = 10,
                               .writes_obj = false});
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();
    const double spacing = 0.2 * std::cbrt(4.0 / 3.0 * std::acos(-1.0) / double(options.particles));
    std::vector<YourParticle> all = your_scene(spacing);

    // firn needs a grid, a material, walls and an execution.
    const firn::Domain<3> domain{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 2 * spacing};
    const auto material = firn::FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    const auto walls = firn::Walls<double, 3>::all({0, 0, 0}, {1, 1, 1}, {firn::Contact::slip, 0});
    const firn::Vec<double, 3> gravity{0.0, -9.81, 0.0};
    const firn::Coloured execution{options.threads};
    using Kernel = firn::QuadraticBSpline;

    const auto view = view_of(all);
    firn::SparseGrid<double, 3> grid(domain);
    auto partition = firn::partition_particles<Kernel>(view, all.size(), domain, options.threads);
    grid.activate(partition);
    firn::G2PReport report = firn::update_stress(execution, view, partition, material, domain.cell_size);

    // Your own output: a state and, with --pictures, a picture.
    const auto picture = [&] {
        example::Cloud cloud;
        cloud.radius = float(0.6 * spacing);
        cloud.look.assign(all.size(), example::Look::skin);
        for (const YourParticle& p : all) {
            cloud.positions.push_back({float(p.position[0]), float(p.position[1]), float(p.position[2])});
            example::Mat3& shape = cloud.shape.emplace_back();
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k) shape(i, k) = float(p.deformation[i][k]);
        }
        example::View view_of_box;
        view_of_box.domain = example::Box{{0, 0, 0}, {1, 1, 1}};
        view_of_box.frame = example::Box{{0.1F, 0, 0.1F}, {0.9F, 1, 0.9F}};
        return example::render(cloud, view_of_box);
    };
    firn::StateSeries states(options.output, options.name);
    int written = 0;
    const auto write = [&](std::uint64_t step, double time, double dt) {
        states.write(your_state(all, step, time, dt));
        if (options.pictures) example::write_png(options.file(example::numbered(written, ".png")), picture());
        ++written;
    };

    write(0, 0, 0);
    example::Progress progress(options.schedule.steps, std::int64_t(all.size()));
    double time = 0;
    for (std::int64_t step = 1; step <= options.schedule.steps; ++step) {
        const double dt = firn::stable_time_step<Kernel>(domain.cell_size, report.signal_speed, norm(gravity));
        if (report.sort_needed) {  // finds a new order; the particles do not move
            partition = firn::partition_particles<Kernel>(view, all.size(), domain, options.threads);
            grid.activate(partition);
        }
        firn::p2g<Kernel, firn::Apic, firn::MlsForce>(execution, view, partition, grid, dt);
        firn::grid_update(execution, grid, dt, gravity, walls);
        report = firn::g2p<Kernel, firn::Apic, firn::MlsForce>(execution, view, partition, grid, material, dt);
        time += dt;
        if (options.schedule.writes_after(step)) write(std::uint64_t(step), time, dt);
        progress.advance();
    }

    example::write_png(options.file(".png"), picture());
    std::cout << "picture: " << options.file(".png").string() << std::endl;
    const bool films = options.film && example::finds_ffmpeg(options.file(""), written);
    return films && !example::make_film(options.file(""), written) ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return your_simulator(argc, argv);
    } catch (const std::exception& problem) {
        std::cerr << "error: " << problem.what() << std::endl;
        return 1;
    }
}
