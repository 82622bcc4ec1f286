// expect: a RigidBody moves by the gap between matter and its surface
#include <firn/firn.hpp>
#include <firn/rigid_body.hpp>

using Body = firn::RigidBody<firn::Collider<firn::Sphere<float, 2>>>;
#ifdef FIRN_GOOD
using Boundary = firn::GapContact<firn::Together<firn::Walls<float, 2>, Body>>;
#else
using Boundary = firn::Together<firn::Walls<float, 2>, Body>;
#endif

void run() {
    firn::SimulationWith<2, firn::FixedCorotated<float>, Boundary> simulation({{0, 0}, {1, 1}, 0.1});
    simulation.step();
}
