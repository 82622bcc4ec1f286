/// \file What each material costs, and several on one grid: step/cubes/MATERIAL/threads:N is four cubes of 35,937
/// particles in motion, all of one material; step/cubes/four/threads:N has a cube of each of four. step/cubes/sand_1m
/// has a million particles, sand_8m, with FIRN_BENCHMARK_FULL, eight.
#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include "step.hpp"

namespace {

using Point = firn::Vec<double, 3>;

constexpr double density = 1, young = 1e3, poisson = 0.3;

constexpr int usual = 33;  // particles along a side of a cube

/// The cubes fall onto each other two and two, and yield where their material does. They have n³ particles each.
template <class Simulation, class Add>
std::unique_ptr<Simulation> four_cubes(const typename Simulation::material_type& material, int n, int threads,
                                       const Add& add) {
    const double finer = double(usual) / n;
    const firn::Domain<3> domain{{0, 0, 0}, {1, 1, 1}, finer / 128};
    auto made = std::make_unique<Simulation>(domain, material, firn::Coloured{threads});
    const double spacing = domain.cell_size / 2, side = n * spacing;
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered, .jitter = 0.1};
    for (int k = 0; k < 4; ++k) {
        const Point lower{0.3 + 0.2 * (k % 2), k < 2 ? 0.4 : 0.42 + side, 0.4};
        const Point upper = lower + Point::filled(side);
        add(*made, k, firn::sample_box<3>(lower, upper, filling), Point{0.5, k < 2 ? 1.0 : -1.5, 0.0});
    }
    made->fixed_time_step = finer * scenes::time_step;
    made->most_steps_between_sorts = 10;
    return made;
}

template <class Simulation, class Add>
bool add_cubes(const std::string& name, const typename Simulation::material_type& material, const Add& add,
               int n = usual) {
    return scenes::add_on_threads("step/cubes/" + name, [=](benchmark::State& state, int threads) {
        scenes::time_steps(state, {.before = 20, .all = 200}, std::size_t(4) * n * n * n,
                           [&] { return four_cubes<Simulation>(material, n, threads, add); });
    });
}

template <class Material>
bool add_material(const Material& material, const std::string& suffix = "", int n = usual) {
    return add_cubes<firn::Simulation<3, Material>>(
        Material::name + suffix, material,
        [](auto& simulation, int, const firn::Samples<3>& cube, const Point& velocity) {
            simulation.add(cube, density, velocity);
        },
        n);
}

using Elastic = firn::FixedCorotated<float>;
using Water = firn::Fluid<float>;
using Sand = firn::Sand<float>;
using Snow = firn::Snow<float>;

const Elastic elastic = Elastic::from_young_poisson(young, poisson);
const Water water = Water::from_properties({.bulk = young});
const Sand sand = Sand::from_properties({.young = young, .poisson = poisson});
const Snow snow = Snow::from_properties({.young = young, .poisson = poisson});

/// So weak that nearly all of it yields.
constexpr firn::MohrCoulombProperties weak_soil{.young = young,
                                                .poisson = poisson,
                                                .cohesion = 0.1,
                                                .friction_angle = firn::degrees(30),
                                                .dilatancy_angle = firn::degrees(5),
                                                .tension = 0.05};
firn::MohrCoulombProperties softening(firn::MohrCoulombProperties soil) {
    soil.softening_strain = 1;
    return soil;
}
constexpr firn::ModifiedCamClayProperties clay{
    .compression = 0.8, .swelling = 0.1, .initial_pressure = 5, .consolidation = 20};
firn::ModifiedCamClayProperties with_constant_modulus(firn::ModifiedCamClayProperties of) {
    of.shear_modulus = 50;  // about as much as by the pressure in the start state
    return of;
}

const bool added[] = {
    add_material(elastic),
    add_material(firn::NeoHookean<float>::from_young_poisson(young, poisson)),
    add_material(firn::Hencky<float>::from_young_poisson(young, poisson)),
    add_material(firn::VonMises<float>::from_properties({.young = young, .poisson = poisson, .yield_stress = 20})),
    add_material(firn::MohrCoulomb<float>::from_properties({.young = young,
                                                            .poisson = poisson,
                                                            .cohesion = 10,
                                                            .friction_angle = firn::degrees(30),
                                                            .dilatancy_angle = firn::degrees(5),
                                                            .tension = 5})),
    add_material(firn::MohrCoulomb<float>::from_properties(weak_soil), "_weak"),
    add_material(firn::MohrCoulomb<float>::from_properties(softening(weak_soil)), "_softening"),
    add_material(water),
    add_material(sand),
    add_material(sand, "_1m", 63),
    scenes::full() && add_material(sand, "_8m", 126),
    add_material(snow),
    add_material(firn::Nacc<float>::from_properties({.young = young, .poisson = poisson, .consolidation = 20})),
    add_material(firn::ModifiedCamClay<float>::from_properties(clay)),
    add_material(firn::ModifiedCamClay<float>::from_properties(with_constant_modulus(clay)), "_constant_G"),
};

const bool added_four = [] {
    using Four = firn::Materials<Elastic, Water, Sand, Snow>;
    return add_cubes<firn::Simulation<3, Four>>(
        "four", {elastic, water, sand, snow},
        [](auto& simulation, int k, const firn::Samples<3>& cube, const Point& velocity) {
            if (k == 0) simulation.template set<0>().add(cube, density, velocity);
            if (k == 1) simulation.template set<1>().add(cube, density, velocity);
            if (k == 2) simulation.template set<2>().add(cube, density, velocity);
            if (k == 3) simulation.template set<3>().add(cube, density, velocity);
        });
}();

}  // namespace
