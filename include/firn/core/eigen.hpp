/// \file Eigen's view of firn's vectors and matrices, and back. Same memory layout; nothing is computed.
#pragma once

#include <firn/core/tensor.hpp>

#include <Eigen/Core>

namespace firn {

template <std::floating_point S, int D>
Eigen::Map<const Eigen::Matrix<S, D, 1>> as_eigen(const Vec<S, D>& a) {
    return Eigen::Map<const Eigen::Matrix<S, D, 1>>(a.v);
}
template <std::floating_point S, int D>
Eigen::Map<const Eigen::Matrix<S, D, D>> as_eigen(const Mat<S, D>& a) {
    return Eigen::Map<const Eigen::Matrix<S, D, D>>(a.m);
}
template <std::floating_point S, int D>
Vec<S, D> from_eigen(const Eigen::Matrix<S, D, 1>& a) {
    Vec<S, D> r{};
    Eigen::Map<Eigen::Matrix<S, D, 1>>(r.v) = a;
    return r;
}
template <std::floating_point S, int D>
    requires(D > 1)
Mat<S, D> from_eigen(const Eigen::Matrix<S, D, D>& a) {
    Mat<S, D> r{};
    Eigen::Map<Eigen::Matrix<S, D, D>>(r.m) = a;
    return r;
}

}  // namespace firn
