// Derivatives go back through explicit steps only.
// expect: firn: an Adjoint goes back through explicit simulations
#include <firn/adjoint.hpp>
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Time = Explicit;
#else
using Time = Implicit;
#endif

using Run = SimulationWith<2, Hencky<float>, Time>;
std::size_t steps(Adjoint<Run>& adjoint) { return adjoint.steps(); }
