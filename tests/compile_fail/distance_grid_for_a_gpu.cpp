// A program reads distances in float; others would give other bits than on the CPU.
// expect: firn: a program for a GPU reads distances in float
#include <firn/boundary/collider.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/wgsl/recorded.hpp>

#ifdef FIRN_GOOD
using Shape = firn::DistanceGrid<float, 3>;
#else
using Shape = firn::DistanceGrid<float, 3, double>;
#endif

auto program(const firn::Collider<Shape>& solid) { return firn::lift<firn::wgsl::recorded>(solid); }
