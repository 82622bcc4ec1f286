// quick: no
/// \file Rigid bodies that water flows around: their inertia, momenta and bits.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/rigid_body.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

using namespace firn;

namespace {

constexpr double radius = 0.12, density = 1000, g = 9.81;

using Disc = RigidBody<Collider<Sphere<double, 2>>>;
using Tank =
    SimulationWith<2, Fluid<double>, VolumeFilter, Aflip<double>, GapContact<Together<Walls<double, 2>, Disc>>>;

/// A disc of 8 cells in the middle of a tank of 8 R, in water at rest. \param ratio  of densities
Tank tank_of(double ratio, bool in_flow, int threads = 1) {
    const double h = radius / 8, width = 8 * radius, sound = 50;
    const Domain<2> domain{{0, 0}, {width, width + 8 * h}, h};
    auto walls = Walls<double, 2>::all(domain.lower, domain.upper, {Contact::slip, 0.0});
    walls.nodes_behind = NodesBehind::mirrored;
    Collider<Sphere<double, 2>> disc{.shape = {radius}, .thickness_in_cells = 0.75};
    disc.position = Vec<double, 2>::filled(width / 2);
    Disc body(disc, ratio * density);
    body.in_flow = in_flow;
    Tank tank(domain, Fluid<double>::from_properties({.bulk = density * sound * sound}), Coloured{threads},
              GapContact{Together(walls, body)});
    auto water = sample_box<2>({0, 0}, {width, width}, {.spacing = h / 2});
    std::erase_if(water.positions, [&](const auto& x) { return norm(x - disc.position) < radius; });
    const auto all = tank.add(water, density);
    std::size_t i = 0;
    tank.set_states(all, [&](const auto&, auto& state) {
        const double pressure = density * g * (width - water.positions[i++][1]);
        state.J = std::pow(1 + 7 * pressure / (density * sound * sound), -1.0 / 7);
    });
    return tank;
}
template <class Run>
auto& body_of(Run& run) {
    return std::get<1>(run.boundary.boundary.parts);
}

/// The mean acceleration over 0.2 R, over that of potential flow in this tank, where the added mass is 1.103 times the
/// mass of the water that the disc displaces, by images of its dipole.
double rise(double ratio, bool in_flow) {
    Tank tank = tank_of(ratio, in_flow);
    std::vector<std::string> warnings;
    tank.warn = [&](const std::string& text) { warnings.push_back(text); };
    const double from = body_of(tank).collider.position[1];
    while (std::abs(body_of(tank).collider.position[1] - from) < 0.2 * radius && tank.time() < 0.5) tank.step();
    CHECK(warnings.empty());
    double nearest = 1;
    const auto& particles = tank.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            nearest = std::min(nearest, norm(particles.exact_position(slot) - body_of(tank).collider.position));
    CHECK(nearest > radius * (1 - 0.05 / 8));
    return body_of(tank).velocity()[1] / (tank.time() * g * (1 - ratio) / (1.103 + ratio));
}

}  // namespace

TEST_CASE("A disc in water has the added mass of potential flow, if water flows around it") {
    for (const double ratio : {2.0, 0.1}) {
        CAPTURE(ratio);
        CHECK(rise(ratio, true) == Approx(1).epsilon(0.09));
    }
    CHECK(rise(0.1, false) < 0.85);
}

TEST_CASE("A disc that water flows around has the same bits on any number of threads") {
    const auto made = [](int threads) {
        Tank tank = tank_of(0.5, true, threads);
        tank.warn = {};
        body_of(tank).set_velocity({0.3, 0.2}, 1.0);
        return tank;
    };
    Tank one = made(1), three = made(3);
    for (int i = 0; i < 60; ++i) one.step(), three.step();
    const auto &a = body_of(one), &b = body_of(three);
    CHECK(std::memcmp(&a.momentum, &b.momentum, sizeof a.momentum) == 0);
    CHECK(std::memcmp(&a.angular_momentum, &b.angular_momentum, sizeof a.angular_momentum) == 0);
}

