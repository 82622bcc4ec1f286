/// \file Uniaxial strain of every material, against closed forms.
#include "scenes/uniaxial.hpp"

#include "support/csv.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

/// τ11 and τ22 over l, with the closed form.
void draw(Plot& plot, const std::string& name, const Path& path, const std::vector<Response>& ours,
          const std::vector<Response>& exact) {
    const std::string closed = plot.curves.empty() ? "closed form" : "_";
    for (const bool across : {false, true}) {
        Curve of_ours{name + (across ? " τ22" : " τ11")};
        Curve reference{across ? "_" : closed, {}, {}, Curve::Kind::reference};
        std::size_t i = 0;
        path.each([&](std::size_t, double l) {
            of_ours.add(l, (across ? ours[i].across : ours[i].along) / 1000);
            reference.add(l, (across ? exact[i].across : exact[i].along) / 1000);
            ++i;
        });
        plot.curves.push_back(of_ours);
        plot.curves.push_back(reference);
    }
}

/// Figures and curves of a model.
template <class Model>
void examine(Case& report, Plot& plot, const std::string& name, const Model& model, const Path& path) {
    const auto ours = driven(model, path), exact = closed(form_of(model), path);
    const auto single = driven(lift<float>(model), path);
    draw(plot, name, path, ours, exact);
    report.at_most(name + ", double", largest_error(ours, exact), 1e-12,
                   "closed form; rounding of " + std::to_string(ours.size()) + " steps");
    report.at_most(name + ", float", largest_error(single, exact), 1e-3,
                   "closed form; a step of l rounds by 6e-8, which moduli over stress amplify");
}

