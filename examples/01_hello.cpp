#include <firn/firn.hpp>
#include <firn/io/states.hpp>

int main() {
    // A jelly cube is thrown across a box of one metre.
    const firn::Domain<3> box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 64};
    const auto jelly = firn::FixedCorotated<float>::from_young_poisson(5e4, 0.3);  // Pa
    firn::Simulation<3> simulation(box, jelly);

    const auto cube = firn::sample_box<3>({0.1, 0.5, 0.4}, {0.35, 0.75, 0.65}, {.spacing = 1.0 / 128});
    simulation.add(cube, 1000.0, {2.0, 0.0, 0.5});  // kg/m³, m/s

    firn::StateSeries states("out", "hello");  // ParaView opens out/hello.hdf.series
    for (int frame = 0; frame <= 20; ++frame) {
        if (frame > 0) simulation.advance(0.02);  // seconds
        states.write(firn::state_of(simulation));
    }
}
