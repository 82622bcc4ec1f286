/// \file A tank of water, sand, snow and jelly, with a ball that moves through them, sources and sinks: 200 steps on
/// the device, fixed or at their bound, are those of the CPU to the bit; runs go on where they have not begun. Closes
/// with "N passed, M failed".
///
///     firn_webgpu_tank [FOLDER]
///
/// Writes into FOLDER, for sets.mjs, the programs and particles of such a tank, and what the CPU makes of them.
#include <firn/io/restart.hpp>
#include <firn/webgpu/on_gpu.hpp>

#include "on_gpu_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

namespace {

using namespace firn;
using namespace checks;

using Water = Fluid<float>;
using Jelly = FixedCorotated<float>;

constexpr std::size_t materials = 4;
constexpr double cell_size = 1.0 / 40, spacing = 1.0 / 100;  // [m]

/// Calls f(type_identity of the material, its number) for each material.
template <class F>
void for_materials(const F& f) {
    f(std::type_identity<Water>{}, std::size_t{0});
    f(std::type_identity<Sand<float>>{}, std::size_t{1});
    f(std::type_identity<Snow<float>>{}, std::size_t{2});
    f(std::type_identity<Jelly>{}, std::size_t{3});
}

/// Sand beside water, snow and jelly that fall on them.
auto matter_in_tank(bool at_bound) {
    Collider<Sphere<float, 2>> ball{.shape = {0.08F}, .contact = Contact::separate, .friction = 0.2};
    ball.position = {0.46, 0.26};
    ball.linear_velocity = {4, -1};
    ball.angular_velocity = 5;
    auto simulation = made<2>(Materials<Water, Sand<float>, Snow<float>, Jelly>(
                                  Water::from_properties({.bulk = 2e4}), Sand<float>::from_properties({.young = 5e4}),
                                  Snow<float>::from_properties({.young = 3e4}), Jelly::from_young_poisson(2e4, 0.3)),
                              cell_size, 2e-4, Together(scenes::rough_walls<2>(), ball));
    if (at_bound) simulation = bounded(simulation);
    simulation.most_steps_between_sorts = 9;
    const auto add = [](auto set, const Vec<double, 2>& lower, const Vec<double, 2>& upper,
                        const Vec<double, 2>& velocity) {
        set.add(sample_box<2>(lower, upper, {.spacing = spacing}), 1000, velocity);
    };
    auto water = simulation.template set<Water>();
    auto sand = simulation.template set<Sand<float>>();
    auto snow = simulation.template set<Snow<float>>();
    add(water, {0.45, 0.03}, {0.95, 0.18}, {-1, 0});
    add(sand, {0.05, 0.03}, {0.45, 0.17}, {2, -1});
    add(snow, {0.57, 0.2}, {0.8, 0.4}, {-2, -4});
    add(simulation.template set<Jelly>(), {0.14, 0.19}, {0.37, 0.44}, {8, -3});
    return simulation;
}

/// Water pours in and lives for a while, balls of snow drop, and what comes to the floor's middle leaves.
auto tank(bool at_bound) {
    auto simulation = matter_in_tank(at_bound);
    auto water = simulation.template set<Water>();
    auto sand = simulation.template set<Sand<float>>();
    auto snow = simulation.template set<Snow<float>>();
    const auto layer = sample_box<2>({0.1, 0.7}, {0.2, 0.7 + spacing}, {.spacing = spacing});
    auto jet = Source<2>::jet(layer, spacing, 1000, {1, -3});
    jet.start = 0.0031;
    jet.lifespan = 0.03;
    water.add_source(jet);
    snow.add_source({.samples = sample_sphere<2>({0.75, 0.8}, 0.05, {.spacing = spacing}),
                     .density = 400,
                     .velocity = {0, -6},
                     .rate = 20});
    water.add_sink({.lower = {0.4, 0}, .upper = {0.5, 0.035}});
    sand.add_sink({.lower = {0.3, 0}, .upper = {0.5, 0.04}});
    sand.add_sink({.lower = {0.1, 0.03}, .upper = {0.2, 0.03}});
    return simulation;
}

using Tank = decltype(tank(true));
using States = std::array<State<float>, materials>;

States states_of(Tank& cpu) {
    States all;
    for_materials([&]<class M>(std::type_identity<M>, std::size_t k) { all[k] = state_of(cpu.template set<M>()); });
    return all;
}
States states_of(webgpu::OnGpu<Tank>& gpu) {
    States all;
    for_materials([&]<class M>(std::type_identity<M>, std::size_t k) { all[k] = gpu.template state_of_set<M>(); });
    return all;
}
void restore_all(Tank& cpu, const States& states) {
    for_materials([&]<class M>(std::type_identity<M>, std::size_t k) { restore(cpu.template set<M>(), states[k]); });
}

void check_same(const std::string& name, Tank& cpu, webgpu::OnGpu<Tank>& gpu) {
    const States expected = states_of(cpu), got = states_of(gpu);
    for_materials([&]<class M>(std::type_identity<M>, std::size_t k) {
        const std::string of_set = name + M::name + ", ";
        check_same_state(of_set, expected[k], got[k]);
        const auto theirs = std::as_const(cpu).template set<M>(), ours = gpu.simulation().template set<M>();
        check_same_totals(of_set, theirs.totals(), ours.totals());
        check(std::ranges::equal(theirs.bodies(), ours.bodies(),
                                 [](const Body& a, const Body& b) {
                                     return a.first == b.first && a.count == b.count && a.end == b.end;
                                 }),
              of_set + "bodies");
        check(theirs.particles().next_id() == ours.particles().next_id(), of_set + "the next id");
    });
    check(gpu.moment() == cpu.moment() && gpu.stable_time_step() == cpu.stable_time_step(),
          name + "moment, and bound of the next step");
}

/// What has met during a run: at a node in the ball, a material and the ball; at any node, two materials.
struct Meetings {
    std::array<bool, materials> ball{};
    std::array<std::array<bool, materials>, materials> other{};

