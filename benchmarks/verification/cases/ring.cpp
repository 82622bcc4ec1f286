/// \file A ring turns on a disk under load.
#include "scenes/ring.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Ring on a disk",
        "A ring with the radii 8 and 16 cells turns on a disk that is bonded to the floor of the domain; in 3D. "
        "Both are 3 cells thick, E = 1e7 Pa, ν = 0.3. A uniform load of 10 kPa grows in 8 ms and presses the "
        "ring on the disk; Coulomb friction μ brakes it. The torque T is what the ring's angular momentum "
        "about its axis loses, the normal force N is that of the contact impulses, both as means over the "
        "second 16 ms. Under uniform pressure, T = ⅔ μ N (r_o³ − r_i³)/(r_o² − r_i²). And T = μ Σ N_p r_p over "
        "the lowest particles of the ring, where their stress gives the shares N_p of N.");
    const double h = 1.0 / 64, inner = 8 * h, outer = 16 * h,
                 arm = 2.0 / 3 * (std::pow(outer, 3) - std::pow(inner, 3)) / (std::pow(outer, 2) - std::pow(inner, 2)),
                 load = 1e4 * std::numbers::pi * (outer * outer - inner * inner);
    Plot& spins = report.plot({"spin", "Angular velocity of the ring", "t [s]", "ω [rad/s]"});
    Plot& torques = report.plot({"torque", "Torque over that of the whole load", "t [s]", "T/(μ F r) [1]"});
    const auto look = [&](const RingOptions& options, const std::string& label) {
        const Braking run = brake_ring(options, Apic{});
        spins.curves.push_back({label, run.time, run.spin});
        Curve torque{label};
        for (std::size_t i = 0; i < run.time.size(); ++i)
            torque.add(run.time[i], run.torque[i] / (options.friction * load * arm));
        torques.curves.push_back(torque);
        report.check({"torque, " + label + " [N m]", run.mean_torque, options.friction * run.mean_normal * arm, 0.02,
                      "⅔ μ N (r_o³ − r_i³)/(r_o² − r_i²)"});
        report.check({"torque, " + label + ", by the particles' forces [N m]", run.mean_torque,
                      options.friction * run.mean_normal * run.arm, 0.02, "μ Σ N_p r_p"});
        return run;
    };
    look({.friction = 0.3}, "μ = 0.3");
    if (report.quick()) return report.finish();
    look({.friction = 0.15}, "μ = 0.15");
    look({.friction = 0.3, .turned = true}, "μ = 0.3, disk turned by 30°");
    const RingOptions options{.friction = 0.3};
    const Braking flip = brake_ring(options, Flip<double>{.ratio = 1}),
                  together = brake_ring({.friction = 0.3, .groups = false}, Apic{});
    spins.curves.push_back({"without groups", together.time, together.spin});
    report.remark(formatted("FLIP with a share of 1: the torque is %.4f of the formula's.",
                            flip.mean_torque / (0.3 * flip.mean_normal * arm)));
    return report.finish();
}
