/// \file How many quanta fixed-point sums count for a unit.
#pragma once

namespace firn {

/// Quanta per unit; powers of two, so that scaling is exact.
template <class S>
struct FixedPointScale {
    S momentum;  ///< quanta per kg m/s
    S mass;      ///< quanta per kg

    bool operator==(const FixedPointScale&) const = default;
};

}  // namespace firn
