/// \file Two elastic disks collide: when they touch, what is conserved, what energy is left.
#include "scenes/disks.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Outcome {
    Curve energy, speed;
    double onset = 0;     ///< when a disk's speed has changed by a hundredth [s]
    double momentum = 0;  ///< largest change of the momentum, over that of a disk
    double angular = 0;   ///< largest change of the angular momentum, over that of a disk × 1 m
    double highest = 0;   ///< of the energy, over its start

    double gained() const { return std::max(highest - 1, 0.0); }
};

template <class S, class Transfer = Apic, class Force = MlsForce, class Kernel = QuadraticBSpline,
          class Execution = Coloured>
Outcome collide(const std::string& label, double h, const Transfer& transfer = {}, double step = 0.4) {
    using TheDisks = Disks<S, Transfer, Force, Kernel, Execution>;
    TheDisks disks(h, transfer);
    const double dt = disks.simulation.fixed_time_step = step * h;  // [s]: 0.4 s/m is 0.47 of a cell in sound's way
    const auto start = disks.simulation.totals();
    const double energy = disks.energy(), v = disks.speed(disks.lower), of_a_disk = start.mass / 2 * v;
    Outcome out{{label}, {label}};
    for (int i = 0; i * dt <= 3.5; ++i) {
        if (i > 0) disks.simulation.step();
        const auto now = disks.simulation.totals();
        const double left = (now.kinetic_energy + now.elastic_energy) / energy, speed = disks.speed(disks.lower) / v;
        out.energy.add(i * dt, left);
        out.speed.add(i * dt, speed);
        if (out.onset == 0 && std::abs(speed - 1) > 1e-2) out.onset = i * dt;
        out.highest = std::max(out.highest, left);
        out.momentum = std::max(out.momentum, norm(now.momentum - start.momentum) / of_a_disk);
        out.angular = std::max(out.angular, std::abs(now.angular_momentum - start.angular_momentum) / of_a_disk);
    }
    return out;
}

/// How much of its energy a transfer may gain, and why.
std::pair<double, const char*> most_gained(const std::string& transfer) {
    if (transfer.find("FLIP") != std::string::npos) return {0.01, "FLIP may gain by noise: the library's own bound"};
    if (transfer.find("FMPM") != std::string::npos) return {1e-4, "an error of the time step, see the next"};
    return {1e-5, "never: nothing drives the disks"};
}

