/// \file Blocks that approach slowly, by contact groups: at which gap they feel each other. Blocks that are pulled
/// apart.
#include "scenes/contact_gap.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

/// The gap of the variants that is farthest from 0; NaN if one feels no force.
double worst_of(const std::vector<double>& gaps) {
    double worst = 0;
    for (const double gap : gaps)
        if (!(std::abs(gap) <= std::abs(worst))) worst = gap;
    return worst;
}

/// Offsets of the blocks from a plane of nodes [cells].
template <int D>
std::vector<Vec<double, D>> offsets(bool quick) {
    std::vector<Vec<double, D>> all{Vec<double, D>::zero()};
    auto crooked = Vec<double, D>::zero();
    crooked[0] = 0.3, crooked[1] = 0.1;
    all.push_back(crooked);
    if (D == 2 && !quick) all.push_back(Vec<double, D>::filled(0.5));
    if (D == 3 && quick) all.resize(1);
    return all;
}

template <int D>
double uniform(double turn, bool quick, double aside = 0) {
    std::vector<double> gaps;
    for (const auto& offset : offsets<D>(quick))
        gaps.push_back(gap_at_first_force<D>({.turn = turn, .offset = offset, .aside = aside, .gap = 0.3}));
    return worst_of(gaps);
}

template <int D>
double jittered(double first, double second, bool quick) {
    std::vector<double> gaps;
    for (const std::uint64_t seed : {1, 2, 3, 4}) {
        if (seed > (quick || D == 3 ? 1 : 4)) break;
        for (const double turn : {0.0, 30.0})
            if (D == 2 || turn == 0)
                gaps.push_back(gap_at_first_force<D>(
                    {.turn = turn, .jitter = {first, second}, .seed = seed, .gap = second > 0 ? 0.65 : 0.4}));
    }
    return worst_of(gaps);
}

template <int D>
void check_approach(Case& report) {
    const std::string in = formatted(", %dD", D), source = "our aim: ";
    const bool quick = report.quick();
    report.at_most("gap at the first force, uniform particles" + in + " [h]", uniform<D>(0, quick), 0.05,
                   source + "a twentieth of a cell");
    report.at_most("gap at the first force, turned by 30°" + in + " [h]", uniform<D>(30, quick), 0.15,
                   source + "the plane that separates the particles is found to a few degrees");
    const double jitter = SamplingOptions{}.jitter;
    report.at_most("gap at the first force, one block jittered" + in + " [h]", jittered<D>(jitter, 0, quick), 0.25,
                   source + "particles stand out of the nominal face by up to 0.125 h");
    report.at_most("gap at the first force, both jittered" + in + " [h]", jittered<D>(jitter, jitter, quick), 0.5,
                   source + "particles stand out of both nominal faces by up to 0.125 h");
}

template <int D>
void check_parting(Case& report) {
    const double jitter = SamplingOptions{}.jitter;
    Parting worst;
    for (const double turn : {0.0, 30.0})
        for (const std::array<double, 2>& of : {std::array{0.0, 0.0}, std::array{jitter, jitter}}) {
            if (report.quick() && D == 3 && turn == 0) continue;
            const Parting felt = part<D>({.turn = turn, .jitter = of, .gap = 0, .speed = 0.01}, D == 2 ? 400 : 60);
            worst.impulse = std::max(worst.impulse, felt.impulse);
            worst.velocity = std::max(worst.velocity, felt.velocity);
        }
    const std::string in = formatted(", %dD", D);
    report.at_most("pulled apart: largest impulse between the groups, over m v" + in, worst.impulse, 0,
                   "none: surfaces that part do not feel each other");
    report.at_most("pulled apart: velocities against those of free blocks, relative" + in, worst.velocity, 1e-12,
                   "free flight; rounding");
}

