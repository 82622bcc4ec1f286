// Plane strain is a matter of two dimensions.
// expect: firn: PlaneStrain is a material of simulations in two dimensions
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
constexpr int D = 2;
#else
constexpr int D = 3;
#endif

void run() { Simulation<D, PlaneStrain<Sand<float>>>{Domain<D>{}}.step(); }
