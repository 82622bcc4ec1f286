/// \file The scale of fixed-point sums.
#pragma once

namespace firn {

/// How many quanta (steps of a fixed-point number) make one unit. Both members are powers of two, so that scaling is
/// exact.
template <class S>
struct FixedPointScale {
    S momentum;  ///< quanta per kg m/s
    S mass;      ///< quanta per kg

    bool operator==(const FixedPointScale&) const = default;
};

}  // namespace firn