Curve drawn(const Approach& of, const std::string& label) {
    Curve curve{label};
    for (std::size_t i = 0; i < of.gap.size(); i += 4) curve.add(-of.gap[i], of.force[i]);
    return curve;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Gap at the first force",
        "Two blocks, 10 cells wide, E = 1 Pa, ν = 0.3, ρ = 1 kg/m³, 2 × 2 particles a cell, approach each other "
        "slowly, at ±0.001 c. Each is a contact group of its own. The gap between their nominal faces when they "
        "feel the first force should be 0. Blocks that touch are pulled apart: there should be no force at all. "
        "Of blocks at several places in the grid, and with several patterns of particles, the farthest from 0 "
        "is reported.");
    const bool quick = report.quick();
    check_approach<2>(report);
    check_approach<3>(report);
    check_parting<2>(report);
    check_parting<3>(report);

    for (const double turn : {0.0, 30.0}) {
        const Pressed run = press_and_pull<2>({.turn = turn}, 0.02, 160);
        const std::string of = turn == 0 ? ", uniform" : ", turned by 30°";
        report.at_most("pressed, then pulled apart: largest force that pulls over the largest that presses" + of,
                       run.pull, 0, "none: contact is unilateral");
        report.check({"pressed, then pulled apart: time of the last force over the duration of the pressing load" + of,
                      run.late, 1, 0.1,
                      "what is pulled lets go; the first mode of a block takes half of that duration"});
    }

    // What one field of velocities does, and harder cases.
    const double one = gap_at_first_force<2, OneField>({.gap = 3.5}),
                 one_turned = gap_at_first_force<2, OneField>({.turn = 30, .gap = 3.5});
    const Parting stuck = part<2, OneField>({.gap = 0, .speed = 0.01}, 400);
    Plot& plot = report.plot(
        {"force", "Force between blocks that approach, 2D", "−gap of the nominal faces [h]", "F / ρ c v A"});
    const double jitter = SamplingOptions{}.jitter;
    plot.curves = {
        drawn(approach<2>({.gap = 0.3}, -0.3), "uniform"),
        drawn(approach<2>({.turn = 30, .gap = 0.3}, -0.3), "turned by 30°"),
        drawn(approach<2>({.jitter = {jitter, 0}, .gap = 0.3}, -0.3), "one jittered"),
        drawn(approach<2>({.jitter = {jitter, jitter}, .gap = 0.4}, -0.3), "both jittered"),
        drawn(approach<2, OneField>({.gap = 3.2}, -0.3), "one field"),
        {"plane waves from gap 0", {-3.2, 0, 0, 0.04, 0.04, 0.3}, {0, 0, 1, 1, 0, 0}, Curve::Kind::reference}};
    report.remark(formatted("Without groups, the blocks feel each other at a gap of %.2f h, turned blocks at %.2f h. ",
                            one, one_turned) +
                  formatted("Pulled apart from touch, the velocities of their particles are off by up to %.0f %%.",
                            100 * stuck.velocity));
    if (!quick) {
        const double corner = uniform<2>(0, false, 3.3), corner_turned = uniform<2>(30, false, 3.3),
                     corner_3d = uniform<3>(0, true, 3.3), askew = uniform<3>(30, true, 3.3);
        report.remark(
            formatted("Harder than these checks are blocks that face each other partly (moved along the face by 3.3 "
                      "cells): %.2f h, turned %.2f h, ",
                      corner, corner_turned) +
            formatted("in 3D %.2f h and %.2f h. ", corner_3d, askew) +
            "At a node near the corner of one block, the particles of the blocks lie on different sides of the node, "
            "so the "
            "plane is found less exactly; in 3D, contact can begin at the first step there (0.3 h is where these "
            "blocks "
            "start).");
        const double rough = jittered<2>(0.5, 0, true), both = jittered<2>(0.5, 0.5, true),
                     rough_3d = jittered<3>(0.5, 0, true), both_3d = jittered<3>(0.5, 0.5, true);
        report.remark(
            formatted("Particles that are jittered by up to half a spacing, so that they stand out by 0.25 h: one "
                      "block %.2f h, both %.2f h, ",
                      rough, both) +
            formatted("in 3D %.2f h and %.2f h.", rough_3d, both_3d));
    }
    const double gradient = gap_at_first_force<2>({.gap = 1, .normals = ContactNormals::volume_gradient}),
                 gradient_turned =
                     gap_at_first_force<2>({.turn = 30, .gap = 1, .normals = ContactNormals::volume_gradient});
    report.remark(
        formatted("With normals from the gradients of volume (ContactNormals::volume_gradient), uniform blocks "
                  "feel the first force at %.2f h, turned ones at %.2f h: ",
                  gradient, gradient_turned) +
        "at the corners of the blocks the normals are wrong by up to 45°, and the gap is measured along them.");
    return report.finish();
}
