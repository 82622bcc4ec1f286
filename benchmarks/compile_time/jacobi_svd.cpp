/// \file What compile times are compared with: a decomposition of Eigen's.
#include <Eigen/SVD>

Eigen::Matrix3f rotation(const Eigen::Matrix3f& a) {
    const Eigen::JacobiSVD<Eigen::Matrix3f> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return svd.matrixU() * svd.matrixV().transpose();
}
