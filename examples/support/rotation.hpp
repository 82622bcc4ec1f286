/// \file Computes how far a body has turned, from the rotation that fits its particles best.
#pragma once

#include <firn/core/tensor.hpp>

#include <Eigen/Dense>

#include <cmath>
#include <span>

namespace example {

/// The angle [rad], 0 to π, of the rotation R that minimises Σ |R (x₀ − x̄₀) − (x − x̄)|². Kabsch 1976.
inline double rotation_angle(std::span<const firn::Vec<double, 3>> before,
                             std::span<const firn::Vec<double, 3>> after) {
    const auto point = [](const firn::Vec<double, 3>& x) { return Eigen::Vector3d(x[0], x[1], x[2]); };
    Eigen::Vector3d centre_before = Eigen::Vector3d::Zero(), centre_after = centre_before;
    for (std::size_t i = 0; i < before.size(); ++i) {
        centre_before += point(before[i]) / double(before.size());
        centre_after += point(after[i]) / double(before.size());
    }
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < before.size(); ++i)
        covariance += (point(after[i]) - centre_after) * (point(before[i]) - centre_before).transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d proper = Eigen::Matrix3d::Identity();
    proper(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    const Eigen::Matrix3d R = svd.matrixU() * proper * svd.matrixV().transpose();
    return std::acos(std::clamp((R.trace() - 1) / 2, -1.0, 1.0));
}

}  // namespace example
