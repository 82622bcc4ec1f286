/// \file The scale of sums in fixed point.
#pragma once

namespace firn {

/// Quanta per unit in fixed-point sums. They are powers of two, so that scaling is exact.
template <class S>
struct FixedPointScale {
    S momentum;  ///< quanta per kg m/s
    S mass;      ///< quanta per kg

    bool operator==(const FixedPointScale&) const = default;
};

}  // namespace firn
