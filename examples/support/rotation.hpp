/// \file Computes how far a body has turned, from the rotation that fits its particles best.
#pragma once

#include <firn/core/tensor.hpp>

#include <Eigen/Dense>

#include <cmath>
#include <numbers>
#include <span>

namespace example {

/// The rotation R that minimises Σ |R (x₀ − x̄₀) − (x − x̄)|². Kabsch 1976.
inline Eigen::Matrix3d best_rotation(std::span<const firn::Vec<double, 3>> before,
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
    return svd.matrixU() * proper * svd.matrixV().transpose();
}

/// Follows a body that turns, also by more than half a turn.
class Turning {
public:
    /// Returns the angle [rad] by which the body has turned from its first place, about an axis that may change. Call
    /// it at least twice in half a turn.
    double angle(std::span<const firn::Vec<double, 3>> first, std::span<const firn::Vec<double, 3>> now) {
        const Eigen::AngleAxisd turn(best_rotation(first, now));  // of 0 to π
        // A rotation by θ about a is one by θ − 2π, too. The nearest to the last one is meant.
        Eigen::Vector3d nearest = turn.angle() * turn.axis();
        for (const double whole : {-2.0, -1.0, 1.0}) {
            const Eigen::Vector3d other = (turn.angle() + 2 * std::numbers::pi * whole) * turn.axis();
            if ((other - vector_).norm() < (nearest - vector_).norm()) nearest = other;
        }
        vector_ = nearest;
        return vector_.norm();
    }

private:
    Eigen::Vector3d vector_ = Eigen::Vector3d::Zero();  // axis × angle
};

}  // namespace example
