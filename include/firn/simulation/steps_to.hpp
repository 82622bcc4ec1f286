/// \file The steps of an advance: where it ends, and the shortened last step.
#pragma once

#include <firn/stage/time_step.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD::detail {

/// The steps of a run until a time, the last of which is shortened to end there. If they are chosen in float, the time
/// left is in two floats, which are lowered step by step as in a WGSL program; else it follows from the run's time.
class StepsTo {
public:
    /// \param now  the run's time [s];  \param duration  how long to advance [s], infinite if there is no end
    StepsTo(double now, double duration, bool in_float)
        : end_(now + duration), in_float_(in_float), left_(now < end_ ? time_left(duration) : TimeLeft<float>{0, 0}) {}

    /// Returns whether the run has arrived. \param now  the run's time [s]
    bool arrived(double now) const { return in_float_ ? !(left_.high > 0) : !(now < end_); }

    /// Takes the next step, of at most `bound` [s]: calls take(step).
    /// \param now  the run's time [s], which take() moves on; after the last step it is exactly the end
    template <class Take>
    void next(double& now, double bound, const Take& take) {
        if (in_float_) {
            const StepWithin<float> within = step_within(left_, float(bound));
            take(TimeStep(double(within.step), true));
            if (std::isfinite(left_.high)) left_ = within.left;
            if (arrived(now)) now = end_;
        } else {
            const double left = end_ - now;
            const bool is_last = left < bound * (1 + 1e-9);
            take(TimeStep(is_last ? left : bound));
            if (is_last) now = end_;
        }
    }

private:
    double end_;
    bool in_float_;
    TimeLeft<float> left_;
};

}  // namespace firn::inline FIRN_BUILD::detail
