/// \file The parallel region of steps, and steps without helpers where those would only hold them up.
///
/// A region of OpenMP's ends when all its threads have arrived. Where another program has a processor, a helper arrives
/// some milliseconds late, and steps of a tenth of that wait for it. So regions are timed: where begin and end take
/// long and the steps were slower for it than without helpers, the next steps go without.
#pragma once

#include <firn/core/parallel.hpp>

#include <algorithm>
#include <cstdint>

namespace firn::detail {

/// Says which steps shall have helpers. It learns from the steps before.
class StepHelpers {
public:
    /// So many steps are to be taken without helpers now; 0: the next ones have them.
    std::uint64_t steps_alone() const { return alone_; }

    /// \param whole  time that so many steps of one region took [s], or of as many as were to be taken without helpers
    /// \param body   that part of it in which their loops ran [s]
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
            alone_ = 1;  // to see how long one takes
        else if (each > without_)
            alone_ = 1 + std::uint64_t(std::min(given_back * double(steps) * (each / without_ - 1), most_alone));
    }

private:
    static constexpr double noticed = 1. / 8;  ///< part of a region's time
    static constexpr double given_back = 10;   ///< times what was lost, before helpers are tried again
    static constexpr double most_alone = 1000;
    static constexpr std::uint64_t most_age = 256;

    std::uint64_t alone_ = 0;       ///< steps to come without helpers
    double without_ = 0;            ///< how long one takes [s]
    std::uint64_t age_ = most_age;  ///< steps since then
};

/// Whether steps may go without helpers. Tests that count regions say no: their machine may be busy.
inline bool helpers_may_be_left_out = true;

/// body(most), which takes up to so many steps and returns how many, in a parallel region of its own; where helpers
/// would hold it up, for some steps on the calling thread.
template <class Body>
void steps_region(int workers, std::uint64_t most, StepHelpers& helpers, const Body& body) {
    if (workers <= 1 || !may_open_region() || !helpers_may_be_left_out)
        return parallel_region(workers, [&] { body(most); });
    double inside = 0;  // [s]
    std::uint64_t taken = 0;
    const auto timed_body = [&](std::uint64_t steps) {
        const double begin = seconds_now();
        taken = body(steps);
        inside = seconds_now() - begin;
    };
    const double begin = seconds_now();
    if (const std::uint64_t alone = helpers.steps_alone(); alone > 0)
        on_this_thread([&] { timed_body(std::min(alone, most)); });
    else
        parallel_region(workers, [&] { timed_body(most); });
    helpers.took(seconds_now() - begin, inside, taken);
}

}  // namespace firn::detail
