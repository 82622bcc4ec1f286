// quick: no
// sanitized: no
/// \file The gradient where walls and colliders act, against difference quotients.
#include "support/derivatives.hpp"

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
}

}  // namespace boundaries_gradient_tests
