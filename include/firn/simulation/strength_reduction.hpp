/// \file The factor of safety by strength reduction.
#pragma once

#include <firn/core/error.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

/// How a factor of safety is sought.
struct StrengthReduction {
    double lowest = 1;        ///< a factor at which the ground stands [1]
    double highest = 3;       ///< a factor at which it fails [1]
    double tolerance = 0.02;  ///< how far the two factors of the result may be apart [1]
};

/// A factor of safety: ground whose strength is divided by it just stands.
struct FactorOfSafety {
    double stands;  ///< the largest factor at which the ground stood [1]
    double fails;   ///< the smallest factor at which it failed [1]

    double value() const { return (stands + fails) / 2; }  ///< Returns the middle of the two.
};

/// Finds the factor of safety of ground: its strength is divided by a factor until it fails, and the factor is found by
/// bisection. Every trial is a run of its own, of a copy of the simulation.
///
///     const auto safety = factor_of_safety(slope, [](auto& soil, double factor) { soil.weaken(factor); },
///                                          [&](auto& slope) { slope.advance(10); return crest_moves(slope) > 0.2; });
///
/// Zienkiewicz, Humpheson and Lewis 1975, "Associated and non-associated visco-plasticity and plasticity in soil
/// mechanics"; Griffiths and Lane 1999, "Slope stability analysis by finite elements".
/// \param ground  a simulation with one material, at rest
/// \param weaken  weaken(material, factor) divides the strength of a material by the factor
/// \param fails   fails(simulation) advances a simulation with a weakened material, and returns whether it fails
/// \throws parameter_error  if the factors or the tolerance are out of range, if the ground fails at the lowest factor,
///                          or if it stands at the highest one
template <class Simulation, class Weaken, class Fails>
FactorOfSafety factor_of_safety(const Simulation& ground, const Weaken& weaken, const Fails& fails,
                                const StrengthReduction& how = {}) {
    if (!(how.lowest > 0 && how.lowest < how.highest) || !std::isfinite(how.highest) || !(how.tolerance > 0))
        throw parameter_error(sentence("A factor of safety is sought from ", how.lowest, " to ", how.highest,
                                       " with a tolerance of ", how.tolerance,
                                       "; all must be positive and finite, and the first smaller than the second."));
    const auto fails_at = [&](double factor) {
        Simulation trial = ground;
        trial.edit_material([&](auto& material) { weaken(material, factor); });
        return bool(fails(trial));
    };
    FactorOfSafety found{how.lowest, how.highest};
    if (fails_at(found.stands))
        throw parameter_error(sentence("The ground fails at the lowest factor, ", how.lowest, ": give a lower one."));
    if (!fails_at(found.fails))
        throw parameter_error(sentence("The ground stands at the highest factor, ", how.highest,
                                       ": give a higher one, or let the trials run longer."));
    while (found.fails - found.stands > how.tolerance) {
        const double factor = found.value();
        (fails_at(factor) ? found.fails : found.stands) = factor;
    }
    return found;
}

}  // namespace firn::inline FIRN_BUILD
