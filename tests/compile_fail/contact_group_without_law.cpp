// A simulation without a contact law has no contact groups, and the compiler says which law to give it.
// expect: firn: this simulation has no contact groups
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Law = CoulombContact;
#else
using Law = OneField;
#endif

void put(SimulationWith<2, FixedCorotated<float>, Law>& simulation, const Body& body) {
    simulation.set_contact_group(body, 1);
}
