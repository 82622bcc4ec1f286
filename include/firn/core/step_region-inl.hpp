/// \file Bodies of step_region.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/core/step_region.hpp>

namespace firn::inline FIRN_BUILD::detail {

FIRN_BODY void steps_region(int workers, std::uint64_t most, StepHelpers& helpers,
                            const std::function<std::uint64_t(std::uint64_t)>& body) {
    if (workers <= 1 || !may_open_region() || !helpers_may_be_left_out)
        return parallel_region(workers, [&] { body(most); });
    double inside = 0;  // computing time of body() [s]
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

}  // namespace firn::inline FIRN_BUILD::detail
