// MLS forces with the linear kernel, whose inertia is not constant, are refused with what to use instead.
// expect: firn: MLS forces need a kernel of constant inertia
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/linear.hpp>
#include <firn/stage/p2g.hpp>
#include <firn/transfer/apic.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Force = WeightGradientForce;
#else
using Force = MlsForce;
#endif

P2GRecord<float, 2> record(const P2GParticle<float, 2>& particle, const Vec<float, 2>& d) {
    return make_record<Linear, Apic, Force>(particle, d, 0.1F, 1e-3F);
}
