/// \file What sticks to walls with mirrored nodes, slides along them, bounces, and leaves them.
#include "case.hpp"
#include "scenes/ball.hpp"
#include "scenes/incline.hpp"
#include "scenes/walls.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Layer {
    double lowest = 0, all = 0;  ///< errors: of the lowest row, relative; the largest, over the displacement of the top
    Curve moved{}, gap{};        ///< of each row: displacement; distance from the next row above, over that at first
};
Layer layer(const std::string& label, bool sheared, double pull, double h, NodesBehind nodes_behind) {
    SoftLayer soft(sheared, pull, h, nodes_behind);
    soft.settle();
    Layer out{.moved = {label}};
    const auto rows = soft.rows();
    for (const auto& row : rows) {
        out.moved.add(row.moved / SoftLayer::height, row.before / SoftLayer::height);
        out.all = std::max(out.all, std::abs(row.moved - row.expected) / soft.displacement(SoftLayer::height));
    }
    out.lowest = std::abs(rows.front().moved / rows.front().expected - 1);
    return out;
}

void check_layers(Case& report) {
    for (const bool sheared : {true, false}) {
        const double pull = 100;  // strains up to 1 and 0.6
        const std::string what = sheared ? "sheared" : "pulled";
        Plot& plot = report.plot({what, "The lower fifth of a soft layer that sticks to the floor, " + what,
                                  sheared ? "u_x / H" : "u_y / H", "Y / H"});
        const SoftLayer soft(sheared, pull, 0.01, NodesBehind::held);
        Curve exact{"exact", {}, {}, Curve::Kind::reference};
        for (double Y = 0; Y <= 0.2; Y += 0.01)
            exact.add(soft.displacement(Y * SoftLayer::height) / SoftLayer::height, Y);
        plot.curves.push_back(exact);
        std::string remark;
        for (const double h : {0.01, 0.005}) {
            if (report.quick() && h < 0.01) continue;
            for (const NodesBehind nodes_behind : {NodesBehind::held, NodesBehind::mirrored}) {
                const std::string name = verification::name_of(nodes_behind);
                Layer of = layer(formatted("%s, h = %g mm", name.c_str(), 1000 * h), sheared, pull, h, nodes_behind);
                while (of.moved.y.back() > 0.2) of.moved.x.pop_back(), of.moved.y.pop_back();
                plot.curves.push_back(of.moved);
                if (nodes_behind == NodesBehind::mirrored) {
                    report.at_most(formatted("displacement of the lowest row, %s, mirrored, h = %g mm, relative",
                                             what.c_str(), 1000 * h),
                                   of.lowest, 0.05, "exact solution; held nodes are off by a third");
                    report.at_most(
                        formatted("largest error of a row over the displacement of the top, %s, mirrored, h = %g mm",
                                  what.c_str(), 1000 * h),
                        of.all, 0.5 * h / SoftLayer::height * 0.1, "exact solution; a twentieth of h/H");
                }
                remark += (remark.empty() ? "" : "; ") + name +
                          formatted(" %s (h = %g mm)", percent(of.lowest).c_str(), 1000 * h);
            }
        }
        report.remark("The lowest row of particles of the layer that is " + what +
                      ", h/4 above the floor, has this error of its displacement: " + remark + ".");
    }
}

void check_pull(Case& report) {
    for (const auto& pull : {Vec<double, 2>{0.0, 5.0}, Vec<double, 2>{3.0, 5.0}}) {
        const std::string how = pull[0] == 0 ? "straight" : "askew";
        const auto felt = PulledOff(pull, NodesBehind::mirrored).after(0.2);
        const char* const source = "what leaves a wall is free; rounding of 200 steps";
        report.at_most("block pulled off, " + how + ": the floor's impulse over the block's", felt.impulse, 1e-14,
                       source);
        report.at_most("block pulled off, " + how + ": largest |τ_yy| over E", felt.stress, 1e-13, source);
        report.at_most("block pulled off, " + how + ": velocity against a free fall's, relative", felt.velocity, 1e-13,
                       source);
    }
}

void check_incline(Case& report) {
    std::string remark;
    for (const double friction : {0.0, 0.3, 0.45}) {
        double error[2] = {}, acceleration[2] = {};
        for (const NodesBehind nodes_behind : {NodesBehind::held, NodesBehind::mirrored}) {
            const Slide run = slide({.friction = friction, .young = report.quick() ? 1e7 : 1e8, .wall = nodes_behind});
            error[int(nodes_behind)] = run.error();
            acceleration[int(nodes_behind)] = run.error_of_acceleration();
        }
        report.at_most(formatted("block on an incline, μ = %.2f: way after 0.5 s, mirrored, relative error", friction),
                       error[1], friction < 0.4 ? 1e-3 : 0.05, "rigid block; as the case Block on an incline");
        report.at_most(
            formatted("block on an incline, μ = %.2f: the error of the way, mirrored over held, above 1", friction),
            std::max(0.0, error[1] / error[0] - 1), 0.2, "no worse; how a block starts is chaotic");
        remark += formatted("%sμ = %.2f: %.2g (held %.2g), acceleration %.1g (held %.1g)", remark.empty() ? "" : "; ",
                            friction, error[1], error[0], acceleration[1], acceleration[0]);
    }
    report.remark("Errors of the block that slides on a wall with mirrored nodes: way, μ = " + remark.substr(5) + ".");
}

void check_bounce(Case& report) {
    double left[2] = {}, approach[2] = {};
    for (const NodesBehind nodes_behind : {NodesBehind::held, NodesBehind::mirrored}) {
        Ball<2, double> ball(1.0 / 32, 1e5, 0.5, {}, nodes_behind);
        const double start = ball.energy(), touch = std::sqrt(2 * 0.5 / 9.81);
        while (ball.simulation.time() < touch + 0.25) {
            ball.simulation.step();
            approach[int(nodes_behind)] = std::max(approach[int(nodes_behind)], -ball.height());
        }
        left[int(nodes_behind)] = ball.energy() / start;
    }
    report.check({"disk that bounces: energy left, mirrored over held", left[1] / left[0], 1, 0.01,
                  "no less: the mirrored disk of a symmetric collision"});
    const auto kept = [&](int i) { return percent(left[i], 2); };
    const auto way = [&](int i) { return formatted("%.2f h", approach[i] * 32); };
    report.remark(
        "A disk that falls on a floor that it may leave (h = R/8) keeps " + kept(1) +
        " of its energy with mirrored nodes, and " + kept(0) + " with held ones; its centre comes " + way(1) + " and " +
        way(0) +
        " nearer to the floor than a rigid disk's. A ball in 3D is the same with both, to 5 digits. The floor "
        "is felt one cell early with both: a disk meets its mirror image as two bodies meet on a grid, and "
        "hardly any of its particles comes nearer to the floor than half a cell, where mirrored nodes differ.");
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Sticking to walls, sliding, and leaving them",
        "The nodes behind a wall are held or mirrored (NodesBehind). A soft layer (neo-Hookean, μ = 10 kPa, λ = 0, ρ = "
        "1000 kg/m³, H = 0.1 m, 2 × 2 particles a cell) sticks to the floor, and an acceleration of 100 m/s² shears it "
        "(by up to 1) or pulls it (by up to 0.6). At rest, P_xy = μ F_xy or P_yy = μ (F_yy − 1/F_yy) bears the weight "
        "above. A block "
        "that rests on a floor is pulled off. A block slides down an incline with friction, and a disk bounces, as in "
        "the cases of these names.");
    check_layers(report);
    check_pull(report);
    check_incline(report);
    check_bounce(report);
    return report.finish();
}
