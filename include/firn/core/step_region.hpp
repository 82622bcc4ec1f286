/// \file The parallel region of one step, and steps without helpers where those would only hold it up.
///
/// A region of OpenMP's ends when all its threads have arrived. Where another program has a processor, a helper arrives
/// some milliseconds late, and a step of a tenth of that waits for it. So the region of a step is timed: where its
/// begin and end take long and the step was slower for it than one without helpers, the next steps go without.
#pragma once

#include <firn/core/parallel.hpp>

#include <algorithm>
#include <chrono>

namespace firn::detail {

/// Says for each step whether it shall have helpers. It learns from the steps before.
class StepHelpers {
public:
    bool are_wanted() const { return alone_ == 0; }

    /// \param whole  time that the step took [s];  \param body  that part of it in which its loops ran [s]
    void took(double whole, double body) {
        if (alone_ > 0) {
            --alone_;
            without_ = age_ < most_age ? (without_ + whole) / 2 : whole;
            age_ = 0;
            return;
        }
        ++age_;
        if (whole - body < whole * noticed) return;
        if (age_ >= most_age)
            alone_ = 1;  // to see how long one takes
        else if (whole > without_)
            alone_ = 1 + int(std::min(given_back * (whole - without_) / without_, most_alone));
    }

private:
    static constexpr double noticed = 1. / 8;  ///< part of a step
    static constexpr double given_back = 10;   ///< times what was lost, before helpers are tried again
    static constexpr double most_alone = 1000;
    static constexpr int most_age = 256;

    int alone_ = 0;       ///< steps to come without helpers
    double without_ = 0;  ///< how long one takes [s]
    int age_ = most_age;  ///< steps since then
};

/// body(), one step or several, in a parallel region of its own; one step, where helpers would hold it up, on the
/// calling thread.
template <class Body>
void steps_region(int workers, bool is_one, StepHelpers& helpers, const Body& body) {
    if (workers <= 1 || !is_one || !may_open_region()) return parallel_region(workers, body);
    using clock = std::chrono::steady_clock;
    const auto seconds = [](clock::duration d) { return std::chrono::duration<double>(d).count(); };
    clock::duration inside{};
    const auto timed_body = [&] {
        const auto begin = clock::now();
        body();
        inside = clock::now() - begin;
    };
    const auto begin = clock::now();
    if (helpers.are_wanted())
        parallel_region(workers, timed_body);
    else
        on_this_thread(timed_body);
    helpers.took(seconds(clock::now() - begin), seconds(inside));
}

}  // namespace firn::detail
