/// \file A strip footing sinks into clay: the limit load, with and without F-bar.
#include "scenes/footing.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Sunk {
    double load = 0;  ///< at a settlement of 0.02 B, over c_u
    Curve curve{};
};

template <class... Policies>
Sunk push(const std::string& label, int cells, NodesBehind behind = NodesBehind::held, double duration = 25) {
    Footing<Policies...> footing(cells, behind);
    footing.push(duration, 0.5);
    Sunk out{footing.last_load(), {sentence(label, ", h = B/", cells)}};
    for (std::size_t i = 0; i < footing.sunk.size(); ++i) out.curve.add(footing.sunk[i], footing.load[i]);
    std::printf("%s: %.4f c_u, %.4f of the exact; %d steps\n", out.curve.label.c_str(), out.load,
                out.load / footing.limit, int(footing.simulation.steps()));
    std::fflush(stdout);
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Strip footing on clay: limit load",
                "A rigid rough strip, B = 1 m wide, is pushed by 0.02 B into weightless clay in plane strain: von "
                "Mises, c_u = σ_Y/√3 = 10 kPa, no hardening, E = 10 MPa, ν = 0.49. The right half is computed, 5 B × 5 "
                "B, h = B/8, B/16, B/32, 2 × 2 particles a cell, quadratic splines, APIC. The nodes of the surface "
                "under the strip move with it; its load is what they bear (Reactions). Exact: (2 + π) c_u (Prandtl "
                "1920).");
    const bool quick = report.quick();
    const double limit = Footing<>::limit;
    using W = WeightGradientForce;
    const std::string mls = "MLS", gradients = "weight gradients", with = ", F-bar";
    Plot& sink = report.plot({"load", "Load over settlement", "s / B", "load / (B c_u)"});
    sink.curves.push_back({"2 + π", {0, 0.02}, {limit, limit}, Curve::Kind::reference});
    const auto drawn = [&](const Sunk& of) {
        sink.curves.push_back(of.curve);
        return of.load;
    };
    const double locked8 = push<MlsForce>(mls, 8).load, free8 = push<MlsForce, FBar>(mls + with, 8).load;
    const double locked16 = drawn(push<MlsForce>(mls, 16));
    const double free16 = drawn(push<MlsForce, FBar>(mls + with, 16));
    const std::string source = "(2 + π) c_u, Prandtl 1920; ";
    const std::string edge =
        "our aim: 12.5 % at B/8 and half as much at B/16, as the strip acts on half a cell beyond "
        "its edge";
    report.check({"load/c_u, MLS, F-bar, h = B/8", free8, limit, 0.125, source + edge});
    report.check({"load/c_u, MLS, F-bar, h = B/16", free16, limit, 0.0625, source + edge});
    if (!quick) {
        const double locked_gradients = drawn(push<W>(gradients, 16));
        const double free_gradients = drawn(push<W, FBar>(gradients + with, 16));
        const double free32 = drawn(push<MlsForce, FBar>(mls + with, 32));
        const double extrapolated = 2 * free32 - free16;
        report.check({"load/c_u, weight gradients, F-bar, h = B/16", free_gradients, limit, 0.0625, source + edge});
        report.check({"load/c_u, MLS, F-bar, h = B/32", free32, limit, 0.06, source + "our aim: 6 %"});
        report.check({"load/c_u, MLS, F-bar, extrapolated to h = 0 from B/16 and B/32", extrapolated, limit, 0.03,
                      source + "our aim: 3 %"});
        report.remark("Without F-bar the load rises on and on: MLS " + two_decimals(locked16) +
                      " c_u, weight gradients " + two_decimals(locked_gradients) + " c_u at h = B/16.");
    }
    report.remark("h = B/8: " + two_decimals(locked8) + " c_u without F-bar, " + two_decimals(free8) + " c_u with it.");
    return report.finish();
}
