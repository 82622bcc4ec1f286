// quick: no
/// \file The verification suite's snowball on coarse cells.
#include "../../benchmarks/verification/scenes/snowball.hpp"

#include "support/catch.hpp"

using namespace firn;
using verification::connected_parts;
using verification::Snowball;

TEST_CASE("A snowball falls freely, keeps its momentum with the floor's, gains no energy, and breaks to pieces") {
    Snowball ball(Snow<double>::from_properties({.critical_compression = 0.1, .critical_stretch = 0.03}), 8, 10);
    const auto balance = ball.run(0.06, 0.002, [](const auto&) {});
    CAPTURE(balance.momentum, balance.fall, balance.most_energy);
    CHECK(balance.touched > 0.004);
    CHECK(balance.momentum < 1e-12);
    CHECK(balance.fall < 1e-12);
    CHECK(balance.most_energy < 1 + 1e-3);
    CHECK(ball.parts().size() > 10);
    CHECK(ball.parts().front() < 0.9 * double(ball.simulation.particles().size()));
}

TEST_CASE("An elastic ball that is thrown at a floor stays in one piece") {
    Snowball ball(FixedCorotated<double>::from_young_poisson(1.4e5, 0.2), 8, 10);
    CHECK(ball.parts().size() == 1);
    const auto balance = ball.run(0.06, 0.002, [](const auto&) {});
    CHECK(balance.momentum < 1e-12);
    CHECK(ball.parts().size() == 1);
}

TEST_CASE("Parts are counted by what is closer than the link, largest first") {
    CHECK(connected_parts({{0.0, 0.0}, {0.9, 0.0}, {1.8, 0.0}, {3.0, 0.0}}, 1) == std::vector<int>{3, 1});
    CHECK(connected_parts({{-0.4, -0.4}, {0.4, 0.4}}, 1) == std::vector<int>{1, 1});
}
