// What Eigen does by branching on a determinant or a pivot is refused, and the sentence says what to write.
// expect: firn: Eigen's checked inverse branches on the determinant
// expect: Write F.inverse(), and firn::select(
// expect: firn: this decomposition of Eigen's branches on values
// expect: Write F.inverse() * b to solve
#include <firn/core/dual.hpp>
#include <firn/core/eigen.hpp>

#include <Eigen/Dense>

template <firn::scalar S>
Eigen::Matrix<S, 2, 2> inverse_or_zero(const Eigen::Matrix<S, 2, 2>& F) {
#ifdef FIRN_GOOD
    const auto singular = F.determinant() == S(0);
    return select(singular, firn::Mat<S, 2>::zero(), firn::Mat<S, 2>(F.inverse()));
#else
    Eigen::Matrix<S, 2, 2> inverse;
    bool is_invertible;
    F.computeInverseWithCheck(inverse, is_invertible);
    return is_invertible ? inverse : Eigen::Matrix<S, 2, 2>(F.lu().solve(inverse));
#endif
}

template Eigen::Matrix<firn::dual<double>, 2, 2> inverse_or_zero(const Eigen::Matrix<firn::dual<double>, 2, 2>&);
