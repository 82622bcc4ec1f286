// part: full
// sanitized: no
/// \file The gradient through the other kernels, force forms, transfers and materials against difference quotients.
#include "support/gradient_checks.hpp"

using namespace derivatives;

namespace policy_gradient_tests {
TEST_CASE("gradients through splines", "[adjoint]") {
    check_policies<3, WeightGradientForce>();
    check_policies<2, CubicBSpline>();
}
TEST_CASE("gradients through kernels without constant inertia", "[adjoint]") {
    check_policies<2, CompactQuartic, WeightGradientForce>();
    check_policies<2, Linear, WeightGradientForce>();
}

TEST_CASE("gradients through PIC and AFLIP", "[adjoint]") {
    check_policies<2, Pic>();
    check_policies<2, Aflip<double>>();
}
TEST_CASE("gradients through the other materials", "[adjoint]") {
    const auto check = [](const auto& material, double stretch) {
        using Material = std::remove_cvref_t<decltype(material)>;
        Run<SimulationWith<2, Material>> run{material, walls_of_run<2>()};
        run.dt = 5e-4;
        run.stretch = stretch;
        CAPTURE(name_of<Material>());
        check_derivatives(run);
    };
    check(NeoHookean<double>::from_young_poisson(1e5, 0.3), 1);
    check(Hencky<double>::from_young_poisson(1e5, 0.3), 1);
    check(Nacc<double>::from_properties({}), 0.97);
    check(Dissipating<VonMises<double>>{VonMises<double>{3e3, 5e3, 100, 100}}, 1);
    using Varied = PerParticle<NeoHookean<double>, "mu">;
    Run<SimulationWith<2, Varied>> run{Varied{NeoHookean<double>{30, 50}}, walls_of_run<2>()};
    run.dt = 1e-2;
    run.along.material = 0;  // it gives the particles their first values
    check_derivatives(run);
}

}  // namespace policy_gradient_tests
