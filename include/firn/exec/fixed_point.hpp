/// \file The scale of fixed-point sums, from a bound of what any node can receive.
///
/// A particle gives node i at most N_i q + |∇N_i| g in any component a, with q = |p_a| + (max |o|) Σ_b |A_ab| and
/// g = Σ_b |G_ab|. Let M be the largest mass in a cell, w_c the kernel's largest weight for a particle in the c-th cell
/// around a node, W = Σ w_c. Then a node's mass is at most Wᴰ M, and its momentum at most
///     Wᴰ M max(q/m)  +  D (K + 1) γ Wᴰ⁻¹ M max(g/m)
/// (γ the kernel's largest gradient, K its support). With n the most particles around a node and B the bound, a scale
/// of 2^⌊log2((max − n)/B)⌋ makes every sum of rounded numbers fit.
#pragma once

#include <firn/core/error.hpp>
#include <firn/kernel/concept.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace firn {

/// Quanta per unit; powers of two, so that scaling is exact.
struct FixedPointScale {
    double momentum;  ///< quanta per kg m/s
    double mass;      ///< quanta per kg
};

/// What the particles are, as far as the bound needs it. Maxima and integer sums: the same for any order.
struct FixedPointLoad {
    double momentum_per_mass = 0;      ///< max q/m [m/s]
    double gradient_per_mass = 0;      ///< max g/m [m/s]
    double cell_mass = 0;              ///< M, rounded up [kg]
    std::uint64_t cell_particles = 0;  ///< most particles in a cell
};

/// A node with less mass than this counts as empty: its velocity would be made of rounding errors.
inline constexpr int fewest_mass_quanta = 64;

/// The largest |o|: how far a node of the support lies from the centre node, in cells.
template <class Kernel>
inline constexpr int largest_offset = Kernel::support - 1 - centre_node<Kernel>;

namespace detail {
inline double largest_scale(double bound, double contributions, double integer_max) {
    if (bound == 0) return 1;
    const double rounded_up = bound * (1 + 0x1p-16);  // the contributions are rounded, to float
    return std::exp2(std::floor(std::log2((integer_max - contributions) / rounded_up)));
}
inline double chosen_scale(std::optional<double> given, double largest, const char* what, const char* unit) {
    if (!given) return largest;
    int exponent = 0;
    if (!(*given > 0) || !std::isfinite(*given) || std::frexp(*given, &exponent) != 0.5)
        throw parameter_error(sentence("The fixed-point scale of ", what, " is ", *given, " quanta per ", unit,
                                       "; it must be a power of two, or left out to be chosen."));
    if (*given > largest)
        throw overflow_error(sentence("With ", *given, " quanta per ", unit, " the sum of ", what,
                                      " at a node could exceed the range of the integers; at most ", largest,
                                      " are safe here. Give a smaller scale, leave it out, or use 64-bit integers."));
    return *given;
}
}  // namespace detail

/// \throws overflow_error  if no scale, or not the given one, keeps every sum in range
template <class Kernel, int D, class Integer>
FixedPointScale fixed_point_scale(const FixedPointLoad& load, std::optional<double> momentum,
                                  std::optional<double> mass) {
    double W = 0;
    for (double w : Kernel::largest_weight) W += w;
    constexpr double integer_max = double(std::numeric_limits<Integer>::max() >> (sizeof(Integer) == 8 ? 1 : 0));
    const double most_mass = std::pow(W, D) * load.cell_mass;
    const double most_momentum =
        most_mass * load.momentum_per_mass + D * (Kernel::support + 1) * Kernel::largest_gradient * std::pow(W, D - 1) *
                                                 load.cell_mass * load.gradient_per_mass;
    const double contributions = std::pow(Kernel::support + 1, D) * double(load.cell_particles);
    if (!std::isfinite(most_momentum) || !std::isfinite(most_mass))
        throw overflow_error(
            sentence("The momentum that a node may receive is not finite (largest speed of a particle and "
                     "its stress: ",
                     load.momentum_per_mass,
                     " m/s). The simulation has blown up: reduce the time step, or look at the initial state."));
    if (contributions >= integer_max / 2)
        throw overflow_error(sentence("Up to ", contributions,
                                      " particles may add to one node: too many for integers of ", 8 * sizeof(Integer),
                                      " bits. Use smaller cells, fewer particles a cell or 64-bit integers."));
    return {detail::chosen_scale(momentum, detail::largest_scale(most_momentum, contributions, integer_max), "momentum",
                                 "kg m/s"),
            detail::chosen_scale(mass, detail::largest_scale(most_mass, contributions, integer_max), "mass", "kg")};
}

}  // namespace firn
