/// \file The bar and the disks by the emitted WGSL program, on whatever device firn::webgpu finds.
#include <firn/webgpu/on_gpu.hpp>

#include "case.hpp"
#include "scenes/bar.hpp"
#include "scenes/disks.hpp"

using namespace firn;
using namespace verification;

namespace {

/// The kinetic energy of the particles' own velocities [J].
template <class Simulation>
double kinetic_energy(const Simulation& simulation) {
    double sum = 0;
    for_particles(simulation, [&](std::size_t slot) {
        const auto v = cast<double>(simulation.particles().velocity(slot));
        sum += 0.5 * double(simulation.particles().mass(slot)) * dot(v, v);
    });
    return sum;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "The same in WGSL",
                "The bar and the disks run again in the WGSL program that firn writes from the same definitions (APIC, "
                "MLS forces, quadratic kernel, float, fixed-point sums at the nodes). The program runs on a device "
                "that WebGPU finds. For this report the device was SwiftShader, a GPU in software.");
    const webgpu::Device device;

    using Integers = ColouredFixedPoint<std::int32_t>;
    using TheBar = Bar<float, Apic, MlsForce, QuadraticBSpline, Integers>;
    const double h = 0.5, dt = 0.02;
    TheBar bar(h);
    bar.simulation.fixed_time_step = dt;
    auto bar_there = webgpu::on_gpu(bar.simulation, device);
    Curve ours{"WGSL"}, here{"C++, double"}, theory{"linear theory", {}, {}, Curve::Kind::reference};
    Bar<double, Apic, MlsForce, QuadraticBSpline> precise(h);
    precise.simulation.fixed_time_step = dt;
    double worst = 0, apart = 0;
    for (int i = 0; i <= (report.quick() ? 50 : 100); ++i) {
        if (i > 0) {
            for (int k = 0; k < 5; ++k) bar_there.step(), precise.simulation.step();
        }
        const double t = 5 * i * dt;
        const auto sums = bar_there.totals();
        ours.add(t, sums.momentum[0] / sums.mass / TheBar::amplitude);
        here.add(t, precise.velocity() / TheBar::amplitude);
        theory.add(t, TheBar::theory(t) / TheBar::amplitude);
        worst = std::max(worst, std::abs(ours.y.back() - theory.y.back()));
        apart = std::max(apart, std::abs(ours.y.back() - here.y.back()));
    }
    report.plot({"bar", "Velocity of the bar's centre of mass, h = 0.5 m", "t [s]", "v / amplitude"}).curves = {
        ours, here, theory};
    report.at_most("bar: error of the velocity in the first period", worst, 2 * h / 25,
                   "linear theory; the ends of the bar are known to a cell each, 2 h of 25 m");
    report.at_most("bar: difference from C++ in double", apart, 1e-4, "500 steps in float and fixed point");

    using TheDisks = Disks<float, Apic, MlsForce, QuadraticBSpline, Integers>;
    TheDisks disks(1.0 / 20);
    disks.simulation.fixed_time_step = 0.02;
    auto disks_there = webgpu::on_gpu(disks.simulation, device);
    const auto start = disks_there.totals();
    const double kinetic_at_start = kinetic_energy(disks_there.simulation());
    const double of_a_disk = start.mass / 2 * norm(TheDisks::velocity);
    Curve kinetic{"WGSL"}, kinetic_here{"C++, fixed point", {}, {}, Curve::Kind::reference};
    double changed = 0, unlike = 0;
    for (int i = 0; i <= 35; ++i) {
        if (i > 0) {
            for (int k = 0; k < 5; ++k) disks_there.step(), disks.simulation.step();
        }
        kinetic.add(0.1 * i, kinetic_energy(disks_there.simulation()) / kinetic_at_start);
        kinetic_here.add(0.1 * i, kinetic_energy(disks.simulation) / kinetic_at_start);
        changed = std::max(changed, norm(disks_there.totals().momentum - start.momentum) / of_a_disk);
        unlike = std::max(unlike, std::abs(kinetic.y.back() - kinetic_here.y.back()));
    }
    report.plot({"disks", "Kinetic energy of the two disks, h = 1/20 m", "t [s]", "E / E(0)"}).curves = {kinetic,
                                                                                                         kinetic_here};
    report.at_most("disks: momentum that changes, over that of a disk", changed, 1e-5,
                   "conserved; 175 steps, each rounded to 2⁻²⁴");
    report.at_most("disks: difference of the kinetic energy from C++ with the same integers", unlike, 1e-5,
                   "the same definitions; equal to the bit where the device does not contract a·b + c");
    return report.finish();
}