TEST_CASE("A ball that water flows around and a drop keep their momentum") {
    const Domain<3> domain{Vec<double, 3>::filled(-1), Vec<double, 3>::filled(1), 1.0 / 24};
    Collider<Sphere<double, 3>> ball{.shape = {0.15}, .friction = 0.2, .thickness_in_cells = 0.75};
    RigidBody body(ball, 300.0);
    body.in_flow = true;
    body.set_velocity({0.5, -1.0, 0.2}, {1.0, 0.0, 2.0});
    SimulationWith<3, Fluid<double>, GapContact<Together<Walls<double, 3>, decltype(body)>>> run(
        domain, Fluid<double>::from_properties({.bulk = 1e5}), Coloured{1},
        GapContact{Together(Walls<double, 3>::all(domain.lower, domain.upper, {Contact::none, 0.0}), body)});
    auto drop = sample_box<3>(Vec<double, 3>::filled(-0.4), Vec<double, 3>::filled(0.4), {.spacing = 1.0 / 48});
    std::erase_if(drop.positions, [](const auto& x) { return norm(x) < 0.15; });
    run.add(drop, density);
    run.gravity = Vec<double, 3>::zero();
    std::vector<std::string> warnings;
    run.warn = [&](const std::string& text) { warnings.push_back(text); };
    const auto start = body_of(run).momentum;
    const auto momenta = [&] {
        const auto totals = run.totals();
        const auto& of = body_of(run);
        return std::pair{totals.momentum + of.momentum, totals.angular_momentum + of.angular_momentum +
                                                            axial_product(of.collider.position, of.momentum)};
    };
    const auto before = momenta();
    for (int i = 0; i < 60; ++i) run.step();
    const auto after = momenta();
    CHECK(norm(after.first - before.first) <= 1e-12 * norm(start));
    CHECK(norm(after.second - before.second) <= 1e-12 * norm(start));
    CHECK(norm(body_of(run).momentum - start) > 0.3 * norm(start));
    CHECK(warnings.empty());
}

TEMPLATE_TEST_CASE_SIG("The velocity along a normal goes on to a node, exactly if matter's velocity is linear", "",
                       ((int D), D), 2, 3) {
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 24};
    SimulationWith<D, FixedCorotated<double>> run(domain, FixedCorotated<double>::from_young_poisson(1e5, 0.3));
    run.gravity = Vec<double, D>::zero();
    const auto all = sample_box<D>(Vec<double, D>::filled(0.1), Vec<double, D>::filled(0.9), {.spacing = 1.0 / 48});
    run.add(all, 1000);
    Mat<double, D> gradient{};
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) gradient(i, j) = 0.3 * (i + 1) - 0.2 * j * j + 0.1;
    auto& particles = run.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) {
            particles.set_velocity(slot, gradient * particles.exact_position(slot));
            particles.set_affine(slot, gradient);
        }
    int seen = 0, alone = 0;
    run.add_pass("look", "grid update", [&](auto& now, const auto&) {
        const auto& grid = now.grid();
        const double h = domain.cell_size;
        const detail::FlowAtBody<double, D> flow(grid);
        auto normal = Vec<double, D>::filled(0.48);
        normal[0] = std::sqrt(1 - dot(normal, normal) + 0.48 * 0.48);
        for (std::size_t b = 0; b < grid.block_count(); ++b)
            for (const int node : {0, block_nodes<D> / 2 + 1, block_nodes<D> - 1}) {
                const Vec<double, D> x = node_position(grid, b, node), off = x - Vec<double, D>::filled(0.5);
                for (const double distance : {-0.7 * h, 1.2 * h}) {
                    const auto [part, given] = flow.at(b, x, distance, normal, 0.75 * h);
                    const double of_surface = dot(gradient * (x - normal * distance), normal);
                    if (dot(off, off) < 0.15 * 0.15) {
                        ++seen;
                        REQUIRE(std::abs(part * of_surface + given - dot(gradient * x, normal)) <= 1e-12);
                        REQUIRE(part != 1);
                    } else if (dot(off, off) > 0.75 * 0.75) {  // no matter beyond
                        ++alone;
                        REQUIRE(part == 1);
                        REQUIRE(given == 0);
                    }
                }
            }
    });
    run.step();
    CHECK(seen > 4);
    CHECK((D == 2 || alone > 0));
}
