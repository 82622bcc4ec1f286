/// \file Twelve steps and their way back are transposes of each other: the rows of a table in which each pair of a
/// material, a transfer, a kernel, a force form, a dimension and a contact of walls occurs.
#pragma once

#include "support/gradient_checks.hpp"

#include <tuple>

namespace transposes {

using namespace firn;

/// Checks one row. \param stretch, strain  of the first states: plastic materials flow
template <int D, class... Policies, class Material>
void check(const Material& material, Contact contact, double stretch = 1, double strain = 0.03) {
    derivatives::Run<SimulationWith<D, Material, Policies...>> run{material, derivatives::walls_of_run<D>(contact)};
    run.dt = 0x1p-12;
    run.stretch = stretch;
    run.strain = strain;
    if constexpr (refines_velocities<decltype(run.transfer)>) run.transfer.order = 3;
    tangent::check_transposed(run.at(0), 12, 2);
}

/// Checks the rows of a material, one for each transfer. \tparam I  the index of the material, from 0 to 8
template <int I, class Material>
void check_rows(const Material& material, double stretch = 1, double strain = 0.03) {
    using Kernels = std::tuple<QuadraticBSpline, CubicBSpline, Linear, CompactQuartic>;
    using Transfers = std::tuple<Pic, Apic, Flip<double>, Aflip<double>, Asflip<double>>;
    constexpr Contact contacts[] = {Contact::stick, Contact::slip, Contact::separate, Contact::none};
    unroll<int(std::tuple_size_v<Transfers>)>([&](auto j) {
        // These numbers were found by trying until no pair was missing.
        constexpr int row = 5 * I + j, kernel = (2 * I + 3 * j + row / 11) % 4;
        constexpr bool gradients = kernel > 1 || row % 2 == 1;  // the last two kernels have no other form
        using Force = std::conditional_t<gradients, WeightGradientForce, MlsForce>;
        CAPTURE(name_of<Material>(), I, int(j));
        check<2 + row * 6 / 8 % 2, std::tuple_element_t<kernel, Kernels>, std::tuple_element_t<int(j), Transfers>,
              Force>(material, contacts[(I + 3 * j + row / 7) % 4], stretch, strain);
    });
}

}  // namespace transposes
