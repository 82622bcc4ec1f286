/// \file Bodies of parallel.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/core/parallel.hpp>

namespace firn::inline FIRN_BUILD::detail {

FIRN_BODY void run_loop(const PhasedLoop& loop, int workers) {
    const ThreadRole& role = role_of_this_thread;
    const bool is_long = std::any_of(loop.counts.begin(), loop.counts.end(), [&](auto n) { return n > loop.grain; });
    const bool is_shared = is_long && workers > 1 && !role.at_work;
    if (is_shared && role.team) return role.team->run(loop, workers);
    if (is_shared && may_open_region()) return parallel_region(workers, [&] { run_loop(loop, workers); });
    for (std::size_t phase = 0; phase < loop.counts.size(); ++phase)
        loop.run(loop.body, phase, 0, loop.counts[phase], 0);
}

}  // namespace firn::inline FIRN_BUILD::detail
