// quick: no
// sanitized: no
/// \file The gradient through loads, against difference quotients.
#include "support/gradient_checks.hpp"
#include "support/message.hpp"

using namespace derivatives;

namespace loads_gradient_tests {
namespace {

/// A spring between a particle and an anchor, whose stiffness swings.
template <class T>
struct Spring {
    T stiffness, rest, frequency;
    Vec<T, 2> anchor;
    static constexpr auto parameters() {
        return std::tuple{parameter{"stiffness", "N/m", &Spring::stiffness}, parameter{"rest", "m", &Spring::rest},
                          parameter{"frequency", "1/s", &Spring::frequency}, parameter{"anchor", "m", &Spring::anchor}};
    }
    Vec<T, 2> operator()(const Vec<T, 2>& x, double time) const {
        const Vec<T, 2> d = x - anchor;
        const T length = norm(d);
        return d * (stiffness * (rest / length - T(1)) * (T(1) + T(0.5) * sin(frequency * T(time))));
    }
};
/// A force that is the same for all particles.
template <class T, int D>
struct Thrust {
    Vec<T, D> force;
    static constexpr auto parameters() { return std::tuple{parameter{"force", "N", &Thrust::force}}; }
    Vec<T, D> operator()(const Vec<T, D>&, double) const { return force; }
};
constexpr auto wind = [](const auto& x, double time) { return x * (40 * dot(x, x) * time) - x * 20.0; };
constexpr auto shake = [](const auto&, double time) { return Vec<double, 2>{5 * std::cos(300 * time), 3}; };

using Jelly = SimulationWith<2, FixedCorotated<double>>;
using Direction = Gradient<Jelly>;
const std::array<Spring<double>, 2> springs{Spring<double>{300, 0.2, 200, {0.6, 0.5}},
                                            Spring<double>{500, 0.3, 350, {0.1, 0.6}}};

/// A run of two bodies in two intervals: a spring pulls the first body, another in each interval; and two forces
/// without parameters.
struct TwoIntervals {
    int steps = 3;
    std::size_t memory = 1 << 26;
    int threads = 1;
    bool sorts = false;

    Jelly start() const {
        Run<Jelly> run{jelly, walls_of_run<2>()};
        run.dt = 1e-3;
        Jelly simulation = run.at(0);
        simulation.add(sample_box(Vec<double, 2>{0.4, 0.1}, Vec<double, 2>{0.6, 0.3},
                                  {.spacing = 1. / 32, .pattern = Pattern::lattice}),
                       800, {-2, 0.5});
        simulation.execution.threads = threads;
        simulation.reactions.emplace();
        if (sorts) simulation.most_steps_between_sorts = 3;
        return simulation;
    }
    /// Takes the steps of an interval, after the loads were changed. \param advance  advance(duration) takes steps
    template <class Advance>
    void take(Jelly& simulation, std::size_t interval, const Spring<double>& spring, const Advance& advance) {
        const std::vector<Body>& bodies = simulation.bodies();
        if (interval == 1) {
            simulation.remove_load(pull);
            simulation.remove_load(blow);
        }
        pull = simulation.add_load(bodies.at(0), differentiable_load(spring));
        if (interval == 0) {
            blow = simulation.add_load(Body{0, simulation.particles().next_id()}, differentiable_load(wind));
            simulation.add_load(bodies.at(1), differentiable_load(shake));
        }
        advance(steps * 1e-3);
    }
    /// Calls visit(gradient, adjoint, simulation) for the gradient of the run.
    template <class Visit>
    void with_gradient(const Visit& visit) {
        Jelly simulation = start();
        Adjoint adjoint(simulation, {.memory = memory});
        adjoint.measure(Run<Jelly>::measure);
        for (std::size_t k = 0; k < 2; ++k) {
            take(simulation, k, springs[k], [&](double duration) { adjoint.advance(duration); });
            adjoint.measure(Run<Jelly>::measure);
        }
        visit(adjoint.gradient(), adjoint, simulation);
    }
    /// The same measure of a run without an Adjoint that begins at t times a direction from start().
    double value(const Direction& direction, double t) {
        Jelly simulation = start();
        const auto measured = [&] { return Adjoint(simulation).measure(Run<Jelly>::measure); };
        auto& particles = simulation.edit_particles();
        const auto& by = direction.set();
        for (const std::uint32_t slot : slots_by_id(particles, 1)) {
            const std::uint32_t id = particles.id(slot);
            particles.set_position(slot, particles.exact_position(slot) + by.position[id] * t);
            particles.set_velocity(slot, particles.velocity(slot) + by.velocity[id] * t);
            particles.set_mass(slot, particles.mass(slot) + by.mass[id] * t);
        }
        double sum = measured();
        for (std::size_t k = 0; k < 2; ++k) {
            auto spring = springs[k];
            const auto& load = direction.intervals.at(k).loads.at(k == 0 ? 0 : 1);
            std::size_t next = 0;
            firn::detail::for_reals(spring, [&](double& number) { number += t * load.parameters.at(next++).second; });
            take(simulation, k, spring, [&](double duration) { simulation.advance(duration); });
            sum += measured();
        }
        return sum;
    }
    /// Compares a gradient along a direction with differences, those of check() and those of value().
    void check_along(const Direction& gradient, Adjoint<Jelly>& adjoint, const Direction& direction) {
        const double got = gradient.along(direction);
        CHECK(got != 0);
        double least = std::numeric_limits<double>::infinity(), least_of_check = least;
        for (const double h : {1e-3, 1e-4, 1e-5, 1e-6}) {
            const double wanted = difference_quotient([&](double t) { return value(direction, t); }, h),
                         by_check = (4 * adjoint.check(gradient, direction, h).central -
                                     adjoint.check(gradient, direction, 2 * h).central) /
                                    3;
            least = std::min(least, std::abs(got - wanted) / std::abs(wanted));
            least_of_check = std::min(least_of_check, std::abs(got - by_check) / std::abs(by_check));
        }
        CAPTURE(got);
        CHECK(least < 1e-6);
        CHECK(least_of_check < 1e-6);
    }

