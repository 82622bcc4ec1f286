// A transfer that refines velocities by a series and blends them, too, has no WGSL program, and the compiler says so.
// expect: firn: a transfer that refines velocities by a series and blends them, too, is not in WGSL
#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/transfer/flip.hpp>
#include <firn/transfer/fmpm.hpp>
#include <firn/wgsl/program.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Transfer = Fmpm;
#else
struct Transfer : Flip<> {
    int order = 2;
    template <class S, int D>
    static Vec<S, D> next(const Vec<S, D>& v_1, const Vec<S, D>& v_j, const Vec<S, D>& there_and_back) {
        return Fmpm::next(v_1, v_j, there_and_back);
    }
};
#endif

wgsl::Program program() {
    return wgsl::make_program<QuadraticBSpline, Transfer, MlsForce, 2>(FixedCorotated<float>{},
                                                                       Walls<float, 2>::all({0, 0}, {1, 1}, {}));
}
