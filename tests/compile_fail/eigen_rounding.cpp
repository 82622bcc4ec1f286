// Eigen's doubles are not rounded to firn's floats without a word.
// expect: firn: the numbers of this Eigen expression do not fit into firn's scalar
// expect: .cast<float>()
#include <firn/boundary/shapes.hpp>
#include <firn/core/eigen.hpp>

firn::HalfSpace<float, 3> tilted(const Eigen::Vector3d& outward) {
#ifdef FIRN_GOOD
    return {.outward = outward.cast<float>()};
#else
    return {.outward = outward};
#endif
}
