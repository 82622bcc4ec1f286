/// \file Bodies of stepper.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/core/stepper.hpp>

namespace firn::inline FIRN_BUILD {

template <int D>
void Stepper<D>::run_steps(int workers, std::uint64_t last_step, const std::function<bool()>& is_done,
                           const std::function<void(std::string&)>& step) {
    std::string warning;
    const auto some_steps = [&](std::uint64_t wanted) {
        std::uint64_t taken = 0;
        for (; taken < wanted && !is_done(); ++taken) {
            step(warning);
            if (!warning.empty()) break;
        }
        return taken;
    };
    while (!is_done()) {
        const std::uint64_t most = detail::regions_span_steps() ? last_step - now_.steps : 1;
        detail::steps_region(workers, most, helpers_, std::ref(some_steps));
        if (!warning.empty() && speaks_) warn(warning);
        warning.clear();
    }
}

}  // namespace firn::inline FIRN_BUILD
