// Implicit and quasi-static steps sum in floating point; integers are refused in a sentence.
// expect: firn: implicit and quasi-static steps run with the execution Coloured
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Execution = Coloured;
#else
using Execution = FixedPoint<std::int32_t>;
#endif

auto make() { return SimulationWith<2, Hencky<float>, QuasiStatic, Execution>({{0.0, 0.0}, {1.0, 1.0}, 0.1}); }
