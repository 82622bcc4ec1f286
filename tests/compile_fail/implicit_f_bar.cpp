// Implicit and quasi-static steps average no volumes.
// expect: firn: implicit and quasi-static steps average no volumes
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Volume = OwnVolume;
#else
using Volume = FBar;
#endif

auto make() { return SimulationWith<2, Hencky<float>, QuasiStatic, Volume>({{0.0, 0.0}, {1.0, 1.0}, 0.1}); }
