// Implicit and quasi-static steps filter no volumes.
// expect: firn: implicit and quasi-static steps filter no volumes, and know no averages but those of FBar
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Volume = FBar;
#else
using Volume = VolumeFilter;
#endif

auto make() { return SimulationWith<2, Hencky<float>, QuasiStatic, Volume>({{0.0, 0.0}, {1.0, 1.0}, 0.1}); }
