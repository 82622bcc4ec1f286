/// \file Water sloshes in a box: period and decay of the first wave, and the noise of its pressure.
#include "scenes/sloshing.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Outcome {
    std::string label;
    double period = 0, decay = 0, viscous_decay = 0, noise = 0;
    Curve amplitude{label}, pressure{label};
};

constexpr double wanted = 0.1;  // decay by viscosity in a period, 2 ν k² T

/// p / ρ g H over y / H of single particles, in a strip of two cells in the middle of the box.
template <class Water>
Curve column(const Water& water, const std::string& label) {
    Curve curve{label, {}, {}, Curve::Kind::particles};
    for_particles(water.simulation, [&](std::size_t slot) {
        const auto& particles = water.simulation.particles();
        const auto x = particles.exact_position(slot);
        if (std::abs(x[0] - Water::length / 2) < water.simulation.domain().cell_size)
            curve.add(water.simulation.material().pressure(particles.state(slot).J) / Water::pressure,
                      x[1] / Water::height);
    });
    return curve;
}

template <class Force, class Volume>
Outcome slosh(const std::string& label, NodesBehind behind, int cells, bool with_viscosity) {
    using Water = Sloshing<Apic, Force, Volume>;
    Outcome out{label};
    Water water(1.0 / cells, behind, 0);
    water.run(4.3);
    out.period = water.relative_period();
    out.decay = water.decay();
    out.noise = water.noise();
    for (std::size_t i = 0; i < water.times.size(); i += 20)
        out.amplitude.add(water.times[i] / Water::period(), water.centres[i]);
    out.pressure = column(water, label);
    if (with_viscosity) {
        Water honey(1.0 / cells, behind, Water::viscosity_for(wanted));
        honey.run(4.3);
        out.viscous_decay = honey.decay();
    }
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Sloshing water",
                "Water in a box with slip walls, L = 1 m wide and H = 0.5 m deep, is let go from the first wave of "
                "linear theory, of amplitude 0.02 m: ρ = 1000 kg/m³, K = 1 MPa, h = 1/64 m, APIC, 2 × 2 particles a "
                "cell. ω² = g k tanh kH, with k = π/L (Lamb, Hydrodynamics, §228). Without viscosity, the amplitude "
                "stays; with the viscosity ν it decays as exp(−2 ν k² t) (§348), as walls and floor do not hold the "
                "water. Runs with VolumeFilter are compared with runs without it.");
    const int cells = report.quick() ? 24 : 64;
    const Outcome mls = slosh<MlsForce, OwnVolume>("MLS", NodesBehind::mirrored, cells, false),
                  quiet_mls = slosh<MlsForce, VolumeFilter>("MLS, filter", NodesBehind::mirrored, cells, true),
                  gradients = slosh<WeightGradientForce, OwnVolume>("gradients", NodesBehind::mirrored, cells, false),
                  quiet_gradients =
                      slosh<WeightGradientForce, VolumeFilter>("gradients, filter", NodesBehind::mirrored, cells, true),
                  held = slosh<MlsForce, OwnVolume>("MLS, nodes held behind walls", NodesBehind::held, cells, false);

    Plot& wave = report.plot({"wave", "Centre of mass from the middle, over that at first", "t / T", ""});
    wave.curves.push_back({"linear theory", {}, {}, Curve::Kind::reference});
    for (double t = 0; t <= 4.3; t += 0.02) wave.curves[0].add(t, std::cos(2 * std::numbers::pi * t));
    Plot& pressure = report.plot(
        {"pressure", "Pressures of single particles in the middle of the box, at the end", "p / ρ g H", "y / H"});
    pressure.curves.push_back({"ρ g (H − y)", {0, 1}, {1, 0}, Curve::Kind::reference});
    for (const Outcome* each : {&quiet_mls, &quiet_gradients, &held}) wave.curves.push_back(each->amplitude);
    for (const Outcome* each : {&held, &gradients, &mls, &quiet_gradients, &quiet_mls})
        pressure.curves.push_back(each->pressure);

    for (const Outcome* each : {&mls, &quiet_mls, &gradients, &quiet_gradients, &held})
        report.check({"period over that of linear theory, " + each->label, each->period, 1, 0.02,
                      "Lamb, Hydrodynamics, §228: ω² = g k tanh kH"});
    for (const auto& [quiet, own] : {std::pair{&quiet_mls, &mls}, std::pair{&quiet_gradients, &gradients}}) {
        report.at_most("loss of amplitude in a period more than without the filter, " + quiet->label,
                       std::max(quiet->decay - own->decay, 0.0), 1e-3, "none; a thousandth for the fit");
        report.check({"decay by viscosity in a period, " + quiet->label, quiet->viscous_decay - quiet->decay, wanted,
                      0.2, "Lamb, Hydrodynamics, §348: 2 ν k² T"});
        report.at_most("noise of the pressure over ρ g H, " + quiet->label, quiet->noise, 0.02,
                       "as for water at rest: 2 %");
    }
    report.remark(
        "After 4.3 periods without a filter, the pressures of single particles differ from their average through the "
        "grid by " +
        percent(mls.noise) + " of ρ g H with MLS forces, and by " + percent(gradients.noise) +
        " with weight gradients; with VolumeFilter, by " + percent(quiet_mls.noise) + " and " +
        percent(quiet_gradients.noise) + ". In a period, the amplitude loses " + percent(mls.decay, 2) + " and " +
        percent(gradients.decay, 2) + " without, " + percent(quiet_mls.decay, 2) + " and " +
        percent(quiet_gradients.decay, 2) +
        " with the filter. The walls matter most: with nodes that are held behind the walls, " + percent(held.decay) +
        " is lost in a period, and the noise is " + percent(held.noise) + ".");
    return report.finish();
}
