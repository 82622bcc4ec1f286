/// \file Plane strain in two dimensions against a slab in three.
#include "scenes/plane_strain.hpp"

#include <firn/soil.hpp>

#include "case.hpp"

using namespace firn;
using namespace verification;

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Plane strain",
        "A block of 12 × 8 cells, in two dimensions with PlaneStrain, and as a slab three cells thick between "
        "smooth mirrored walls in three. It sticks to a floor; its upper part begins to move sideways and down. "
        "E = 1 MPa, ν = 0.3, ρ = 1000 kg/m³, h = 1/16 m, 2 particles a cell and axis, quadratic splines, APIC, "
        "500 steps of 0.2 ms in double. Each particle of the block is compared with the six of the slab that "
        "began beside it.");
    const auto compare = [&](const std::string& name, const auto& model, double speed, int steps, const auto& flown) {
        const PlaneStrainErrors errors = compare_with_slab(model, steps, 2e-4, speed, flown);
        report.at_most(name + ": positions [h]", errors.position, 1e-9, "the slab; rounding");
        report.at_most(name + ": stress in the plane, of the largest", errors.plane, 1e-9, "the slab; rounding");
        report.at_most(name + ": stress across the plane, of the largest", errors.across, 1e-9, "the slab; rounding");
        return errors;
    };
    const auto strained = [](const auto& s) { return s.plastic_strain > 1e-3; };
    compare("Hencky", Hencky<double>::from_young_poisson(1e6, 0.3), 1, 500, [](const auto&) { return false; });
    const auto metal =
        compare("von Mises", VonMises<double>::from_properties({.young = 1e6, .poisson = 0.3, .yield_stress = 5e3}), 2,
                500, strained);
    const auto sand =
        compare("sand", Sand<double>::from_properties({.young = 1e6, .poisson = 0.3, .friction_angle = degrees(30)}), 2,
                500, strained);
    compare("Mohr–Coulomb",
            MohrCoulomb<double>::from_properties({.young = 1e6,
                                                  .poisson = 0.3,
                                                  .cohesion = 1e3,
                                                  .friction_angle = degrees(25),
                                                  .dilatancy_angle = degrees(5),
                                                  .tension = 500}),
            2, 500, strained);
    const auto clay = compare("NACC, 400 steps", Nacc<double>::from_properties({.young = 1e6, .poisson = 0.3}), 0.7,
                              400, [](const auto& s) { return s.log_volume != 0; });
    const auto percent = [](double share) { return sentence(std::round(100 * share)) + " %"; };
    report.remark("Flown are " + percent(metal.flown) + " of the particles of metal, " + percent(sand.flown) +
                  " of sand, " + percent(clay.flown) + " of NACC; the stress across the plane reaches " +
                  percent(metal.share) + ", " + percent(sand.share) + " and " + percent(clay.share) +
                  " of the largest one.");
    report.remark(
        "NACC is compared over 400 steps. In the next ones the pressure of a particle reaches the tip of its ellipse, "
        "where the model jumps to no shear; rounding decides in which step, and the two runs part.");
    return report.finish();
}
