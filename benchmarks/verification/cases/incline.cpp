/// \file A block slides down an incline with friction.
#include "scenes/incline.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

Curve every(const Slide& run, const std::string& label, std::size_t step, double scale = 1) {
    Curve curve{label};
    for (std::size_t i = 0; i < run.time.size(); i += step) curve.add(run.time[i], run.way[i] * scale);
    return curve;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Block on an incline",
        "A block of 0.3 × 0.1 m, ρ = 1000 kg/m³, ν = 0.3, h = 1/40 m, starts from rest on an incline of θ = 30° with "
        "Coulomb friction μ. A rigid block slides by ½ g t² (sin θ − μ cos θ): this is its way. Either the incline is "
        "the grid's own plane, and gravity is askew (not at right angles to it). Or the incline is a solid that lies "
        "askew in the grid. The program Matter reports an error of 1e-3 for its own incline.");
    const bool quick = report.quick();
    const double stiff = 1e8;
    Plot& ways = report.plot({"way", "Way of the centre of mass, E = 1e8 Pa, the solid askew", "t [s]", "x [m]"});
    for (const double friction : {0.0, 0.2, 0.3, 0.45})
        for (const bool askew : {false, true}) {
            if (quick && friction == 0.2) continue;
            const Slide run = slide({.friction = friction, .young = stiff, .askew = askew});
            const std::string label = formatted("μ = %.2f, ", friction) + (askew ? "solid askew" : "gravity askew");
            if (askew) {
                ways.curves.push_back(every(run, formatted("μ = %.2f", friction), 200));
                Curve expected = every(run, friction == 0 ? "rigid block" : "", 200);
                for (std::size_t i = 0; i < expected.x.size(); ++i) expected.y[i] = run.expected[i * 200];
                expected.kind = Curve::Kind::reference;
                ways.curves.push_back(expected);
            }
            report.check({"way after 0.5 s, " + label + " [m]", run.way.back(), run.expected.back(),
                          friction < 0.4 ? 1e-3 : 0.05,
                          friction < 0.4 ? "rigid block; Matter's 1e-3"
                                         : "rigid block; so near tan θ the start of an elastic one counts, see below"});
            report.at_most("acceleration in the second half, " + label + ", relative error",
                           run.error_of_acceleration(), askew ? 5e-3 : 1e-4,
                           askew ? "rigid block; nodes in and out of the solid change as it slides over them"
                                 : "rigid block; all transients are over");
        }
    Curve errors{"μ = 0.3"}, near{"μ = 0.45"};
    std::vector<double> young{1e6, 1e7, 1e8};
    if (!quick) young.push_back(1e9);
    for (const double E : young) {
        errors.add(E, slide({.friction = 0.3, .young = E}).error());
        near.add(E, slide({.friction = 0.45, .young = E}).error());
    }
    Curve root{"E^(−1/2)", {}, {}, Curve::Kind::reference};
    for (const double E : young) root.add(E, errors.y[0] * std::sqrt(young[0] / E));
    report.plot({"stiffness", "Error of the way after 0.5 s, gravity askew", "Young's modulus [Pa]", "error", true})
        .curves = {errors, near, root};
    report.check({"exponent of the error in Young's modulus, μ = 0.3", fitted_order(errors.x, errors.y), -0.5, 0.2,
                  "the time that shear waves take through the block is as E^(−1/2)"});
    const double flip = slide<double, Flip<double>>({.friction = 0.3, .young = 1e7}).error(),
                 pic = slide<double, Pic>({.friction = 0.3, .young = 1e7}).error(),
                 apic = slide({.friction = 0.3, .young = 1e7}).error(),
                 gradients = slide<double, Apic, WeightGradientForce>({.friction = 0.3, .young = 1e7}).error();
    report.remark(
        "The error that is left comes from the block's elasticity, not from the contact. Gravity sets in at once, and "
        "friction is below μN until the first shear waves have passed through the whole block. So the block gets a "
        "lead over the rigid block. The lead shrinks with the time of the waves, as E^(−1/2). Later the acceleration "
        "is that of the formula. If μ is near tan θ = 0.577, friction almost holds the block, and the same lead is a "
        "large part of a short way. How long the start lasts is chaotic, because rounding decides which nodes slip "
        "first. With other compiler options, the lead at 1e6 Pa was twice as long at μ = 0.3, and six times as long at "
        "μ = 0.45.");
    report.remark(
        formatted("The errors of the way at 1e7 Pa and μ = 0.3: APIC %.1e, PIC %.1e, FLIP %.1e, weight gradients %.1e.",
                  apic, pic, flip, gradients));
    return report.finish();
}