/// The stresses of tests/reference/uniaxial_strain.csv; their largest relative error.
template <class Model>
double file_error(const std::string& name, const Model& model) {
    double worst = 0;
    for (const auto& row : csv::read("uniaxial_strain.csv")) {
        if (row.at("model") != name) continue;
        const Response ours = driven(model, Path{{1, csv::number(row, "lambda1")}}).back();
        const double size = std::abs(csv::number(row, "tau11"));
        worst = std::max({worst, std::abs(ours.along - csv::number(row, "tau11")) / size,
                          std::abs(ours.across - csv::number(row, "tau22")) / size});
    }
    return worst;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Every material under uniaxial strain",
        "One material point is stretched along one axis: F = diag(l, 1, 1), in steps of at most 0.35 %. Each step "
        "updates F by the flow, applies the return mapping and computes the stress, as G2P does for a particle. The "
        "Kirchhoff stress along (τ11) and across (τ22) the stretch is compared with the closed forms in the papers of "
        "the models. The error is the largest difference on the way, divided by the largest stress.");
    const UniaxialModels of;
    Plot& solids = report.plot({"elastic", "Elastic solids, E = 100 kPa, ν = 0.3", "l", "τ [kPa]"});
    examine(report, solids, "fixed corotated", of.fixed_corotated, of.of_solid);
    examine(report, solids, "neo-Hookean", of.neo_hookean, of.of_solid);
    examine(report, solids, "Hencky", of.hencky, of.of_solid);
    Plot& fluid = report.plot({"fluid", "Fluid, K = 100 kPa, γ = 7: compressed, pulled apart, closed", "l", "τ [kPa]"});
    examine(report, fluid, "fluid", of.fluid, of.of_fluid);
    Plot& snow = report.plot({"snow", "Snow: crushed, torn, crushed to the limit of hardening, torn", "l", "τ [kPa]"});
    examine(report, snow, "snow", of.snow, of.of_snow);
    Plot& metal =
        report.plot({"von_mises", "Von Mises, H = 100 kPa: compressed, stretched, compressed", "l", "τ [kPa]"});
    examine(report, metal, "von Mises", of.von_mises, of.of_metal);
    Plot& sand = report.plot({"sand", "Sand, φ = 20°: opens, slips, slips back, slips", "l", "τ [kPa]"});
    examine(report, sand, "sand", of.sand, of.of_sand);

    const std::string file = "tests/reference/uniaxial_strain.csv, of 13 digits";
    report.at_most("fixed corotated, l = 0.5, 0.8, 1.2, 2", file_error("fixed_corotated", of.fixed_corotated), 1e-12,
                   file);
    report.at_most("neo-Hookean, l = 0.5, 0.8, 1.2, 2", file_error("neo_hookean_log", of.neo_hookean), 1e-12, file);
    report.at_most("Hencky, l = 0.5, 0.8, 1.2, 2", file_error("hencky", of.hencky), 1e-12, file);

    const Response pressed = driven(of.sand, Path{{1, 0.95}}).back();
    report.check({"sand, τ22/τ11 of first compression", pressed.across / pressed.along, form_of(of.sand).ratio(), 1e-12,
                  "(1 − √1.5 α) / (1 + √6 α): Klár et al. 2016, on the cone"});
    report.at_most("sand in a simulation",
                   largest_error(simulated(of.sand, of.of_sand), closed(form_of(of.sand), of.of_sand)), 1e-10,
                   "closed form; a particle of a body that a 3D simulation (APIC) stretches");

    report.at_most("sand in a simulation, F-bar",
                   largest_error(simulated<FBar>(of.sand, of.of_sand), closed(form_of(of.sand), of.of_sand)), 1e-10,
                   "as above: the average of a rate of volume change that is the same everywhere is this rate");

    const NaccForm clay = form_of(of.nacc);
    // Past the yield surface, steps that yield and steps that do not alternate, and rounding decides which: a path that
    // differs by 1e-12 has a stress that differs by 0.4 %.
    const Path of_clay{{1, 0.985, 1.005, 0.985}};
    report.at_most("Cam clay in a simulation, F-bar, until it yields",
                   largest_error(simulated<FBar>(of.nacc, of_clay), simulated(of.nacc, of_clay)), 1e-10,
                   "as above; against the same without F-bar");
    Plot& cam = report.plot({"nacc", "Cam clay: compressed, and stretched", "l", "τ [kPa]"});
    for (const double end : {0.91, 1.05}) {
        const bool crushed = end < 1;
        const Path path{{1, end}, 20000};
        const NaccErrors errors = nacc_errors(of.nacc, clay, end, path.steps);
        const std::string name = std::string("Cam clay, ") + (crushed ? "compressed" : "stretched");
        report.at_most(name + ": elastic part", errors.elastic, 1e-12, "closed form, over p₀; rounding");
        report.check({name + ": yields at l", errors.yields_at, clay.yields_at(end), 1e-5,
                      "yield function of Wolper et al. 2019; one step"});
        if (crushed) {
            report.at_most(name + ": pressure past that", errors.pressure, 1e-10,
                           "p = κ/2 (1 − l²), as shear keeps the volume; over p₀; rounding");
            report.at_most(name + ": beyond its ellipse", errors.ellipse, 1e-10,
                           "the ellipse that the step began with, over p₀²; rounding");
        }
        const auto ours = driven(of.nacc, path);
        Curve along{crushed ? "τ11" : "_"}, across{crushed ? "τ22" : "_"};
        Curve closed{crushed ? "closed form until it yields" : "_", {}, {}, Curve::Kind::reference}, other = closed;
        other.label = "_";
        std::size_t i = 0;
        path.each([&](std::size_t, double l) {
            const Response now = ours[i++];
            if (i % 100 != 0) return;
            along.add(l, now.along / 1000);
            across.add(l, now.across / 1000);
            if ((l > clay.yields_at(end)) != crushed) return;
            closed.add(l, clay.response(l).along / 1000);
            other.add(l, clay.response(l).across / 1000);
        });
        for (const Curve& curve : {along, across, closed, other}) cam.curves.push_back(curve);
    }

    report.remark(
        "The product F = Π (1 + Δl/l) of all steps is l itself. So return mappings that are exact in logarithmic "
        "strain or in principal stretches have rounding errors only. Cam clay hardens explicitly, with the p₀ of the "
        "trial state. In compression its stress lies on or inside the ellipse that a step began with. There is no "
        "closed form after it yields.");
    report.remark(
        "The friction angle of sand is 20° here. Sand with the friction angle of dry sand (35°) and ν = 0.3 does not "
        "slip in its first compression in a box, because the elastic stress ratio ν/(1 − ν) lies inside the yield "
        "cone. Sand that a stretch has opened bears no pressure until l is back at 1 (Tampubolon et al. 2017). "
        "Stretched Cam clay tears at once: its pressure reaches −β p₀ and then zero, because α softens p₀ to 1e-5 κ.");
    return report.finish();
}
