/// \file Two equal elastic bars meet head-on, by contact groups: restitution, duration and force.
#include "scenes/contact_bars.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

/// The bars with a transfer and a force form, over cells.
struct Series {
    Curve restitution;
    std::vector<BarsOutcome> outcomes{};
};
template <int D = 2, class Law = CoulombContact, class Transfer = Apic, class Force = MlsForce>
Series series(const std::string& label, const std::vector<int>& cells, const Transfer& transfer = {}) {
    Series out{{label}};
    for (const int n : cells) {
        Bars<D, Law, Transfer, Force> bars({.cells = n}, transfer);
        out.outcomes.push_back(meet(bars, Law::between_groups ? 0 : 0.01));
        out.restitution.add(n, out.outcomes.back().restitution);
    }
    return out;
}

std::string listed(const Series& of) {
    std::string text = of.restitution.label + " ";
    for (std::size_t i = 0; i < of.outcomes.size(); ++i)
        text += formatted("%s%.3f", i > 0 ? ", " : "", of.outcomes[i].restitution);
    return text;
}

Curve force_of(const BarsOutcome& of, const std::string& label, double from, double to) {
    Curve curve{label};
    for (std::size_t i = 0; i < of.time.size(); ++i)
        if (of.time[i] > from && of.time[i] < to) curve.add(of.time[i], of.force[i]);
    return curve;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Two elastic bars, by contact groups",
                "Two equal elastic bars (ν = 0) meet head-on at ±v, v = 0.01 c, with 2 × 2 particles a cell and steps "
                "of 0.3 h/c. Each bar is a contact group of its own. The linear theory: the bars exchange their "
                "velocities; contact lasts 2 L/c, with the force ρ c v A, and does not pull when they part. Cells are "
                "counted along a bar.");
    const bool quick = report.quick();
    const std::vector<int> cells = quick ? std::vector{20, 40} : std::vector{20, 40, 80, 160},
                           coarse = quick ? std::vector{20} : std::vector{20, 40, 80};
    const std::vector<double> least{0.93, 0.955, 0.97, 0.98};

    const Series apic = series("APIC, groups", cells), one = series<2, OneField>("APIC, one field", cells);
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const BarsOutcome& of = apic.outcomes[i];
        const std::string where = formatted(", %d cells", cells[i]);
        report.check({"restitution e" + where, of.restitution, 1, 1 - least[i],
                      formatted("no loss; dispersion takes a part: at least %g", least[i])});
        report.check(
            {"duration of the contact" + where + " [L/c]", of.duration(), 2, 0.01 * std::max(1.0, 80. / cells[i]),
             "2 L/c; 1 % at 80 cells, and as h above; from the middle of the first step with a force to that of "
             "the last"});
        report.check({"force, mean over the middle half of the contact" + where + " [ρ c v A]", of.plateau, 1, 2e-3,
                      "plane waves: ρ c v A"});
        report.at_most("largest force that pulls" + where + " [ρ c v A]", of.tension, 0, "none: contact is unilateral");
        report.check({"impulse between the groups" + where + " [m v]", 2 * of.impulse, 1 + of.restitution, 1e-11,
                      "the bar's change of momentum; rounding"});
    }
    double worst = 0;
    for (const double offset : {0.25, 0.5, 0.8}) {
        Bars<2> bars({.cells = 20, .offset = offset});
        worst = std::max(worst, std::abs(meet(bars).restitution - apic.outcomes[0].restitution));
    }
    report.at_most("change of e if the bars meet 0.25, 0.5, 0.8 h beside a plane of nodes, 20 cells", worst, 1e-3,
                   "the same: the surface comes from the particles, not from the grid");
    Bars<3> solid({.cells = quick ? 20 : 40});
    const BarsOutcome in_3d = meet(solid);
    report.check({"restitution e in 3D over that in 2D, " + formatted("%d cells", quick ? 20 : 40), in_3d.restitution,
                  apic.outcomes[quick ? 0 : 1].restitution, 1e-6, "the same motion: ν = 0"});
    report.at_most("largest force that pulls, 3D [ρ c v A]", in_3d.tension, 0, "none: contact is unilateral");

    const Series flip = series<2, CoulombContact, Flip<double>>("FLIP(0.99), groups", coarse, {.ratio = 0.99}),
                 fmpm = series<2, CoulombContact, Fmpm>("FMPM(2), groups", coarse),
                 gradients = series<2, CoulombContact, Apic, WeightGradientForce>("weight gradients, groups", coarse);
    for (const Series* each : {&flip, &fmpm, &gradients})
        for (std::size_t i = 0; i < coarse.size(); ++i)
            report.at_most(
                "largest force that pulls, " + each->restitution.label + formatted(", %d cells [ρ c v A]", coarse[i]),
                each->outcomes[i].tension, 0, "none: contact is unilateral");

    const std::size_t shown = quick ? 1 : 2;
    const std::string at = formatted("%d cells", cells[shown]);
    report.plot({"force", "Force between the bars, " + at, "(t − t_touch) c/L", "F / ρ c v A"}).curves = {
        force_of(apic.outcomes[shown], "APIC, groups", -1.8, 2.7),
        force_of(one.outcomes[shown], "APIC, one field", -1.8, 2.7),
        force_of(flip.outcomes.back(), "FLIP(0.99), groups", -1.8, 2.7),
        force_of(fmpm.outcomes.back(), "FMPM(2), groups", -1.8, 2.7),
        {"linear theory", {-1.8, 0, 0, 2, 2, 2.7}, {0, 0, 1, 1, 0, 0}, Curve::Kind::reference}};
    Plot& kept = report.plot({"restitution", "Restitution over the number of cells", "cells along a bar", "e"});
    for (const Series* each : {&apic, &one, &flip, &fmpm, &gradients}) kept.curves.push_back(each->restitution);
    kept.curves.push_back({"linear theory", {20, double(cells.back())}, {1, 1}, Curve::Kind::reference});

    const BarsOutcome& stuck = one.outcomes[shown];
    const double h = 1.0 / cells[shown];
    report.remark("Restitution with " + formatted("%d to %d cells: ", cells.front(), cells.back()) + listed(apic) +
                  "; " + listed(one) + "; " + listed(flip) + "; " + listed(fmpm) + "; " + listed(gradients) +
                  ". Dispersion of the waves limits e, not contact: short waves lag, and stay in the bars as vibration "
                  "when these part. FLIP and FMPM keep less than APIC here, because the steps are small.");
    const double closing = 2 * Bars<2>::speed / h;  // [cells a unit of time]
    report.remark(
        formatted("Without groups, bars of %d cells feel the first force (1 %% of ρ c v A) at a gap of %.2f h, ",
                  cells[shown], -stuck.first * closing) +
        formatted("and the last one %.2f L/c after their faces should meet: most of the contact is over before. ",
                  stuck.last) +
        formatted("When they part, they pull each other with up to %.3f ρ c v A. ", stuck.tension) +
        formatted("With groups, the first force acts at a gap of %.3f h.", -apic.outcomes[shown].first * closing));
    report.remark(
        formatted("Duration of the contact with FLIP(0.99), FMPM(2) and weight gradients, %d cells: %.3f, "
                  "%.3f and %.3f L/c.",
                  coarse.back(), flip.outcomes.back().duration(), fmpm.outcomes.back().duration(),
                  gradients.outcomes.back().duration()));
    return report.finish();
}
