/// \file What a run is warned of: each once, when it happens, with what to do. And that good runs are not.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/message.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/gap_contact.hpp>
#include <firn/firn.hpp>

using namespace firn;
using test_support::holds;
using test_support::message;

namespace {

/// Keeps what a simulation warns of.
template <class Simulation>
std::vector<std::string>& listen(Simulation& simulation, std::vector<std::string>& said) {
    simulation.warn = [&said](const std::string& text) { said.push_back(text); };
    return said;
}
std::size_t count(const std::vector<std::string>& said, const std::string& part) {
    return std::size_t(std::count_if(said.begin(), said.end(), [&](const auto& text) { return holds(text, part); }));
}

/// A block in the middle, of samples two a cell and axis, and more options.
template <int D>
Samples<D> block(double from, double to, double spacing = 1.0 / 64, Pattern pattern = Pattern::lattice) {
    return sample_box<D>(Vec<double, D>::filled(from), Vec<double, D>::filled(to),
                         {.spacing = spacing, .pattern = pattern});
}

}  // namespace

TEST_CASE("a bound that falls by a thousand is warned of once, and what ends the run names particle, step and cause") {
    // Jelly thrown against a wall at 170 times the speed of its waves: warnings come within 230 steps, the end in
    // 2,400.
    Simulation<2> simulation({{0.0, 0.0}, {2.0, 1.0}, 1.0 / 32});
    std::vector<std::string> said;
    listen(simulation, said);
    simulation.add(sample_box<2>({1.75, 0.05}, {1.95, 0.25}, {.spacing = 1.0 / 64}), 1000, {2000.0, 0.0});
    double largest = 0;
    const std::string end = message<particle_error>([&] {
        for (int i = 0; i < 200'000; ++i) {
            const double bound = simulation.stable_time_step();
            largest = std::max(largest, bound);
            const std::size_t before = said.size();
            simulation.step();
            if (bound < 1e-3 * largest) REQUIRE(count(said, "has fallen to ") == 1);  // at once
            if (bound > 1e-3 * largest && bound > 1e-6) REQUIRE(said.size() == before);
        }
    });
    CAPTURE(end, said);
    CHECK(count(said, "has fallen to ") == 1);
    CHECK(said.size() <= 2);  // that steps are very small may be said before
    for (const std::string& text : {end, said.back()}) {
        CHECK(holds(text, "t step "));  // At step, at step
        CHECK(holds(text, "It is set by particle "));
        CHECK(holds(text, " with velocity ("));
        CHECK(holds(text, "J = "));
        CHECK(holds(text, "travel at 11.6"));  // sqrt((λ + 2 μ) / ρ) of E = 1e5 Pa, ν = 0.3
        CHECK(holds(text, "take a stiffer material, lower speeds"));
    }
    CHECK(holds(end, sentence("At step ", simulation.steps())));
    CHECK(holds(end, "too small to change the time"));
}

TEST_CASE("a bound that needs more than a million steps a second is warned of once") {
    for (const double young : {1e5, 1e12}) {
        Simulation<2> simulation({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32},
                                 FixedCorotated<float>::from_young_poisson(young, 0.3));
        std::vector<std::string> said;
        listen(simulation, said);
        simulation.add(block<2>(0.4, 0.6), 1000);
        for (int i = 0; i < 5; ++i) simulation.step();
        CHECK(said.size() == (young > 1e6 ? 1U : 0U));
        CHECK(count(said, "a second takes ") == said.size());
        CHECK(count(said, "It is set by particle ") == said.size());
    }
}

TEST_CASE("a time step so far above the bound that no number says how far is warned of once, and ends the run") {
    Simulation<2> simulation({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32});
    std::vector<std::string> said;
    simulation.add(block<2>(0.4, 0.6), 1000);
    simulation.fixed_time_step = 1e306;  // the bound is some ms: the ratio overflows
    simulation.warn = [&](const std::string& text) {
        said.push_back(text);
        if (said.size() > 10) throw std::runtime_error("warned again and again");
    };
    CHECK_THROWS_AS(simulation.step(), particle_error);
    REQUIRE(said.size() == 1);
    CHECK(holds(said[0], "s is inf times the bound"));
}

TEST_CASE("what else sets the bound is named, too") {
    Simulation simulation(Domain<2>{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32}, FixedCorotated<float>{}, Coloured{},
                          Collider<Sphere<float, 2>>{.linear_velocity = {2e5, 0.0}});
    std::vector<std::string> said;
    listen(simulation, said);
    simulation.add(block<2>(0.4, 0.6), 1000);
    simulation.step();
    CAPTURE(said);
    CHECK(count(said, "It is set by the boundary, which moves at up to 200000 m/s.") == 1);
}

TEMPLATE_TEST_CASE_SIG("a body whose particles lie further apart than a cell is warned of when it is added", "",
                       ((int D), D), 2, 3) {
    Simulation<D> simulation({Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 32});
    std::vector<std::string> said;
    listen(simulation, said);
    simulation.add(block<D>(0.1, 0.3, 1.0 / 32), 1000);  // one a cell is enough
    CHECK(said.empty());
    simulation.add(block<D>(0.4, 0.6, 1.0 / 30), 1000);
    REQUIRE(said.size() == 1);
    CHECK(holds(said[0], "particle_spacing<"));
    CHECK(holds(said[0], sentence(1.0 / 64)));
    simulation.add(block<D>(0.7, 0.9, 1.0 / 20), 1000);
    CHECK(said.size() == 1);
}

