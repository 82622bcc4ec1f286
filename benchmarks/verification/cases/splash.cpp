/// \file Water after a splash: its depth, the pressure of its layers, and its motion, after 20 s.
#include "scenes/splash.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Outcome {
    std::string label;
    double right = 0, released = 0, compressed = 1;
    Curve depth{label};
    Curve layers{label};
    bool is_mirrored = false;
    double raw = 0, corrected = 0, worst = 0, at_floor = 0, kinetic = 0, besides_waves = 0;
};

struct Scene {
    double width, height;
    const char* name;
};
constexpr Scene dam{0.4, 0.4, "dam"}, still{1, 0.16, "still"};

template <class S = float, class Volume>
Outcome settle(const Scene& scene, int cells, int per_cell, NodesBehind behind, const Volume& volume,
               const std::string& more = "", std::uint64_t seed = 0, double end = 20) {
    const std::string p = std::to_string(per_cell);
    Outcome out{sentence(scene.name, ", h = 1/", cells, ", ", p, " × ", p,
                         behind == NodesBehind::mirrored ? ", mirrored" : "", more)};
    Splash<S, Volume> water(scene.width, scene.height, 1.0 / cells, per_cell, behind, seed, volume);
    out.is_mirrored = behind == NodesBehind::mirrored;
    out.compressed = water.compressed();
    out.right = water.depth_at_rest, out.released = water.released;
    const auto see = [&](double time, double depth) { out.depth.add(time, depth / out.right); };
    water.go_on(end - 4, see);
    const auto mean = water.go_on(4, see);
    out.raw = mean.raw_depth, out.corrected = mean.depth, out.worst = mean.worst_layer(),
    out.at_floor = mean.at_floor(), out.kinetic = mean.kinetic;
    out.besides_waves = mean.kinetic_besides_waves;
    for (std::size_t k = 0; k < mean.pressures.size(); ++k)
        out.layers.add(mean.pressures[k], (double(k) + 0.5) / cells / out.right);
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Water after a splash",
        "A column of water, 0.4 m wide and high, collapses in a box of 1 m with slipping walls (dam), or a layer "
        "of 0.16 m is let go (still): ρ = 1000 kg/m³, K = 100 kPa, no viscosity, VolumeFilter. After 20 s the "
        "water must fill its volume. Figures are means over the last 4 s. Waves go on for a minute; as they "
        "lift the centre of mass by their energy, the depth is given with and without this.");
    constexpr auto held = NodesBehind::held, mirrored = NodesBehind::mirrored;
    const VolumeFilter filter;
    std::vector<Outcome> all{settle(dam, 32, 2, held, filter), settle(dam, 32, 4, held, filter),
                             settle(dam, 32, 2, mirrored, filter), settle(still, 32, 2, held, filter),
                             settle(still, 32, 2, mirrored, filter)};
    const Outcome own = settle(dam, 32, 2, held, OwnVolume{}, ", no filter"),
                  unshifted = settle(dam, 32, 2, held, VolumeFilter{.shifting = 0}, ", no shifting");
    std::vector<Outcome> more;
    if (!report.quick()) {
        all.push_back(settle<double>(dam, 32, 2, held, filter, ", double"));
        all.push_back(settle(dam, 32, 2, held, filter, ", jittered", 1));
        all.push_back(settle(still, 64, 2, mirrored, filter));
        more.push_back(settle(dam, 64, 2, held, filter));
        more.push_back(settle(dam, 64, 2, held, VolumeFilter{.shifting = 1}, ", shifting = 1"));
        more.push_back(settle(still, 64, 2, held, filter));
        more.push_back(settle(still, 64, 2, held, VolumeFilter{.shifting = 1}, ", shifting = 1"));
        more.push_back(settle(dam, 64, 4, held, filter));
    }

    Plot& depth = report.plot({"depth", "Twice the height of the centre of mass, over the depth at rest", "t [s]", ""});
    depth.curves.push_back({"at rest", {0, 20}, {1, 1}, Curve::Kind::reference});
    for (const Outcome* each :
         std::initializer_list<const Outcome*>{&all[0], &all[1], &all[2], &all[3], &unshifted, &own})
        depth.curves.push_back(each->depth);
    Plot& layers = report.plot({"layers", "Pressure of layers of a cell, mean over 4 s", "p / ρ g d", "y / depth"});
    layers.curves.push_back({"ρ g d", {1, 1}, {0, 1}, Curve::Kind::reference});
    for (std::size_t i = 0; i < 5; ++i) layers.curves.push_back(all[i].layers);

    for (const Outcome& each : all) {
        report.check({"depth over volume per width, " + each.label, each.corrected / each.right, each.compressed, 0.03,
                      "1 − ρ g d/2K: its own weight compresses water"});
        report.at_most("pressure of the layers, largest |p/ρ g d − 1|, " + each.label, each.worst, 0.1, "hydrostatic");
        report.at_most("the same of the lowest layer, " + each.label, each.at_floor, each.is_mirrored ? 0.1 : 0.2,
                       each.is_mirrored ? "hydrostatic" : "a fifth: walls that hold nodes (elastic column)");
        if (each.released > 50)  // a dam
            report.at_most("kinetic energy besides the waves over that of the fall, " + each.label,
                           each.besides_waves / each.released, 0.01, "rest, but for four standing waves");
    }
    report.check({"depth with the waves, " + all[0].label, all[0].raw / all[0].right, 1, 0.03, "the volume"});
    report.check({"depth without shifting, " + unshifted.label, unshifted.corrected / unshifted.right, 0.55, 0.1,
                  "no reference: what it was when this case was written"});

    const auto text = [](const Outcome& of) { return percent(of.corrected / of.right - 1); };
    std::string finer;
    for (const Outcome& each : more)
        finer += (finer.empty() ? "" : "; ") + each.label + ": " + text(each) + " (with waves " +
                 percent(each.raw / each.right - 1) + ")";
    report.remark("Without VolumeFilter the depth of the dam is off by " + text(own) +
                  ", with a filter that does not "
                  "shift particles by " +
                  text(unshifted) +
                  ". Nothing compares J of a particle, which is integrated, with the density around it: where the flow "
                  "brings particles together between nodes, no node feels it. Particle shifting moves them apart.");
    report.remark("The kinetic energy in the last 4 s is " + percent(all[0].kinetic / all[0].released, 2) + ", " +
                  percent(all[1].kinetic / all[1].released, 2) + " and " +
                  percent(all[2].kinetic / all[2].released, 2) +
                  " of that of the fall in the first three runs. Nearly all of it is in standing waves.");
    report.remark("Between mirrored walls without friction the waves have " +
                  percent(all[2].kinetic / all[2].released) +
                  " of the energy of the fall after 20 s, and lift the centre of mass so much that the depth is " +
                  percent(all[2].raw / all[2].right - 1) + " too large if that is not taken off.");
    if (!finer.empty())
        report.remark(
            "On finer cells: " + finer +
            ". Between walls that hold nodes, still water is never still; the finer the cells, the more often "
            "particles cross them. Mirrored walls, or a larger rate of shifting, mend it.");
    return report.finish();
}
