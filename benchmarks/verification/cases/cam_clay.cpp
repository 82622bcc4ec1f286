/// \file Triaxial tests of modified Cam clay.
#include "case.hpp"
#include "scenes/cam_clay_paths.hpp"

using namespace firn;
using namespace verification;

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Modified Cam clay in triaxial tests",
        "One point of normally consolidated clay at 100 kPa, M = 1.2, λ* = 0.1, κ* = 0.02, is sheared at a constant "
        "volume, or drained with a constant lateral stress, with a constant shear modulus (G = 3 MPa) and with "
        "G = g p' (ν = 0.3). The undrained path is p'/p'ᵢ = (M²/(M² + η²))^(1 − κ/λ), times "
        "exp((1 − κ*) η²/(6 g λ*)) for G = g p', where g is the ratio of the Cauchy stress's shear modulus to p' at "
        "q = 0; for small κ* the factor 1 − κ* is often left out. The drained one is "
        "p' = p'ᵢ 3/(3 − η) with the volume of the model's lines. The shear strain at the end is compared with the "
        "integral of the flow rule.");
    const auto examine = [&](const std::string& name, const ModifiedCamClayProperties& clay) {
        Plot& plot =
            report.plot({name == "constant G" ? "constant" : "coupled", "Undrained, " + name, "p' [kPa]", "q [kPa]"});
        const auto test = [&](const std::string& which, const auto& run, double strain) {
            const Path coarse = run(clay, strain, 500), middle = run(clay, strain, 1000),
                       fine = run(clay, strain, 2000);
            report.at_most(which + ", " + name + ": path", fine.path_error, 1e-6, "closed form");
            report.at_most(which + ", " + name + ": shear strain, extrapolated to steps of no length",
                           std::abs(2 * fine.strain_error - middle.strain_error), 1e-6, "integral of the flow rule");
            report.check({which + ", " + name + ": order of the error in the step",
                          std::log2(coarse.strain_error / middle.strain_error), 1, 0.05, "first order"});
            return fine;
        };
        const Path path = test("undrained", [](const auto&... a) { return undrained(a...); }, 0.03);
        Curve ours{name}, closed{"closed form", {}, {}, Curve::Kind::reference};
        for (const auto& [p, q, expected] : path.drawn) ours.add(p / 1e3, q / 1e3), closed.add(expected / 1e3, q / 1e3);
        plot.curves = {ours, closed};
        test("drained", [](const auto&... a) { return drained(a...); }, 0.1);
        const Path end = drained(clay, 1.5, 500);
        report.check({"drained, " + name + ": q/(M p') at a strain of 1.5", end.ratio, 1, 1e-4, "critical state"});
    };
    examine("constant G", {.critical_slope = 1.2, .shear_modulus = 3e6, .initial_pressure = 1e5, .consolidation = 1e5});
    examine("G = g p'", {.critical_slope = 1.2, .initial_pressure = 1e5, .consolidation = 1e5});
    return report.finish();
}
