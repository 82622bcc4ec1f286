/// \file The bar and the disks by the emitted WGSL program, on whatever device firn::webgpu finds.
#include <firn/webgpu/host.hpp>
#include <firn/wgsl/inputs.hpp>
#include <firn/wgsl/program.hpp>

#include "case.hpp"
#include "scenes/bar.hpp"
#include "scenes/disks.hpp"

using namespace firn;
using namespace verification;

namespace {

/// The program of a simulation on the CPU, from where it is.
template <class Simulation>
webgpu::Simulation on_device(const webgpu::Device& device, Simulation& simulation) {
    simulation.partition();  // sorts
    const auto program = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(
        simulation.material(), simulation.boundary, Gravity<float, 2>{cast<float>(simulation.gravity)});
    webgpu::Simulation there(device, program,
                             wgsl::make_inputs<2>(program, simulation.domain(), simulation.particles(),
                                                  simulation.fixed_time_step, device.limits()));
    there.initialise();
    return there;
}

/// What is summed over the particles of a device.
struct Sums {
    Vec<double, 2> momentum{};
    double mass = 0, kinetic = 0;  ///< [J], of the particles' own velocities

    explicit Sums(webgpu::Simulation& simulation) {
        const auto v = simulation.read("velocity"), m = simulation.read("mass");
        for (std::size_t i = 0; i < m.size(); ++i) {
            const Vec<double, 2> velocity{double(v[2 * i]), double(v[2 * i + 1])};
            mass += double(m[i]);
            momentum += velocity * double(m[i]);
            kinetic += 0.5 * double(m[i]) * dot(velocity, velocity);
        }
    }
};

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

    using TheBar = Bar<float, Apic, MlsForce, QuadraticBSpline>;
    const double h = 0.5, dt = 0.02;
    TheBar bar(h);
    bar.simulation.fixed_time_step = dt;
    webgpu::Simulation bar_there = on_device(device, bar.simulation);
    Curve ours{"WGSL"}, here{"C++, double"}, theory{"linear theory", {}, {}, Curve::Kind::reference};
    Bar<double, Apic, MlsForce, QuadraticBSpline> precise(h);
    precise.simulation.fixed_time_step = dt;
    double worst = 0, apart = 0;
    for (int i = 0; i <= (report.quick() ? 50 : 100); ++i) {
        if (i > 0) {
            bar_there.step(5);
            for (int k = 0; k < 5; ++k) precise.simulation.step();
        }
        const double t = 5 * i * dt;
        const Sums sums(bar_there);
        ours.add(t, sums.momentum[0] / sums.mass / TheBar::amplitude);
        here.add(t, precise.velocity() / TheBar::amplitude);
        theory.add(t, TheBar::theory(t) / TheBar::amplitude);
        worst = std::max(worst, std::abs(ours.y.back() - theory.y.back()));
        apart = std::max(apart, std::abs(ours.y.back() - here.y.back()));
    }
    bar_there.check();
    report.plot({"bar", "Velocity of the bar's centre of mass, h = 0.5 m", "t [s]", "v / amplitude"}).curves = {
        ours, here, theory};
    report.at_most("bar: error of the velocity in the first period", worst, 2 * h / 25,
                   "linear theory; the ends of the bar are known to a cell each, 2 h of 25 m");
    report.at_most("bar: difference from C++ in double", apart, 1e-4, "500 steps in float and fixed point");

    using TheDisks = Disks<float, Apic, MlsForce, QuadraticBSpline, ColouredFixedPoint<std::int32_t>>;
    TheDisks disks(1.0 / 20);
    disks.simulation.fixed_time_step = 0.02;
    webgpu::Simulation disks_there = on_device(device, disks.simulation);
    const Sums start(disks_there);
    const double of_a_disk = start.mass / 2 * norm(TheDisks::velocity);
    Curve kinetic{"WGSL"}, kinetic_here{"C++, fixed point", {}, {}, Curve::Kind::reference};
    double changed = 0, unlike = 0;
    for (int i = 0; i <= 35; ++i) {
        if (i > 0) {
            disks_there.step(5);
            for (int k = 0; k < 5; ++k) disks.simulation.step();
        }
        const Sums sums(disks_there);
        kinetic.add(0.1 * i, sums.kinetic / start.kinetic);
        kinetic_here.add(0.1 * i, kinetic_energy(disks.simulation) / start.kinetic);
        changed = std::max(changed, norm(sums.momentum - start.momentum) / of_a_disk);
        unlike = std::max(unlike, std::abs(kinetic.y.back() - kinetic_here.y.back()));
    }
    disks_there.check();
    report.plot({"disks", "Kinetic energy of the two disks, h = 1/20 m", "t [s]", "E / E(0)"}).curves = {kinetic,
                                                                                                         kinetic_here};
    report.at_most("disks: momentum that changes, over that of a disk", changed, 1e-5,
                   "conserved; 175 steps, each rounded to 2⁻²⁴");
    report.at_most("disks: difference of the kinetic energy from C++ with the same integers", unlike, 1e-5,
                   "the same definitions; equal to the bit where the device does not contract a·b + c");
    return report.finish();
}
