/// \file The scale of fixed-point sums.
#pragma once

#include <firn/core/build.hpp>

namespace firn::inline FIRN_BUILD {

/// The scale of fixed-point sums of momentum and mass: how many quanta make one unit. A quantum is the smallest step of
/// a fixed-point number. Both members are powers of two, so that scaling is exact.
template <class S>
struct FixedPointScale {
    S momentum;  ///< number of quanta that make 1 kg m/s
    S mass;      ///< number of quanta that make 1 kg

    bool operator==(const FixedPointScale&) const = default;
};

}  // namespace firn::inline FIRN_BUILD