TEMPLATE_TEST_CASE_SIG("bodies that overlap are warned of, those that touch are not", "", ((int D), D),
                       FIRN_TEST_FIRST_1(2, 3)) {
    const auto warned = [](const Samples<D>& one, const Samples<D>& other) {
        using Two = Materials<FixedCorotated<float>, NeoHookean<float>>;
        std::size_t overlapping[2];
        for (const bool of_two_materials : {false, true}) {
            Simulation<D, Two> simulation({Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 32});
            std::vector<std::string> said;
            listen(simulation, said);
            simulation.template set<0>().add(one, 1000);
            if (of_two_materials)
                simulation.template set<1>().add(other, 1000);
            else
                simulation.template set<0>().add(other, 1000);
            simulation.step();
            simulation.step();
            overlapping[of_two_materials] = count(said, "overlap");
            CHECK(said.size() == overlapping[of_two_materials]);
        }
        CHECK(overlapping[0] == overlapping[1]);
        return overlapping[0] == 1;
    };
    const double s = 1.0 / 64;
    const auto box = [&](double from, double to, double spacing, Pattern pattern) {
        Vec<double, D> lower = Vec<double, D>::filled(0.3), upper = Vec<double, D>::filled(D == 2 ? 0.5 : 0.4);
        lower[0] = from;
        upper[0] = to;
        return sample_box<D>(lower, upper, {.spacing = spacing, .pattern = pattern});
    };
    for (const Pattern pattern : {Pattern::lattice, Pattern::jittered, Pattern::poisson_disk}) {
        CAPTURE(int(pattern));
        CHECK(warned(box(0.1, 0.3, s, pattern), box(0.2, 0.4, s, pattern)));
        CHECK(warned(box(0.1, 0.3, s, pattern), box(0.2, 0.4, 0.8 * s, pattern)));
        CHECK(warned(block<D>(0.2, 0.5), sample_sphere<D>(Vec<double, D>::filled(0.3), 0.1, {.spacing = s})));
        for (const double shift : {0.0, 0.3 * s, 0.5 * s})  // against each other
            CHECK_FALSE(warned(box(0.1, 0.3 - shift, s, pattern), box(0.3, 0.4, s, pattern)));
        CHECK_FALSE(warned(box(0.1, 0.3, s, pattern), box(0.3, 0.4, 0.8 * s, pattern)));
        CHECK_FALSE(warned(box(0.1, 0.2, s, pattern), box(0.4, 0.5, s, pattern)));
    }
}

TEST_CASE("matter inside a solid, and walls that are not the domain's, are warned of before the first step") {
    using Solids = BoundaryList<Collider<Sphere<float, 2>>>;
    using Both = Together<Walls<float, 2>, Solids>;
    const Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32};
    const auto run = [&](double centre, float upper) {
        const Solids solids{{{.shape = {0.1F}, .position = {centre, 0.5}}}};
        Simulation simulation(domain, FixedCorotated<float>{}, Coloured{},
                              Both(Walls<float, 2>::all({0.0F, 0.0F}, {1.0F, upper}, {}), solids));
        std::vector<std::string> said;
        listen(simulation, said);
        simulation.add(block<2>(0.4, 0.6), 1000);
        for (int i = 0; i < 3; ++i) simulation.step();
        return said;
    };
    CHECK(run(0.8, 1.0F).empty());
    CHECK(run(0.701, 1.0F).empty());  // against it
    const auto inside = run(0.65, 1.0F);
    REQUIRE(inside.size() == 1);
    // By hand: in the lattice from 0.4 + 1/128 on, those within 0.1 − 0.1/32 of (0.65, 0.5).
    int expected = 0;
    for (int i = 0; i < 13; ++i)
        for (int j = 0; j < 13; ++j)
            expected +=
                std::hypot(0.4 + (i + 0.5) * 0.2 / 13 - 0.65, 0.4 + (j + 0.5) * 0.2 / 13 - 0.5) < 0.1 - 0.1 / 32;
    CHECK(holds(inside[0], sentence(expected, " of 169 particles lie inside a solid")));
    CHECK(holds(inside[0], "Move the body or the solid"));
    const auto walls = run(0.8, 0.875F);
    REQUIRE(walls.size() == 1);
    CHECK(holds(walls[0], "the walls reach from (0, 0) m to (1, 0.875) m"));
    CHECK(holds(walls[0], "the domain from (0, 0) m to (1, 1) m"));
    CHECK(run(0.65, 0.875F).size() == 2);
}

