/// \file The two cubes in every execution: step/two_cubes/EXECUTION/threads:N.
#include "step.hpp"

namespace {

template <class Execution>
void add(const Execution& execution, int threads) {
    scenes::add_step<float, firn::Apic>("two_cubes", +[] { return scenes::two_cubes<3>(); }, execution, threads);
}

const bool registered = [] {
    add(firn::Serial{}, 1);
    for (const int threads : {1, 2}) {
        add(firn::FixedPoint<std::int32_t>{threads}, threads);
        add(firn::FixedPoint<std::int64_t>{threads}, threads);
        add(firn::ColouredFixedPoint<std::int32_t>{threads}, threads);
        add(firn::ColouredFixedPoint<std::int64_t>{threads}, threads);
    }
    return true;
}();

}  // namespace
