/// \file A simulation is made from the policies that its program chooses, in any order; the others are the defaults.
#include "support/catch.hpp"
#include "support/share_of_apic.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/firn.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/lagrangian.hpp>

using namespace firn;
using test_support::ShareOfApic;

namespace policies_tests {
namespace {

template <class A, class B>
constexpr bool same = std::same_as<A, B>;

template <class V>
concept has_z = requires(V v) { v.z(); };

using Jelly = FixedCorotated<float>;
using Ball = Collider<Sphere<float, 2>>;
const Domain<2> box{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16};

/// A boundary of a user's own, outside of firn.
struct Lid {
    float height = 0.5F;
    static constexpr auto parameters() { return std::tuple{parameter{"height", "m", &Lid::height}}; }
    template <class S, int D>
    Vec<S, D> velocity(const Vec<S, D>& x, Vec<S, D> v) const {
        v[1] = select(x[1] >= S(height), min(v[1], S(0)), v[1]);
        return v;
    }
    template <int D>
    bool reaches(const Vec<double, D>&, const Vec<double, D>& upper) const {
        return upper[1] >= double(height);
    }
    template <class S>
    Lid lifted() const {
        return *this;
    }
};

/// A boundary with data, but without a list of parameters.
struct Ceiling {
    double height = 0.5;
    template <class S, int D>
    Vec<S, D> velocity(const Vec<S, D>& x, Vec<S, D> v) const {
        v[1] = select(x[1] >= S(height), min(v[1], S(0)), v[1]);
        return v;
    }
    template <int D>
    bool reaches(const Vec<double, D>&, const Vec<double, D>& upper) const {
        return upper[1] >= height;
    }
};

/// A boundary that pushes every node that it reaches with a force along x [N].
template <class S>
struct Pushing {
    S force = S(0.5), from = S(0.5);
    static constexpr auto parameters() {
        return std::tuple{parameter{"force", "N", &Pushing::force}, parameter{"from", "m", &Pushing::from}};
    }
    template <int D>
    Vec<S, D> velocity(const Vec<S, D>& x, Vec<S, D> v, const S& mass, const S& dt) const {
        v[0] = select(x[1] >= from, v[0] + force * dt / mass, v[0]);
        return v;
    }
    template <int D>
    bool reaches(const Vec<double, D>&, const Vec<double, D>& upper) const {
        return upper[1] >= double(from);
    }
};

}  // namespace

TEST_CASE("Policies are named in any order, and what is not named is the default") {
    const Jelly jelly;
    const auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::slip, 0});
    const Ball ball{.shape = {0.25F}};

    const Simulation by_default(box, jelly);
    static_assert(same<decltype(by_default), const Simulation<2, Jelly>>);
    CHECK(by_default.boundary.upper == Vec<double, 2>(1, 1));
    CHECK(by_default.boundary.at_upper[0].contact == Contact::separate);

    const Simulation in_order(box, jelly, Coloured{3}, Together(walls, ball));
    const Simulation boundary_alone(box, jelly, Together(walls, ball));
    using Solids = Together<Walls<float, 2>, Ball>;
    static_assert(same<decltype(in_order), const SimulationWith<2, Jelly, Solids>>);
    static_assert(same<decltype(boundary_alone), decltype(in_order)>);
    static_assert(same<SimulationWith<2, Jelly, Solids>,
                       Simulation<2, Jelly, Apic, MlsForce, QuadraticBSpline, Coloured, Solids>>);
    CHECK(in_order.execution.threads == 3);
    CHECK(std::get<1>(boundary_alone.boundary.parts).shape.radius == 0.25F);

    const Simulation all(box, jelly, Flip{0.5F}, CubicBSpline{}, ball, WeightGradientForce{}, FixedPoint<>{2});
    static_assert(
        same<decltype(all),
             const SimulationWith<2, Jelly, Ball, FixedPoint<>, Flip<float>, WeightGradientForce, CubicBSpline>>);
    static_assert(same<decltype(all),
                       const Simulation<2, Jelly, Flip<float>, WeightGradientForce, CubicBSpline, FixedPoint<>, Ball>>);
    CHECK(all.transfer.ratio == 0.5F);
    CHECK(all.execution.threads == 2);
    CHECK(all.boundary.shape.radius == 0.25F);

    // The default walls are those of the domain, none across a periodic axis; given ones are taken.
    Domain<2> tube = box;
    tube.periodic[0] = true;
    const Simulation threads_alone(tube, Jelly{}, detail::Serial{});
    CHECK(threads_alone.boundary.at_lower[0].contact == Contact::none);
    CHECK(threads_alone.boundary.at_lower[1].contact == Contact::separate);
    CHECK(Simulation(tube, jelly, walls).boundary.at_lower[0].contact == Contact::slip);
    static_assert(same<decltype(Simulation(box, Materials(jelly, Snow<float>{}), ball, Pic{})),
                       SimulationWith<2, Materials<Jelly, Snow<float>>, Pic, Ball>>);
}

