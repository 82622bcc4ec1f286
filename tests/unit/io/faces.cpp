// Positions on the faces of the domain, and outside of it by rounding: they are taken at every door.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include <cmath>
#include <random>

using namespace firn;
using test_support::message;

namespace faces_tests {
namespace {

template <class S>
Simulation<2, NoStress<S>> box(const Domain<2>& domain) {
    Simulation<2, NoStress<S>> run(domain, NoStress<S>{});
    run.gravity = {0.0, 0.0};
    run.warn = nullptr;
    return run;
}

Domain<2> from(double lower, double upper, double h) {
    return {.lower = {lower, lower}, .upper = {upper, upper}, .cell_size = h};
}

/// Whether a point is taken by add(), by set_position() and by a source, and then a step runs.
template <class S>
bool is_taken(const Domain<2>& domain, const Vec<double, 2>& x) {
    const Vec<double, 2> middle = (domain.lower + domain.upper) * 0.5;
    const double volume = domain.cell_size * domain.cell_size / 4;
    try {
        auto added = box<S>(domain), moved = box<S>(domain), given = box<S>(domain);
        added.add(Samples<2>{{x, middle}, volume}, 1000, {1.0, 0.0});
        moved.add(Samples<2>{{middle, middle}, volume}, 1000, {1.0, 0.0});
        moved.edit_particles().set_position(0, x);
        given.add_source({.samples = {{x}, volume}});
        given.add(Samples<2>{{middle}, volume}, 1000, {1.0, 0.0});
        for (auto* run : {&added, &moved, &given}) run->step();
        return true;
    } catch (const particle_error&) {
        return false;
    }
}

}  // namespace

TEMPLATE_TEST_CASE("a position on a face, or beside it by rounding, is taken wherever the domain lies", "", float,
                   double) {
    std::mt19937_64 random(1);
    const auto uniform = [&](double a, double b) { return a + (b - a) * double(random() >> 11) * 0x1p-53; };
    const double eps = double(std::numeric_limits<TestType>::epsilon());
    int taken = 0, tried = 0, refused = 0;
    for (int i = 0; i < 60; ++i) {
        // Corners as people write them, with a digit or two; up to map coordinates.
        const double h = std::round(uniform(1, 20)) / 100, far = i % 3 == 0 ? std::round(uniform(-1e6, 1e6)) : 0;
        const double lower = far + std::round(uniform(-50, 50)) / 10;
        const double upper =
            i % 2 == 0 ? lower + h * std::round(uniform(8, 20)) : lower + std::round(uniform(5, 30)) / 10;
        const Domain<2> domain = from(lower, upper, h);
        const double middle = (lower + upper) / 2, farther = std::max(std::abs(lower), std::abs(upper));
        const double ulps = std::min(3.9 * eps * farther, 0.99e-3 * h);
        for (const double x : {lower, upper, lower - ulps, upper + ulps, std::nextafter(upper, middle),
                               upper - 1e-9 * h, lower + 1e-9 * h}) {
            ++tried;
            taken += is_taken<TestType>(domain, {x, middle}) && is_taken<TestType>(domain, {middle, x});
        }
        const double beyond = 2e-3 * h;  // more than any rounding
        refused += !is_taken<TestType>(domain, {lower - beyond, middle}) &&
                   !is_taken<TestType>(domain, {middle, upper + beyond});
    }
    CHECK(taken == tried);
    CHECK(refused == 60);
}

TEST_CASE("a face's own number, rounded to float, is taken by a run in float and after a conversion to double") {
    // 0.7F is less than 0.7, and 1.4F is less than 1.4; -0.7F is more than -0.7.
    auto run = box<float>(from(0.7, 1.4, 0.05));
    run.add(Samples<2>{{{double(0.7F), 1.0}, {1.0, double(1.4F)}, {0.7, 1.4}}, 1e-3}, 1000, {0.01, 0.0});
    auto again = box<double>(from(0.7, 1.4, 0.05));
    restore(again, state_of(run), Restart::converted);
    again.step();
    CHECK(again.particles().exact_position(0)[0] >= 0.7);
}

TEST_CASE("the message shows by how much a position is outside, if its digits do not") {
    const Domain<2> domain{.lower = {0.3, 4.6e6}, .upper = {1.3, 4.6e6 + 1}, .cell_size = 1.0 / 64};
    const auto said = [&](const Vec<double, 2>& x) {
        auto run = box<double>(domain);
        return message<particle_error>([&] { run.add(Samples<2>{{x}, 1e-4}, 1000); });
    };
    CHECK(said({0.3 - 1e-12, 4.6e6}).find("0 at (0.3, 4600000) (1e-12 m outside along axis 0).") != std::string::npos);
    CHECK(said({1.3 + 1e-10, 4.6e6 + 1.0005}).find(" (1e-10 m outside along axis 0, 0.0005 m outside along axis 1)") !=
          std::string::npos);
    CHECK(said({1.5, 4.6e6}).find("0 at (1.5, 4600000).") != std::string::npos);
    CHECK(said({std::nan(""), 4.6e6}).find("0 at (nan, 4600000).") != std::string::npos);
    // A program's own arrays are not changed: there one last digit is refused, and shown.
    std::vector<double> x{0.3 - 5.6e-17, 4.6e6};
    CHECK(message<particle_error>([&] {
              check_positions<double, 2>(1, domain, [&](std::size_t, int a) { return x[std::size_t(a)]; });
          }).find("(5.55e-17 m outside along axis 0)") != std::string::npos);
}

}  // namespace faces_tests