TEST_CASE("walls between planes of nodes are warned of, with the nearest cell size that fits") {
    const auto said_of = [](const auto& domain, const auto& boundary) {
        Simulation simulation(domain, FixedCorotated<float>{}, boundary);
        std::vector<std::string> said;
        listen(simulation, said);
        simulation.add(sample_box<2>(domain.lower + Vec<double, 2>{0.4, 0.4}, domain.lower + Vec<double, 2>{0.5, 0.5},
                                     {.spacing = domain.cell_size / 2}),
                       1000);
        simulation.step();
        simulation.step();
        return said;
    };
    const auto box = [](const Domain<2>& domain) {
        return Walls<float, 2>::all(domain.lower, domain.upper, {Contact::separate, 0});
    };
    const Domain<2> whole{{0, 0}, {1, 1}, 1.0 / 32}, third{{0, 0}, {1, 1}, 0.03}, nearly{{0, 0}, {1, 1}, 0.033333};
    CHECK(said_of(whole, box(whole)).empty());
    CHECK(said_of(nearly, box(nearly)).empty());  // 30.0003 cells
    const auto said = said_of(third, box(third));
    REQUIRE(said.size() == 1);  // once
    CHECK(holds(said[0],
                "the wall at 1 m along axis 0 stands 0.333333333 cells from the nearest plane of nodes, at 0.99 m"));
    CHECK(holds(said[0], "The nearest cell size that fits all walls is 0.0303030303 m (now 0.03 m)"));
    // 0.7 and 1 are multiples of 0.1/3, not of 1/33.
    const Domain<2> oblong{{-3, 2}, {-2, 2.7}, 0.03};
    CHECK(count(said_of(oblong, Together(Collider<Sphere<float, 2>>{.position = {-9, -9}}, box(oblong))),
                "fits all walls is 0.0333333333 m") == 1);
    const Domain<2> odd{{0, 0}, {1, 0.712345}, 0.03};
    CHECK(count(said_of(odd, box(odd)), "No cell size near 0.03 m fits all walls") == 1);
    auto open = box(third);
    open.at_upper = {Wall{Contact::none, 0}, Wall{Contact::none, 0}};
    CHECK(said_of(third, open).empty());                    // nothing stands there
    CHECK(said_of(third, GapContact{box(third)}).empty());  // acts where it stands
    auto inner = box(whole);
    inner.lower = {0.2, 0.25};
    CHECK(count(said_of(whole, inner), "the wall at 0.2 m along axis 0 stands 0.4 cells from") == 1);
}

TEST_CASE("positions that have too few digits in float are warned of") {
    for (const bool far : {false, true}) {
        const Vec<double, 2> corner = far ? Vec<double, 2>{5e5, 4.6e6} : Vec<double, 2>{500, 460};
        Simulation<2> simulation({corner, corner + Vec<double, 2>{10, 10}, 0.5});
        std::vector<std::string> said;
        listen(simulation, said);
        simulation.add(sample_box<2>(corner + Vec<double, 2>{2, 2}, corner + Vec<double, 2>{4, 4}, {.spacing = 0.25}),
                       1000);
        simulation.step();
        CHECK(said.size() == std::size_t(far));
        CHECK(count(said, "positions of up to 4600010 m") == std::size_t(far));
        CHECK(count(said, "whose last digit there is 0.5 m, with cells of 0.5 m") == std::size_t(far));
    }
}

TEST_CASE("matter that comes to an end of the domain without a wall is warned of once") {
    // A block thrown at the upper end of x, over a floor of its own: what has walls there bounces.
    const auto said_in = [](const auto& boundary, bool periodic) {
        Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32};
        domain.periodic[0] = periodic;
        Simulation simulation(domain, FixedCorotated<float>{}, boundary);
        simulation.gravity = {};
        std::vector<std::string> said;
        listen(simulation, said);
        simulation.add(block<2>(0.6, 0.8), 1000, {5.0, 0.0});
        simulation.advance(0.1);
        return said;
    };
    const Collider<HalfSpace<float, 2>> floor{};
    const auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {});
    auto open = walls;
    open.at_upper[0].contact = Contact::none;
    CHECK(said_in(walls, false).empty());
    CHECK(said_in(Together(floor, walls), false).empty());
    CHECK(said_in(floor, true).empty());
    for (const auto& said : {said_in(floor, false), said_in(open, false), said_in(Together(floor, open), false)}) {
        REQUIRE(said.size() == 1);
        CHECK(holds(said[0], "has come to the end of the domain, at (1, 0."));
        CHECK(holds(said[0], "firn::Together(firn::Walls"));
    }
}

TEST_CASE("nobody is warned where nobody listens, and the bits are the same") {
    Simulation<2> heard({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32}), deaf({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32});
    std::vector<std::string> said;
    listen(heard, said);
    deaf.warn = nullptr;
    for (auto* simulation : {&heard, &deaf}) {
        simulation->add(block<2>(0.3, 0.5), 1000);
        simulation->add(block<2>(0.4, 0.6), 1000);
        for (int i = 0; i < 20; ++i) simulation->step();
    }
    CHECK(said.size() == 1);
    for (std::size_t slot = 0; slot < heard.particles().slots(); ++slot)
        if (heard.particles().is_particle(slot))
            REQUIRE(heard.particles().exact_position(slot) == deaf.particles().exact_position(slot));
}
