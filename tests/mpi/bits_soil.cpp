// ranks: 3
// threads: 2 1
#include "support/message.hpp"
#include <firn/soil.hpp>

#include "mpi/bits.hpp"

using namespace scenes;

TEST_CASE("Soil in plane strain, which slides and is pressed together with water, has the same bits", "[mpi]") {
    const auto slide = [](const auto& execution) {
        const auto soil = MohrCoulomb<float>::from_properties({.young = 1e6,
                                                               .cohesion = 200,
                                                               .friction_angle = degrees(25),
                                                               .residual_cohesion = 50,
                                                               .residual_friction_angle = degrees(20),
                                                               .softening_strain = 1});
        using Soil = PlaneStrain<Undrained<SofteningBand<MohrCoulomb<float>>>>;
        Simulation simulation(Domain<2>{{0, 0}, {1, 1}, 1. / 96}, Soil{{{soil, 0.005F}, 1e6F}}, execution, FBar{});
        simulation.add(sample_box<2>({0.1, 0.0}, {0.6, 0.4}, {.spacing = 1. / 192}), 1600, {2., 0.});
        return simulation;
    };
    const Seen many = check_same_bits<Coloured>(slide, 300);
    CHECK(many.migrations >= 1);
}

TEST_CASE("Ground at rest that one rank finds wrong is refused on all of them", "[mpi]") {
    using Soil = PlaneStrain<MohrCoulomb<float>>;
    Simulation simulation(Domain<2>{{0, 0}, {1, 1}, 1. / 32}, Soil{MohrCoulomb<float>{}}, mpi::Distributed<Coloured>());
    const Body ground = simulation.add(sample_box<2>({0.1, 0.1}, {0.9, 0.5}, {.spacing = 1. / 64}), 1600);
    // One particle has no surface above it, so one rank only finds this.
    const auto torn = [](const Vec<double, 2>& x) {
        return x[0] < 0.1 + 1. / 64 && x[1] < 0.1 + 1. / 64 ? std::numeric_limits<double>::quiet_NaN() : 0.5;
    };
    test_support::check_refused<parameter_error>(
        [&] { set_at_rest(simulation.set(), ground, {.surface = torn, .earth_pressure = 0.6}); }, "give finite ones");
    set_at_rest(simulation.set(), ground, {.surface = [](const auto&) { return 0.5; }, .earth_pressure = 0.6});
    CHECK(simulation.steps() == 0);
}
