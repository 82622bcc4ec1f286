// quick: -O1
/// \file firn/simulation/surface.hpp: the surface of a simulation's particles after a run; of a set, of a body; what is
/// known of the particles' shape and volume.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/simulation/surface.hpp>

#include <cmath>

using namespace firn;
using test_support::check_refused;

namespace surface_of_set_tests {
namespace {

template <class Set>
double present_volume(const Set& set) {
    const auto& particles = set.particles();
    double sum = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        double ratio = 1;
        if constexpr (requires { particles.state(slot).J; })
            ratio = double(particles.state(slot).J);
        else
            ratio = double(determinant(particles.state(slot).F));
        sum += double(particles.volume(slot)) * ratio;
    }
    return sum;
}
bool same(const SurfaceMesh& a, const SurfaceMesh& b) {
    bool equal = a.triangles == b.triangles && a.vertices.size() == b.vertices.size();
    for (std::size_t v = 0; equal && v < a.vertices.size(); ++v)
        for (int k = 0; k < 3; ++k) equal = equal && a.vertices[v][k] == b.vertices[v][k];
    return equal;
}

}  // namespace

TEST_CASE("The surface of water that has come to rest encloses its volume", "[surface]") {
    constexpr double h = 1.0 / 16;
    Simulation simulation(Domain<3>{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = h},
                          Fluid<float>{.bulk = 5e4F, .gamma = 7, .viscosity = 300});
    simulation.add(sample_box<3>({0, 0, 0}, {1, 0.4, 1}, {.spacing = h / 2}), 1000);
    simulation.advance(1);
    const auto surface = surface_of(simulation, {}, {"velocity", "volume_ratio"});
    CHECK_NOTHROW(check_closed(surface));
    CHECK(signed_volume(surface) == Approx(present_volume(simulation)).epsilon(0.05));
    CHECK(surface.alone.empty());

    REQUIRE(surface.fields.size() == 2);
    CHECK(surface.fields[0].unit == "m/s");
    REQUIRE(surface.fields[0].values.size() == 3 * surface.vertices.size());
    for (const double speed : surface.fields[0].values)
        if (!(std::abs(speed) < 0.1)) FAIL_CHECK("a component of the velocity is " << speed << " m/s");
    for (const double J : surface.fields[1].values)
        if (!(J > 0.8 && J < 1.2)) FAIL_CHECK("the volume ratio on the surface is " << J);
}

TEST_CASE("A surface of elastic bodies, of one of them, and in another order of memory", "[surface]") {
    constexpr double h = 1.0 / 16;
    const auto made = [&](int threads) {
        Simulation simulation(Domain<3>{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = h},
                              FixedCorotated<float>::from_young_poisson(1e4, 0.3), {threads});
        simulation.add(sample_box<3>({0.3, 0.1, 0.3}, {0.7, 0.4, 0.7}, {.spacing = h / 2}), 1000);
        simulation.add(sample_box<3>({0.35, 0.6, 0.35}, {0.6, 0.8, 0.6}, {.spacing = h / 2}), 1000, {0, -2, 0});
        simulation.advance(0.05);
        return simulation;
    };
    const auto simulation = made(1);
    const Body lower = simulation.bodies()[0], upper = simulation.bodies()[1];
    CHECK(same(surface_of(made(3), {.threads = 2}), surface_of(simulation)));

    const auto both = surface_of(simulation), one = surface_of(simulation, lower),
               other = surface_of(simulation, upper);
    for (const auto* surface : {&both, &one, &other}) CHECK_NOTHROW(check_closed(*surface));
    CHECK(signed_volume(one) + signed_volume(other) == Approx(signed_volume(both)).epsilon(1e-3));  // they are apart
    CHECK(signed_volume(both) == Approx(present_volume(simulation)).epsilon(0.03));
    for (const auto& x : other.vertices)
        if (!(x[1] > 0.42)) FAIL_CHECK("the upper body's surface has a vertex at y = " << x[1]);
    CHECK_NOTHROW(check_closed(surface_of(simulation.set<0>(), {.threads = 2}, {"velocity", "deformation_gradient"})));

    check_refused<parameter_error>([&] { surface_of(simulation, {}, {"speed"}); }, "no field 'speed'");
    check_refused<parameter_error>([&] { surface_of(simulation, {}, {"speed"}); }, "velocity");
    check_refused<parameter_error>([&] { surface_of(simulation, Body{900000, 3}); }, "no particles");
    check_refused<parameter_error>([&] { surface_of(simulation, {.level = 2}); }, "level");
}

TEST_CASE("F of elastic matter deforms the kernels, F of plastic matter does not", "[surface]") {
    // A plate that is stretched to 2.2 of its length and width is whole if F is known, and else falls into pieces.
    constexpr double h = 0.2, stretch = 2.2;
    const auto triangles = [&](auto material) {
        Simulation simulation(Domain<3>{.lower = {-1, -1, -1}, .upper = {5, 5, 2}, .cell_size = h}, material);
        auto samples = sample_box<3>({0, 0, 0}, {1.6, 1.6, 0.4}, {.spacing = h / 2});
        for (auto& x : samples.positions) x = {x[0] * stretch, x[1] * stretch, x[2] / (stretch * stretch)};
        const auto body = simulation.add(samples, 1000);
        simulation.set_states(body, [&](const auto&, auto& state) {
            state.F(0, 0) = state.F(1, 1) = float(stretch), state.F(2, 2) = float(1 / (stretch * stretch));
        });
        const auto surface = surface_of(simulation, {.cell_size = 0.04});
        CHECK_NOTHROW(check_closed(surface));
        // V − E + F of the shells together
        return std::ptrdiff_t(surface.vertices.size()) - std::ptrdiff_t(surface.triangles.size() / 2);
    };
    CHECK(triangles(FixedCorotated<float>::from_young_poisson(1e4, 0.3)) == 2);
    CHECK(triangles(VonMises<float>{}) != 2);
}

TEST_CASE("Snow that is packed has the volume that its plastic part tells", "[surface]") {
    constexpr double h = 0.1;
    Simulation simulation(Domain<3>{.lower = {0, 0, 0}, .upper = {2, 2, 2}, .cell_size = h}, Snow<float>{});
    auto samples = sample_box<3>({0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}, {.spacing = h / 2});
    for (auto& x : samples.positions) x = x * 0.9;
    const auto body = simulation.add(samples, 400);
    simulation.set_states(body, [](const auto&, auto& state) { state.plastic_volume = 0.729F; });
    CHECK(signed_volume(surface_of(simulation)) == Approx(0.729).epsilon(0.03));
}

}  // namespace surface_of_set_tests