TEST_CASE("What does not fit is seen among the parts of a boundary, also beside one that does not say what it is for") {
    using detail::boundary_fits;
    using Own = Walls<float, 2>;
    static_assert(boundary_fits<Lid, float, 2>::value && boundary_fits<Together<Lid>, float, 2>::value);
    static_assert(boundary_fits<Together<Lid, Own, Ball>, float, 2>::value);
    static_assert(!boundary_fits<Together<Lid, Walls<double, 2>>, float, 2>::value);
    static_assert(!boundary_fits<Together<Lid, Together<Lid, Walls<float, 3>>>, float, 2>::value);
    static_assert(!boundary_fits<Together<Own, Lid, Collider<Sphere<double, 2>>>, float, 2>::value);
    static_assert(!boundary_fits<BoundaryList<Collider<Sphere<float, 3>>>, float, 2>::value);
    static_assert(detail::made_for<Together<Lid, Own>>::D == 2);
}

TEST_CASE("A boundary of a user's own is told from other policies, and acts") {
    Simulation simulation(box, Jelly{}, Together(Walls<float, 2>::all({0, 0}, {1, 1}, {}), Lid{0.6F}));
    simulation.gravity = {};
    simulation.add(sample_box<2>({0.3, 0.3}, {0.5, 0.5}, {.spacing = 1.0 / 32}), 1000, {0.0, 1.0});
    double highest = 0;
    while (simulation.time() < 0.3) {
        simulation.step();
        const auto& particles = simulation.particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) highest = std::max(highest, particles.exact_position(slot)[1]);
    }
    CHECK(highest < 0.66);  // free it would be at 0.8
    CHECK(highest > 0.55);
}

TEST_CASE("A boundary may act with a force: it is told the mass of a node and the time step") {
    // Each node with matter from y = 0.5 on gets the impulse F dt, whatever its mass, and whoever else is beside.
    const auto walls = Walls<float, 2>::all({-1, 0}, {1, 1}, {});
    const Domain<2> here{{-1.0, 0.0}, {1.0, 1.0}, 1.0 / 16};
    const auto check = [&](auto boundary, std::size_t part, double force = 0.5) {
        Simulation simulation(here, Jelly{}, boundary, CoulombContact{});
        simulation.gravity = {};
        simulation.fixed_time_step = 1e-3;
        const Body low = simulation.add(sample_box<2>({0.3, 0.3}, {0.5, 0.5625}, {.spacing = 1.0 / 32}), 1000);
        simulation.add(sample_box<2>({0.3, 0.5625}, {0.5, 0.75}, {.spacing = 1.0 / 32}), 1000);
        simulation.set_contact_group(low, 1);
        simulation.reactions.emplace();
        simulation.step();
        int nodes = 0;  // of both groups: each has a node of its own
        const auto& grid = simulation.grid();
        for (std::size_t b = 0; b < grid.block_count(); ++b)
            for (int i = 0; i < block_nodes<2>; ++i)
                nodes += position_of_place(grid.domain(), grid.block(b), 1, i & (block_size - 1)) >= 0.5 &&
                         grid.nodes(b)[i * node_width + node_mass] > 0;
        CHECK(nodes > 40);
        CHECK(simulation.reactions->parts[part].impulse[0] == Approx(force * 1e-3 * nodes).epsilon(1e-5));
        CHECK(simulation.totals().momentum[0] == Approx(0.5e-3 * nodes).epsilon(1e-4));
        CHECK(std::abs(simulation.reactions->parts[part].impulse[1]) < 1e-9);
    };
    check(Pushing<float>{}, 0);
    check(Together(walls, Pushing<float>{}), 1);
    check(BoundaryList<Pushing<float>>{{{0.2F}, {0.3F}}}, 1, 0.3);
}

