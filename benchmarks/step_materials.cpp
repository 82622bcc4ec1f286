/// \file What each material costs, and several on one grid: step/cubes/MATERIAL/threads:1 is four cubes of 35,937
/// particles in motion, all of one material; step/cubes/four/threads:1 has a cube of each of four.
#include <firn/firn.hpp>

#include "step.hpp"

namespace {

using Point = firn::Vec<double, 3>;

constexpr double density = 1, young = 1e3, poisson = 0.3;

/// The cubes fall onto each other two and two, and yield where their material does.
template <class Simulation, class Add>
std::unique_ptr<Simulation> four_cubes(const typename Simulation::material_type& material, const Add& add) {
    const firn::Domain<3> domain{{0, 0, 0}, {1, 1, 1}, 1.0 / 128};
    auto made = std::make_unique<Simulation>(domain, material, firn::Coloured{1});
    const double spacing = domain.cell_size / 2, side = 33 * spacing;
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered, .jitter = 0.1};
    for (int k = 0; k < 4; ++k) {
        const Point lower{0.3 + 0.2 * (k % 2), k < 2 ? 0.4 : 0.42 + side, 0.4};
        const Point upper = lower + Point::filled(side);
        add(*made, k, firn::sample_box<3>(lower, upper, filling), Point{0.5, k < 2 ? 1.0 : -1.5, 0.0});
    }
    made->fixed_time_step = scenes::time_step;
    made->most_steps_between_sorts = 10;
    return made;
}

template <class Simulation, class Add>
void add_cubes(const std::string& name, const typename Simulation::material_type& material, const Add& add) {
    benchmark::RegisterBenchmark(("step/cubes/" + name + "/threads:1").c_str(), [material,
                                                                                 add](benchmark::State& state) {
        scenes::time_steps(state, {.before = 20, .all = 200}, 4 * 35'937,
                           [&] { return four_cubes<Simulation>(material, add); });
    })->Unit(benchmark::kMillisecond);
}

template <class Material>
bool add_material(const Material& material) {
    add_cubes<firn::Simulation<3, Material>>(
        Material::name, material, [](auto& simulation, int, const firn::Samples<3>& cube, const Point& velocity) {
            simulation.add(cube, density, velocity);
        });
    return true;
}

using Elastic = firn::FixedCorotated<float>;
using Water = firn::Fluid<float>;
using Sand = firn::Sand<float>;
using Snow = firn::Snow<float>;

const Elastic elastic = Elastic::from_young_poisson(young, poisson);
const Water water = Water::from_properties({.bulk = young});
const Sand sand = Sand::from_properties({.young = young, .poisson = poisson});
const Snow snow = Snow::from_properties({.young = young, .poisson = poisson});

const bool added[] = {
    add_material(elastic),
    add_material(firn::NeoHookean<float>::from_young_poisson(young, poisson)),
    add_material(firn::Hencky<float>::from_young_poisson(young, poisson)),
    add_material(firn::VonMises<float>::from_properties({.young = young, .poisson = poisson, .yield_stress = 20})),
    add_material(water),
    add_material(sand),
    add_material(snow),
    add_material(firn::Nacc<float>::from_properties({.young = young, .poisson = poisson, .consolidation = 20})),
};

const bool added_four = [] {
    using Four = firn::Materials<Elastic, Water, Sand, Snow>;
    add_cubes<firn::Simulation<3, Four>>(
        "four", {elastic, water, sand, snow},
        [](auto& simulation, int k, const firn::Samples<3>& cube, const Point& velocity) {
            if (k == 0) simulation.template set<0>().add(cube, density, velocity);
            if (k == 1) simulation.template set<1>().add(cube, density, velocity);
            if (k == 2) simulation.template set<2>().add(cube, density, velocity);
            if (k == 3) simulation.template set<3>().add(cube, density, velocity);
        });
    return true;
}();

}  // namespace
