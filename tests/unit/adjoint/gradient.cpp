// sanitized: -O1
/// \file Gradients of short runs: closed forms, difference quotients, and the same bits for any number of threads and
/// any memory.
#include "support/gradient_checks.hpp"
#include "support/message.hpp"

using namespace derivatives;

namespace gradient_tests {
namespace {

using Elastic = SimulationWith<2, FixedCorotated<double>>;

Run<Elastic> run_of_jelly() {
    Run<Elastic> run{jelly, walls_of_run<2>()};
    run.dt = 1e-3;
    return run;
}
Elastic falling() {
    Elastic simulation(Domain<2>({0, 0}, {1, 1}, 1. / 16), jelly);
    simulation.add(sample_box(Vec<double, 2>{0.4, 0.5}, Vec<double, 2>{0.6, 0.7}, {.spacing = 1. / 32}), 1000,
                   {0.5, 0});
    simulation.fixed_time_step = 1e-3;
    return simulation;
}

}  // namespace

TEST_CASE("free fall: the derivative of the height by gravity is t (t + dt)/2, by the velocity t", "[adjoint]") {
    Elastic simulation = falling();
    Adjoint adjoint(simulation);
    for (int k = 0; k < 40; ++k) adjoint.step();
    const double t = simulation.time(), dt = 1e-3;
    adjoint.measure([&](const auto& p) { return p.mass * p.position[1]; });
    const auto gradient = adjoint.gradient();
    const double mass = 1000 * double(simulation.particles().size()) / (32 * 32);
    double by_gravity = 0, by_velocity = 0;
    for (const auto& interval : gradient.intervals) by_gravity += interval.gravity[1];
    for (const auto& v : gradient.set().velocity) by_velocity += v[1];
    CHECK(by_gravity / mass == Approx(t * (t + dt) / 2).epsilon(1e-12));
    CHECK(by_velocity / mass == Approx(t).epsilon(1e-12));
    CHECK(gradient.intervals.size() == 40);
    // Each interval has its part: gravity in step k acts for the steps from k on.
    CHECK(gradient.intervals[0].gravity[1] / mass == Approx(dt * t).epsilon(1e-11));
    CHECK(gradient.intervals[39].gravity[1] / mass == Approx(dt * dt).epsilon(1e-11));
    CHECK(simulation.time() == t);
    CHECK(simulation.gravity[1] == -9.81);
}

TEST_CASE("the gradient of a jelly on a wall with friction is the limit of difference quotients", "[adjoint]") {
    check_derivatives(run_of_jelly());
}

TEST_CASE("a gradient has the same bits for any number of threads and any memory", "[adjoint][slow]") {
    const auto of = [](int threads, std::size_t memory) {
        Run<Elastic> run = run_of_jelly();
        Elastic simulation = run.at(0);
        simulation.execution.threads = threads;
        simulation.most_steps_between_sorts = 3;
        simulation.reactions.emplace();
        Adjoint adjoint(simulation, {.memory = memory});
        adjoint.advance(0.02);
        simulation.gravity[0] = 1;
        adjoint.advance(0.011);
        adjoint.measure(Run<Elastic>::measure);
        const auto impulse = simulation.reactions->parts.at(0).impulse;
        const auto gradient = adjoint.gradient();
        CHECK(norm(impulse) > 0);
        CHECK(simulation.reactions->parts.at(0).impulse == impulse);
        std::vector<double> all{gradient.set().material.mu, gradient.set().material.lambda,
                                double(adjoint.steps() == 31)};
        for (const auto& interval : gradient.intervals)
            all.insert(all.end(), {interval.gravity[0], interval.gravity[1]});
        for (const auto& x : gradient.set().position) all.insert(all.end(), {x[0], x[1]});
        for (const auto& v : gradient.set().velocity) all.insert(all.end(), {v[0], v[1]});
        return all;
    };
    const std::vector<double> one = of(1, 1 << 26);
    CHECK(std::count(one.begin(), one.end(), 0.0) < 3);
    for (const int threads : {2, 3, 4, 7}) CHECK(of(threads, 1 << 26) == one);
    for (const std::size_t memory : {300'000, 400'000, 1'500'000}) CHECK(of(2, memory) == one);
}

TEST_CASE("measuring after every step is measuring after each call of step()", "[adjoint]") {
    const auto half = [](const auto& p) { return 0.5 * double(p.id % 2) * p.position[1] * p.velocity[0]; };
    const auto run = [&](bool by_steps) {
        Run<Elastic> made = run_of_jelly();
        made.steps = 7;
        Elastic simulation = made.at(0);
        const Body body = simulation.bodies().front();
        Adjoint adjoint(simulation);
        double sum = adjoint.measure(half, &body);
        if (by_steps) {
            adjoint.measure_steps(half, &body);
            adjoint.advance(7e-3);
        } else {
            for (int k = 0; k < 7; ++k) adjoint.step(), sum += adjoint.measure(half, &body);
            CHECK(sum == adjoint.measured());
        }
        const auto gradient = adjoint.gradient();
        std::vector<double> all{adjoint.measured(), gradient.set().material.mu};
        for (const auto& x : gradient.set().position) all.insert(all.end(), {x[0], x[1]});
        return all;
    };
    const std::vector<double> at_once = run(true), one_by_one = run(false);
    REQUIRE(at_once.size() == one_by_one.size());
    for (std::size_t k = 0; k < at_once.size(); ++k) CHECK(at_once[k] == Approx(one_by_one[k]).epsilon(1e-12));
    CHECK(at_once[1] != 0);
}

TEST_CASE("a program's own measure, between calls and at the end", "[adjoint]") {
    // L = Σ x at 10 steps + ½ Σ v² at 20, by its derivatives, against the same by functions.
    const auto run = [](bool own) {
        Elastic simulation = run_of_jelly().at(0);
        Adjoint adjoint(simulation);
        const auto ids = simulation.particles().next_id();
        for (int k = 0; k < 10; ++k) adjoint.step();
        if (own)
            adjoint.measure_own(std::vector<Vec<double, 2>>(ids, {1, 0}), {});
        else
            adjoint.measure([](const auto& p) { return p.position[0]; });
        for (int k = 0; k < 10; ++k) adjoint.step();
        if (own) {
            std::vector<Vec<double, 2>> velocities(ids);
            for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
                if (simulation.particles().is_particle(slot))
                    velocities[simulation.particles().id(slot)] = simulation.particles().velocity(slot);
            adjoint.measure_own({}, velocities);
        } else {
            adjoint.measure([](const auto& p) {
                using T = std::remove_cvref_t<decltype(p.mass)>;
                return T(0.5) * dot(p.velocity, p.velocity);
            });
        }
        return adjoint.gradient().set();
    };
    const auto by_lists = run(true), by_functions = run(false);
    for (std::size_t id = 0; id < by_lists.position.size(); ++id)
        for (int a = 0; a < 2; ++a)
            CHECK(by_lists.position[id][a] == Approx(by_functions.position[id][a]).epsilon(1e-11));
}

TEST_CASE("check() tells a smooth derivative from a kink", "[adjoint]") {
    Elastic simulation = run_of_jelly().at(0);
    Adjoint adjoint(simulation);
    adjoint.advance(0.005);
    simulation.gravity[0] = 3;
    adjoint.advance(0.005);
    adjoint.measure(Run<Elastic>::measure);
    const auto before = simulation.particles().exact_position(0);
    const auto gradient = adjoint.gradient();
    auto direction = gradient.zero();
    CHECK(gradient.along(direction) == 0);
    Random random(5);
    for (auto& x : direction.set().position) x = Vec<double, 2>{random.uniform(-1, 1), random.uniform(-1, 1)} * 0.03;
    for (auto& v : direction.set().velocity) v = {random.uniform(-1, 1), random.uniform(-1, 1)};
    for (auto& state : direction.set().state)
        for (double& f : state.F.m) f = random.uniform(-0.1, 0.1);
    direction.set().material.mu = 1e4;
    direction.intervals[0].gravity = {3, 5};
    direction.intervals[1].gravity = {-2, 1};
    const DerivativeCheck smooth = adjoint.check(gradient, direction, 1e-5);
    CHECK(smooth.central == Approx(smooth.gradient).epsilon(1e-6));
    CHECK(smooth.forward == Approx(smooth.backward).epsilon(1e-3));
    CHECK(smooth.other_cells == 0);
    CHECK(adjoint.check(gradient, direction, 0.5).other_cells > 10);
    CHECK(simulation.particles().exact_position(0) == before);
    CHECK(simulation.gravity[0] == 3);

    // Matter on a floor may leave it, and cannot enter it: its velocity after a step has a kink at rest.
    Elastic resting(Domain<2>({0, 0}, {1, 1}, 1. / 16), jelly);
    const auto block = sample_box(Vec<double, 2>{0.4, 0}, Vec<double, 2>{0.6, 0.2}, {.spacing = 1. / 32});
    resting.add(block, 1000);
    resting.gravity = {0, 0};
    resting.fixed_time_step = 1e-3;
    Adjoint still(resting);
    still.step();
    still.measure([](const auto& p) { return p.mass * p.velocity[1]; });
    const auto at_rest = still.gradient();
    auto upwards = at_rest.zero();
    for (auto& v : upwards.set().velocity) v = {0, 1};
    const double mass = 1000 * block.volume * double(block.positions.size());
    const DerivativeCheck kink = still.check(at_rest, upwards, 1e-3);
    CHECK(kink.forward == Approx(mass).epsilon(1e-3));
    CHECK(kink.backward < 0.95 * mass);
    CHECK(kink.gradient >= Approx(kink.backward).epsilon(1e-3));
    CHECK(kink.gradient <= Approx(kink.forward).epsilon(1e-3));
}

TEST_CASE("an adjoint warns once of policies that jump", "[adjoint]") {
    const auto warnings = []<class... Policies>(const Policies&... policies) {
        std::vector<std::string> said;
        Simulation simulation(Domain<2>({0, 0}, {1, 1}, 1. / 16), jelly, policies...);
        simulation.add(sample_box(Vec<double, 2>{0.4, 0.4}, Vec<double, 2>{0.6, 0.6}, {.spacing = 1. / 32}), 1000);
        simulation.warn = [&](const std::string& text) { said.push_back(text); };
        Adjoint adjoint(simulation);
        adjoint.advance(1e-3);
        return said;
    };
    CHECK(warnings().empty());
    CHECK(warnings(CubicBSpline{}, WeightGradientForce{}).empty());
    const auto check = [](const std::vector<std::string>& said, const char* text) {
        REQUIRE(said.size() == 1);
        CHECK(said[0].find(text) != std::string::npos);
    };
    check(warnings(Linear{}, WeightGradientForce{}), "the kernel Linear");
    check(warnings(WeightGradientForce{}), "the first that reaches a node");
    check(warnings(Asflip<double>{}), "with ASFLIP");
}

namespace {
/// A floor that sinks, whose motion is for doubles only.
template <class S>
struct Lift {
    S height;
    static constexpr const char* name = "lift";
    static constexpr auto parameters() { return std::tuple{parameter{"height", "m", &Lift::height}}; }
    Vec<S, 2> velocity(const Vec<S, 2>& x, const Vec<S, 2>& v) const {
        return select(x[1] < height, Vec<S, 2>::zero(), v);
    }
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>&) const { return true; }
    Lift advanced(double dt) const
        requires std::same_as<S, double>
    {
        return {height - dt};
    }
};
}  // namespace