    void see(const Tank& cpu) {
        const auto& moving = std::get<1>(cpu.boundary.parts);
        std::array<std::set<std::array<int, 2>>, materials> nodes;
        for_materials([&]<class M>(std::type_identity<M>, std::size_t k) {
            const auto& particles = cpu.template set<M>().particles();
            for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
                if (!particles.is_particle(slot)) continue;
                const auto x = particles.exact_position(slot) * (1 / cell_size);
                const int first[] = {int(std::floor(x[0] - 0.5)), int(std::floor(x[1] - 0.5))};
                for (int node = 0; node < 9; ++node) nodes[k].insert({first[0] + node / 3, first[1] + node % 3});
            }
            ball[k] = ball[k] || std::ranges::any_of(nodes[k], [&](const auto& node) {
                          const Vec<double, 2> at{node[0] * cell_size, node[1] * cell_size};
                          return norm(at - moving.position) < double(moving.shape.radius);
                      });
        });
        for (std::size_t j = 0; j < materials; ++j)
            for (std::size_t k = 0; k < materials; ++k)
                other[j][k] = other[j][k] || (j != k && std::ranges::any_of(nodes[j], [&](const auto& node) {
                                                  return nodes[k].contains(node);
                                              }));
    }
    void check_all() const {
        for_materials([&]<class M>(std::type_identity<M>, std::size_t k) {
            check(ball[k], sentence(M::name, " meets the ball"));
            check(std::ranges::count(other[k], true) > 0,
                  sentence(M::name, " meets ", std::ranges::count(other[k], true), " other materials"));
        });
    }
};

/// What came by a source and went by sinks, in a set.
template <class M>
void check_traffic(const Tank& begin, const Tank& end, bool comes, bool goes) {
    const auto at_first = begin.template set<M>(), now = end.template set<M>();
    const std::size_t came = now.particles().next_id() - at_first.particles().next_id();
    std::size_t old = 0;  // of the particles of the beginning, which no lifespan ends
    for (std::size_t slot = 0; slot < now.particles().slots(); ++slot)
        if (now.particles().is_particle(slot) && now.particles().id(slot) < at_first.particles().next_id()) ++old;
    const std::size_t went = at_first.particles().size() - old, ended = old + came - now.particles().size();
    check((came > 50) == comes && (went > 20) == goes,
          sentence(M::name, ": ", at_first.particles().size(), " particles, ", came, " came, ", went, " + ", ended,
                   " went"));
}

/// That a run goes on from states where it has not begun.
void go_on(Tank& cpu, webgpu::OnGpu<Tank>& gpu) {
    Tank back = tank(true);
    restore_all(back, states_of(gpu));
    auto over = webgpu::on_gpu(tank(true), gpu.device());
    restore_all(over.edit(), states_of(cpu));
    for (int k = 0; k < 20; ++k) cpu.step(), back.step(), over.step(), gpu.step();
    check_same("the tank goes on: ", cpu, gpu);
    check_same("CPU, GPU by states: ", cpu, over);
    const States stayed = states_of(cpu), returned = states_of(back);
    for_materials([&]<class M>(std::type_identity<M>, std::size_t k) {
        check_same_state(sentence("CPU, GPU, CPU by states: ", M::name, ", "), stayed[k], returned[k]);
    });
}

/// A file of numbers. Returns its name.
template <class T>
std::string write_numbers(const std::filesystem::path& folder, const std::string& name, const std::vector<T>& numbers) {
    std::ofstream out(folder / name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(numbers.data()), std::streamsize(numbers.size() * sizeof(T)));
    if (!out.flush()) throw io_error("Cannot write " + (folder / name).string());
    return name;
}
void write_text(const std::filesystem::path& path, const std::string& text) {
    std::ofstream out(path, std::ios::binary);
    out << text;
    if (!out.flush()) throw io_error("Cannot write " + path.string());
}

