/// \file Element tests of Mohr–Coulomb soil.
#include "case.hpp"
#include "scenes/soil_element.hpp"

using namespace firn;
using namespace verification;

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Mohr–Coulomb in element tests",
        "A cube of soil, c = 10 kPa, E = 1 MPa, ν = 0.3, is compressed or stretched along an axis by up to 20 %, in "
        "steps of 0.5 %, while a pressure of 20 kPa is kept along the others (triaxial), or along one of them, the "
        "last being held (plane strain). At yield σ₁ = σ₃ N_φ + 2 c √N_φ, N_φ = (1 + sin φ)/(1 − sin φ), in "
        "Kirchhoff stresses, and in triaxial compression dε_v/dε₁ = 1 − N_ψ. Errors of stresses are parts of the "
        "largest stress.");
    using Vector = Element::Vector;
    constexpr double cohesion = 1e4, confined = 2e4;
    for (const double friction : {0., 20., 30.})
        for (const double part : {0., 0.5, 1.}) {
            const double dilatancy = part * friction;
            if (friction == 0 && part > 0) continue;
            const auto soil = MohrCoulomb<double>::from_properties({.young = 1e6,
                                                                    .poisson = 0.3,
                                                                    .cohesion = cohesion,
                                                                    .friction_angle = degrees(friction),
                                                                    .dilatancy_angle = degrees(dilatancy)});
            const SoilStrength strength(cohesion, degrees(friction));
            const double N_psi = SoilStrength(0, degrees(dilatancy)).N_phi;
            const Element start = Element{soil}.strained_with({0, 0, 0}, {1, 1, 1}, 0, -confined);
            const auto strained = [&](const Vector& step, const Vector& free, int count) {
                Element now = start;
                for (int i = 0; i < count; ++i) now = now.strained_with(step, free, 1, -confined);
                return now;
            };
            const std::string name = ", φ = " + sentence(friction) + "°, ψ = " + sentence(dilatancy) + "°";
            const double major = strength.major(confined), scale = std::max(cohesion, major);
            const auto stress = [&](const std::string& test, double found, double expected) {
                report.at_most(test + name, std::abs(found - expected) / scale, 1e-10, "closed form");
            };
            const Vector shorter{-0.005, 0, 0}, longer{0.005, 0, 0}, both{0, 1, 1}, one{0, 1, 0};
            const Element compressed = strained(shorter, both, 40);
            stress("triaxial compression", -compressed.stress()[0], major);
            const Vector flow = compressed.strained_with(shorter, both, 1, -confined).plastic() - compressed.plastic();
            report.at_most("dε_v/dε₁ in triaxial compression" + name, std::abs(flow.sum() / flow[0] - (1 - N_psi)),
                           1e-9, "1 − N_ψ");
            stress("triaxial extension", -strained(longer, both, 40).stress()[0], strength.minor(confined));
            stress("plane strain", -strained(shorter, one, 40).stress()[0], major);
        }
    return report.finish();
}
