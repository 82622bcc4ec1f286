// A volumetric policy for which there are no WGSL kernels has no WGSL program, and the compiler says so.
// expect: firn: this volumetric policy is not yet in WGSL
#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/volumetric/f_bar.hpp>
#include <firn/wgsl/program.hpp>

using namespace firn;

struct Own {
    static constexpr const char* name = "own";
    static constexpr bool averages_volume = false;
};

#ifdef FIRN_GOOD
using Volume = FBar;
#else
using Volume = Own;
#endif

wgsl::Program program() {
    return wgsl::make_program<QuadraticBSpline, Pic, MlsForce, 2>(
        FixedCorotated<float>{}, Walls<float, 2>::all({0, 0}, {1, 1}, {}), Gravity<float, 2>{}, Volume{});
}
