// With FBar, a model in PlasticVolume has no WGSL program.
// expect: firn: FBar with PlasticVolume is not yet in WGSL
#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/plastic_volume.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/volumetric/f_bar.hpp>
#include <firn/wgsl/program.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Soil = MohrCoulomb<float>;
#else
using Soil = PlasticVolume<MohrCoulomb<float>>;
#endif

wgsl::Program program() {
    return wgsl::make_program<QuadraticBSpline, Pic, MlsForce, 2>(Soil{}, Walls<float, 2>::all({0, 0}, {1, 1}, {}),
                                                                  Gravity<float, 2>{}, FBar{});
}