TEST_CASE("an adjoint tells what it cannot do", "[adjoint]") {
    using test_support::check_refused;
    Elastic simulation = falling();
    check_refused<parameter_error>([&] { Adjoint adjoint(simulation, {.memory = 1000}); },
                                   "give the adjoint memory for three at least");
    {
        Adjoint adjoint(simulation);
        check_refused<usage_error>([&] { adjoint.gradient(); }, "Nothing was measured");
        const Body unknown{simulation.particles().next_id(), 1};
        check_refused<parameter_error>([&] { adjoint.measure([](const auto& p) { return p.mass; }, &unknown); },
                                       "There is no body");
        adjoint.step();
        check_refused<parameter_error>([&] { adjoint.measure_own(std::vector<Vec<double, 2>>(3), {}); },
                                       "derivatives for 3 particles");
        adjoint.measure([](const auto& p) { return p.mass; });
        simulation.step();
        check_refused<usage_error>([&] { adjoint.step(); }, "without the adjoint");
        check_refused<usage_error>([&] { adjoint.gradient(); }, "without the adjoint");
        check_refused<usage_error>([&] { adjoint.measure([](const auto& p) { return p.mass; }); },
                                   "without the adjoint");
    }
    {
        Adjoint adjoint(simulation);
        simulation.edit_particles();
        check_refused<usage_error>([&] { adjoint.step(); }, "its particles were changed");
    }
    Elastic probed = falling();
    probed.add_pass("probe", "g2p", [](auto&, const auto&) {});
    check_refused<usage_error>([&] { Adjoint adjoint(probed); }, "The pass \"probe\"");
    SimulationWith<2, FixedCorotated<double>, Lift<double>> sinking(Domain<2>({0, 0}, {1, 1}, 1. / 16), jelly,
                                                                    Lift<double>{0.1});
    check_refused<usage_error>([&] { Adjoint adjoint(sinking); }, "advanced() is not a template over the scalar");
    Elastic loaded = falling();
    loaded.add_load({0, 1}, [](const Vec<double, 2>&, double) { return Vec<double, 2>{1, 0}; });
    check_refused<usage_error>([&] { Adjoint adjoint(loaded); }, "firn::differentiable_load");
}

}  // namespace gradient_tests
