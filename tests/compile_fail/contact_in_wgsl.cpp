// Contact between groups has no WGSL kernels, and the compiler says so.
// expect: firn: contact between groups of bodies is not yet in WGSL
#include <firn/boundary/walls.hpp>
#include <firn/contact/coulomb.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/volumetric/own_volume.hpp>
#include <firn/wgsl/program.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Policy = OwnVolume;
#else
using Policy = CoulombContact;
#endif

wgsl::Program program() {
    return wgsl::make_program<QuadraticBSpline, Pic, MlsForce, 2>(
        FixedCorotated<float>{}, Walls<float, 2>::all({0, 0}, {1, 1}, {}), Gravity<float, 2>{}, Policy{});
}
