/// \file An elastic ball bounces, on a floor that acts on nodes or by the gap of particles: against Hertz's contact in
/// 3D, and how high a disk comes back with each transfer.
#include "case.hpp"
#include "scenes/ball.hpp"

#include <utility>

using namespace firn;
using namespace verification;

namespace {

constexpr double g = 9.81;

struct Impact {
    Curve force;
    double approach = 0,
           duration = 0;  ///< how far the centre comes below the touch [m]; force above 2 % of its peak [s]
    double rebound = 0;   ///< the height it will reach, over that it fell from
    double energy = 0;    ///< left, over its start
    double momentum = 0;  ///< largest error of its balance, over the greatest momentum
    double first = 0;     ///< way of the centre below the touch when the floor first pushes [m]
};

/// A ball falls, until it has left the floor.
template <bool ByGap = false>
Impact impact(double h, double young, double drop, const Hertz& hertz, NodesBehind nodes_behind = NodesBehind::held) {
    Ball<3, float, Apic, ByGap> ball(h, young, drop, {}, nodes_behind);
    auto& simulation = ball.simulation;
    const double mass = simulation.totals().mass, touch = std::sqrt(2 * drop / g), start = ball.energy();
    Impact out{{formatted("h = R/%.0f", Ball<3, float>::radius / h)}};
    double given = 0, peak = 0, scale = 0;
    bool touched = false;
    while (simulation.time() < touch + 1.4 * hertz.duration) {
        simulation.step();
        const double impulse = simulation.reactions->parts[0].impulse[1];
        given += impulse;
        if (impulse != 0 && !std::exchange(touched, true)) out.first = -ball.height();
        const double momentum = simulation.totals().momentum[1];
        scale = std::max(scale, std::abs(momentum));
        out.momentum = std::max(out.momentum, std::abs(momentum - (given - mass * g * simulation.time())));
        out.force.add(simulation.time(), impulse / simulation.last_time_step());
        peak = std::max(peak, out.force.y.back());
        out.approach = std::max(out.approach, -ball.height());
    }
    out.momentum /= scale;
    double first = 0, last = 0;
    for (std::size_t i = 0; i < out.force.x.size(); ++i)
        if (out.force.y[i] > 0.02 * peak) {
            if (first == 0) first = out.force.x[i];
            last = out.force.x[i];
        }
    out.duration = last - first;
    const double v = simulation.totals().momentum[1] / mass;
    out.rebound = (ball.height() + v * v / (2 * g)) / drop;
    out.energy = ball.energy() / start;
    return out;
}

/// The height of a disk of 1e5 Pa that falls by 0.5 m.
template <class Transfer, bool ByGap = false>
Curve bounces(const std::string& label, double duration, const Transfer& transfer = {}) {
    Ball<2, double, Transfer, ByGap> ball(1.0 / 32, 1e5, 0.5, transfer);
    Curve height{label};
    for (int i = 0; 0.01 * i <= duration; ++i) {
        if (i > 0) ball.simulation.advance(0.01 * i - ball.simulation.time());
        height.add(0.01 * i, ball.height());
    }
    return height;
}

/// The highest point after the first time below the touch.
double first_return(const Curve& height) {
    std::size_t i = 0;
    while (i < height.y.size() && height.y[i] > 0) ++i;
    while (i < height.y.size() && height.y[i] <= 0) ++i;
    double highest = 0;
    for (; i < height.y.size() && height.y[i] > 0; ++i) highest = std::max(highest, height.y[i]);
    return highest;
}

/// The ball on a floor that acts by the gap of particles, with held and with mirrored nodes behind it.
void check_by_gap(Case& report, double young, double drop, const Hertz& half_space, const Hertz& whole) {
    const double R = Ball<3, float>::radius;
    Plot& forces =
        report.plot({"force_by_gap", "Force of the floor by the gap of particles (APIC, float)", "t [s]", "F [N]"});
    for (const NodesBehind nodes_behind : {NodesBehind::held, NodesBehind::mirrored}) {
        const std::string how = std::string("by the gap, ") + verification::name_of(nodes_behind);
        Curve approaches;
        std::string remark;
        for (double cells = 4; cells <= (report.quick() ? 8 : 16); cells *= 2) {
            const double h = R / cells;
            const Impact one = impact<true>(h, young, drop, half_space, nodes_behind);
            const std::string label = one.force.label + ", " + how;
            if (nodes_behind == NodesBehind::held) forces.curves.push_back(one.force);
            report.at_most("first push of the floor, " + label + ": how far from the touch, over h",
                           std::abs(one.first) / h, 0.1,
                           "the nominal surfaces meet; in a step the ball flies by up to 0.05 h, and its lowest "
                           "particles lie on lines of a lattice");
            report.check({"greatest approach, " + label + " [m]", one.approach, whole.approach, 1.2 / cells,
                          "Hertz, Lurie for the whole ball; first order in h"});
            report.check({"duration of the contact, " + label + " [s]", one.duration, whole.duration, 0.4 / cells,
                          "Hertz, Lurie for the whole ball; first order in h"});
            report.at_most("balance of momentum: floor's impulse, weight, ball, " + label, one.momentum, 1e-5,
                           "Newton; sums of some 600 steps in float");
            approaches.add(h, one.approach);
            remark +=
                formatted("%s%s: approach %.1f %% of the whole ball's, duration %.1f %%, height %.0f %%",
                          remark.empty() ? "" : "; ", one.force.label.c_str(), 100 * one.approach / whole.approach,
                          100 * one.duration / whole.duration, 100 * one.rebound);
        }
        if (!report.quick())
            report.check({"greatest approach, " + how + ", extrapolated to h = 0 from the two finest [m]",
                          2 * approaches.y[2] - approaches.y[1], whole.approach, 0.03,
                          "Hertz, Lurie for the whole ball; linear elasticity"});
        report.remark("Floor " + how + ". " + remark + ".");
    }
    for (const auto& [label, hertz] : {std::pair{"Hertz, half-space", &half_space}, std::pair{"whole ball", &whole}}) {
        Curve theory{label, {}, {}, hertz == &whole ? Curve::Kind::reference : Curve::Kind::ours};
        for (std::size_t i = 0; i < hertz->time.size(); ++i)
            theory.add(hertz->time[i] + std::sqrt(2 * drop / g), hertz->force[i]);
        forces.curves.push_back(theory);
    }
}

}  // namespace

