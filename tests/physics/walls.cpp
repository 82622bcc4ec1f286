/// \file Walls whose nodes behind are mirrored, in quick forms of the verification suite's cases: planes of symmetry to
/// rounding, full order where matter sticks, stresses beside a floor, and nothing that holds what leaves.
#include "../../benchmarks/verification/scenes/walls.hpp"

#include "support/catch.hpp"

#include "../../benchmarks/verification/scenes/column.hpp"

using namespace firn;
using namespace verification;

namespace {

const Matter matter{3846.15384615, 5769.23076923, 1};  // E = 10⁴ Pa, ν = 0.3

template <class Transfer>
double off_periodic(const Transfer& transfer = {}) {
    const WavesBetweenWalls<AxisAligned<2>, Transfer> waves{{matter, 0.05}, 1. / 8, 2, 0.2, transfer};
    auto walled = waves.walled({Contact::slip, NodesBehind::mirrored});
    auto periodic = waves.periodic();
    for (long i = 0; i < waves.steps(); ++i) {
        walled.step();
        periodic.step();
    }
    return largest_distance(walled.simulation, periodic.simulation) / waves.h;
}

template <int D, class Transfer, class Force>
double off_whole(int planes, NodesBehind nodes_behind = NodesBehind::mirrored) {
    const HalvedCubes<D, Transfer, Force> cubes{4, planes};
    auto part = cubes.make(true, nodes_behind), whole = cubes.make(false);
    for (int i = 0; i < 200; ++i) {
        part.step();
        whole.step();
    }
    return largest_distance(part, whole) / cubes.side;
}

#ifndef FIRN_TEST_QUICK
double error_of_stuck_waves(int n, NodesBehind nodes_behind) {
    const WavesBetweenWalls<StuckWaves, Apic> waves{{matter, 1e-3}, 1.0 / n};
    auto scene = waves.walled({Contact::stick, nodes_behind});
    for (long i = 0; i < waves.steps(); ++i) scene.step();
    return scene.error().mean_square / scene.solution.amplitude;
}
#endif

}  // namespace

#ifndef FIRN_TEST_QUICK
TEST_CASE("Waves between slipping walls with mirrored nodes are those of the periodic square of twice the side") {
    CHECK(off_periodic(Apic{}) < 1e-10);  // measured: 4e-15, and 0.1 with held nodes
    CHECK(off_periodic(Fmpm{2}) < 1e-10);
}
#endif

TEST_CASE("Half of a collision beside a wall with mirrored nodes moves as the whole") {
    CHECK(off_whole<2, Flip<double>, WeightGradientForce>(2) < 1e-12);  // measured: 3e-15
#ifndef FIRN_TEST_QUICK
    CHECK(off_whole<3, Apic, MlsForce>(2) < 1e-12);
#endif
    CHECK(off_whole<2, Flip<double>, WeightGradientForce>(1, NodesBehind::held) > 1e-4);  // so the test can fail
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("Waves of matter that sticks to walls with mirrored nodes are of second order") {
    const double coarse = error_of_stuck_waves(8, NodesBehind::mirrored),
                 fine = error_of_stuck_waves(16, NodesBehind::mirrored);
    CAPTURE(coarse, fine);
    CHECK(std::log2(coarse / fine) > 1.8);
    CHECK(fine < 0.3 * error_of_stuck_waves(16, NodesBehind::held));
}
#endif

TEST_CASE("A column that slips or sticks beside walls with mirrored nodes has the stress of the weight above",
          "[slow]") {
    for (const Contact contact : {Contact::slip, Contact::stick}) {
        Column<double, MlsForce, QuadraticBSpline> column(0.005, 1e6, 5, {contact, NodesBehind::mirrored});
        column.settle(4);
        const auto errors = column.errors();
        CAPTURE(errors.lowest, errors.stress, errors.displacement);
        CHECK(errors.lowest < 0.02);         // measured: 1.5 %, half of that with cells of half the side; held: 23 %
        CHECK(errors.stress < 0.01);         // held: 7 %
        CHECK(errors.displacement < 0.001);  // held: 2.5 %
        CHECK(errors.support == Approx(1).epsilon(1e-5));
    }
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("A soft layer that sticks to a floor with mirrored nodes is sheared as the exact solution says") {
    SoftLayer soft(true, 10, 0.01, NodesBehind::mirrored);
    soft.settle(8);
    const auto rows = soft.rows();
    for (const auto& row : rows)
        CHECK(row.moved == Approx(row.expected).epsilon(0.03));  // held: 32 % in the lowest row
}
#endif

TEST_CASE("What is pulled off a wall with mirrored nodes feels nothing of the wall") {
    const auto felt = PulledOff({3.0, 5.0}, NodesBehind::mirrored).after(0.1);
    CHECK(felt.impulse == 0);
    CHECK(felt.stress < 1e-13);
    CHECK(felt.velocity < 1e-13);
}