std::string metres(double h) { return formatted("h = 1/%.0f m", 1 / h); }

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Two colliding disks",
                "Two elastic disks fly at each other and bounce (Sulsky, Chen and Schreyer 1994): E = 1000 Pa, ν = "
                "0.3, ρ = 1000 kg/m³, R = 0.2 m, 2 × 2 particles a cell. They approach each other at 0.283 m/s. Rigid "
                "disks touch at 1.586 s; on a grid, disks feel each other up to two cells earlier. Momentum and "
                "angular momentum must stay constant. The energy must not grow.");
    const bool quick = report.quick();
    const double h = 1.0 / 20;
    std::vector<Outcome> transfers;
    transfers.push_back(collide<double, Apic>("APIC", h));
    transfers.push_back(collide<double, Pic>("PIC", h));
    transfers.push_back(collide<double, Flip<double>>("FLIP, 5 % PIC", h));
    transfers.push_back(collide<double, Aflip<double>>("AFLIP", h));
    transfers.push_back(collide<double, Fmpm>("FMPM(2)", h));
    Plot& energies = report.plot({"energy", "Kinetic and elastic energy, h = 1/20 m", "t [s]", "E / E(0)"});
    for (const Outcome& each : transfers) {
        energies.curves.push_back(each.energy);
        const std::string& label = each.energy.label;
        report.at_most("momentum that " + label + " changes, over that of a disk", each.momentum, 1e-11,
                       "conserved; rounding");
        const auto [most, why] = most_gained(label);
        report.at_most("energy above its start, " + label, each.gained(), most, why);
    }
    const Outcome refined = collide<double, Fmpm>("FMPM(2) in steps of a quarter", h, {}, 0.1);
    report.at_most("energy above its start, " + refined.energy.label, refined.gained(), 1e-8,
                   "the nodes' forces do the work of the stress, so none is gained");
    energies.curves.push_back({"conserved", {0, 3.5}, {1, 1}, Curve::Kind::reference});
    report.at_most("angular momentum that APIC changes, over that of a disk × 1 m", transfers[0].angular, 1e-11,
                   "conserved, Jiang et al. 2015; rounding");

    std::vector<Outcome> sizes{transfers[0]};
    sizes[0].speed.label = metres(h);
    for (double finer = h / 2; finer >= (quick ? h / 2 : h / 8); finer /= 2)
        sizes.push_back(collide<double, Apic>(metres(finer), finer));
    Plot& speeds = report.plot({"speed", "Speed of a disk along the line of centres, APIC", "t [s]", "v / v(0)"});
    Curve lost;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const double size = h / double(1 << i), earlier = Disks<double>::onset - sizes[i].onset;
        sizes[i].speed.label = metres(size);
        speeds.curves.push_back(sizes[i].speed);
        report.at_most(
            "how much earlier they touch, in cells, " + metres(size), earlier * Disks<double>::approach / size, 2,
            "rigid disks touch after 1.586 s; MPM's at most two cells earlier (the speed has changed by 1 %)");
        lost.add(size, 1 - sizes[i].energy.y.back());
        report.check({"energy left after the bounce, " + metres(size), sizes[i].energy.y.back(), 1, 7 * size,
                      "kept; the loss is numerical and of first order, see below: a third at twenty cells a metre"});
    }
    if (!quick)
        report.check({"order of the loss of energy in h", fitted_order(lost.x, lost.y), 1, 0.3,
                      "free surfaces and contact: known to a cell"});
    speeds.curves.push_back({"rigid disks, without loss",
                             {0, Disks<double>::onset, Disks<double>::onset, 3.5},
                             {1, 1, -1, -1},
                             Curve::Kind::reference});

    const Outcome gradients = collide<double, Apic, WeightGradientForce>("weight gradients", h),
                  cubic = collide<double, Apic, WeightGradientForce, CubicBSpline>("cubic kernel", h),
                  single = collide<float>("float", h),
                  fixed = collide<float, Apic, MlsForce, QuadraticBSpline, ColouredFixedPoint<std::int64_t>>(
                      "fixed point", h);
    report.plot({"variants", "Energy with other forces, kernels, numbers (APIC, h = 1/20 m)", "t [s]", "E / E(0)"})
        .curves = {transfers[0].energy, gradients.energy, cubic.energy, single.energy, fixed.energy};
    const auto& exact = transfers[0].energy.y;
    for (const Outcome* each : {&single, &fixed}) {
        double worst = 0;
        for (std::size_t k = 0; k < exact.size(); ++k) worst = std::max(worst, std::abs(each->energy.y[k] - exact[k]));
        report.at_most("energy, " + each->energy.label + " against double, largest difference", worst, 1e-4,
                       "sums of some 2000 steps, each rounded to 2⁻²⁴");
        report.at_most("momentum that " + each->energy.label + " changes, over that of a disk", each->momentum, 1e-5,
                       "conserved; sums of some 2000 steps, each rounded to 2⁻²⁴");
    }
    const Outcome small = collide<double, Apic>("APIC in steps of a quarter", h, {}, 0.1);
    std::string kept;
    for (const Outcome* each : std::initializer_list<const Outcome*>{
             &transfers[0], &transfers[1], &transfers[2], &transfers[3], &transfers[4], &gradients, &cubic, &small}) {
        kept += (kept.empty() ? "" : ", ") + each->energy.label + " " + percent(each->energy.y.back());
    }
    report.remark("With h = 1/20 m, this part of the energy is left after 3.5 s: " + kept +
                  ". All of them keep the momentum.");
    report.remark(
        "The contact through the grid takes the energy. Two bodies in one cell share one velocity field. They would "
        "slide and spread against each other, but in the cells of the contact the grid averages this motion away, with "
        "every transfer. A finer grid loses less energy. More steps lose more. With wider kernels, bodies feel each "
        "other earlier and lose more. FLIP's share carries noise that the grid does not see: AFLIP's energy rises by "
        "half a percent before it falls.");
    return report.finish();
}
