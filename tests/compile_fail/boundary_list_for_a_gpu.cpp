// How many boundaries a list has is known only while the program runs.
// expect: firn: a BoundaryList gets its length at run time
#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/wgsl/recorded.hpp>

using Ball = firn::Collider<firn::Sphere<float, 2>>;
#ifdef FIRN_GOOD
using Balls = firn::Together<Ball, Ball>;
#else
using Balls = firn::BoundaryList<Ball>;
#endif

auto program(const Balls& balls) { return firn::lift<firn::wgsl::recorded>(balls); }