    LoadId pull{}, blow{};  ///< loads that are removed
};

}  // namespace

TEST_CASE("gradients through loads are the limits of difference quotients", "[adjoint]") {
    TwoIntervals run;
    run.with_gradient([&](const Direction& gradient, Adjoint<Jelly>& adjoint, Jelly& simulation) {
        Random random(7);
        const auto check = [&](const char* name, const auto& change) {
            CAPTURE(name);
            Direction direction = gradient.zero();
            change(direction);
            run.check_along(gradient, adjoint, direction);
        };
        check("position", [&](Direction& by) {
            for (auto& x : by.set().position) x = Vec<double, 2>{random.uniform(-1, 1), random.uniform(-1, 1)} * 0.03;
        });
        check("velocity", [&](Direction& by) {
            for (auto& v : by.set().velocity) v = {random.uniform(-1, 1), random.uniform(-1, 1)};
        });
        check("mass", [&](Direction& by) {
            for (double& m : by.set().mass) m = random.uniform(-0.5, 0.5);
        });
        REQUIRE(gradient.intervals.size() == 2);
        const auto& last = gradient.intervals[1].loads;
        REQUIRE(last.size() == 2);  // the force without parameters that was added third, and the new spring
        CHECK(last[0].load == LoadId{0, 2});
        CHECK(last[0].parameters.empty());
        CHECK(last[1].load == LoadId{0, 3});
        for (std::size_t interval = 0; interval < 2; ++interval) {
            const std::size_t at = interval == 0 ? 0 : 1;
            const auto& of = gradient.intervals[interval].loads[at].parameters;
            REQUIRE(of.size() == 5);
            CHECK(of[2].first == "frequency");
            CHECK(of[4].first == "anchor[1]");
            for (std::size_t k = 0; k < of.size(); ++k) {
                const double size = k == 0 ? 100 : k == 2 ? 50 : 0.05;
                CAPTURE(interval);
                check(of[k].first.c_str(),
                      [&](Direction& by) { by.intervals[interval].loads[at].parameters[k].second = size; });
            }
        }
        // The simulation has its loads again.
        simulation.step();
        CHECK(norm(simulation.reactions->of({0, 3}).impulse) > 0);
        CHECK(simulation.reactions->loads.size() == 2);
    });
}

TEST_CASE("thrust: the derivative of the momentum is N t, of the moment of mass N t (t + dt)/2", "[adjoint]") {
    Simulation simulation(Domain<3>({0, 0, 0}, {1, 1, 1}, 1. / 8), FixedCorotated<float>{1e4f, 1e4f});
    const Body body = simulation.add(
        sample_box<3>({0.3, 0.3, 0.3}, {0.6, 0.6, 0.6}, {.spacing = 1. / 16, .pattern = Pattern::lattice}), 1000);
    simulation.fixed_time_step = 0x1p-9;
    simulation.add_load(body, differentiable_load(Thrust<float, 3>{{1, 2, 3}}));
    Adjoint adjoint(simulation);
    for (int k = 0; k < 8; ++k) adjoint.step();
    adjoint.measure([](const auto& p) { return p.mass * (p.velocity[2] + 100 * p.position[1]); });
    const auto gradient = adjoint.gradient();
    Vec<double, 3> sum{};
    for (const auto& interval : gradient.intervals)
        for (int a = 0; a < 3; ++a) sum[a] += interval.loads.at(0).parameters.at(std::size_t(a)).second;
    const double count = body.count, t = simulation.time(), dt = 0x1p-9;
    CHECK(sum[2] == Approx(count * t).epsilon(1e-4));
    CHECK(sum[1] == Approx(100 * count * t * (t + dt) / 2).epsilon(1e-4));
    CHECK(std::abs(sum[0]) < 1e-4 * count * t);
}

TEST_CASE("steps with a load and their way back are transposes of each other", "[adjoint]") {
    const auto check = []<class Simulation>(Run<Simulation> run) {
        run.dt = 0x1p-10;
        Simulation simulation = run.at(0);
        simulation.add_load(simulation.bodies().front(), differentiable_load(springs[0]));
        tangent::check_transposed(simulation, 12, 4, springs[0]);
    };
    check(Run<Jelly>{jelly, walls_of_run<2>()});
    check(Run<SimulationWith<2, FixedCorotated<double>, Aflip<double>>>{jelly, walls_of_run<2>()});
}

TEST_CASE("gradients through loads have the same bits for any number of threads and any memory", "[adjoint]") {
    const auto of = [](int threads, std::size_t memory) {
        TwoIntervals run{.steps = 12, .memory = memory, .threads = threads, .sorts = true};
        std::vector<double> all;
        run.with_gradient([&](const Direction& gradient, Adjoint<Jelly>& adjoint, Jelly&) {
            CHECK(adjoint.steps() == 24);
            if (memory < 1'000'000) CHECK(std::ranges::max(adjoint.repetitions()) > 1);
            firn::detail::for_gradient(gradient, [&](const double& number) { all.push_back(number); });
        });
        return all;
    };
    const std::vector<double> one = of(1, 1 << 26);
    CHECK(of(3, 1 << 26) == one);
    CHECK(of(1, 200'000) == one);
    CHECK(of(3, 250'000) == one);
}

TEST_CASE("a load that begins later leaves the states that are kept as they were", "[adjoint]") {
    const auto of = [](std::size_t memory) {
        Jelly simulation = TwoIntervals{}.start();
        const Body body = simulation.bodies().front();
        Adjoint adjoint(simulation, {.memory = memory});
        for (int k = 0; k < 24; ++k) {
            if (k == 9) simulation.add_load(body, differentiable_load(wind));
            adjoint.step();
        }
        adjoint.measure(Run<Jelly>::measure);
        std::vector<double> all;
        const Direction gradient = adjoint.gradient();
        firn::detail::for_gradient(gradient, [&](const double& number) { all.push_back(number); });
        if (memory < 1'000'000) CHECK(std::ranges::max(adjoint.repetitions()) > 0);
        return all;
    };
    const std::vector<double> all_kept = of(1 << 26);
    for (const std::size_t memory : {200'000, 230'000, 260'000, 300'000, 400'000}) CHECK(of(memory) == all_kept);
}

TEST_CASE("an adjoint refuses loads of doubles, and says what to do", "[adjoint]") {
    const auto pull = [](const Vec<double, 2>& x, double) { return x * -1.0; };
    TwoIntervals run;
    Jelly simulation = run.start();
    const Body body = simulation.bodies().front();
    Adjoint adjoint(simulation);
    adjoint.step();
    const LoadId differentiable = simulation.add_load(body, differentiable_load(wind));
    adjoint.step();
    const LoadId load = simulation.add_load(body, pull);
    test_support::check_refused<usage_error>([&] { adjoint.step(); }, "firn::differentiable_load");
    test_support::check_refused<usage_error>([&] { Adjoint other(simulation); }, "Load 1 of material 0");
    simulation.remove_load(load);
    simulation.remove_load(differentiable);
    adjoint.step();
    adjoint.measure([](const auto& p) { return p.velocity[0]; });
    const auto gradient = adjoint.gradient();
    CHECK(gradient.intervals[0].loads.empty());
    CHECK(gradient.intervals[1].loads.size() == 1);
    CHECK(gradient.intervals[2].loads.empty());
}

}  // namespace loads_gradient_tests
