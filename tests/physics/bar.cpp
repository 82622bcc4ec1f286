/// \file The elastic bar of the verification suite, small, against linear theory (tests/reference/bar_mode1.csv).
#include "../../benchmarks/verification/scenes/bar.hpp"

#include "support/catch.hpp"
#include "support/csv.hpp"

using namespace firn;

namespace {

struct Errors {
    double velocity = 0;  ///< largest |v_cm − theory| over one period, over the amplitude
    double energy = 0;    ///< kinetic energy at t = 10 s over that at t = 0, minus 1
};

template <class Transfer, class Force>
Errors run(double h) {
    using Bar = verification::Bar<double, Transfer, Force, QuadraticBSpline>;
    Bar bar(h);
    Errors errors;
    double start = 0, kinetic = 0;
    for (const auto& row : csv::read("bar_mode1.csv")) {
        const double t = csv::number(row, "t");
        if (t > 10) break;
        bar.simulation.advance(t - bar.simulation.time());
        kinetic = bar.simulation.totals().kinetic_energy;
        if (t == 0) {
            start = kinetic;
            CHECK(kinetic / Bar::height == Approx(csv::number(row, "kinetic_energy_per_area")).epsilon(1e-3));
        }
        errors.velocity =
            std::max(errors.velocity, std::abs(bar.velocity() - csv::number(row, "v_cm")) / Bar::amplitude);
    }
    errors.energy = kinetic / start - 1;
    return errors;
}

}  // namespace

TEST_CASE("A bar swings in its first mode as linear theory says, and the error halves with the cells") {
    // Both ends are known to a fraction of a cell only, so the length is: first order. Two cells of 25 m is the bound;
    // measured: 5.3 % and 2.6 %.
    const Errors coarse = run<Apic, MlsForce>(1.0), fine = run<Apic, MlsForce>(0.5);
    CAPTURE(coarse.velocity, fine.velocity, coarse.energy, fine.energy);
    CHECK(coarse.velocity < 2 * 1.0 / 25);
    CHECK(fine.velocity < 2 * 0.5 / 25);
    CHECK(fine.velocity < 0.55 * coarse.velocity);
    CHECK(std::abs(fine.energy) < 0.5 * std::abs(coarse.energy));
    CHECK(std::abs(coarse.energy) < 0.01);
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("The bar swings within the same bound with forces by weight gradients") {
    const Errors errors = run<Apic, WeightGradientForce>(0.5);
    CAPTURE(errors.velocity, errors.energy);
    CHECK(errors.velocity < 2 * 0.5 / 25);
    CHECK(std::abs(errors.energy) < 0.01);
}
#endif

TEST_CASE("PIC damps the bar in one period, over twenty times as much as APIC", "[slow]") {
    const Errors pic = run<Pic, WeightGradientForce>(0.5), apic = run<Apic, WeightGradientForce>(0.5);
    CAPTURE(pic.energy, apic.energy);
    CHECK(pic.energy < -0.05);
    CHECK(pic.energy < -20 * std::abs(apic.energy));
}
