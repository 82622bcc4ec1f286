// Boundaries that act by the gap of particles have no WGSL kernels, and the compiler says so.
// expect: firn: boundaries that act by the gap of particles (GapContact) are not yet in WGSL
#include <firn/boundary/gap_contact.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/wgsl/program.hpp>

using namespace firn;

wgsl::Program program() {
    const auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {});
#ifdef FIRN_GOOD
    const auto boundary = walls;
#else
    const GapContact boundary{walls};
#endif
    return wgsl::make_program<QuadraticBSpline, Pic, MlsForce, 2>(FixedCorotated<float>{}, boundary);
}