int main(int argc, char** argv) {
    using Ball3 = Ball<3, float>;
    const double young = 1e6, drop = 0.1, R = Ball3::radius;
    const double mass = Ball3::density * 4.0 / 3 * std::numbers::pi * R * R * R, speed = std::sqrt(2 * g * drop);
    const Hertz hertz(mass, R, speed, young, Ball3::poisson), whole(mass, R, speed, young, Ball3::poisson, true);
    Case report(
        argc, argv, "Bouncing ball",
        "An elastic ball (R = 0.25 m, E = 1e6 Pa, ν = 0.3, ρ = 1000 kg/m³) falls by 0.1 m onto a floor that it "
        "may leave again. The reference is Hertz 1882 with gravity: m α̈ = m g − 4/3 E/(1 − ν²) √R α^(3/2), "
        "where α is the way of the ball's centre towards the floor after the touch. Hertz takes the ball for a "
        "half-space beyond the contact. The contact's radius becomes 0.4 R here; by a series of Legendre "
        "polynomials (Lurie 1964) the whole ball is stiffer: it approaches by 87 % as much. Matter feels a floor "
        "as soon as both share a node, or by the gap of particles (GapContact). In 2D, a disk falls by 0.5 m and "
        "bounces, with each transfer.");
    Plot& forces = report.plot({"force", "Force of the floor on the ball (APIC, float)", "t [s]", "F [N]"});
    Curve theory{"Hertz", {}, {}, Curve::Kind::reference};
    for (std::size_t i = 0; i < hertz.time.size(); ++i)
        theory.add(hertz.time[i] + std::sqrt(2 * drop / g), hertz.force[i]);
    Curve approaches;
    for (double cells = 4; cells <= (report.quick() ? 8 : 16); cells *= 2) {
        const double h = R / cells;
        const Impact one = impact(h, young, drop, hertz);
        const std::string label = one.force.label;
        forces.curves.push_back(one.force);
        report.check({"greatest approach, " + label + " [m]", one.approach, hertz.approach, h / hertz.approach + 0.1,
                      "Hertz, Johnson 1985, §11.4; the floor is felt up to a cell early"});
        report.check({"duration of the contact, " + label + " [s]", one.duration, hertz.duration, 0.6 * 4 / cells,
                      "Hertz; first order in h, as the approach"});
        report.at_most("balance of momentum: floor's impulse, weight, ball, " + label, one.momentum, 1e-5,
                       "Newton; sums of some 600 steps in float");
        report.check({"height that it comes back to, " + label, one.rebound, 1, 0.25,
                      "no loss; part of it goes into the ball's vibration, and the grid takes some"});
        approaches.add(h, one.approach);
        report.remark(
            formatted("With %s, %.1f %% of the energy is left, and the ball comes back to %.1f %% of its height.",
                      label.c_str(), 100 * one.energy, 100 * one.rebound));
    }
    forces.curves.push_back(theory);
    if (!report.quick())
        report.check({"greatest approach, extrapolated to h = 0 from the two finest [m]",
                      2 * approaches.y[2] - approaches.y[1], hertz.approach, 0.1,
                      "Hertz; its strains are small, ours up to a sixth of R over the contact"});

    check_by_gap(report, young, drop, hertz, whole);

    const double duration = report.quick() ? 1.5 : 6;
    Plot& heights = report.plot({"height", "Height of a disk, h = R/8", "t [s]", "centre above the touch [m]"});
    Curve fall{"free fall", {}, {}, Curve::Kind::reference};
    for (double t = 0; t <= std::sqrt(2 * 0.5 / g); t += 0.01) fall.add(t, 0.5 - 0.5 * g * t * t);
    const std::vector<Curve> disks{bounces<Apic>("APIC", duration),
                                   bounces<Pic>("PIC", duration),
                                   bounces<Flip<double>>("FLIP, 5 % PIC", duration),
                                   bounces<Aflip<double>>("AFLIP", duration),
                                   bounces<Fmpm>("FMPM(2)", duration),
                                   bounces<Apic, true>("APIC, by the gap", duration)};
    std::string returned;
    for (const Curve& disk : disks) {
        heights.curves.push_back(disk);
        double off = 0;
        for (std::size_t i = 0; i < 25; ++i)
            off = std::max(off, std::abs(disk.y[i] - (0.5 - 0.5 * g * disk.x[i] * disk.x[i])));
        report.at_most("free fall before the touch, " + disk.label + ", largest error [m]", off, 0.5 * g * 0.25 * 0.01,
                       "½ g t²; symplectic Euler falls ½ g t dt farther");
        returned += (returned.empty() ? "" : ", ") + disk.label + formatted(" %.0f %%", 200 * first_return(disk));
    }
    heights.curves.push_back(fall);
    report.remark(
        "Matter feels the floor as soon as both share a node, about one cell early. So the ball is pressed in by less, "
        "and the difference grows with the cell: the error goes with h. The losses go with h, too.");
    report.remark("At its first bounce, the disk comes back to this part of the 0.5 m: " + returned + ".");
    return report.finish();
}
