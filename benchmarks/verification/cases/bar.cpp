/// \file The bar in its first mode: each transfer, force, kernel and precision over ten periods.
#include "case.hpp"
#include "scenes/bar.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Outcome {
    Curve velocity, energy;
    double worst = 0;         ///< largest |v_cm − theory| in the first period, over the amplitude
    double period = 0;        ///< from the crossings of zero [s]
    double energy_left = 0;   ///< after the first period, over its start
    double highest = 0;       ///< of the energy, over its start
};

template <class S, class Transfer, class Force, class Kernel>
Outcome swing(const std::string& label, double h, double duration, const Transfer& transfer = {}) {
    using TheBar = Bar<S, Transfer, Force, Kernel>;
    TheBar bar(h, transfer);
    Outcome out{{label}, {label}};
    const auto energy = [&] {
        const auto totals = bar.simulation.totals();
        return totals.kinetic_energy + totals.elastic_energy;
    };
    const double start = energy(), interval = 0.1;
    std::vector<double> crossings;
    double last = bar.velocity();
    out.velocity.add(0, last / TheBar::amplitude);
    out.energy.add(0, 1);
    for (int i = 1; i * interval <= duration + 1e-9; ++i) {
        bar.simulation.advance(i * interval - bar.simulation.time());
        const double t = i * interval, v = bar.velocity(), left = energy() / start;
        if ((v < 0) != (last < 0)) crossings.push_back(t - interval * v / (v - last));
        last = v;
        out.velocity.add(t, v / TheBar::amplitude);
        out.energy.add(t, left);
        out.highest = std::max(out.highest, left);
        if (t <= TheBar::period + 1e-9) {
            out.worst = std::max(out.worst, std::abs(v - TheBar::theory(t)) / TheBar::amplitude);
            out.energy_left = left;
        }
    }
    out.period = 2 * (crossings.back() - crossings.front()) / double(crossings.size() - 1);
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Elastic bar in its first mode",
                "A bar of 25 m, held at one end, swings along its axis: E = 100 Pa, ρ = 1 kg/m³, ν = 0, v₀ = 0.1 m/s, "
                "2 × 2 particles a cell. Linear theory (Sulsky, Chen and Schreyer 1994; Bardenhagen and Kober 2004): "
                "period 10 s, velocity of the centre of mass (2/π) v₀ cos(2πt/10 s), energy kept.");
    const double duration = report.quick() ? 20 : 100, h = 0.5;
    std::vector<Outcome> all;
    const auto add = [&](Outcome outcome) { all.push_back(std::move(outcome)); };
    add(swing<double, Apic, MlsForce, QuadraticBSpline>("APIC", h, duration));
    add(swing<double, Pic, MlsForce, QuadraticBSpline>("PIC", h, duration));
    add(swing<double, Flip<double>, MlsForce, QuadraticBSpline>("FLIP", h, duration));
    add(swing<double, Aflip<double>, MlsForce, QuadraticBSpline>("AFLIP", h, duration));
    add(swing<double, Fmpm, MlsForce, QuadraticBSpline>("FMPM", h, duration));
    Plot& velocities = report.plot({"velocity", "Velocity of the centre of mass, h = 0.5 m", "t [s]", "v / amplitude"});
    Plot& energies = report.plot({"energy", "Kinetic and strain energy, h = 0.5 m", "t [s]", "E / E(0)"});
    Curve theory{"linear theory", {}, {}, Curve::Kind::reference};
    for (double t = 0; t <= duration + 1e-9; t += 0.1) theory.add(t, std::cos(2 * std::numbers::pi / 10 * t));
    velocities.curves.push_back(theory);
    for (const Outcome& each : all) {
        velocities.curves.push_back(each.velocity);
        energies.curves.push_back(each.energy);
    }
    return report.finish();
}
