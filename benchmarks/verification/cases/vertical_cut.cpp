/// \file The height to which soil stands when it is cut vertically.
#include "scenes/vertical_cut.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

int main(int argc, char** argv) {
    Case report(
        argc, argv, "A vertical cut",
        "Soil stands H = 1 m high behind a vertical face, on 0.5 H of soil that goes on before it: c = 1 kPa, "
        "E = 1 MPa, ν = 0.3, no tension cut-off, no dilatancy; MohrCoulomb in PlaneStrain, F-bar, 2 × 2 particles a "
        "cell, quadratic splines, APIC. Its weight is raised slowly, with damping, until it goes on moving. The "
        "stability number γH/c is between 3.7752 and 3.7776 for φ = 0 (limit analysis: Pastor, Thai and Francescato "
        "2000, and others); with friction it is less than 4 tan(45° + φ/2), the mechanism of a plane slip surface.");
    const std::vector<int> all = report.quick() ? std::vector{8} : std::vector{8, 16, 32};
    const auto examine = [&](double friction, double low, double high, double exact, double within,
                             const std::string& source) {
        std::vector<double> found;
        std::string text;
        for (const int cells : all) {
            const auto [stands, fails] =
                VerticalCut::critical(VerticalCut(1.0 / cells, degrees(friction), degrees(0)), low, high, 0.05);
            found.push_back((stands + fails) / 2);
            text += (text.empty() ? "" : ", ") + sentence(found.back()) + " (H/" + std::to_string(cells) + ")";
        }
        report.remark("φ = " + sentence(friction) + "°: " + text + ".");
        if (found.size() < 3) return;
        const std::string angle = ", φ = " + sentence(friction) + "°, ";
        report.check({"γH/c" + angle + "h = H/32", found[2], exact, within, source});
        report.check(
            {"γH/c" + angle + "extrapolated from H/16 and H/32", 2 * found[2] - found[1], exact, within, source});
    };
    examine(0, 3.6, 4.4, 3.776, 0.06, "limit analysis, 6 %");
    const double plane = 4 * std::tan(degrees(45 + 10).in_radians());
    examine(20, 4.9, 6.3, 0.95 * plane, 0.05 / 0.95, "below 4 tan(45° + φ/2), and within 10 % of it");
    return report.finish();
}
