/// \file A part of a collision beside slipping walls with mirrored nodes, against the whole without walls.
#include "case.hpp"
#include "scenes/walls.hpp"

using namespace firn;
using namespace verification;

namespace {

/// The largest distance of a particle from where the whole run has it, within 200 steps, over L, and over steps.
template <int D, class Transfer, class Force>
Curve off_whole(int cells, int planes, NodesBehind nodes_behind = NodesBehind::mirrored) {
    const HalvedCubes<D, Transfer, Force> cubes{cells, planes};
    auto part = cubes.make(true, nodes_behind), whole = cubes.make(false);
    Curve off;
    double largest = 0;
    for (int i = 1; i <= 200; ++i) {
        part.step();
        whole.step();
        if (i % 10 != 0) continue;
        largest = std::max(largest, largest_distance(part, whole) / cubes.side);
        off.add(i, std::max(largest, 1e-17));
    }
    return off;
}

template <class Transfer, class Force>
void check(Case& report, Plot& plot, const std::string& label, bool drawn) {
    const int cells = report.quick() ? 4 : 8;
    const auto hold = [&](const char* what, const Curve& off) {
        report.at_most(sentence(what, ", ", label, ": largest |Δx| over L"), off.y.back(), 1e-12,
                       "a plane of symmetry changes nothing; rounding of 200 steps");
    };
    const Curve half = off_whole<2, Transfer, Force>(cells, 1);
    hold("half of two squares", half);
    hold("quarter of two squares", off_whole<2, Transfer, Force>(cells, 2));
    hold("half of two cubes", off_whole<3, Transfer, Force>(cells, 1));
    hold("quarter of two cubes", off_whole<3, Transfer, Force>(cells, 2));
    if (!drawn) return;
    for (const bool mirrored : {true, false}) {
        plot.curves.push_back(mirrored ? half : off_whole<2, Transfer, Force>(cells, 1, NodesBehind::held));
        plot.curves.back().label = label + (mirrored ? ", mirrored" : ", held");
    }
}

template <class Transfer>
void check(Case& report, Plot& plot, const std::string& label) {
    check<Transfer, MlsForce>(report, plot, label + ", MLS", true);
    check<Transfer, WeightGradientForce>(report, plot, label + ", weight gradients", false);
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Half against whole",
                "Two elastic cubes (in 2D squares) of side L = 0.25 m fly at each other at 2 m/s and bounce (E = 10⁴ "
                "Pa, ν = 0.3, ρ = 1000 kg/m³, L = 8 h, 2 particles a cell and axis). The plane x = 0 halves both of "
                "them and lies on nodes. One run has all of both bodies and no wall; the other has what is in front of "
                "the plane, and a slipping wall with mirrored nodes there. A second plane (z = 0 in 3D; in 2D y = 0, "
                "where the squares meet) leaves a quarter, with an edge between the walls. All runs are in double.");
    Plot& plot =
        report.plot({"squares", "Half of two squares: largest distance from the whole run", "step", "|Δx| / L", true});
    check<Apic>(report, plot, "APIC");
    check<Pic>(report, plot, "PIC");
    check<Flip<double>>(report, plot, "FLIP 0.95");
    check<Fmpm>(report, plot, "FMPM(2)");
    report.remark(
        "A slipping wall with mirrored nodes is a plane of symmetry, to rounding. With held nodes, particles of half "
        "the squares are up to " +
        percent(plot.curves[1].y.back()) + " of L from those of the whole (APIC).");
    return report.finish();
}
