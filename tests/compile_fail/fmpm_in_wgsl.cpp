// A transfer that refines velocities has no WGSL program, and the compiler says so.
// expect: firn: FMPM takes further passes, for which there are no WGSL kernels
#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/transfer/flip.hpp>
#include <firn/transfer/fmpm.hpp>
#include <firn/wgsl/program.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Transfer = Flip<>;
#else
using Transfer = Fmpm;
#endif

wgsl::Program program() {
    return wgsl::make_program<QuadraticBSpline, Transfer, MlsForce, 2>(FixedCorotated<float>{},
                                                                       Walls<float, 2>::all({0, 0}, {1, 1}, {}));
}
