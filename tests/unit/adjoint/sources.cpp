// quick: no
// sanitized: no
/// \file The gradient through runs in which particles come and go, against difference quotients.
#include "support/gradient_checks.hpp"
#include "support/message.hpp"

using namespace derivatives;

namespace source_gradient_tests {
namespace {

constexpr double dt = 1e-3;
constexpr int steps = 31;

/// What may change.
struct Start {
    double mu = jelly.mu, lambda = jelly.lambda, velocity = 1, gravity = -9.81, jet = -3, density = 800;
};
constexpr double age = 0.7 * dt;  ///< of particles when they come in
const SamplingOptions lattice{.spacing = 1. / 32, .pattern = Pattern::lattice};

/// A source whose layers come in a little before the ends of steps 3, 8, …, and are taken away 16 steps later.
Source<2> source_of(const Start& start) {
    return {.samples = sample_box(Vec<double, 2>{0.3, 0.41}, Vec<double, 2>{0.5, 0.45}, lattice),
            .density = start.density,
            .velocity = {0.1, start.jet},
            .rate = 0.2 / dt,
            .start = 3 * dt - age,
            .lifespan = 16 * dt};
}
/// A block flies into a sink and is hit by what a source pours on it.
SimulationWith<2, FixedCorotated<double>> made(const Start& start) {
    SimulationWith<2, FixedCorotated<double>> simulation(
        Domain<2>({0, 0}, {1, 1}, 1. / 16), FixedCorotated<double>{start.mu, start.lambda}, {}, walls_of_run<2>());
    simulation.fixed_time_step = dt;
    simulation.gravity[1] = start.gravity;
    simulation.warn = {};
    simulation.add(sample_box(Vec<double, 2>{0.32, 0.2}, Vec<double, 2>{0.55, 0.4}, lattice), 1000,
                   {start.velocity, 0.1});
    simulation.add_source(source_of(start));
    simulation.add_sink({.lower = {0.5404, 0}, .upper = {0.7, 0.33}});
    return simulation;
}

/// What is measured of each particle at the end, and after each step.
constexpr auto at_end = [](const auto& p) {
    return p.mass * dot(p.velocity, p.velocity) + (p.position[0] + p.state.F(0, 1)) * double(1 + p.id % 3);
};
constexpr auto each_step = [](const auto& p) { return p.position[1] * p.velocity[0] * 0.1; };

template <class Set, class Function>
double sum_of(const Set& set, const Function& f) {
    using State = material_state_t<std::remove_cvref_t<decltype(set.material())>, 2>;
    double sum = 0;
    for (const std::uint32_t slot : slots_by_id(set.particles(), 1))
        sum += f(firn::detail::measured<double, 2, State>(set.particles(), slot, [](double x) { return x; }));
    return sum;
}
template <class Set>
void add_ids(const Set& set, std::vector<std::uint32_t>& all) {
    for (const std::uint32_t slot : slots_by_id(set.particles(), 1)) all.push_back(set.particles().id(slot));
}

}  // namespace

TEST_CASE("adjoints follow their particles, whichever come and go", "[adjoint]") {
    using State = material_state_t<FixedCorotated<double>, 2>;
    using View = decltype(std::declval<Particles<double, 2, State>&>().view());
    firn::detail::ParticleAdjoints<double, 2> bars;
    std::vector<double> of(100);  // for each id, the adjoint of one number
    const auto follow = [&](const aligned_vector<std::uint32_t>& order, std::uint32_t next_id) {
        bars.follow(field_table<double, 2, State>(), order, next_id, 1);
        std::vector<double> now(of.size());
        const View view = bars.view<View>();
        for (std::size_t slot = 0; slot < order.size(); ++slot) {
            const std::uint32_t id = order[slot];
            REQUIRE(*view.stress.at(slot, 1) == (id == no_particle ? 0 : of[id]));
            REQUIRE(*view.state[0].at(slot, 3) == (id == no_particle ? 0 : -of[id]));
            if (id == no_particle) continue;
            now[id] = *view.stress.at(slot, 1) += 1 + id;
            *view.state[0].at(slot, 3) -= 1 + id;
        }
        of = now;  // of others, nothing is known any more
    };
    const auto list = [](std::uint32_t first, std::uint32_t last) {
        aligned_vector<std::uint32_t> order;
        for (std::uint32_t id = first; id < last; ++id) order.push_back(id);
        order.resize((order.size() + pack_size - 1) / pack_size * pack_size, no_particle);
        return order;
    };
    follow(list(1, pack_size), 90);
    follow(list(0, pack_size), 90);  // the first one appears, and the others move by one
    follow(list(0, 70), 80);
    follow(list(0, 0), 80);
    follow(list(5, 50), 60);
    Random random(3);
    for (int k = 0; k < 200; ++k) {
        std::vector<std::uint32_t> ids;
        for (std::uint32_t id = 0; id < 60; ++id)
            if (random.uniform(0, 1) < 0.7) ids.push_back(id);
        for (std::size_t i = ids.size(); i-- > 1;)
            if (k % 3 > 0) std::swap(ids[i], ids[std::size_t(random.uniform(0, double(i)))]);
        aligned_vector<std::uint32_t> order(ids.begin(), ids.end());
        order.resize((order.size() + pack_size - 1) / pack_size * pack_size, no_particle);
        follow(order, 60);
    }
}

TEST_CASE("a gradient goes back through sources, sinks and lifespans", "[adjoint]") {
    const Start start;
    std::vector<std::uint32_t> ids;  // of the particles after each step
    std::size_t most = 0;
    const auto value = [&](const Start& of, bool is_first = false) {
        auto simulation = made(of);
        std::vector<std::uint32_t> now;
        double sum = 0;
        for (int k = 0; k < steps; ++k) {
            simulation.step();
            sum += sum_of(simulation, each_step);
            add_ids(simulation, now);
            most = std::max(most, simulation.particles().size());
        }
        if (is_first) ids = now;
        REQUIRE(now == ids);
        return sum + sum_of(simulation, at_end);
    };
    const double plain = value(start, true);

    auto simulation = made(start);
    const std::uint32_t of_block = simulation.particles().next_id();
    Adjoint adjoint(simulation);
    adjoint.measure_steps(each_step);
    adjoint.advance(10 * dt);
    adjoint.advance(21 * dt);
    adjoint.measure(at_end);
    CHECK(adjoint.steps() == steps);
    CHECK(adjoint.measured() == Approx(plain).epsilon(1e-13));
    const std::uint32_t next_id = simulation.particles().next_id();
    CHECK(next_id > of_block + 30);
    CHECK(simulation.particles().size() < next_id - 18);
    std::size_t left_of_block = 0;
    for (const std::uint32_t slot : slots_by_id(simulation.particles(), 1))
        left_of_block += std::size_t(simulation.particles().id(slot) < of_block);
    CHECK(left_of_block < of_block);  // the sink has taken some
    CHECK(left_of_block > of_block / 2);

    const auto gradient = adjoint.gradient();
    const auto& of = gradient.set();
    REQUIRE(of.velocity.size() == next_id);
    double velocity = 0, jet = 0, density = 0;
    for (std::uint32_t id = 0; id < next_id; ++id)
        if (id < of_block)
            velocity += of.velocity[id][0];
        else
            jet += of.velocity[id][1] + age * of.position[id][1], density += of.mass[id] / (32 * 32);
    double gravity = 0;
    for (const auto& interval : gradient.intervals) gravity += interval.gravity[1];
    const std::tuple<double Start::*, double, const char*> all[] = {
        {&Start::mu, of.material.mu, "mu"},       {&Start::lambda, of.material.lambda, "lambda"},
        {&Start::velocity, velocity, "velocity"}, {&Start::gravity, gravity, "gravity"},
        {&Start::jet, jet, "velocity of source"}, {&Start::density, density, "density of source"}};
    for (const auto& [number, got, name] : all) {
        CAPTURE(name);
        check_slope(got, start.*number, [&, member = number](double t) {
            Start other = start;
            other.*member += t;
            return value(other);
        });
    }
}

TEST_CASE("a gradient through sources and sinks has the same bits for any number of threads and any memory",
          "[adjoint]") {
    std::vector<std::size_t> checkpoints;
    const auto of = [&](int threads, std::size_t memory) {
        auto simulation = made({});
        simulation.execution.threads = threads;
        simulation.most_steps_between_sorts = 7;
        Adjoint adjoint(simulation, {.memory = memory});
        adjoint.measure_steps(each_step);
        adjoint.advance(10 * dt);
        adjoint.advance(21.5 * dt);
        adjoint.measure(at_end);
        const auto gradient = adjoint.gradient();
        checkpoints.push_back(adjoint.checkpoints());
        const auto& set = gradient.set();
        std::vector<double> all{adjoint.measured(), set.material.mu, set.material.lambda};
        for (const auto& interval : gradient.intervals)
            all.insert(all.end(), {interval.gravity[0], interval.gravity[1]});
        for (const auto& x : set.position) all.insert(all.end(), {x[0], x[1]});
        for (const auto& v : set.velocity) all.insert(all.end(), {v[0], v[1]});
        for (const auto& state : set.state) all.insert(all.end(), state.F.m, state.F.m + 4);
        all.insert(all.end(), gradient.position_norm.begin(), gradient.position_norm.end());
        return all;
    };
    const std::vector<double> one = of(1, 1 << 26);
    CHECK(of(3, 1 << 26) == one);
    for (const std::size_t memory : {110'000, 200'000, 500'000}) CHECK(of(1, memory) == one);
    CHECK(of(3, 110'000) == one);
    CHECK(checkpoints[0] > steps);
    CHECK(checkpoints[2] < 4);
}

TEST_CASE("a step with an adjoint is the step without, to the bit, where particles come and go", "[adjoint]") {
    auto plain = made({}), recorded = made({});
    plain.fixed_time_step = recorded.fixed_time_step = 0;
    Adjoint adjoint(recorded);
    for (int k = 0; k < steps; ++k) {
        plain.step();
        adjoint.step();
        REQUIRE(recorded.time() == plain.time());
        const auto &a = plain.particles(), &b = recorded.particles();
        const auto slots = slots_by_id(a, 1), others = slots_by_id(b, 1);
        REQUIRE(slots.size() == others.size());
        for (std::size_t i = 0; i < slots.size(); ++i) {
            REQUIRE(a.id(slots[i]) == b.id(others[i]));
            REQUIRE(a.exact_position(slots[i]) == b.exact_position(others[i]));
            REQUIRE(a.velocity(slots[i]) == b.velocity(others[i]));
        }
    }
}

TEST_CASE("check() changes particles when they come in, and tells which go at another step", "[adjoint]") {
    auto simulation = made({});
    const std::uint32_t of_block = simulation.particles().next_id();
    Adjoint adjoint(simulation);
    adjoint.measure_steps(each_step);
    adjoint.advance(steps * dt);
    adjoint.measure(at_end);
    const auto gradient = adjoint.gradient();
    auto direction = gradient.zero();
    Random random(5);
    for (std::uint32_t id = of_block; id < direction.set().velocity.size(); ++id) {
        direction.set().velocity[id] = {random.uniform(-1, 1), random.uniform(-1, 1)};
        direction.set().position[id] = Vec<double, 2>{random.uniform(-1, 1), random.uniform(-1, 1)} * 0.003;
        direction.set().mass[id] = random.uniform(-0.1, 0.1);
        for (double& f : direction.set().state[id].F.m) f = random.uniform(-0.02, 0.02);
    }
    const DerivativeCheck newcomers = adjoint.check(gradient, direction, 1e-5);
    CHECK(newcomers.gradient != 0);
    CHECK(newcomers.central == Approx(newcomers.gradient).epsilon(1e-6));
    CHECK(newcomers.other_cells == 0);

    auto faster = gradient.zero();
    for (std::uint32_t id = 0; id < of_block; ++id) faster.set().velocity[id] = {1, 0};
    const DerivativeCheck of_block_only = adjoint.check(gradient, faster, 1e-5);
    CHECK(of_block_only.central == Approx(of_block_only.gradient).epsilon(1e-6));
    CHECK(of_block_only.other_cells == 0);
    // Faster by a tenth, a column comes to the sink one or two steps earlier.
    CHECK(adjoint.check(gradient, faster, 0.05).other_cells >= 4);

    adjoint.step();
    adjoint.measure(at_end);
    test_support::check_refused<usage_error>([&] { adjoint.check(gradient, direction, 1e-5); },
                                             "not of the steps recorded so far");
    const auto later = adjoint.gradient();
    auto heavier = later.zero();
    for (double& m : heavier.set().mass) m = 1;
    const DerivativeCheck one_more = adjoint.check(later, heavier, 1e-5);
    CHECK(one_more.central == Approx(one_more.gradient).epsilon(1e-6));
}

namespace {
using Two = SimulationWith<2, Materials<FixedCorotated<double>, Fluid<double>>, Flip<double>>;

/// Drops fall on a block, and are gone soon: at first and at last there are none.
Two splash(double viscosity, double velocity, double jet) {
    const auto water = Fluid<double>::from_properties({.bulk = 1e5, .viscosity = viscosity, .tension = 1e3});
    Two simulation(Domain<2>({0, 0}, {1, 1}, 1. / 16), Materials{jelly, water}, {}, walls_of_run<2>());
    simulation.fixed_time_step = dt;
    simulation.warn = {};
    simulation.set<0>().add(sample_box(Vec<double, 2>{0.32, 0.2}, Vec<double, 2>{0.55, 0.4}, lattice), 1000,
                            {velocity, 0});
    auto source = source_of({.jet = jet});
    source.lifespan = 8 * dt;
    source.end = 14 * dt;
    simulation.set<1>().add_source(source);
    return simulation;
}
}  // namespace

TEST_CASE("a gradient goes back through a material whose particles all come and go", "[adjoint]") {
    constexpr double viscosity = 20;
    const auto measure = [](const auto& p) { return p.mass * dot(p.velocity, p.velocity) + 3 * p.position[1]; };
    const auto value = [&](double nu, double velocity, double jet) {
        Two simulation = splash(nu, velocity, jet);
        double sum = 0;
        for (int k = 0; k < 24; ++k) {
            simulation.step();
            sum += sum_of(simulation.set<1>(), measure);
        }
        return sum + sum_of(simulation.set<0>(), measure);
    };
    Two simulation = splash(viscosity, 1, -3);
    Adjoint adjoint(simulation);
    adjoint.measure_steps<1>(measure);
    adjoint.advance(24 * dt);
    adjoint.measure<0>(measure);
    CHECK(simulation.set<1>().particles().size() == 0);
    CHECK(simulation.set<1>().particles().next_id() >= 18);
    CHECK(adjoint.measured() == Approx(value(viscosity, 1, -3)).epsilon(1e-13));
    const auto gradient = adjoint.gradient();
    double velocity = 0, jet = 0;
    for (const auto& v : gradient.set<0>().velocity) velocity += v[0];
    const auto& drops = gradient.set<1>();
    for (std::size_t id = 0; id < drops.velocity.size(); ++id)
        jet += drops.velocity[id][1] + age * drops.position[id][1];
    check_slope(drops.material.viscosity, viscosity, [&](double t) { return value(viscosity + t, 1, -3); });
    check_slope(velocity, 1, [&](double t) { return value(viscosity, 1 + t, -3); });
    check_slope(jet, 3, [&](double t) { return value(viscosity, 1, -3 + t); });
}

TEST_CASE("an adjoint with sources and sinks tells what it cannot do", "[adjoint]") {
    using test_support::check_refused;
    auto simulation = made({});
    {
        Adjoint adjoint(simulation, {.memory = 80'000});
        check_refused<parameter_error>([&] { adjoint.advance(0.1); }, "give the adjoint memory for three at least");
        check_refused<usage_error>([&] { adjoint.step(); }, "without the adjoint");
    }
    simulation = made({});
    Adjoint adjoint(simulation);
    adjoint.advance(5 * dt);
    simulation.add_sink({.lower = {0, 0}, .upper = {1, 1}});
    check_refused<usage_error>([&] { adjoint.step(); }, "was added after the adjoint was made");

    // The last particles go: what was measured before still has its derivatives.
    SimulationWith<2, FixedCorotated<double>> emptied(Domain<2>({0, 0}, {1, 1}, 1. / 16), jelly);
    emptied.fixed_time_step = dt;
    emptied.gravity = {0, 0};
    emptied.add(sample_box(Vec<double, 2>{0.4, 0.4}, Vec<double, 2>{0.5, 0.5}, lattice), 1000, {0, -10});
    emptied.add_sink({.lower = {0, 0}, .upper = {1, 0.3}});
    Adjoint last(emptied);
    last.measure_steps([](const auto& p) { return p.position[1]; });
    last.advance(20 * dt);
    CHECK(emptied.particles().size() == 0);
    const auto gradient = last.gradient();
    double by_velocity = 0;
    for (const auto& v : gradient.set().velocity) by_velocity += v[1];
    // Each particle was measured at the ends of the steps before the one in which it came to the sink.
    CHECK(by_velocity > 9 * dt * (1 + 9) / 2 * 9);
}

}  // namespace source_gradient_tests