/// Writes the numbers of all particles of the sets, and their ids, to files that begin with a name.
void write_particles(Json& json, const std::filesystem::path& folder, const std::string& name,
                     const std::array<wgsl::Program, materials>& programs, const Tank& cpu) {
    json.key(name.c_str()).object([&] {
        for_materials([&]<class M>(std::type_identity<M>, std::size_t k) {
            const auto& particles = cpu.template set<M>().particles();
            const wgsl::Inputs inputs = wgsl::make_inputs<2>(programs[k], cpu.domain(), particles, 0);
            std::vector<std::uint32_t> ids;
            for (const std::size_t slot : wgsl::detail::slots_of<2>(particles)) ids.push_back(particles.id(slot));
            json.key(M::name).object([&] {
                const std::string start = name + "_" + M::name + "_";
                json.field("particles", inputs.particles).field("ids", write_numbers(folder, start + "ids", ids));
                for (const auto& [buffer, numbers] : inputs.buffers)
                    if (wgsl::is_of_particles(programs[k].buffer(buffer)))
                        json.field(buffer.c_str(), write_numbers(folder, start + buffer, numbers));
            });
        });
    });
}

/// Writes what sets.mjs runs. The ball stands still, and there are no sinks, which the host in JavaScript leaves to its
/// user. Steps end where bursts are due, at binary fractions of a second, which are exact: a source on the CPU would
/// see the sum of the steps instead.
void write_for_javascript(const std::filesystem::path& folder) {
    Tank cpu = matter_in_tank(true);
    cpu.most_steps_between_sorts = 0;
    auto& ball = std::get<1>(cpu.boundary.parts);
    ball.linear_velocity = {};
    ball.angular_velocity = 0;
    const auto layer = sample_box<2>({0.1, 0.7}, {0.2, 0.7 + spacing}, {.spacing = spacing});
    Source<2> source{.samples = layer, .density = 1000, .velocity = {1, -3}, .rate = 256, .start = 1.0 / 512};
    source.end = 5.0 / 512;
    std::array<wgsl::Program, materials> programs;
    for_materials([&]<class M>(std::type_identity<M>, std::size_t k) {
        programs[k] = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(
            cpu.template set<M>().material(), cpu.boundary, Gravity<float, 2>{cast<float>(cpu.gravity)});
        std::filesystem::create_directories(folder / M::name);
        write_text(folder / M::name / "program.wgsl", programs[k].code);
        write_text(folder / M::name / "manifest.json", wgsl::manifest(programs[k]));
    });
    Json json;
    json.object([&] {
        const Domain<2>& domain = cpu.domain();
        const auto number = [&](double x) { json.value(x); };
        json.key("domain").object([&] {
            json.key("lower").array(domain.lower.v, number).key("upper").array(domain.upper.v, number);
            json.field("cell_size", domain.cell_size);
        });
        json.key("source").object([&] {
            json.field("set", Water::name).field("density", source.density).field("rate", source.rate);
            json.field("start", source.start).field("end", source.end).field("volume", layer.volume);
            json.key("velocity").array(source.velocity.v, number);
            std::vector<double> positions;
            for (const Vec<double, 2>& x : layer.positions) positions.insert(positions.end(), x.v, x.v + 2);
            json.key("position").array(positions, number);
        });
        write_particles(json, folder, "start", programs, cpu);
        constexpr double end = 13.0 / 1024;
        for (; source.time_of(source.bursts) <= source.end; ++source.bursts) {
            cpu.advance(source.time_of(source.bursts) - cpu.time());
            cpu.template set<Water>().add(layer, source.density, source.velocity);
        }
        cpu.advance(end - cpu.time());
        json.field("time", cpu.time()).field("steps", cpu.steps());
        write_particles(json, folder, "end", programs, cpu);
    });
    write_text(folder / "sets.json", json.text());
}

void in_a_tank(bool at_bound, const webgpu::Device& device) {
    constexpr std::uint64_t steps = 200;
    const Tank begin = tank(at_bound);
    Tank cpu = begin;
    auto gpu = webgpu::on_gpu(cpu, device);
    Meetings meetings;
    for (const double duration : {0.0101, 0.0103}) {  // which end in a shortened step
        cpu.advance(duration);
        gpu.advance(duration);
        meetings.see(cpu);
    }
    check(cpu.steps() > 50 && cpu.steps() < steps - 50, "many single steps follow", sentence(cpu.steps()));
    for (; cpu.steps() < steps; meetings.see(cpu)) cpu.step();
    while (gpu.steps() < steps) gpu.step();
    check_same(at_bound ? "a tank, in steps at their bound: " : "a tank: ", cpu, gpu);

    meetings.check_all();
    check_traffic<Water>(begin, cpu, true, true);
    check_traffic<Sand<float>>(begin, cpu, false, true);
    check_traffic<Snow<float>>(begin, cpu, true, false);
    check_traffic<Jelly>(begin, cpu, false, false);
    const auto place = [](const Tank& of) { return std::get<1>(of.boundary.parts).position; };
    check(norm(place(cpu) - place(begin)) > 0.1, "the ball moves");
    if (at_bound) go_on(cpu, gpu);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        if (argc > 1) write_for_javascript(argv[1]);
        const webgpu::Device device;
        for (const bool at_bound : {false, true}) in_a_tank(at_bound, device);
    } catch (const std::exception& e) {
        check(false, "the test", e.what());
    }
    return finish();
}
