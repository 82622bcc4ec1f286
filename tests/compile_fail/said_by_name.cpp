// What a bare number or a missing name could mean in two ways does not compile: angles, and which material is meant.
// expect: firn: this simulation has several materials: say which one is meant
// expect: firn: an angle says its unit: write firn::degrees(35) or firn::radians(0.6)
// errors: 3
#include <firn/firn.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/math/rotor.hpp>

using namespace firn;

using Two = Simulation<2, Materials<Snow<float>, Sand<float>>>;

#ifdef FIRN_GOOD
Body add(Two& two, const Samples<2>& samples) { return two.set<Sand<float>>().add(samples, 1000); }
State<float> state(Two& two) { return state_of(two.set<Sand<float>>()); }
Sand<float> sand() { return Sand<float>::from_properties({.friction_angle = degrees(35)}); }
Rotor<double, 2> turned() { return rotor(radians(0.5)); }
#else
Body add(Two& two, const Samples<2>& samples) { return two.add(samples, 1000); }
State<float> state(Two& two) { return state_of(two); }
Sand<float> sand() { return Sand<float>::from_properties({.friction_angle = 35}); }
Rotor<double, 2> turned() { return rotor(0.5); }
#endif
