/// \file Point masses: balls that settle in a box, lagrangian/collisions/n:N/threads:T, and hanging cloth,
/// lagrangian/cloth/side:N/threads:T. FIRN_BENCHMARK_FULL adds the largest; FIRN_BENCHMARK_QUICK leaves out the large.
///
/// The time of a step of collisions is that of all but the integration. Its parts are counters: sorting (measured by
/// itself, on the same points), finding contacts (sorting included), impulses, shifts, and the walls.
#include <firn/boundary/walls.hpp>
#include <firn/data/random.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/collisions.hpp>
#include <firn/lagrangian/particle_system.hpp>

#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <string>

namespace {

using firn::Vec;

bool is_set(const char* variable) {
    const char* value = std::getenv(variable);
    return value && *value;
}

template <class F>
double seconds_of(const F& f) {
    const auto begin = std::chrono::steady_clock::now();
    f();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double uniform(std::uint64_t seed, std::uint64_t k) { return firn::unit_interval(firn::random_bits(seed, k)) - 0.5; }

/// About n balls on a lattice in the unit cube, each off its place by up to an eighth of the spacing along each axis
/// and a little larger than its place: six contacts each. In random order, in random motion.
firn::PointMasses<float, 3> balls(std::size_t n) {
    const auto side = std::size_t(std::round(std::cbrt(double(n))));
    const double spacing = 1 / double(side);
    std::vector<std::size_t> places(side * side * side);
    std::iota(places.begin(), places.end(), 0);
    for (std::size_t k = places.size() - 1; k > 0; --k) std::swap(places[k], places[firn::random_bits(1, k) % (k + 1)]);
    firn::PointMasses<float, 3> points;
    for (std::size_t k : places) {
        const std::size_t at[] = {k % side, k / side % side, k / side / side};
        Vec<double, 3> x{}, v{};
        for (int a = 0; a < 3; ++a) {
            x[a] = (double(at[a]) + 0.5 + 0.25 * uniform(2, 3 * k + std::size_t(a))) * spacing;
            v[a] = uniform(3, 3 * k + std::size_t(a));
        }
        points.add({.position = x, .velocity = v, .radius = 0.515 * spacing});
    }
    return points;
}

void collisions(benchmark::State& state, std::size_t n, int threads) {
    firn::PointMasses<float, 3> points = balls(n);
    const auto walls = firn::Walls<float, 3>::all({{0, 0, 0}}, {{1, 2, 1}}, {firn::Contact::separate, 0.2});
    firn::Collisions<float, 3> collisions;
    collisions.restitution = 0.2;
    collisions.friction = 0.3;
    firn::CollisionGrid<float, 3> grid;
    const float dt = 0.02f / std::cbrt(float(n));
    double sort = 0, find = 0, impulses = 0, shifts = 0, at_walls = 0;
    const auto step = [&] {
        for (auto& v : points.velocity) v[1] -= 9.81f * dt;
        for (std::size_t i = 0; i < points.size(); ++i)
            points.position[i] += firn::cast<double>(points.velocity[i]) * double(dt);
        sort += seconds_of([&] { grid.build(points, threads); });
        const double parts[] = {seconds_of([&] { collisions.find(points, walls, 0.2, threads); }),
                                seconds_of([&] { collisions.change_velocities(points, threads); }),
                                seconds_of([&] { collisions.shift(points, threads); }),
                                seconds_of([&] { firn::meet_surfaces(points, walls, 0.2, threads); })};
        find += parts[0], impulses += parts[1], shifts += parts[2], at_walls += parts[3];
        return parts[0] + parts[1] + parts[2] + parts[3];
    };
    for (int k = 0; k < 10; ++k) step();
    sort = find = impulses = shifts = at_walls = 0;
    for (auto _ : state) state.SetIterationTime(step());
    const double count = double(points.size());
    const auto milliseconds = [](double seconds) {
        return benchmark::Counter(1e3 * seconds, benchmark::Counter::kAvgIterations);
    };
    state.counters["particles"] = count;
    state.counters["contacts_per_particle"] = 2 * double(collisions.contacts()) / count;
    state.counters["bytes_per_particle"] = double(collisions.bytes()) / count;
    state.counters["sort_ms"] = milliseconds(sort);
    state.counters["find_ms"] = milliseconds(find);
    state.counters["impulses_ms"] = milliseconds(impulses);
    state.counters["shifts_ms"] = milliseconds(shifts);
    state.counters["walls_ms"] = milliseconds(at_walls);
}

/// A cloth of side × side points that hangs by one edge: stretch, shear and bend as constraints, coloured.
void cloth(benchmark::State& state, std::size_t side, int threads) {
    firn::ParticleSystem<3, float> system;
    system.threads = threads;
    const double spacing = 1 / double(side - 1);
    const auto net = firn::cloth({{0, 0, 0}}, {{1, 0, 0}}, {{0, 0, 1}}, {side - 1, side - 1});
    system.add(net, {.mass = 0.1 * spacing * spacing});
    system.constraints.add(net);
    for (std::size_t i = 0; i < side; ++i) system.points.pin(std::uint32_t(i));
    const double dt = 1.0 / 600;
    for (int k = 0; k < 5; ++k) system.step(dt);
    for (auto _ : state) state.SetIterationTime(seconds_of([&] { system.step(dt); }));
    state.counters["particles"] = double(side * side);
    state.counters["constraints"] = double(net.links.size());
    state.counters["iterations"] = system.iterations;
}

template <class F>
void add(const std::string& name, int threads, const F& body) {
    benchmark::RegisterBenchmark((name + "/threads:" + std::to_string(threads)).c_str(), body)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
}

const bool registered = [] {
    const bool quick = is_set("FIRN_BENCHMARK_QUICK"), full = is_set("FIRN_BENCHMARK_FULL");
    std::vector<std::size_t> numbers{10'000, 30'000, 100'000}, sides{64, 128, 256};
    if (!quick) numbers.insert(numbers.end(), {300'000, 1'000'000}), sides.insert(sides.end(), {512, 1024});
    if (full) numbers.push_back(4'000'000);
    for (const int threads : {1, 2}) {
        for (const std::size_t n : numbers)
            add("lagrangian/collisions/n:" + std::to_string(n), threads,
                [=](benchmark::State& state) { collisions(state, n, threads); });
        for (const std::size_t side : sides)
            add("lagrangian/cloth/side:" + std::to_string(side), threads,
                [=](benchmark::State& state) { cloth(state, side, threads); });
    }
    return true;
}();

}  // namespace
