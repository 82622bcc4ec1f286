/// \file The factor of safety of a slope by strength reduction.
#include "scenes/soil_slope.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

int main(int argc, char** argv) {
    Case report(
        argc, argv, "A slope that loses its strength",
        "A slope of 2 horizontal to 1 vertical, H = 10 m high, on a rigid rough base at the level of its toe: "
        "φ = 20°, c = 0.05 γ H, ψ = 0, ν = 0.3, E = 10 MPa, ρ = 2000 kg/m³; MohrCoulomb in PlaneStrain, F-bar, "
        "2 × 2 particles a cell, quadratic splines, APIC. It begins in the stress of its weight, K₀ = 1, and "
        "comes to rest with damping. c and tan φ are divided by a factor; it fails if the soil at the crest moves "
        "by more than 0.02 H within 20 √(H/g). The factor of safety is 1.4 (Griffiths and Lane 1999, finite "
        "elements; Bishop and Morgenstern's charts give 1.38).");
    const auto weaken = [](SoilSlope::Soil& soil, double factor) { soil.weaken(factor); };
    std::string found;
    for (const int cells : report.quick() ? std::vector{10} : std::vector{10, 20, 40}) {
        const auto slope = SoilSlope::at_rest(SoilSlope::height / cells);
        const FactorOfSafety safety =
            factor_of_safety(slope, weaken, [](auto& trial) { return SoilSlope::fails(trial); },
                             {.lowest = 1.2, .highest = 1.6, .tolerance = 0.02});
        report.check({"factor of safety, h = H/" + std::to_string(cells), safety.value(), 1.4, 0.1 / 1.4,
                      "Griffiths and Lane 1999, 1.4 ± 0.1"});
        found += (found.empty() ? "" : ", ") + sentence(safety.stands, " to ", safety.fails) + " for H/" +
                 std::to_string(cells);
    }
    report.remark(
        "The factor lies between the last at which the slope stood and the first at which it failed: " + found + ".");
    return report.finish();
}
