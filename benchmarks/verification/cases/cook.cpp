/// \file Cook's membrane: a panel that bends and shears without changing its volume, and locks without F-bar.
#include "scenes/cook.hpp"

#include "comparison.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Panel {
    double middle = 0, corner = 0;  ///< [m]
    std::vector<double> stress{};   ///< mean stress down the middle column [Pa]
    Effort effort{};
};

template <class... Policies>
Panel load(const std::string& label, double poisson, int cells, NodesBehind behind = NodesBehind::held) {
    CookMembrane<Policies...> membrane(poisson, cells, 2 * cells, behind);
    membrane.simulation.warn = {};  // of the small steps that stiff matter needs
    const Effort effort = measured(membrane.simulation, [&] { membrane.settle(); });
    const Panel panel{membrane.middle(), membrane.corner(), membrane.mean_stress(), effort};
    std::printf("%s, ν = %g, %d cells: %.5f mm, corner %.5f mm; %.2f s, %lld Newton steps, %lld products\n",
                label.c_str(), poisson, cells, 1000 * panel.middle, 1000 * panel.corner, effort.seconds,
                effort.newton_steps, effort.products);
    std::fflush(stdout);
    return panel;
}

/// A force form, with and without F-bar, by explicit steps or by a load step.
template <class Force>
struct Pair {
    std::string name;

    std::string label(bool remedy, bool by_load_step) const {
        return name + (remedy ? ", F-bar" : "") + (by_load_step ? ", load step" : "");
    }
    Panel load(bool remedy, bool by_load_step, double poisson, int cells) const {
        const std::string of = label(remedy, by_load_step);
        if (by_load_step)
            return remedy ? ::load<Force, FBar, QuasiStatic>(of, poisson, cells)
                          : ::load<Force, QuasiStatic>(of, poisson, cells);
        return remedy ? ::load<Force, FBar>(of, poisson, cells) : ::load<Force>(of, poisson, cells);
    }
};

