/// \file A fountain. Drops rise from a ring of jets and one in the middle, slowed by gravity and the air, and the wind
/// blows them aside. They gather in a basin, where they collide with each other, and vanish at the end of their life.
/// Prints how many drops the wind has carried past the rim.
#include "support/run_particles.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>

#include <numbers>

namespace {

constexpr int D = 3;
using Point = firn::Vec<double, D>;
using Post = firn::Collider<firn::Capsule<float, D>>;
using Rim = firn::Collider<firn::Box<float, D>>;
using Boundary = firn::Together<firn::Walls<float, D>, Post, Rim, Rim, Rim, Rim>;
using System = firn::ParticleSystem<D, float, firn::Verlet, Boundary>;

constexpr double half = 1, height = 0.16, thickness = 0.05;  // half the basin's side; its rim [m]
constexpr firn::Contact slides = firn::Contact::separate;

/// The four sides of the rim.
std::array<Rim, 4> rim() {
    std::array<Rim, 4> sides;
    for (std::size_t k = 0; k < 4; ++k) {
        const int across = k < 2 ? 0 : 2;
        sides[k].contact = slides;
        sides[k].shape.half_extents[1] = float(height / 2);
        sides[k].shape.half_extents[across] = float(thickness);
        sides[k].shape.half_extents[2 - across] = float(half + (k < 2 ? 2 * thickness : 0));
        sides[k].position = {0, height / 2, 0};
        sides[k].position[across] = (k % 2 ? 1 : -1) * (half + thickness);
    }
    return sides;
}

/// A plain, with a basin on it. The highest jet comes from a post in the middle.
Boundary basin() {
    const auto plain = firn::Walls<float, D>::all({-3, 0, -3}, {3, 50, 3}, {slides, 0.5});
    Post post{.shape = {0.4F, 0.06F}, .contact = slides};
    const auto [left, right, back, front] = rim();
    return {plain, post, left, right, back, front};
}

bool is_in_basin(const Point& x) { return std::max(std::abs(x[0]), std::abs(x[2])) < half; }

int fountain(int argc, char** argv) {
    example::CommandLine line({.name = "fountain",
                               .about = "Drops of a fountain rise in the wind and gather in a basin.",
                               .particles = 40'000,
                               .steps = 1600,
                               .frames = 60,
                               .can_go_on = true});
    constexpr double emission = 3.2;  // the time in which as many drops as --particles are born [s]
    double dt = 2e-3, wind = 7, speed = 5.8, lifespan = 3;
    std::int64_t jets = 8;
    line.add("--dt", dt, "Time step in s", 1e-5, 1e-2);
    line.add("--speed", speed, "Speed of the middle jet in m/s", 0.1, 50);
    line.add("--lifespan", lifespan, "Life of a drop in s, plus or minus half a second", 1, 1e9);
    line.add("--wind", wind, "Wind in m/s", -30, 30);
    line.add("--jets", jets, "Number of jets around the middle one", 0, 1000);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    const double radius = 0.009 * std::cbrt(40'000 / double(options.particles));  // keeps the volume of water

    System system(basin());
    system.threads = options.threads;
    system.restitution = 0.2;
    system.add_force(firn::DragOnPoints<float, D>{{.wind = {float(wind), 0, 0}}});
    system.collisions.emplace();
    system.collisions->restitution = 0.1;

    // The rate does not depend on the steps, so that a run can go on beyond its end. Half of the drops are from the
    // middle jet.
    const double rate = double(options.particles) / emission;
    firn::Emitter<D> emitter{.position = {0, 0.48, 0},
                             .nozzle = 0.06,
                             .speed = speed,
                             .speed_spread = 0.04 * speed,
                             .cone = 0.09,
                             .rate = jets > 0 ? rate / 2 : rate,
                             .lifespan = lifespan,
                             .lifespan_spread = 0.5,
                             .mass = 1000 * 4.0 / 3 * std::numbers::pi * radius * radius * radius,
                             .radius = radius};
    system.add_emitter(emitter);
    for (std::int64_t jet = 0; jet < jets; ++jet) {
        const double angle = 2 * std::numbers::pi * double(jet) / double(jets);
        emitter.position = {0.75 * half * std::cos(angle), height, 0.75 * half * std::sin(angle)};
        emitter.direction = {-0.35 * std::cos(angle), 1, -0.35 * std::sin(angle)};
        emitter.speed = 0.75 * speed;
        emitter.speed_spread = 0.03 * speed;
        emitter.nozzle = 0.035;
        emitter.cone = 0.05;
        emitter.rate = rate / 2 / double(jets);
        emitter.seed = std::uint64_t(jet) + 2;
        system.add_emitter(emitter);
    }

    const auto picture = [&] {
        auto cloud = example::cloud_of<D>(system, radius, [](std::size_t) { return example::teal; });
        for (const auto& v : system.points.velocity) cloud.tone.push_back(0.5F + 0.1F * norm(v));
        cloud.look.assign(cloud.positions.size(), example::Look::water);
        example::add_mesh(cloud.surface, example::post_mesh({}, 0.46, 0.06), example::slate);
        for (const Rim& side : rim()) {
            const Point extents = firn::cast<double>(side.shape.half_extents);
            example::add_mesh(cloud.surface, example::box_mesh(side.position - extents, side.position + extents),
                              example::slate);
        }
        example::View view{.direction = {{-0.4F, -0.5F, -1.0F}}};
        view.domain = example::Box{{{-1.8F, 0, -1.8F}}, {{1.8F, 1, 1.8F}}};
        view.frame = example::Box{{{-1.2F, 0, -1.2F}}, {{1.5F, 1.5F, 1.2F}}};
        view.smoothing = 0.3F;
        return example::render(cloud, view);
    };
    const example::Outcome outcome = example::run(system, options, [&] { system.step(dt); }, picture);
    if (!outcome.has_moved()) return outcome.exit_code();
    const auto inside = std::count_if(system.points.position.begin(), system.points.position.end(), is_in_basin);
    std::printf("%s%zu drops, %zu of them beyond the rim\n", outcome.part().c_str(), system.points.size(),
                system.points.size() - std::size_t(inside));
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return fountain(argc, argv); });
}
