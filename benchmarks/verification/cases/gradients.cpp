/// \file Gradients of whole runs, against difference quotients and runs in dual numbers.
#include "support/derivatives.hpp"
#include "support/tangent.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

/// What a row tells beside its name.
struct Options {
    double stretch = 1, strain = 0.03;  ///< of the first states
    bool is_smooth = true;              ///< whether rounding never chooses a branch: then 200 steps are compared, too
};

/// The figures of a simulation with these policies.
/// \tparam D  the dimension
template <int D, class... Policies, class Material, class Boundary = Walls<double, D>>
void examine(Case& report, const std::string& name, const Material& material,
             const Boundary& boundary = derivatives::walls_of_run<D>(), const Options& options = {}) {
    using Simulation = SimulationWith<D, Material, Boundary, Policies...>;
    derivatives::Run<Simulation> run{material, boundary};
    run.stretch = options.stretch;
    run.strain = options.strain;
    run.boundary_changes = false;  // the positions of walls have no use as inputs
    run.dt = 0x1p-12;

    run.steps = 1;
    report.at_most(name + ": one step, difference quotient", run.error(), 1e-6,
                   "the best of three 5-point quotients along a random direction");
    double worst = 0;
    for (const tangent::Compared& one : tangent::compare(run.at(0), 12, 4))
        worst = std::max(worst, std::abs(one.gradient - one.tangent) / one.terms);
    report.at_most(name + ": 12 steps, ⟨u, J v⟩ − ⟨Jᵀu, v⟩", worst, 1e-12,
                   "rounding, over the sum of the sizes of the terms; the worst of 4 directions");
    if (!options.is_smooth) return;
    worst = 0;
    for (const tangent::Compared& one : tangent::compare(run.at(0), 200, report.quick() ? 2 : 16))
        worst = std::max(worst, std::abs(one.gradient - one.tangent) / std::abs(one.tangent));
    report.at_most(name + ": 200 steps, dual numbers", worst, 1e-9, "rounding; relative, the worst of 16 directions");
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Gradients of whole runs",
                "A block of matter, strained and moving at random, hits walls with friction. `Adjoint` gives the "
                "gradient of a sum of all numbers of the particles, with random weights, by all that the program has "
                "set: positions, velocities, C, states, masses and volumes of particles, parameters of the material, "
                "of the transfer and of the boundary, and gravity. The same run in dual numbers gives its derivative "
                "along random directions v. This run is written as plain loops over particles and the nodes around "
                "each; only the policies are firn's. u are the weights, J is the derivative of the steps. Sand and "
                "clay have no figure for 200 steps: where nothing holds them any more, rounding decides which branch "
                "a particle takes.");
    using derivatives::jelly;
    examine<2>(report, "fixed corotated", jelly);
    examine<2>(report, "neo-Hookean", NeoHookean<double>::from_young_poisson(1e5, 0.3));
    examine<2>(report, "Hencky", Hencky<double>::from_young_poisson(1e5, 0.3));
    const Options pressed{.stretch = 0.97};
    examine<2>(report, "viscous fluid", Fluid<double>::from_properties({.bulk = 1e4, .viscosity = 10}),
               derivatives::walls_of_run<2>(), pressed);
    examine<2>(report, "snow", Snow<double>::from_properties({}), derivatives::walls_of_run<2>());
    examine<2>(report, "von Mises",
               VonMises<double>::from_properties({.young = 1e5, .yield_stress = 500, .hardening = 1e3}));
    examine<3>(report, "sand in 3D", Sand<double>::from_properties({.young = 1e5}), derivatives::walls_of_run<3>(),
               {.stretch = 0.99, .strain = 0.08, .is_smooth = false});
    examine<2>(report, "cam clay", Nacc<double>::from_properties({.young = 1e5, .consolidation = 500}),
               derivatives::walls_of_run<2>(), {.stretch = 0.95, .is_smooth = false});
    examine<2>(report, "dissipating von Mises", Dissipating<VonMises<double>>{VonMises<double>{3e3, 5e3, 100, 100}});

    examine<2, Pic>(report, "PIC", jelly);
    examine<2, Flip<double>>(report, "FLIP", jelly);
    examine<2, Aflip<double>>(report, "AFLIP", jelly);
    examine<2, Asflip<double>>(report, "ASFLIP", jelly);
    examine<2, Fmpm>(report, "FMPM of order 2", jelly);

    examine<3>(report, "3D", jelly);
    examine<3, WeightGradientForce>(report, "3D, weight gradients", jelly);
    examine<2, CubicBSpline>(report, "cubic B-spline", jelly);
    examine<2, CubicBSpline, WeightGradientForce>(report, "cubic B-spline, weight gradients", jelly);
    examine<2, CompactQuartic, WeightGradientForce>(report, "compact quartic", jelly);
    examine<2, Linear, WeightGradientForce>(report, "linear", jelly);

    for (const auto& [contact, name] : {std::pair{Contact::stick, "stick"}, std::pair{Contact::slip, "slip"}}) {
        auto walls = derivatives::walls_of_run<2>(contact);
        examine<2>(report, std::string("walls, ") + name, jelly, walls);
        walls.nodes_behind = NodesBehind::mirrored;
        examine<2>(report, std::string("mirrored walls, ") + name, jelly, walls);
    }
    auto mirrored = derivatives::walls_of_run<2>();
    mirrored.nodes_behind = NodesBehind::mirrored;
    examine<2>(report, "mirrored walls, separate", jelly, mirrored);
    Collider<Box<double, 2>> plank;
    plank.shape.half_extents = {0.1, 0.06};
    plank.position = {0.35, 0.12};
    plank.rotation = rotor(degrees(20));
    plank.linear_velocity = {-1, 0.3};
    plank.angular_velocity = 3;
    plank.contact = Contact::slip;
    plank.friction = 0.2;
    examine<2>(report, "a moving plank beside walls", jelly, Together(derivatives::walls_of_run<2>(), plank));
    examine<2, FBar>(report, "F-bar", jelly);
    examine<3, FBar, WeightGradientForce>(report, "F-bar in 3D, weight gradients", jelly);
    return report.finish();
}
