/// \file A thick cylinder under internal pressure that does not change its volume: Lamé's solution.
#include "scenes/cylinder.hpp"

#include "comparison.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Loaded {
    std::string label;
    double outer = 0;    ///< u(b) over the exact
    double scatter = 0;  ///< root of the mean square over the rings of the scatter of the mean stress, over p
    Curve radial{}, mean{};
    Effort effort{};

    Comparison::Rest rest() const { return {outer - 1, effort}; }
};

template <class... Policies>
Loaded load(const std::string& label, double poisson, int cells) {
    using Cylinder = ThickCylinder<Policies...>;
    Cylinder cylinder(poisson, cells);
    cylinder.simulation.warn = {};  // of the small steps that stiff matter needs
    const Effort effort = measured(cylinder.simulation, [&] { cylinder.settle(poisson < 0.4 ? 4 : 2); });
    Loaded out{label, cylinder.outer_displacement() / cylinder.displacement(Cylinder::outer)};
    out.radial.label = out.mean.label = label;
    out.effort = effort;
    const auto rings = cylinder.rings();
    for (const CylinderRing& ring : rings) {
        out.radial.add(ring.radius, ring.radial / Cylinder::pressure);
        out.mean.add(ring.radius, std::log10(ring.scatter / Cylinder::pressure + 1e-9));
        out.scatter += ring.scatter * ring.scatter;
    }
    out.scatter = std::sqrt(out.scatter / double(rings.size())) / Cylinder::pressure;
    std::printf(
        "%s, ν = %g, h = 1/%d m: u(b) %.5f of the exact, scatter %.4f p; %.2f s, %lld Newton steps, %lld "
        "products\n",
        label.c_str(), poisson, cells, out.outer, out.scatter, effort.seconds, effort.newton_steps, effort.products);
    std::fflush(stdout);
    return out;
}

/// Of several ν, h = 1/16 m.
template <class... Policies>
std::vector<Loaded> study(const std::string& label, const std::vector<double>& poissons) {
    std::vector<Loaded> all;
    for (const double poisson : poissons) all.push_back(load<Policies...>(label, poisson, 16));
    return all;
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
    using W = WeightGradientForce;
    const std::string mls = "MLS", gradients = "weight gradients", with = ", F-bar", step = ", load step";
    const auto poissons = quick ? std::vector{0.3, 0.49} : std::vector{0.3, 0.49, 0.499, 0.4999};
    const auto drawn = [&](const std::vector<Loaded>& all) {
        Curve curve{all.front().label};
        for (std::size_t i = 0; i < all.size(); ++i) curve.add(-std::log10(1 - 2 * poissons[i]), all[i].outer);
        over_poisson.curves.push_back(curve);
        return all;
    };
    Comparison comparison;
    const std::string which = std::string(quick ? "ν = 0.49" : "ν = 0.4999") + ", h = 1/16 m";
    const auto compare = [&](const std::vector<Loaded>& by_damping, const std::vector<Loaded>& by_load_step) {
        drawn(by_damping), drawn(by_load_step);
        comparison.add(by_damping.back().label + ", " + which, by_damping.back().rest(), by_load_step.back().rest());
    };
    const auto coarse = study<MlsForce, FBar>(mls + with, poissons),
               coarse_gradients = study<W, FBar>(gradients + with, poissons),
               coarse_step = study<MlsForce, FBar, QuasiStatic>(mls + with + step, poissons),
               coarse_gradients_step = study<W, FBar, QuasiStatic>(gradients + with + step, poissons);
    compare(study<MlsForce>(mls, poissons), study<MlsForce, QuasiStatic>(mls + step, poissons));
    compare(study<W>(gradients, poissons), study<W, QuasiStatic>(gradients + step, poissons));
    compare(coarse, coarse_step);
    compare(coarse_gradients, coarse_gradients_step);
    const std::string source = "Lamé's solution; our aim: 3 %";
    for (const auto* each : {&coarse, &coarse_gradients, &coarse_step, &coarse_gradients_step})
        report.check(
            {"u(b) over the exact, " + each->back().label + ", " + which, each->back().outer, 1, 0.03, source});
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
        const Loaded plain = fine(load<MlsForce>(mls, poisson, 32)),
                     plain_step = fine(load<MlsForce, QuasiStatic>(mls + step, poisson, 32)),
                     with_mls = fine(load<MlsForce, FBar>(mls + with, poisson, 32)),
                     with_mls_step = fine(load<MlsForce, FBar, QuasiStatic>(mls + with + step, poisson, 32)),
                     with_gradients = fine(load<W, FBar>(gradients + with, poisson, 32)),
                     with_gradients_step = fine(load<W, FBar, QuasiStatic>(gradients + with + step, poisson, 32));
        const double without = plain.scatter, scattered = with_mls.scatter;
        for (const Loaded* each : {&with_mls, &with_mls_step})
            report.at_most(
                "standard deviation of the mean stress over a ring over p, " + each->label + ", ν = 0.4999, h = 1/32 m",
                each->scatter, 0.05, "Lamé: none; our aim: 5 %");
        comparison.add(plain.label + ", ν = 0.4999, h = 1/32 m", plain.rest(), plain_step.rest());
        comparison.add(with_mls.label + ", ν = 0.4999, h = 1/32 m", with_mls.rest(), with_mls_step.rest());
        comparison.add(with_gradients.label + ", ν = 0.4999, h = 1/32 m", with_gradients.rest(),
                       with_gradients_step.rest());
        report.remark(
            "Displacements tell little of locking here, stresses tell all: without F-bar, the mean stress "
            "scatters over a ring by " +
            two_decimals(without) + " p with MLS forces at ν = 0.4999, h = 1/32 m; with F-bar by " +
            formatted("%.3f", scattered) +
            " p. The load acts on the innermost ring of particles, a quarter of a cell within the cylinder, "
            "which makes u(b) smaller by 0.8 % at h = 1/32 m.");
    }
    report.remark(
        "By a load step (firn::QuasiStatic) the cylinder is at rest at once. In a load step nothing but its axes of "
        "symmetry holds it: nodes on these keep to them.\n\n" +
        comparison.table("error of u(b)"));
    return report.finish();
}
