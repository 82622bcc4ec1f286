// quick: no
/// \file Domains far from 0: a run in map coordinates has the bits of the same run at 0, in float, too. What gets
/// metres is refused where a float has too few digits for them.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/message.hpp"
#include "support/scenes.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/field/attraction.hpp>
#include <firn/field/damped.hpp>
#include <firn/firn.hpp>

using namespace firn;
using test_support::holds;
using test_support::message;

namespace far_domain_tests {

constexpr double h = 1.0 / 16;

/// A cube of triangles.
TriangleMesh cube(const Vec<double, 3>& lower, double side) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.vertices.push_back(lower + Vec<double, 3>{double(i & 1), double(i >> 1 & 1), double(i >> 2)} * side);
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

struct Seen {
    std::uint64_t hash;
    std::vector<Reaction<3>> parts;
    Vec<double, 3> momentum;
};

/// Matter between walls, a ball that moves and turns, a slope and a solid; drawn to a point, damped. Cells of a metre.
template <class S, class Solid>
Seen run(const Vec<double, 3>& corner, const Solid& solid) {
    const Domain<3> domain{corner, corner + Vec<double, 3>::filled(16), 1};
    const auto walls = Walls<S, 3>::all(domain.lower, domain.upper, {Contact::separate, 0.3});
    const Collider<Sphere<S, 3>> ball{.shape = {S(2)},
                                      .friction = 0.2,
                                      .position = corner + Vec<double, 3>{4, 12, 8},
                                      .linear_velocity = {0, -16, 0},
                                      .angular_velocity = {0, 0, 3}};
    const Collider<HalfSpace<S, 3>> slope{.shape = {{S(0.6), S(0.8), S(0)}},
                                          .position = corner + Vec<double, 3>{0, 8, 0}};
    Simulation simulation(domain, FixedCorotated<S>::from_young_poisson(S(1e6), S(0.3)),
                          Together(walls, solid, ball, BoundaryList<Collider<HalfSpace<S, 3>>>{{slope}}));
    simulation.warn = {};
    simulation.add(sample_box<3>(corner + Vec<double, 3>{2, 7, 2}, corner + Vec<double, 3>{15.5, 10, 14},
                                 {.spacing = test_support::fewer_if_quick(0.5, 1.0)}),
                   1000, {8, -32, 0});
    simulation.reactions.emplace();
    simulation.fixed_time_step = 1.0 / 1024;
    const Attraction<S, 3> field{{S(0), S(-9.81), S(0)}, corner + Vec<double, 3>::filled(4), {}, S(16), S(80)};
    for (int i = 0; i < 40; ++i) simulation.step(Damped<S, 3, Attraction>{field, S(0.5)});
    scenes::Hash bits;
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
        if (simulation.particles().is_particle(slot)) {
            bits.add(simulation.particles().place(slot).v, 3);
            bits.add(simulation.particles().velocity(slot).v, 3);
        }
    return {bits.value, simulation.reactions->parts, simulation.totals().momentum};
}

}  // namespace far_domain_tests

using namespace far_domain_tests;

