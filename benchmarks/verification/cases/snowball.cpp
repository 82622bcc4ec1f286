/// \file A snowball is thrown at a floor: momentum, energy, and the pieces that it breaks into.
#include "scenes/snowball.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

constexpr double speed = 8, duration = 0.12;  // [m/s], [s]

struct Outcome {
    std::string label;
    std::size_t mass_kept = 0;  ///< particles at last, and at first
    std::size_t at_first = 0;
    double momentum = 0, fall = 0, most_energy = 0, touched = 0;
    std::vector<int> before{}, after{};  ///< pieces when it touches the floor, and at last
    Curve kinetic{"kinetic"}, elastic{"elastic"}, total{"kinetic, elastic and potential"};
    Curve pieces{label}, largest{label}, points{label};

    double share() const { return double(after.front()) / double(at_first); }
    /// Pieces of at least a hundredth of the ball.
    double chunks() const {
        return double(
            std::count_if(after.begin(), after.end(), [&](int n) { return 100 * std::size_t(n) >= at_first; }));
    }
};

template <class Material>
Outcome smash(const std::string& label, const Material& material, int cells) {
    Snowball<Material> ball(material, speed, cells);
    Outcome out{label};
    out.at_first = ball.simulation.particles().size();
    const double start = ball.energy();
    const auto balance = ball.run(duration, 0.001, [&](const auto& now) {
        const auto totals = now.simulation.totals();
        const double t = 1000 * now.simulation.time();
        const auto parts = now.parts();
        if (now.simulation.time() < 0.005) out.before = parts;
        out.after = parts;
        out.kinetic.add(t, totals.kinetic_energy / start);
        out.elastic.add(t, totals.elastic_energy / start);
        out.total.add(t, now.energy() / start);
        out.pieces.add(t, double(parts.size()));
        out.largest.add(t, double(parts.front()) / double(out.at_first));
    });
    out.momentum = balance.momentum, out.fall = balance.fall;
    out.most_energy = balance.most_energy, out.touched = balance.touched;
    out.mass_kept = ball.simulation.particles().size();
    for (const auto& x : ball.positions()) out.points.add(x[0], x[1]);
    out.points.kind = Curve::Kind::published;  // drawn as points
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    const auto snow = [](double critical, double hardening = 10) {
        return Snow<double>::from_properties(
            {.critical_compression = 0.025 * critical, .critical_stretch = 0.0075 * critical, .hardening = hardening});
    };
    Case report(argc, argv, "A snowball breaks on a floor",
                "A disk of snow, R = 0.1 m, is thrown down at 8 m/s onto a floor with friction 0.5; g = 9.81 m/s². The "
                "snow is that of Stomakhin et al. 2013 (table 2: E = 140 kPa, ν = 0.2, θc = 0.025, θs = 0.0075, ξ = "
                "10, 400 kg/m³), in plane strain, with 2 × 2 particles a cell. A piece is a group of particles that is "
                "farther than one cell from all other particles.");
    const int cells = 20;
    const std::vector<Outcome> all{
        smash("snow", snow(1), cells), smash("θc, θs × 0.3", snow(0.3), cells), smash("θc, θs × 4", snow(4), cells),
        smash("ξ = 5", snow(1, 5), cells),
        smash("elastic, same E, ν", FixedCorotated<double>::from_young_poisson(1.4e5, 0.2), cells)};
    const Outcome &usual = all[0], &fine = all[1], &coarse = all[2], &ductile = all[3], &elastic = all[4];

    Plot& energy = report.plot({"energy", "Energy of the snow, over its initial value", "t [ms]", "E / E(0)"});
    energy.curves = {usual.kinetic, usual.elastic, usual.total};
    energy.curves.push_back(elastic.total);
    energy.curves.back().label = "all, of the elastic ball";
    Plot& pieces = report.plot({"pieces", "Pieces", "t [ms]", "number"});
    Plot& largest = report.plot({"largest", "Largest piece", "t [ms]", "share of the ball"});
    for (const Outcome& each : all) pieces.curves.push_back(each.pieces), largest.curves.push_back(each.largest);
    for (const Outcome* each : {&usual, &coarse, &ductile})
        report.plot({"after_" + std::string(each == &usual    ? "snow"
                                            : each == &coarse ? "tough"
                                                              : "ductile"),
                     each->label + ", after 120 ms",
                     "x [m]",
                     "y [m]",
                     false,
                     {each->points}});

    for (const Outcome& each : all) {
        report.at_most("momentum, " + each.label, each.momentum, 1e-12,
                       "Δp = g M t + impulses of the floor (Reactions)");
        report.at_most("free fall of the centre of mass, " + each.label, each.fall, 1e-12,
                       "Σ v dt, v = v₀ + g t, of the same steps, until it touches");
        report.at_most("energy gained at any time, " + each.label, each.most_energy - 1, 1e-3,
                       "none; a step of symplectic Euler may exchange a little");
        report.check(
            {"particles at last, " + each.label, double(each.mass_kept), double(each.at_first), 0, "mass is kept"});
        report.check({"pieces before it touches, " + each.label, double(each.before.size()), 1, 0, "a ball"});
    }
    report.check(
        {"pieces of the elastic ball, at last", double(elastic.after.size()), 1, 0, "elasticity has no fracture"});
    report.check({"pieces of the ball with ξ = 5, at last", double(ductile.after.size()), 1, 0,
                  "Stomakhin et al. 2013: the smaller ξ, the more ductile"});
    report.at_most("largest piece of the snowball, share", usual.share(), 0.95, "it breaks");
    report.at_most("1 / chunks of the snowball", 1 / usual.chunks(), 0.5, "into at least two of 1 % or more");
    report.at_most("largest piece with θc, θs × 4 over that with × 1", coarse.share() / usual.share(), 0.95,
                   "Stomakhin et al. 2013: the larger θc and θs, the chunkier");
    report.at_most("largest piece with θc, θs × 1 over that with × 0.3", usual.share() / fine.share(), 0.95,
                   "the same");

    std::string counts;
    for (const Outcome& each : all)
        counts += sentence(counts.empty() ? "" : "; ", each.label, ": ", each.after.size(), " pieces, ", each.chunks(),
                           " with at least 1 % of the ball, the largest with ", two_decimals(each.share()));
    report.remark("After 120 ms with h = R/20, the balls have these pieces (the largest as a share of the ball): " +
                  counts + ".");
    if (!report.quick()) {
        const Outcome finer = smash("snow, h = R/40", snow(1), 40);
        pieces.curves.push_back(finer.pieces), largest.curves.push_back(finer.largest);
        report.at_most("largest piece, h = R/40, share", finer.share(), 0.95, "it breaks");
        report.at_most("momentum, h = R/40", finer.momentum, 1e-12, "as above");
        report.remark(sentence("With cells of R/40 there are ", finer.after.size(), " pieces, ", finer.chunks(),
                               " with at least 1 % of the ball, the largest with ", two_decimals(finer.share()),
                               ". Where the ball breaks depends on the cells. That it breaks into a core, chunks at "
                               "both sides and crumbs does not."));
    }
    report.remark(
        "The method resolves cracks badly. A crack is a gap of one cell that kernels do not bridge. So most pieces are "
        "single particles thrown off the rim, and their number grows with the number of cells. The grid chooses where "
        "the ball breaks: the ball and its pieces are symmetric. With θc, θs × 0.3 the ball is crushed to a cake and "
        "not to powder, because the crushing takes up the energy before the stretch can break the ball. The paper "
        "shows powder, from varied materials in 3D. It gives pictures only.");
    return report.finish();
}
