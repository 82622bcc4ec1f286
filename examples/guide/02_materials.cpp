//! # Materials
//!
//! A material says what stress a deformation causes. firn has eight; each is a small struct of parameters, and its
//! page gives the formula and the paper.
//!
//! | material | models | you give |
//! | --- | --- | --- |
//! | firn::FixedCorotated | rubber, jelly: an elastic solid that bears being turned inside out | E, ν |
//! | firn::NeoHookean | an elastic solid that resists compression without bound | E, ν |
//! | firn::Hencky | an elastic solid in logarithmic strain: the base of those that flow | E, ν |
//! | firn::VonMises | metal, clay for modelling: flows where the shear stress reaches a limit | E, ν, yield stress |
//! | firn::Sand | dry sand: bears shear only under pressure (Drucker and Prager) | E, ν, friction angle |
//! | firn::Nacc | soil, fruit, bread: crushed by pressure, breaks under tension (cam clay) | E, ν, consolidation |
//! | firn::Snow | snow: hardens when crushed, breaks when stretched | E, ν, two critical strains |
//! | firn::Fluid | water, honey: pressure and viscosity, no memory of its shape | bulk modulus, viscosity |
//!
//! E is Young's modulus [Pa], ν Poisson's ratio. Real materials are stiff: sound crosses a cell of steel in a
//! microsecond, and a step must be shorter than that. What you see of a fall or a flow hardly depends on E as long as
//! the speed of sound √(E/ρ) is ten times the speed of the motion. So choose E by that rule, not from a table of steel.
//!
//! ## One point under strain
//!
//! A material is a pure function, so you can ask it without a simulation. Here a point of each is compressed along one
//! axis by up to 10 %, then released, and the stress on that axis is written after each percent. You see at once which
//! of them come back.
#include <firn/firn.hpp>

#include <cstdio>

//! `firn::updated` follows the flow for a step: F ← (I + dt ∇v) F, then the plastic return mapping of the material.
//! `firn::kirchhoff_stress` gives τ = J σ [Pa] in the new state.
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

//! Properties have names and defaults; you write only those that you choose. A value out of range throws
//! firn::parameter_error, whose sentence says what is allowed.
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

    //! The elastic solid comes back to no stress. Metal and snow have flowed while they were compressed: brought back
    //! to their old length they are under tension.
    return std::abs(elastic) < 1e-6 && metal > 1e3 && snow > 0 ? 0 : 1;
}

//! ## In a simulation
//!
//! ```cpp
//! const auto sand = firn::Sand<float>::from_properties({.friction_angle = firn::degrees(35)});
//! firn::Simulation simulation(box, sand);
//! ```
//!
//! A parameter that differs from particle to particle becomes a field with firn::PerParticle; firn::Dissipating adds
//! the energy that plastic flow takes. Next: [Your own material](03_own_material.cpp), and
//! [several materials](05_several_materials.cpp) on one grid.
//!
//! ![Jelly, water, sand, snow and a rigid bunny on one grid: examples/08_four_materials](../images/four_materials.png)
