// Eigen's singular values and eigenvalues of lanes are refused in a sentence that names firn's own function.
// expect: firn: Eigen finds singular values by branching on values
// expect: Write firn::svd(firn::Mat<S, D>(F)), see firn/math/svd.hpp
// expect: firn: Eigen finds eigenvalues by branching on values
// expect: firn::left_singular(firn::Mat<S, D>(F))
#include <firn/core/eigen.hpp>
#include <firn/core/pack.hpp>
#include <firn/math/svd.hpp>

#include <Eigen/Dense>

template <firn::scalar S>
S largest_stretch(const Eigen::Matrix<S, 3, 3>& F) {
#ifdef FIRN_GOOD
    return firn::svd(firn::Mat<S, 3>(F)).values[0];
#else
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<S, 3, 3>> squares(F * F.transpose());
    return Eigen::JacobiSVD<Eigen::Matrix<S, 3, 3>>(F).singularValues()[0] - squares.eigenvalues()[0];
#endif
}

template firn::native_pack<float> largest_stretch(const Eigen::Matrix<firn::native_pack<float>, 3, 3>&);
