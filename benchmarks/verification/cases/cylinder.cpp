/// \file A thick cylinder under internal pressure that does not change its volume: Lamé's solution.
#include "scenes/cylinder.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Loaded {
    std::string label;
    double outer = 0;    ///< u(b) over the exact
    double scatter = 0;  ///< root of the mean square over the rings of the scatter of the mean stress, over p
    Curve radial{}, mean{};
};

template <class... Policies>
Loaded load(const std::string& label, double poisson, int cells) {
    using Cylinder = ThickCylinder<Policies...>;
    Cylinder cylinder(poisson, cells);
    cylinder.simulation.warn = {};  // of the small steps that stiff matter needs
    cylinder.settle(poisson < 0.4 ? 4 : 2);
    Loaded out{label, cylinder.outer_displacement() / cylinder.displacement(Cylinder::outer)};
    out.radial.label = out.mean.label = label;
    const auto rings = cylinder.rings();
    for (const CylinderRing& ring : rings) {
        out.radial.add(ring.radius, ring.radial / Cylinder::pressure);
        out.mean.add(ring.radius, std::log10(ring.scatter / Cylinder::pressure + 1e-9));
        out.scatter += ring.scatter * ring.scatter;
    }
    out.scatter = std::sqrt(out.scatter / double(rings.size())) / Cylinder::pressure;
    std::printf("%s, ν = %g, h = 1/%d m: u(b) %.5f of the exact, scatter %.4f p\n", label.c_str(), poisson, cells,
                out.outer, out.scatter);
    std::fflush(stdout);
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Thick cylinder under internal pressure",
                "A cylinder in plane strain, inner radius a = 1 m, outer radius b = 2 m, ν = 0.4999, under an internal "
                "pressure p = 1e-3 E: a force outwards of 2π a p in all on the innermost ring of particles. "
                "Particles lie on circles, h = 1/32 m or 1/16 m, quadratic splines, APIC. Damping brings it to rest. "
                "The exact solution is Lamé's, u(b) = 2 (1 − ν²) p a² b / (E (b² − a²)).");
    const bool quick = report.quick();
    Plot& over_poisson =
        report.plot({"poisson", "Displacement of the outer face, h = 1/16 m", "−log10(1 − 2ν)", "u(b) / exact"});
    over_poisson.curves.push_back({"exact", {0.4, 3.7}, {1, 1}, Curve::Kind::reference});
    const auto study = [&](const std::string& name, auto run) {
        Curve curve{name};
        for (const double poisson : quick ? std::vector{0.3, 0.49} : std::vector{0.3, 0.49, 0.499, 0.4999})
            curve.add(-std::log10(1 - 2 * poisson), run(poisson));
        over_poisson.curves.push_back(curve);
        return curve;
    };
    using W = WeightGradientForce;
    const std::string mls = "MLS", gradients = "weight gradients", with = ", F-bar";
    study(mls, [&](double poisson) { return load<MlsForce>(mls, poisson, 16).outer; });
    const Curve coarse =
        study(mls + with, [&](double poisson) { return load<MlsForce, FBar>(mls + with, poisson, 16).outer; });
    study(gradients, [&](double poisson) { return load<W>(gradients, poisson, 16).outer; });
    const Curve coarse_gradients =
        study(gradients + with, [&](double poisson) { return load<W, FBar>(gradients + with, poisson, 16).outer; });
    const std::string source = "Lamé's solution; our aim: 3 %";
    for (const Curve& each : {coarse, coarse_gradients})
        report.check({"u(b) over the exact, " + each.label + ", ν = " + (quick ? "0.49" : "0.4999") + ", h = 1/16 m",
                      each.y.back(), 1, 0.03, source});
    if (!quick) {
        const double poisson = 0.4999;
        using Exact = ThickCylinder<>;
        Plot& radial = report.plot({"stress", "Radial stress, mean over each ring, h = 1/32 m", "r [m]", "σ_rr / p"});
        Plot& scatter = report.plot({"scatter", "Standard deviation of the mean stress over each ring, h = 1/32 m",
                                     "r [m]", "log10 of s((σ_rr + σ_θθ)/2) / p"});
        Curve exact{"exact", {}, {}, Curve::Kind::reference};
        for (double r = 1; r < 2.001; r += 0.02) exact.add(r, Exact::radial_stress(r) / Exact::pressure);
        radial.curves.push_back(exact);
        const auto fine = [&](const Loaded& of) {
            radial.curves.push_back(of.radial);
            scatter.curves.push_back(of.mean);
            report.check({"u(b) over the exact, " + of.label + ", ν = 0.4999, h = 1/32 m", of.outer, 1, 0.03,
                          of.label.find("F-bar") == std::string::npos ? "Lamé's solution; without F-bar, for comparison"
                                                                      : source});
            return of;
        };
        const double without = fine(load<MlsForce>(mls, poisson, 32)).scatter;
        const double scattered = fine(load<MlsForce, FBar>(mls + with, poisson, 32)).scatter;
        report.at_most("standard deviation of the mean stress over a ring over p, MLS, F-bar, ν = 0.4999, h = 1/32 m",
                       scattered, 0.05, "Lamé: none; our aim: 5 %");
        fine(load<W, FBar>(gradients + with, poisson, 32));
        report.remark(
            "Displacements tell little of locking here, stresses tell all: without F-bar, the mean stress "
            "scatters over a ring by " +
            two_decimals(without) + " p with MLS forces at ν = 0.4999, h = 1/32 m; with F-bar by " +
            formatted("%.3f", scattered) +
            " p. The load acts on the innermost ring of particles, a quarter of a cell within the cylinder, "
            "which makes u(b) smaller by 0.8 % at h = 1/32 m.");
    }
    return report.finish();
}
