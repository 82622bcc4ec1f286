// TrBdf2 has velocities at the end of a step that only Flip tells from those with which matter has moved.
// expect: Take firn::Flip{1}
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Transfer = Flip<float>;
#else
using Transfer = Apic;
#endif

auto make() { return SimulationWith<2, Hencky<float>, TrBdf2, Transfer>({{0.0, 0.0}, {1.0, 1.0}, 0.1}); }