/// The root of the mean square of second differences: how much the stress jumps from particle to particle [Pa].
double roughness(const std::vector<double>& of) {
    double sum = 0;
    for (std::size_t i = 1; i + 1 < of.size(); ++i) sum += std::pow(of[i - 1] - 2 * of[i] + of[i + 1], 2);
    return std::sqrt(sum / double(of.size() - 2));
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Cook's membrane: bending without change of volume",
                "A tapered panel in plane strain, with the corners (0, 0), (48, 44), (48, 60) and (0, 44) mm, is held "
                "at its left edge. A shear force of 1 N per mm of thickness is spread over its right edge: E = 240.565 "
                "MPa, h = 44/32 mm, 64 × 64 particles by mapping a square, quadratic splines, APIC. Damping brings it "
                "to rest. Strains are small. The reference is a mixed finite-element method of ours that does not "
                "lock (quadrilaterals with nine nodes and three pressures, 64 × 64 elements; 128 × 128 for ν = 0.3 and "
                "0.499), for Poisson's ratio ν from 0.3 "
                "to 0.4999.");
    const bool quick = report.quick();
    const Pair<MlsForce> mls{"MLS"};
    const Pair<WeightGradientForce> gradients{"weight gradients"};
    const std::string source = "mixed finite elements; ", aim = "our aim: 3 %";

    Plot& over_poisson = report.plot({"poisson", "Middle of the right edge, h = 44/16 mm", "−log10(1 − 2ν)", "u [mm]"});
    Plot& over_cells = report.plot({"cells", "Middle of the right edge, ν = 0.499", "h [mm]", "u [mm]"});
    Curve reference{"mixed finite elements", {}, {}, Curve::Kind::reference};
    for (const CookReference& each : cook_references)
        reference.add(-std::log10(1 - 2 * each.poisson), 1000 * each.middle);
    over_poisson.curves.push_back(reference);
    const double exact = cook_references[3].middle, exact_corner = cook_references[3].corner;
    over_cells.curves.push_back(
        {"mixed finite elements", {1.375, 5.5}, {1000 * exact, 1000 * exact}, Curve::Kind::reference});

    Plot& stress = report.plot(
        {"stress", "Mean stress in the plane, middle column, ν = 0.499, h = 44/32 mm", "t", "(σ_xx + σ_yy)/2 [kPa]"});
    Curve elements{"mixed finite elements", {}, {}, Curve::Kind::reference};
    for (std::size_t i = 0; i < cook_mean_stress.size(); ++i)
        elements.add((3 * double(i) + 0.5) / 64, 1e3 * cook_mean_stress[i]);
    stress.curves.push_back(elements);

    double rough[2][2][2] = {}, worst = 0;  // of each force form, by a load step or not, without F-bar and with it
    Comparison comparison;
    const auto study = [&](const auto& pair) {
        constexpr bool is_mls = std::same_as<std::remove_cvref_t<decltype(pair)>, Pair<MlsForce>>;
        for (const bool remedy : {false, true}) {
            Comparison::Rest by_damping[2];
            for (const bool by_load_step : {false, true}) {
                const std::string label = pair.label(remedy, by_load_step);
                Curve by_poisson{label}, by_cells = by_poisson;
                by_cells.add(5.5, 1000 * pair.load(remedy, by_load_step, 0.499, 8).middle);
                const auto compare = [&](const Panel& panel, int k, double should, const char* which) {
                    const Comparison::Rest rest{panel.middle / should - 1, panel.effort};
                    if (by_load_step)
                        comparison.add(pair.label(remedy, false) + which, by_damping[k], rest);
                    else
                        by_damping[k] = rest;
                };
                for (const CookReference& each : cook_references) {
                    if (quick && each.poisson > 0.4999 - 1e-9) continue;
                    const Panel panel = pair.load(remedy, by_load_step, each.poisson, 16);
                    by_poisson.add(-std::log10(1 - 2 * each.poisson), 1000 * panel.middle);
                    if (each.poisson == 0.499) by_cells.add(2.75, 1000 * panel.middle);
                    if (each.poisson == 0.499) compare(panel, 0, each.middle, ", ν = 0.499, h = 44/16 mm");
                    if (!remedy && !by_load_step) worst = std::max(worst, 1 - panel.middle / each.middle);
                }
                if (!quick) {
                    const Panel fine = pair.load(remedy, by_load_step, 0.499, 32);
                    by_cells.add(1.375, 1000 * fine.middle);
                    compare(fine, 1, exact, ", ν = 0.499, h = 44/32 mm");
                    Curve down{label};
                    for (std::size_t j = 0; j < fine.stress.size(); ++j)
                        down.add((double(j) + 0.5) / 64, fine.stress[j] / 1000);
                    if (is_mls && (remedy || !by_load_step)) stress.curves.push_back(down);
                    rough[is_mls ? 0 : 1][by_load_step][remedy] = roughness(fine.stress);
                    const std::string which = label + ", ν = 0.499, h = 44/32 mm [m]";
                    report.check({"u of (48, 52) mm, " + which, fine.middle, exact, remedy ? 0.03 : 0.05,
                                  source + (remedy ? aim : "without F-bar, for comparison")});
                    if (remedy)
                        report.check(
                            {"u of the corner (48, 60) mm, " + which, fine.corner, exact_corner, 0.03, source + aim});
                } else if (remedy) {
                    report.check({"u of (48, 52) mm, " + label + ", ν = 0.499, h = 44/16 mm [m]", by_cells.y.back(),
                                  1000 * exact, 0.04, source + "our aim: 4 %"});
                }
                over_poisson.curves.push_back(by_poisson);
                over_cells.curves.push_back(by_cells);
            }
        }
    };
    study(mls);
    study(gradients);
    const Panel pic = load<MlsForce, Pic, FBar>("MLS, PIC, F-bar", 0.499, 32);
    report.check(
        {"u of (48, 52) mm, MLS, PIC, F-bar, ν = 0.499, h = 44/32 mm [m]", pic.middle, exact, 0.03, source + aim});
    const double flip = load<MlsForce, Flip<double>>("MLS, FLIP", 0.3, 16).middle / cook_references[0].middle - 1;
    if (!quick)
        for (const int i : {0, 1})
            for (const bool by_load_step : {false, true})
                report.at_most(
                    "jumps of the mean stress with F-bar over those without, " + (i == 0 ? mls.name : gradients.name) +
                        (by_load_step ? ", load step" : "") + ", ν = 0.499, h = 44/32 mm",
                    rough[i][by_load_step][1] / rough[i][by_load_step][0], 0.1, "no checkerboard; our aim: a tenth");
    if (!quick)
        report.remark(
            "Without F-bar the panel is too stiff, the more so the less it is compressible and the coarser the cells: "
            "by up to " +
            percent(worst) +
            " at ν = 0.4999, h = 44/16 mm, MLS. With weight gradients the displacements lock less. The stresses are "
            "useless with both. With F-bar, the mean stress jumps from particle to particle by " +
            percent(rough[0][0][1] / rough[0][0][0]) + " (MLS) and " + percent(rough[1][0][1] / rough[1][0][0]) +
            " (weight gradients) of what it does without (ν = 0.499, h = 44/32 mm, middle column; root of the mean "
            "square of second differences).");
    report.remark("FLIP is not right here, with or without F-bar, for any ν, nor is AFLIP: FLIP 0.95 gives " +
                  percent(flip) +
                  " too much at ν = 0.3, without F-bar. The cause is probably that a load acts on the velocities of "
                  "the particles of the edge, "
                  "and these transfers keep the part of it that the grid does not see.");
    CookMembrane<MlsForce, FBar, QuasiStatic> stiff(0.499, quick ? 16 : 32, quick ? 32 : 64);
    stiff.settle(SmallNodeRule{}.threshold);
    report.remark(
        "By a load step (firn::QuasiStatic) the panel is at rest at once. By damping it is not: nodes at the slanting "
        "edges that have little matter give way for long. With weight gradients, without F-bar, ν = 0.3, h = 44/16 mm, "
        "u is 0.9 % too large after 5 periods and 1.4 % after 160, and 1.4 % after a load step in which no nodes "
        "follow others (SmallNodeRule::threshold = 0). In the load steps here, nodes with less than a hundredth of the "
        "matter of the largest one follow those beside them, and the edges are stiffer: u is 1.4 % too small. With the "
        "default, a tenth, they are stiffer still: the middle of the right edge moves by " +
        percent(1 - stiff.middle() / exact) + " and the corner by " + percent(1 - stiff.corner() / exact_corner) +
        " too little (MLS, F-bar, ν = 0.499, h = 44/" + (quick ? "16" : "32") +
        " mm). With F-bar and ν = 0.4999 a load step of this size takes 69 Newton steps, as their line search makes "
        "them short; sixteen load steps of a sixteenth take six each.\n\n" +
        comparison.table("error of u of (48, 52) mm"));
    return report.finish();
}
