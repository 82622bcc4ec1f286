// A shape whose distances lie in memory cannot become part of a program's text.
// expect: firn: a DistanceGrid reads its distances from memory that a program for a GPU does not have
#include <firn/boundary/collider.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/wgsl/recorded.hpp>

#ifdef FIRN_GOOD
using Shape = firn::Sphere<float, 3>;
#else
using Shape = firn::DistanceGrid<float, 3>;
#endif

auto program(const firn::Collider<Shape>& solid) { return firn::lift<firn::wgsl::recorded>(solid); }
