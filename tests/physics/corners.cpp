// quick: no
/// \file Water at rest in concave corners: a container, a notch. Nothing creeps into the solid, however it is given.
#include "support/catch.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/data/sampled_distance.hpp>
#include <firn/firn.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

using namespace firn;

namespace corners_tests {

constexpr double h = 0.02;
using V = Vec<double, 2>;

/// How far water goes into a solid in 2 s [cells]; negative if it stays outside.
/// \param depth  a function: the depth of a position in the solid [m]
template <class Boundary, class Depth>
double deepest(const Boundary& boundary, const V& lower, const V& upper, const Depth& depth) {
    Simulation simulation(Domain<2>{.lower = {0, 0}, .upper = {1, 1}, .cell_size = h},
                          Fluid<double>::from_properties({.bulk = 1e5}), boundary);
    auto water = sample_box<2>(lower, upper, {.spacing = h / 2});
    std::erase_if(water.positions, [&](const V& x) { return depth(x) > -1.1 * h; });
    simulation.add(water, 1000);
    simulation.advance(2);
    double most = -1;
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
        if (simulation.particles().is_particle(slot))
            most = std::max(most, depth(simulation.particles().exact_position(slot)));
    return most / h;
}

/// What is not between two planes through the origin, by nothing but its distance.
template <scalar S, int D>
struct Notch {
    S cosine = S(1), sine = S(0);  ///< of half the angle between the planes
    static constexpr auto parameters() {
        return std::tuple{parameter{"cosine", "1", &Notch::cosine}, parameter{"sine", "1", &Notch::sine}};
    }
    S signed_distance(const Vec<S, D>& x) const {
        using firn::min;
        return min(x[1] * sine + x[0] * cosine, x[1] * sine - x[0] * cosine);
    }
};

}  // namespace corners_tests

using namespace corners_tests;

TEST_CASE("water rests in a hollow box as between half-spaces, and does not creep into its corners") {
    const V centre{0.5 + 0.3 * h, 0.5 + 0.1 * h};
    const auto depth = [&](const V& x) {
        return std::max(std::abs(x[0] - centre[0]), std::abs(x[1] - centre[1])) - 0.2;
    };
    const V corner{0.19, 0.19}, lower = centre - corner, upper{centre[0] + 0.19, 0.5};
    const Collider<Complement<Box<double, 2>>> box{.shape = {{.half_extents = {0.2, 0.2}}}, .position = centre};
    BoundaryList<Collider<HalfSpace<double, 2>>> planes;
    for (const V n : {V{1, 0}, V{-1, 0}, V{0, 1}, V{0, -1}})
        planes.all.push_back({.shape = {n}, .position = centre - n * 0.2});
    const double of_box = deepest(box, lower, upper, depth), of_planes = deepest(planes, lower, upper, depth);
    CAPTURE(of_box, of_planes);
    CHECK(of_box < -0.5);  // the layer holds matter about a cell away
    CHECK(std::abs(of_box - of_planes) < 0.05);
}

TEST_CASE("water rests in a notch of half-spaces, of a shape of one's own, and of a grid of distances") {
    for (const double degrees : {60.0, 90.0, 120.0}) {
        const double half = degrees / 360 * std::numbers::pi, c = std::cos(half), s = std::sin(half);
        const V tip{0.5 + 0.13 * h, 0.2 + 0.31 * h};
        const Notch<double, 2> notch{c, s};
        const auto depth = [&](const V& x) { return -notch.signed_distance(x - tip); };
        BoundaryList<Collider<HalfSpace<double, 2>>> planes;
        for (const double side : {1.0, -1.0}) planes.all.push_back({.shape = {{side * c, s}}, .position = tip});
        DistanceNumbers<float, 2> grid{.lower = {-0.6, -0.3}, .spacing = h / 2, .nodes = {121, 111}, .values = {}};
        for (int i = 0; i < 121; ++i)
            for (int j = 0; j < 111; ++j)
                grid.values.push_back(float(notch.signed_distance(grid.lower + V{double(i), double(j)} * (h / 2))));
        const Collider<Notch<double, 2>> own{.shape = notch, .position = tip};
        const Collider<DistanceGrid<double, 2>> sampled{
            .shape = {std::make_shared<const DistanceNumbers<float, 2>>(grid)}, .position = tip};
        const auto of = [&](const auto& boundary) { return deepest(boundary, {0.02, 0.2}, {0.98, 0.35}, depth); };
        CAPTURE(degrees);
        CHECK(of(planes) < -0.4);
        CHECK(of(own) < -0.4);
        CHECK(of(sampled) < -0.4);
    }
}

TEST_CASE("by the gap, water does not enter a step of a grid of distances, which has a concave corner and an edge") {
    const Box<double, 2> floor{{0.45, 0.1}};
    for (const double cells : {1.0, 2.0}) {
        const Box<double, 2> step{{0.2, 0.1 + cells * h / 2}};
        const auto distance = [&](const V& x) {
            return std::min(floor.signed_distance(x - V{0.5, 0.1}),
                            step.signed_distance(x - V{0.25, 0.1 + cells * h / 2}));
        };
        const Collider<DistanceGrid<double, 2>> solid{
            .shape = {sampled_distance<2>(distance, {.lower = {-0.1, -0.1}, .upper = {1.1, 1.1}, .spacing = h / 2})}};
        const auto walls = Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0.0});
        Simulation run(Domain<2>{{0, 0}, {1, 1}, h}, Fluid<double>::from_properties({.bulk = 1e5}),
                       GapContact{Together(walls, solid)}, Coloured{1});
        run.warn = {};
        run.add(sample_box<2>({0.45, 0.2}, {0.9, 0.35}, {.spacing = h / 2}), 1000);
        double deepest = 0;
        while (run.time() < 0.5) {
            run.advance(0.025);
            for (std::size_t slot = 0; slot < run.particles().slots(); ++slot)
                if (run.particles().is_particle(slot))
                    deepest = std::max(deepest, -distance(run.particles().exact_position(slot)));
        }
        CAPTURE(cells, deepest / h);
        // Where faces counted behind which the solid does not lie, this was 0.8.
        CHECK(deepest < (cells == 1 ? 0.15 : 0.35) * h);
    }
}
