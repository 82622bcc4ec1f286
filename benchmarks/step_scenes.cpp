/// \file Every scene with what firn::Simulation uses by default: step/SCENE/coloured/threads:N.
#include <firn/io/obj.hpp>

#include "step.hpp"

namespace {

using scenes::cubes_of;
using scenes::Matter;
using scenes::Scene;
using Point = firn::Vec<double, 3>;

/// One body of particles on a jittered lattice in a box.
Matter<3> box(const Point& lower, const Point& upper, double spacing, double jitter = 0.1) {
    Matter<3> body;
    body.samples =
        firn::sample_box<3>(lower, upper, {.spacing = spacing, .pattern = firn::Pattern::jittered, .jitter = jitter});
    body.centre = (lower + upper) * 0.5;
    return body;
}

/// The bunny of the examples, twice, 150,000 particles, eight a cell: one lies below, the other falls on it.
Scene<3> bunnies() {
    constexpr double size = 0.32;
    const firn::TriangleMesh mesh = firn::read_obj(FIRN_BENCHMARKS_MESH);
    const firn::TriangleMesh below = firn::fitted(mesh, {0.47, 0.17, 0.5}, size);
    const firn::TriangleMesh above = firn::rotated(firn::fitted(mesh, {0.53, 0.49, 0.52}, size),
                                                   firn::rotation({0.0, 1.0, 0.0}, 2.2), {0.53, 0.49, 0.52});
    const double spacing = std::cbrt(2 * std::abs(firn::signed_volume(below)) / 150'000);
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered, .jitter = 0.1};
    Scene<3> scene;
    scene.domain.cell_size = 2 * spacing;
    scene.time_step = scenes::time_step * scene.domain.cell_size * 128;
    scene.matter.resize(2);
    scene.matter[0].samples = firn::sample_mesh(below, filling);
    scene.matter[1].samples = firn::sample_mesh(above, filling);
    scene.matter[1].velocity = {0.0, -2.0, 0.0};
    return scene;
}

/// One cube of 148,877 particles, 27 a cell, that falls.
Scene<3> dense_block() {
    Scene<3> scene;
    scene.domain = scenes::unit_box();
    const double h = scene.domain.cell_size, side = 53 * h / 3;
    scene.matter = {box({50 * h, 60 * h, 50 * h}, {50 * h + side, 60 * h + side, 50 * h + side}, h / 3)};
    scene.matter[0].velocity = {2.0, -1.4, 1.0};
    return scene;
}

/// A sheet one cell thick, 143,648 particles, that turns in its plane and falls flat.
Scene<3> thin_sheet() {
    Scene<3> scene;
    scene.domain.cell_size = 1.0 / 256;
    scene.time_step = scenes::time_step / 2;
    const double h = scene.domain.cell_size;
    scene.matter = {box({60 * h, 60 * h, 120 * h}, {194 * h, 194 * h, 121 * h}, h / 2)};
    scene.matter[0].velocity = {0.3, 0.3, -1.0};
    scene.matter[0].spin = 6;
    return scene;
}

/// Heavy deformation: a soft cube of 140,608 particles that spins so fast that it is torn out to twice its volume and
/// more, and swings back; up to 0.25 cells a step, far from all walls.
Scene<3> splash() {
    Scene<3> scene;
    const double h = 1.0 / 128;
    scene.domain = {{0.0, 0.0, 0.0}, {4.0, 4.0, 4.0}, h};
    scene.young = 100;
    scene.time_step = 7.5e-5;
    scene.matter = {box({250 * h, 250 * h, 250 * h}, {276 * h, 276 * h, 276 * h}, h / 2)};
    scene.matter[0].spin = 150;
    scene.matter[0].jostle = 3;
    scene.steps.before = 100;
    return scene;
}

/// Disorder: every F off by up to 0.2 at random, particles anywhere in their cells and in no order, all on the way at
/// 0.3 cells a step. So soft (1 Pa) that it stays disordered.
Scene<3> disorder(const Point& lower, const Point& upper, double particles_per_cell) {
    Scene<3> scene;
    const double h = 1.0 / 128;
    scene.domain = {{0.0, 0.0, 0.0}, {4.0, 4.0, 4.0}, h};
    scene.young = 1;
    scene.gravity = Point::zero();
    const Point extent = upper - lower;
    const double cells = extent[0] * extent[1] * extent[2];
    const auto count = std::size_t(std::lround(particles_per_cell * cells));
    Matter<3> body;
    for (std::size_t i = 0; i < count; ++i) {
        Point x{};
        for (int a = 0; a < 3; ++a) x[a] = h * (lower[a] + extent[a] * 0.5 * (1 + scenes::random_number(1, i, a)));
        body.samples.positions.push_back(x);
    }
    body.samples.volume = h * h * h / particles_per_cell;
    body.velocity = Point{1.0, 0.75, 0.5} * (0.3 * h / scene.time_step);
    body.strain = 0.2;
    body.jostle = 0.02 * h / scene.time_step;
    scene.matter.push_back(std::move(body));
    return scene;
}
/// 144,000 particles, as everywhere below.
Scene<3> disorder_solid() { return disorder({40, 40, 40}, {70, 60, 70}, 8); }
Scene<3> disorder_sheet() { return disorder({40, 40, 40}, {174, 174.33, 41}, 8); }
/// Particles a block of 4³ cells.
Scene<3> spray_11() { return disorder({40, 40, 40}, {135, 134, 133.82}, 11.0 / 64); }
Scene<3> spray_4() { return disorder({40, 40, 40}, {173, 172, 171.2}, 4.0 / 64); }

/// A ball of 9,000 particles near a corner of a domain of cells³.
Scene<3> ball(int cells, double from_corner) {
    const double h = 1.0 / 128;
    Scene<3> scene;
    scene.domain.upper = Point::filled(cells * h);
    const Point centre = Point::filled(from_corner > 0 ? from_corner * h : (cells + from_corner) * h);
    Matter<3> body;
    body.samples = firn::sample_sphere<3>(centre, 6.5 * h, {.spacing = h / 2});
    body.centre = centre;
    body.velocity = {0.5, 0.5, 0.5};
    scene.domain.cell_size = h;
    scene.matter.push_back(std::move(body));
    return scene;
}
Scene<3> near_corner() { return ball(64, 32); }
Scene<3> far_corner() { return ball(4096, -32); }

benchmark::internal::Benchmark* add(const std::string& name, Scene<3> (*make)(), int threads) {
    return scenes::add_step<float, firn::Apic>(name, make, firn::Coloured{threads}, threads);
}

const bool registered = [] {
    for (const int threads : scenes::thread_counts()) add("two_cubes", scenes::all_of_two_cubes, threads);
    for (const int threads : {1, 2}) {
        add("two_cubes_8k", cubes_of<8'000>, threads);
        add("two_cubes_10k", cubes_of<10'000>, threads);
        add("two_cubes_100k", cubes_of<100'000>, threads);
        add("two_cubes_1m", cubes_of<1'000'000>, threads);
        if (scenes::full()) {
            add("two_cubes_8m", cubes_of<8'000'000>, threads);
            add("two_cubes_16m", cubes_of<16'000'000>, threads);
        }
        add("bunnies", bunnies, threads);
        add("dense_block", dense_block, threads);
        add("thin_sheet", thin_sheet, threads);
        add("splash", splash, threads);
        add("disorder_solid", disorder_solid, threads);
        add("disorder_sheet", disorder_sheet, threads);
        add("spray_11", spray_11, threads);
        add("spray_4", spray_4, threads);
        add("near_corner", near_corner, threads);
        add("far_corner", far_corner, threads);
    }
    return true;
}();

}  // namespace
