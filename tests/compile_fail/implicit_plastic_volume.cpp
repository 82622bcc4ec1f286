// Implicit and quasi-static steps do not take PlasticVolume with FBar.
// expect: firn: implicit and quasi-static steps do not take PlasticVolume with FBar
#include <firn/firn.hpp>
#include <firn/implicit.hpp>
#include <firn/soil.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Soil = MohrCoulomb<float>;
#else
using Soil = PlasticVolume<MohrCoulomb<float>>;
#endif

auto make() { return SimulationWith<2, Soil, QuasiStatic, FBar>({{0.0, 0.0}, {1.0, 1.0}, 0.1}); }
