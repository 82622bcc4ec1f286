// quick: no
// sanitized: no
/// \file The gradient where walls and colliders act, against difference quotients.
#include "support/gradient_checks.hpp"
#include "support/message.hpp"

using namespace derivatives;

namespace boundaries_gradient_tests {
namespace {

template <int D, class Boundary>
void check(const Boundary& boundary) {
    Run<SimulationWith<D, FixedCorotated<double>, Boundary>> run{jelly, boundary};
    run.dt = 1e-3;
    run.boundary_changes = false;
    check_derivatives(run);
}
Collider<Sphere<double, 2>> ball(Contact contact) {
    Collider<Sphere<double, 2>> ball;
    ball.shape.radius = 0.1;
    ball.position = {0.4, 0.1};
    ball.contact = contact;
    ball.friction = 0.2;
    return ball;
}

template <int D>
using Plank = Collider<Box<double, D>>;
template <int D>
Plank<D> moving_plank() {
    Plank<D> plank;
    plank.shape.half_extents = Vec<double, D>::filled(0.06);
    plank.shape.half_extents[0] = 0.1;
    plank.position = Vec<double, D>::filled(0.12);
    plank.position[0] = D == 2 ? 0.35 : 0.22;
    plank.contact = Contact::slip;
    plank.friction = 0.2;
    plank.linear_velocity[0] = -1, plank.linear_velocity[1] = 0.3;
    if constexpr (D == 2) {
        plank.rotation = rotor(degrees(20));
        plank.angular_velocity = 3;
    } else {
        plank.rotation = rotor({1, 2, 3}, degrees(20));
        plank.angular_velocity = {1, -2, 3};
    }
    return plank;
}
/// Numbers of a plank that may be changed one by one. Those of its rotation may not.
template <int D, class OfPlank, class F>
void for_motion(OfPlank& plank, const F& f) {
    for (auto& number : plank.position.v) f(number);
    for (auto& number : plank.linear_velocity.v) f(number);
    if constexpr (D == 2)
        f(plank.angular_velocity);
    else
        for (auto& number : plank.angular_velocity.v) f(number);
    f(plank.friction);
}
/// Checks the derivatives by the motion of a plank, of a run that is recorded by three calls. What does not move has a
/// derivative for each interval; what moves has one by its start.
/// \param set  sets the plank before the third call;  \param goes_on  whether the plank moves on from where it was
template <int D, class Boundary, class OfPlank, class Set>
void check_motion(const Boundary& boundary, const OfPlank& of_plank, bool goes_on, const Set& set) {
    Run<SimulationWith<D, FixedCorotated<double>, Boundary>> run{jelly, boundary};
    run.dt = 1e-3;
    run.boundary_changes = false;
    const auto take = [&](auto& simulation, const auto& step) {
        for (int k = 0; k < 6; ++k) {
            if (k == 4) set(of_plank(simulation.boundary));
            step(k);
        }
    };
    auto simulation = run.at(0);
    Adjoint adjoint(simulation);
    take(simulation, [&](int k) {
        if (k == 0) adjoint.advance(3e-3);
        if (k > 2) adjoint.step();
    });
    adjoint.measure(decltype(run)::measure);
    const auto gradient = adjoint.gradient();
    REQUIRE(adjoint.steps() == 6);
    std::vector<double> total;
    for (std::size_t i = 0; i < gradient.intervals.size(); ++i) {
        std::size_t next = 0;
        auto of = gradient.intervals[i].boundary;
        for_motion<D>(of_plank(of), [&](double number) {
            const bool is_place = next < std::size_t(D);
            if (i == 0) total.push_back(0);
            if (i == 0 || !is_place) total[next] += number;
            ++next;
        });
    }
    const auto value = [&](std::size_t wanted, double change) {
        auto other = run.at(0);
        std::size_t next = 0;
        for_motion<D>(of_plank(other.boundary), [&](double& number) { number += next++ == wanted ? change : 0; });
        take(other, [&](int) { other.step(); });
        Adjoint after(other);
        return after.measure(decltype(run)::measure);
    };
    for (std::size_t k = 0; k < total.size(); ++k) {
        CAPTURE(k);
        const double wanted = difference_quotient([&](double change) { return value(k, change); }, 1e-6);
        CHECK(total[k] == Approx(wanted).epsilon(1e-6).margin(1e-9));
        CHECK(std::abs(total[k]) > 1e-4);
    }
    auto whole = run;
    whole.dt = 0x1p-10;
    tangent::check_transposed(whole.at(0), 12, 2);
    // check() moves the plank on from where it is, too.
    auto direction = gradient.zero();
    double along = 0.3;
    for (auto& interval : direction.intervals)
        for_motion<D>(of_plank(interval.boundary), [&](double& number) { number = 0.1 * (along = -along + 0.01); });
    const DerivativeCheck check = adjoint.check(gradient, direction, 1e-5);
    if (goes_on) CHECK(check.gradient == Approx(check.central).epsilon(1e-6));
}

}  // namespace

TEST_CASE("gradients with walls of every contact", "[adjoint]") {
    for (const Contact contact : {Contact::stick, Contact::slip, Contact::separate, Contact::none})
        check<2>(walls_of_run<2>(contact, 0.2));
}
TEST_CASE("gradients with colliders beside walls, by the friction of a collider, too", "[adjoint]") {
    for (const Contact contact : {Contact::stick, Contact::slip, Contact::separate}) {
        const Together both(walls_of_run<2>(), ball(contact));
        check<2>(both);
        if (contact == Contact::stick) continue;
        using Both = std::remove_const_t<decltype(both)>;
        Run<SimulationWith<2, FixedCorotated<double>, Both>> run{jelly, both};
        run.dt = 1e-3;
        run.boundary_changes = false;
        const auto at = [&](double friction) {
            auto other = run;
            std::get<1>(other.boundary.parts).friction = friction;
            return other.value(0);
        };
        auto simulation = run.at(0);
        Adjoint adjoint(simulation);
        adjoint.advance(3e-3);
        adjoint.measure(decltype(run)::measure);
        const double got = std::get<1>(adjoint.gradient().intervals[0].boundary.parts).friction;
        CHECK(got == Approx((at(0.2 + 1e-5) - at(0.2 - 1e-5)) / 2e-5).epsilon(1e-6));
        CHECK(std::abs(got) > 1e-6);
    }
}
TEST_CASE("gradients by the motion of a collider", "[adjoint]") {
    const auto leave = [](auto&) {};
    const auto second = [](auto& both) -> auto& { return std::get<1>(both.parts); };
    check_motion<2>(Together(walls_of_run<2>(Contact::slip, 0.2), moving_plank<2>()), second, true, leave);
    check_motion<3>(Together(walls_of_run<3>(Contact::slip, 0.2), moving_plank<3>()), second, true, leave);
    BoundaryList<Plank<2>> list;
    list.all = {moving_plank<2>()};
    check_motion<2>(list, [](auto& all) -> auto& { return all.all[0]; }, true, leave);
    // Where the program puts a collider somewhere, what was before does not count.
    check_motion<2>(
        list, [](auto& all) -> auto& { return all.all[0]; }, false,
        [](auto& plank) { plank.position[0] = 0.3, plank.position[1] = 0.1; });
}
TEST_CASE("gradients by the motion of a solid that is given by distances", "[adjoint]") {
    // A disc, at nodes 3 cm apart.
    const auto disc = [](const Vec<double, 2>& centre) {
        DistanceNumbers<double, 2> numbers{centre - Vec<double, 2>::filled(0.24), 0.03, {17, 17}, {}};
        for (int i = 0; i < 17; ++i)
            for (int j = 0; j < 17; ++j) numbers.values.push_back(std::hypot(0.03 * i - 0.24, 0.03 * j - 0.24) - 0.1);
        Collider<DistanceGrid<double, 2, double>> solid;
        solid.shape = {std::make_shared<const DistanceNumbers<double, 2>>(std::move(numbers))};
        solid.contact = Contact::slip;
        solid.friction = 0.2;
        solid.position = Vec<double, 2>{0.35, 0.12} - centre;
        solid.linear_velocity = {-1, 0.3};
        solid.angular_velocity = 3;
        return solid;
    };
    check_motion<2>(
        Together(walls_of_run<2>(Contact::slip, 0.2), disc({0, 0})),
        [](auto& both) -> auto& { return std::get<1>(both.parts); }, true, [](auto&) {});
    // Far from its own origin the solid is moved near to it in each step: there is no way back through that.
    Run<SimulationWith<2, FixedCorotated<double>, decltype(disc({}))>> far{jelly, disc({60, 0})};
    far.boundary_changes = false;
    auto simulation = far.at(0);
    test_support::check_refused<usage_error>([&] { Adjoint adjoint(simulation); }, "from its own origin");
}
TEST_CASE("gradients with mirrored walls, by their friction, too", "[adjoint]") {
    const auto mirrored = []<int D>(std::integral_constant<int, D>, Contact contact) {
        auto walls = walls_of_run<D>(contact, 0.2);
        walls.nodes_behind = NodesBehind::mirrored;
        return walls;
    };
    const auto check = []<int D, class... Policies>(std::integral_constant<int, D>, const auto& boundary) {
        using Boundary = std::remove_cvref_t<decltype(boundary)>;
        Run<SimulationWith<D, FixedCorotated<double>, Boundary, Policies...>> run{jelly, boundary};
        run.boundary_changes = false;
        run.downwards = -20;  // so that matter comes so near that it reaches the nodes behind the wall
        run.dt = 1e-3;
        check_derivatives(run);
        run.dt = 0x1p-11;
        tangent::check_transposed(run.at(0), 12, 2);
    };
    constexpr std::integral_constant<int, 2> plane;
    for (const Contact contact : {Contact::stick, Contact::slip, Contact::separate}) {
        CAPTURE(int(contact));
        check(plane, mirrored(plane, contact));
        check.operator()<2, Flip<double>>(plane, mirrored(plane, contact));
    }
    constexpr std::integral_constant<int, 3> space;
    check(space, Together(moving_plank<3>(), mirrored(space, Contact::slip)));
}
TEST_CASE("gradients by the friction of walls", "[adjoint]") {
    Run<SimulationWith<2, FixedCorotated<double>>> run{jelly, walls_of_run<2>(Contact::slip, 0.2)};
    run.dt = 1e-3;
    run.boundary_changes = false;
    const auto at = [&](double friction) {
        auto other = run;
        other.boundary.at_lower[1].friction = friction;
        return other.value(0);
    };
    auto simulation = run.at(0);
    Adjoint adjoint(simulation);
    adjoint.advance(3e-3);
    adjoint.measure(decltype(run)::measure);
    const double got = adjoint.gradient().intervals[0].boundary.at_lower[1].friction;
    CHECK(got == Approx((at(0.2 + 1e-5) - at(0.2 - 1e-5)) / 2e-5).epsilon(1e-6));
    CHECK(std::abs(got) > 1e-6);
}
TEST_CASE("gradients in a periodic domain, of matter across its faces", "[adjoint]") {
    Run<SimulationWith<2, FixedCorotated<double>>> run{jelly, walls_of_run<2>()};
    run.boundary.at_lower[0].contact = run.boundary.at_upper[0].contact = Contact::none;
    run.periodic[0] = true;
    run.dt = 1e-3;
    run.speed = 3;
    run.boundary_changes = false;
    check_derivatives(run);
    run.dt = 0x1p-10;
    tangent::check_transposed(run.at(0), 12, 2);
}

}  // namespace boundaries_gradient_tests
