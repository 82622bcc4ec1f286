/// \file Invariants of stress as fields of a state: p′, q and the Lode angle.
#pragma once

#include <firn/io/state.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Invariants of a stress τ, which is positive in tension.
struct StressInvariants {
    double mean_pressure;      ///< p = −tr τ / 3 [Pa]
    double deviatoric_stress;  ///< q = √(3/2) ‖dev τ‖ [Pa]
    /// θ [rad]: sin 3θ = −(27/2) det(dev τ)/q³, from −π/6 (triaxial extension) to π/6 (triaxial compression); 0 if q =
    /// 0
    double lode_angle;
};

/// Returns the invariants of a stress. \param tau  the 3 × 3 elements [Pa], row by row
inline StressInvariants stress_invariants(const double* tau) {
    const double mean = (tau[0] + tau[4] + tau[8]) / 3;
    const double a = tau[0] - mean, b = tau[4] - mean, c = tau[8] - mean, d = tau[1], e = tau[2], f = tau[5];
    const double size = a * a + b * b + c * c + 2 * (d * d + e * e + f * f);
    const double determinant = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e);
    const double q = std::sqrt(1.5 * size);
    const double sine = q > 0 ? std::clamp(-13.5 * determinant / (q * q * q), -1.0, 1.0) : 0;
    return {-mean, q, std::asin(sine) / 3};
}

/// Adds three fields to a state: `mean_pressure` p′ [Pa], `deviatoric_stress` q [Pa] and `lode_angle` θ [rad] of the
/// effective Kirchhoff stress. If particles have a `pore_pressure`, it is subtracted from the pressure. A restart does
/// not read these fields.
///
/// The Lode angle is that of Nayak and Zienkiewicz 1972, with its sign so that compression is positive.
/// \throws parameter_error  if the state has no field `kirchhoff_stress`, or, in two dimensions, no
///                          `kirchhoff_stress_zz`: the material must be in plane strain
template <state_scalar S>
void add_stress_invariants(State<S>& state) {
    const bool flat = state.dimension == 2;
    const std::vector<S>& stress = state.field("kirchhoff_stress").values;
    const StateField<S>*across = flat ? state.find("kirchhoff_stress_zz") : nullptr,
          *water = state.find("pore_pressure");
    if (flat && !across)
        throw parameter_error(
            "The state has no stress across the plane, so its invariants are not known: give the material as "
            "PlaneStrain<…>, which keeps it.");
    StateField<S> p{"mean_pressure", "Pa", 1, {}}, q{"deviatoric_stress", "Pa", 1, {}},
        angle{"lode_angle", "rad", 1, {}};
    for (std::size_t i = 0; i < state.size(); ++i) {
        double tau[9] = {};
        if (flat) {
            for (std::size_t k = 0; k < 4; ++k) tau[k / 2 * 3 + k % 2] = double(stress[4 * i + k]);
            tau[8] = double(across->values[i]);
        } else {
            std::copy_n(stress.data() + 9 * i, 9, tau);
        }
        const StressInvariants of = stress_invariants(tau);
        p.values.push_back(S(of.mean_pressure - (water ? double(water->values[i]) : 0)));
        q.values.push_back(S(of.deviatoric_stress));
        angle.values.push_back(S(of.lode_angle));
    }
    for (StateField<S>* field : {&p, &q, &angle}) {
        std::erase_if(state.fields, [&](const StateField<S>& old) { return old.name == field->name; });
        state.fields.push_back(std::move(*field));
    }
}

}  // namespace firn::inline FIRN_BUILD
