/// \file A strip footing sinks into soil with friction and associated flow: the limit load.
#include "case.hpp"
#include "scenes/footing.hpp"

using namespace firn;
using namespace verification;

namespace {

/// How a footing is pushed into soil of one friction angle.
struct Push {
    double friction;    ///< φ = ψ [°]
    double settlement;  ///< [m]
    double duration;    ///< in units of the footing
    double within;      ///< of N_c, extrapolated [1]
};

/// Returns the load over N_c c. \param duration  in units of the footing
double pushed(const Push& push, int cells, double duration, Plot& plot) {
    Footing<FlowingSoil, FBar> footing(associated_soil(degrees(push.friction), push.settlement), cells);
    footing.push(duration, 0.5);
    Curve curve{sentence("φ = ", push.friction, "°, h = B/", cells, duration > push.duration ? ", slowly" : "")};
    for (std::size_t i = 0; i < footing.sunk.size(); ++i)
        curve.add(footing.sunk[i] / push.settlement, footing.load[i] / footing.soil.bearing);
    plot.curves.push_back(curve);
    const double ratio = footing.last_load() / footing.soil.bearing;
    std::printf("%s, %g units: %.4f N_c c\n", curve.label.c_str(), duration, ratio);
    std::fflush(stdout);
    return ratio;
}
/// The same with FBar, but without PlasticVolume.
double pushed_with_f_bar_alone(const Push& push, int cells) {
    using Soil = PlaneStrain<MohrCoulomb<double>>;
    const auto under = associated_soil(degrees(push.friction), push.settlement);
    Footing<Soil, FBar> footing(
        {Soil{under.material}, under.mu, under.strength, under.bearing, under.extent, under.settlement}, cells);
    footing.simulation.warn = {};
    footing.push(push.duration, 0.5);
    return footing.last_load() / footing.soil.bearing;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Strip footing on soil with friction: limit load",
        "A rigid rough strip, B = 1 m wide, is pushed into weightless soil in plane strain: Mohr–Coulomb, c = 10 "
        "kPa, ψ = φ, E = 1 GPa, ν = 0.3. The right half is computed, 8 B × 4 B, h = B/8 and B/16, 2 × 2 particles "
        "a cell, quadratic splines, APIC, MLS forces, PlasticVolume with F-bar, mirrored walls, in the frame of "
        "the strip. Exact: N_c = (N_φ e^(π tan φ) − 1) cot φ (Prandtl 1920), 5.14, 14.83 and 30.14.");
    Plot& plot =
        report.plot({"load_friction", "Load over settlement", "s over its last value [1]", "load / (N_c c B)"});
    const Push all[] = {{0, 0.001, 120, 0.03}, {20, 0.004, 1000, 0.07}, {30, 0.008, 2000, 0.10}};
    for (const Push& push : all) {
        const std::string angle = sentence("load over N_c c B, φ = ψ = ", push.friction, "°, ");
        const double at8 = pushed(push, 8, push.duration, plot);
        report.check({angle + "h = B/8", at8, 1, 0.1, "Prandtl 1920; the strip acts as one that is wider by h or so"});
        if (report.quick()) continue;
        const double at16 = pushed(push, 16, push.duration, plot);
        report.check({angle + "h = B/16", at16, 1, 0.06, "Prandtl 1920"});
        report.check({angle + "extrapolated to h = 0", 2 * at16 - at8, 1, push.within, "Prandtl 1920"});
    }
    if (report.quick()) return report.finish();
    const double slow = pushed(all[1], 8, 2 * all[1].duration, plot);
    report.remark("Pushed half as fast, φ = 20°, h = B/8, the load is " + two_decimals(slow) + " N_c c B.");
    report.remark(
        "With F-bar alone, particles of a cell that shear at different rates cannot dilate as each of them must: "
        "φ = 20°, h = B/8 then bears " +
        two_decimals(pushed_with_f_bar_alone(all[1], 8)) + " N_c c B, and the load goes on rising.");
    return report.finish();
}
