// A transfer with further passes has no WGSL program, and the compiler says so.
// expect: firn: FLIP, AFLIP, ASFLIP and FMPM take further passes
#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/transfer/flip.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/wgsl/program.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Transfer = Pic;
#else
using Transfer = Flip<>;
#endif

wgsl::Program program() {
    return wgsl::make_program<QuadraticBSpline, Transfer, MlsForce, 2>(FixedCorotated<float>{},
                                                                       Walls<float, 2>::all({0, 0}, {1, 1}, {}));
}
