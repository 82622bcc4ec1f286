//! # Materials
//!
//! A material says what stress a deformation causes. firn has ten materials, and firn::NoStress for the points of nets on a grid. Each is a small struct of parameters.
//! Its page in the reference gives the formula and the paper.
//!
//! | material | models | you give |
//! | --- | --- | --- |
//! | firn::FixedCorotated | rubber, jelly: an elastic solid that can even be turned inside out | E, ν |
//! | firn::NeoHookean | an elastic solid that resists compression without bound | E, ν |
//! | firn::Hencky | an elastic solid in logarithmic strain: the base of the materials that flow | E, ν |
//! | firn::VonMises | metal, clay for modelling: flows where the shear stress reaches a limit | E, ν, yield stress |
//! | firn::Sand | dry sand: bears shear only under pressure (Drucker and Prager) | E, ν, friction angle |
//! | firn::MohrCoulomb | soil, soft rock: cohesion and friction, dilatancy, a tension cut-off, softening | E, ν, c, φ, ψ, t |
//! | firn::Nacc | mud, fruit, bread: pressure crushes it, tension breaks it (cam clay) | E, ν, consolidation |
//! | firn::ModifiedCamClay | clay by the parameters of a textbook: stiff and strong by its pressure and history | λ, κ, M, e₀ or N, p_c |
//! | firn::Snow | snow: hardens when crushed, breaks when stretched | E, ν, two critical strains |
//! | firn::Fluid | water, honey: has pressure and viscosity, keeps no shape | bulk modulus, viscosity |
//!
//! E is Young's modulus [Pa], and ν is Poisson's ratio. Real materials are stiff: sound crosses a cell of steel in a
//! microsecond, and a time step must be shorter than that. But a fall or a flow hardly depends on E if the speed of
//! sound √(E/ρ) is at least ten times the speed of the motion. So choose E by that rule, not from a table of materials.
//!
//! ## One point under strain
//!
//! A material is a pure function, so you can use it without a simulation. This program compresses a point of each
//! material along one axis by up to 10 %, and then releases it. It writes the stress on that axis after every 5 %. You
//! see which materials come back to no stress.
#include <firn/firn.hpp>

#include <cstdio>

//! `firn::updated` follows the flow for one step: first F ← (I + dt ∇v) F, then the plastic return mapping of the
//! material. `firn::kirchhoff_stress` gives the stress τ = J σ [Pa] of the new state.
template <class Material>
double compress_and_release(const char* name, const Material& material) {
    auto state = firn::initial_state<2>(material);
    firn::Mat<double, 2> rate = firn::Mat<double, 2>::zero();
    double stress = 0, length = 1;
    std::printf("%-16s", name);
    for (int percent = 1; percent <= 20; ++percent) {
        const double next = percent <= 10 ? 1 - 0.01 * percent : 0.8 + 0.01 * percent;
        rate(0, 0) = next / length - 1;  // ∇v dt with dt = 1 s
        state = firn::updated(material, state, rate, 1.0);
        stress = firn::kirchhoff_stress(material, state)(0, 0);
        length = next;
        if (percent % 5 == 0) std::printf("%10.0f", stress);
    }
    std::printf("   Pa\n");
    return stress;
}

//! Properties have names and defaults. You write only those that you want to change. A value out of range throws
//! firn::parameter_error; its message says which values are allowed.
int main() {
    std::printf("%-16s%10s%10s%10s%10s\n", "compressed by", "5 %", "10 %", "5 %", "0 %");
    const double elastic = compress_and_release("fixed corotated",  //
                                                firn::FixedCorotated<double>::from_young_poisson(1e5, 0.3));
    const double metal = compress_and_release(
        "von Mises", firn::VonMises<double>::from_properties({.young = 1e5, .poisson = 0.3, .yield_stress = 2e3}));
    compress_and_release("sand", firn::Sand<double>::from_properties(
                                     {.young = 1e5, .poisson = 0.3, .friction_angle = firn::degrees(35)}));
    const double snow = compress_and_release(
        "snow", firn::Snow<double>::from_properties({.young = 1e5, .poisson = 0.3, .critical_compression = 0.025}));
    compress_and_release("water", firn::Fluid<double>::from_properties({.bulk = 1e5, .viscosity = 1e-3}));

    //! The elastic solid comes back to no stress. Metal and snow have flowed under compression. So they are under
    //! tension when they have their old length again.
    return std::abs(elastic) < 1e-6 && metal > 1e3 && snow > 0 ? 0 : 1;
}