TEST_CASE("A transfer may have parameters of its own, in what a particle keeps of its affine field") {
    const auto moved = [](auto transfer, int steps) {
        Simulation simulation(box, Jelly{}, transfer);
        simulation.add(sample_box<2>({0.3, 0.3}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000, {0.4, 0.1});
        simulation.fixed_time_step = 1e-3;
        simulation.set_states(simulation.bodies()[0], [](const auto& x, auto& state) {
            state.F = Mat<float, 2>::rows(1 + 0.1F * float(x[0]), 0.02F, 0, 1 - 0.05F * float(x[1]));
        });
        for (int i = 0; i < steps; ++i) simulation.step();
        return state_of(simulation);
    };
    const auto field = [](const State<float>& state, const char* name) {
        return std::ranges::find(state.fields, name, &StateField<float>::name)->values;
    };
    const State<float> apic = moved(Apic{}, 20), all = moved(ShareOfApic<float>{1}, 20);
    CHECK(field(all, "position") == field(apic, "position"));
    CHECK(field(all, "deformation_gradient") == field(apic, "deformation_gradient"));
    // One step from the same start: half of C, and the same velocity gradient.
    const State<float> once = moved(Apic{}, 1), half = moved(ShareOfApic<float>{}, 1);
    auto C = field(once, "affine_velocity");
    for (float& c : C) c *= 0.5F;
    CHECK(field(half, "affine_velocity") == C);
    CHECK(*std::ranges::max_element(C) > 0.1F);
    CHECK(field(half, "deformation_gradient") == field(once, "deformation_gradient"));
    const auto parameters = moved(ShareOfApic<float>{0.25F}, 0).parameters;
    const auto share = std::ranges::find(parameters, "share", &StateParameter::name);
    REQUIRE(share != parameters.end());
    CHECK(share->group == "transfer");
    CHECK(share->values == std::vector<double>{0.25});
}

TEST_CASE("A state is written of boundaries without parameters, and says that it cannot tell their data") {
    const Simulation simulation(box, Jelly{}, Together(Walls<float, 2>::all({0, 0}, {1, 1}, {}), Ceiling{}));
    std::vector<std::string> names;
    for_parameters(simulation.boundary,
                   [&](const std::string& name, const char*, const auto&) { names.push_back(name); });
    CHECK(names == std::vector<std::string>{"0_lower", "0_upper"});
    auto run = simulation;
    run.add(sample_box<2>({0.25, 0.25}, {0.5, 0.5}, {.spacing = 1.0 / 32}), 1000);
    CHECK(state_of(run).dimension == 2);
    const auto unseen = detail::settings_of<0>(run).unseen;
    CHECK(unseen == std::vector<std::string>{"boundary_1"});
}

TEST_CASE("A particle system is made from its boundary") {
    const auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::slip, 0});
    const Ball ball{.shape = {0.25F}};
    ParticleSystem alone(ball);
    static_assert(same<decltype(alone), ParticleSystem<2, float, Verlet, Ball>>);
    const ParticleSystem both(Together(walls, ball));
    static_assert(same<decltype(both), const ParticleSystem<2, float, Verlet, Together<Walls<float, 2>, Ball>>>);
    const ParticleSystem in_double(Walls<double, 3>::all({0, 0, 0}, {1, 1, 1}, {}));
    static_assert(same<decltype(in_double), const ParticleSystem<3, double, Verlet, Walls<double, 3>>>);
    const ParticleSystem copy(alone);
    static_assert(same<decltype(copy), const ParticleSystem<2, float, Verlet, Ball>>);
    CHECK(std::get<1>(both.boundary.parts).shape.radius == 0.25F);
}

TEST_CASE("Vectors name their components") {
    Vec<float, 3> a{1, 2, 3};
    a.y() = 5;
    const Vec<float, 3> b = a;
    CHECK(b.x() == 1);
    CHECK(b.y() == 5);
    CHECK(b.z() == 3);
    static_assert(has_z<Vec<float, 3>> && !has_z<Vec<float, 2>>);
}

}  // namespace policies_tests