TEMPLATE_TEST_CASE("a run in map coordinates has the bits of the same run at 0", "[far_domains]",
                   FIRN_TEST_PRECISIONS) {
    using S = TestType;
    const Vec<double, 3> none{}, far{500'000, 4'600'000, -1024};  // double has all positions exactly
    const auto solid = [](const Vec<double, 3>& corner) {
        return Collider<Capsule<S, 3>>{.shape = {S(2), S(1)}, .position = corner + Vec<double, 3>{8, 4, 8}};
    };
    const Seen at_0 = run<S>(none, solid(none)), there = run<S>(far, solid(far));
    CHECK(at_0.hash == there.hash);
    REQUIRE(at_0.parts.size() == 4);
    for (std::size_t k = 0; k < 4; ++k) {
        const auto &a = at_0.parts[k], &b = there.parts[k];
        CAPTURE(k);
        CHECK(norm(a.impulse) > 0);
        CHECK(norm(a.impulse - b.impulse) == 0);
        // Torques are about the parts' positions; that of walls is 0, far away. A double knows 1e-9 m there.
        const Vec<double, 3> arm = k == 0 ? far : none;
        CHECK(norm(b.angular_impulse - a.angular_impulse - cross(arm, a.impulse)) <= 1e-8 * norm(a.impulse));
    }
}

TEMPLATE_TEST_CASE("a mesh in map coordinates is where it is", "[far_domains]", FIRN_TEST_PRECISIONS) {
    using S = TestType;
    const auto rock = [](const Vec<double, 3>& corner) {
        return Collider<DistanceGrid<S, 3>>{
            .shape = {mesh_distance(cube(corner + Vec<double, 3>{6, 2, 6}, 4), {.spacing = 0.5, .band = 4})}};
    };
    const Vec<double, 3> none{}, far{500'000, 4'600'000, -1024};
    const Seen at_0 = run<S>(none, rock(none)), there = run<S>(far, rock(far));
    CHECK(norm(at_0.parts[1].impulse) > 0);
    CHECK(norm(at_0.parts[1].impulse - there.parts[1].impulse) <= 1e-3 * norm(at_0.parts[1].impulse));
    CHECK(norm(at_0.momentum - there.momentum) <= 1e-5 * norm(at_0.momentum));
    // As it turns about its origin, far away, so does its surface.
    auto turning = rock(far);
    turning.angular_velocity = {0, 0, 1e-6};
    const auto here = turning.measured_from(far);
    const Vec<S, 3> x{S(8), S(4), S(8)};
    CHECK(norm(cast<double>(here.surface_velocity(x)) - cross({0, 0, 1e-6}, far + cast<double>(x))) <= 1e-6);
}

namespace far_domain_tests {
struct Ceiling {  // of a user, in metres
    double height;
    template <class P>
    Vec<P, 2> velocity(const Vec<P, 2>& x, const Vec<P, 2>& v) const {
        Vec<P, 2> after = v;
        after[1] = select(x[1] >= P(height), min(v[1], P(0)), v[1]);
        return after;
    }
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>& upper) const { return upper[1] >= height; }
};

template <class S, class Boundary, class Acceleration>
double highest(const Vec<double, 2>& corner, const Boundary& boundary, const Acceleration& acceleration) {
    Simulation simulation(Domain<2>{corner, corner + Vec<double, 2>{1, 1}, h}, FixedCorotated<S>{}, boundary);
    simulation.warn = {};
    simulation.add(
        sample_box<2>(corner + Vec<double, 2>{0.25, 0.25}, corner + Vec<double, 2>{0.5, 0.5}, {.spacing = h / 2}), 1000,
        {0, 2});
    simulation.advance(0.2, acceleration);
    double top = 0;
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
        if (simulation.particles().is_particle(slot))
            top = std::max(top, simulation.particles().exact_position(slot)[1] - corner[1]);
    return top;
}
}  // namespace far_domain_tests

TEST_CASE("a boundary and a field of one's own get metres, and are refused where float has too few digits",
          "[far_domains]") {
    const Vec<double, 2> none{0, 0}, near{8, -4}, far{20'000, 20'000};
    const auto ceiling = [](const Vec<double, 2>& corner) { return Ceiling{corner[1] + 0.6}; };
    // Free, it would rise to 0.9 m.
    const double at_0 = highest<float>({0, 0}, ceiling({0, 0}), none);
    CHECK(at_0 < 0.65);
    CHECK(std::abs(highest<float>(near, ceiling(near), none) - at_0) <= 1e-5);
    CHECK(std::abs(highest<double>(far, ceiling(far), none) - at_0) <= 1e-4);
    const auto upwards = [](double from) {  // 20 m/s² above a height, else 0
        return [from](const auto& x) {
            using V = std::remove_cvref_t<decltype(x)>;
            using P = std::remove_cvref_t<decltype(x[0])>;
            V a = V::zero();
            a[1] = select(x[1] >= P(from), P(-20), P(0));
            return a;
        };
    };
    const NoBoundary open{};
    const double turned = highest<float>({0, 0}, open, upwards(0.6));
    CHECK(turned < 0.85);
    CHECK(std::abs(highest<float>(near, open, upwards(near[1] + 0.6)) - turned) <= 1e-4);
    for (const std::string& text : {message<parameter_error>([&] { highest<float>(far, ceiling(far), none); }),
                                    message<parameter_error>([&] { highest<float>(far, open, upwards(0)); })}) {
        CAPTURE(text);
        CHECK(holds(text, "of your own gets positions up to 20001 m"));
        CHECK(holds(text, "last digit there is 0.001953125 m"));
        CHECK(holds(text, "by minus (20000, 20000) m"));
    }
    // A vector, a field of firn's and walls need no digits.
    CHECK_NOTHROW(highest<float>(far, Walls<float, 2>::all(far, far + Vec<double, 2>{1, 1}, {}),
                                 Gravity<float, 2>{{0.0F, -1.0F}}));
}
