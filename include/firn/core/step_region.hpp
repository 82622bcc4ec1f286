/// \file The parallel region in which steps run. Where helpers (threads other than the calling one) would slow the
/// steps down, the steps run without helpers.
///
/// A parallel region of OpenMP ends only when all its threads have arrived. If another program occupies a processor, a
/// helper arrives some milliseconds late. The step has to wait for this helper, although the step itself may take only
/// a tenth of this time. Regions are therefore timed: if starting and ending a region takes long, and the steps took
/// longer than without helpers, the next steps run without helpers.
#pragma once

#include <firn/core/parallel.hpp>

#include <algorithm>
#include <cstdint>
#include <functional>

namespace firn::inline FIRN_BUILD::detail {

/// Decides whether the next steps run with helpers (other threads), from the computing times of the previous steps.
class StepHelpers {
public:
    /// Number of steps to take next without helpers; 0: the next steps have helpers.
    std::uint64_t steps_alone() const { return alone_; }

    /// Records the computing time of the last steps, which ran in one parallel region, or without helpers.
    /// \param whole  computing time of all these steps, including the begin and end of the region [s]
    /// \param body   computing time of all these steps, without the begin and end of the region [s]
    /// \param steps  number of steps
    void took(double whole, double body, std::uint64_t steps) {
        if (steps == 0) return;
        const double each = whole / double(steps);
        if (alone_ > 0) {
            alone_ -= std::min(steps, alone_);
            without_ = age_ < most_age ? (without_ + each) / 2 : each;
            age_ = 0;
            return;
        }
        age_ += steps;
        if (whole - body < whole * noticed) return;
        if (age_ >= most_age)
            alone_ = 1;  // measures how long one step takes
        else if (each > without_)
            alone_ = 1 + std::uint64_t(std::min(given_back * double(steps) * (each / without_ - 1), most_alone));
    }

private:
    /// Starting and ending a region counts as slow if the two together take at least this fraction of the region's
    /// computing time.
    static constexpr double noticed = 1. / 8;
    /// Helpers are tried again when steps without helpers have saved this many times the time that the last steps with
    /// helpers lost.
    static constexpr double given_back = 10;
    static constexpr double most_alone = 1000;      ///< largest number of steps in a row without helpers
    static constexpr std::uint64_t most_age = 256;  ///< number of steps after which without_ is out of date

    std::uint64_t alone_ = 0;       ///< number of steps still to take without helpers
    double without_ = 0;            ///< computing time of one step without helpers [s]
    std::uint64_t age_ = most_age;  ///< number of steps since without_ was measured
};

/// Whether a step may run on the calling thread alone, without helper threads. Tests that count parallel regions set
/// this to false.
inline bool helpers_may_be_left_out = true;

/// Takes at most `most` steps: calls body(most) in a parallel region. If helpers (other threads) would slow the steps
/// down, steps_region() calls body(n) on the calling thread alone instead, with n ≤ `most`.
/// \param body  body(n) takes at most n steps and returns the number of steps taken
void steps_region(int workers, std::uint64_t most, StepHelpers& helpers,
                  const std::function<std::uint64_t(std::uint64_t)>& body);

}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_HAS_BODIES
#include <firn/core/step_region-inl.hpp>
#endif
