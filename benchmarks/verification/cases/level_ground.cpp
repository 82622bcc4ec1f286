/// \file Level ground that begins in the stress of its own weight does not move.
#include "scenes/level_ground.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Level ground at rest",
        "Level ground of 40 cells, 2 m high, with its surface on a plane of nodes, between smooth mirrored walls: "
        "ρ = 2000 kg/m³, ν = 0.3, waves of pressure at 10 m/s, 2 × 2 particles a cell, quadratic splines, APIC, "
        "no damping. It begins in the stress of its weight (set_at_rest, K₀ = 0.5) and stands for 1 s, which are "
        "5 times the way of a wave up and down. Without that stress it falls by centimetres.");
    using Ground = LevelGround;
    const auto sand = Sand<double>::from_properties(
        {.young = Ground::young, .poisson = Ground::poisson, .friction_angle = degrees(30)});
    const auto stands = [&](const std::string& name, const auto& material, const GroundAtRest<2>& ground) {
        const Unrest unrest = Ground::stand(material, 1, ground);
        report.at_most(name + ": largest speed [m/s]", unrest.speed, 1e-3, "at rest");
        report.at_most(name + ": largest displacement after 1 s [m]", unrest.displacement, 5e-4, "at rest");
    };
    stands("Hencky, 2D", Hencky<double>::from_young_poisson(Ground::young, Ground::poisson), Ground::ground());
    stands("sand, plane strain", PlaneStrain<Sand<double>>{sand}, Ground::ground());
    stands("sand, plane strain, float", PlaneStrain<Sand<float>>{lift<float>(sand)}, Ground::ground());
    auto wet = Ground::ground();
    wet.water_table = 1.5;
    stands("sand, undrained below a water table at 1.5 m", PlaneStrain<Undrained<Sand<double>>>{{sand, 1e6}}, wet);
    const Unrest falls = Ground::stand(PlaneStrain<Sand<double>>{sand}, 1, Ground::ground(), false);
    report.remark("Without the stress at the start, the sand moves with up to " + sentence(falls.speed) + " m/s.");
    return report.finish();
}