//! ## What E and ν do
//!
//! `examples/compare.sh` lets two cubes collide with ν = 0.3 and 0.15, and two bunnies with E = 1 and 2 kPa. For each
//! pair it prints a table and draws a picture: above when each run is most deformed, below at equal times.
//!
//! ![Two cubes, left ν = 0.3, right ν = 0.15; above, deformations are drawn six times as large](../images/two_cubes_compared.png)
//!
//! | two cubes, E = 1 kPa | ν = 0.3 | ν = 0.15 |
//! | --- | --- | --- |
//! | lower cube at its lowest, after | 0.194 s | 0.193 s |
//! | compressed by | 4.75 % | 4.94 % |
//! | bulged by | 0.93 % | 0.35 % |
//! | strain, ½ (FᵀF − I), root mean square | 5.39 % | 5.38 % |
//! | height of the upper cube after 0.4 s | 0.355 m | 0.370 m |
//!
//! With a lower ν the cube bulges less than half as much, but it is compressed a little more, and is strained as much.
//! So it "deforms less at contact" only sideways.
//!
//! ![Two bunnies, left E = 1 kPa, right 2 kPa](../images/two_bunnies_compared.png)
//!
//! | two bunnies, ν = 0.3 | E = 1 kPa | E = 2 kPa |
//! | --- | --- | --- |
//! | upper bunny's greatest strain | 4.52 % | 3.06 % |
//! | upper bunny turned by, after 0.2 s | 99.4° | 104.5° |
//! | lower bunny turned by, after 0.2 s | 12.8° | 14.4° |
//! | upper bunny turned by, after 2900 steps | 98.8° (0.200 s) | 37.8° (0.143 s) |
//!
//! At equal times the stiffer bunny has turned a little more. That is not because greater forces turn it faster: after
//! the contact both turn at about 1100 °/s. It bounces off sooner, and so has turned for longer. After equal numbers of
//! steps it has turned far less, because its time step is shorter. Both forms of force show the same
//! (`--force weight_gradient`).
//!
//! ## Soil
//!
//! The materials of soils are in `firn/soil.hpp`. Tests of soil give a cohesion c and a friction angle φ: on a plane under
//! the pressure p, soil bears the shear stress c + p tan φ. That is firn::MohrCoulomb. Its other parameters:
//!
//! | property | meaning | where it comes from |
//! | --- | --- | --- |
//! | `dilatancy_angle` ψ | sheared soil gains sin ψ of volume per shear; at most φ | loose soil and clay: 0; dense sand: φ − 30° |
//! | `tension` | largest tension; without it c cot φ, which is more than soil bears | 0, unless it was measured |
//! | `residual_cohesion`, `residual_friction_angle`, `residual_dilatancy_angle`, `softening_strain` | values after a plastic shear strain of `softening_strain`; they fall linearly until then | tests with a large shear |
//!
//! ```cpp
//! const auto clay = firn::MohrCoulomb<double>::from_properties({.young = 1e7,
//!                                                               .poisson = 0.3,
//!                                                               .cohesion = 2e4,
//!                                                               .friction_angle = firn::degrees(22),
//!                                                               .tension = 4e3,
//!                                                               .residual_cohesion = 2e3,
//!                                                               .residual_friction_angle = firn::degrees(15),
//!                                                               .softening_strain = 2});
//! ```
//!
//! Soil that softens slides in bands, about as wide as a cell: on a finer grid less work breaks it. firn::SofteningBand
//! takes the width of a band in nature, and scales the softening strain by the cell size. The work of a band is then
//! that of every grid: `firn::SofteningBand<firn::MohrCoulomb<double>>{clay, 0.02}`. A run in two dimensions is a cut
//! through a long slope if its material is firn::PlaneStrain of that.
//!
//! Take firn::MohrCoulomb for slopes, pits, footings and walls that hold soil. Do not take it for dry sand that flies
//! apart and lands: it bears pressure as soon as torn matter is pressed, although the gap is still open, which
//! firn::Sand remembers. Nor for soil that pressure compacts (firn::Nacc), nor for clay without drainage, whose strength
//! does not depend on pressure (firn::VonMises costs less). Pore water is
//! firn::Undrained around it. Slopes, ground at rest and factors of safety have a page of their own: [Soils](20_soils.cpp).
//!
//! ## Clay by the parameters of a textbook
//!
//! firn::ModifiedCamClay takes what a soil's laboratory report gives: the slopes λ and κ of compression and swelling in
//! the plane of v = 1 + e and ln p', the ratio M = q/p' of the critical state, the consolidation pressure p_c, and the
//! void ratio e₀ of the start or N, the specific volume on the compression line at 1 kPa. The shear modulus is constant,
//! or proportional to the pressure (from ν, or as the ratio G/p').
//!
//! ```cpp
//! const auto clay = firn::ModifiedCamClay<double>::from_properties(
//!     {.critical_slope = 0.9, .compression = 0.16, .swelling = 0.06, .specific_volume = 2.86,
//!      .initial_pressure = 2e4, .consolidation = 5e4});
//! ```
//!
//! Take it for consolidation, bearing capacity and failure of clay and silt whose parameters are known. Take
//! firn::Nacc for matter with cohesion, or where only E, ν and a strength are known; take firn::Sand for dry sand.
//!
//! The stiffness of this clay is p'/κ*, so it has no state without stress. New particles are at `initial_pressure`. A
//! free body swells until its pressure is what its weight causes; far above that it flies apart, with up to about
//! √(2 κ* p'/ρ). So start with the pressure of its own weight at half its depth, or less, or let
//! firn::set_at_rest give each particle the stress of its depth; `firn::PerParticle<firn::ModifiedCamClay<double>,
//! "consolidation">` gives it a consolidation of its own.
//!
//! ## In a simulation
//!
//! ```cpp
//! const auto sand = firn::Sand<float>::from_properties({.friction_angle = firn::degrees(35)});
//! firn::Simulation simulation(box, sand);
//! ```
//!
//! With firn::PerParticle a parameter becomes a field, which has a value for each particle. firn::Dissipating records
//! the energy that plastic flow takes. Next: [Your own material](03_own_material.cpp), and
//! [several materials](05_several_materials.cpp) on one grid.
//!
//! ![Jelly, water, sand, snow and a rigid bunny on one grid: examples/08_four_materials](../images/four_materials.webp)
