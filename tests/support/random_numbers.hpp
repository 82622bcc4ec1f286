/// \file Repeatable random numbers, vectors and matrices for tests: the same on every machine.
#pragma once

#include <firn/core/eigen.hpp>
#include <firn/core/pack.hpp>

#include <Eigen/Dense>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace test_support {

class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}

    double uniform(double low, double high) { return low + (high - low) * double(engine_() >> 11) * 0x1p-53; }
    double normal() {
        const double radius = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
        return radius * std::cos(2 * std::numbers::pi * uniform(0, 1));
    }
    template <int D>
    firn::Vec<double, D> vector(double low, double high) {
        firn::Vec<double, D> v{};
        for (int i = 0; i < D; ++i) v[i] = uniform(low, high);
        return v;
    }
    template <int D>
    firn::Vec<double, D> direction() {
        firn::Vec<double, D> v{};
        for (int i = 0; i < D; ++i) v[i] = normal();
        return v * (1 / firn::norm(v));
    }
    template <int D>
    firn::Mat<double, D> gaussian() {
        firn::Mat<double, D> m{};
        for (double& x : m.m) x = normal();
        return m;
    }
    template <int D>
    firn::Mat<double, D> rotation() {
        firn::Mat<double, D> q{};  // Gram and Schmidt, twice, as Kahan advises
        for (int j = 0; j < D; ++j) {
            firn::Vec<double, D> column = direction<D>();
            for (int pass = 0; pass < 2; ++pass)
                for (int k = 0; k < j; ++k) column -= q.column(k) * firn::dot(column, q.column(k));
            column = column * (1 / firn::norm(column));
            for (int i = 0; i < D; ++i) q(i, j) = column[i];
        }
        if (firn::determinant(q) < 0)
            for (int i = 0; i < D; ++i) q(i, 0) = -q(i, 0);
        return q;
    }
    /// Gaussian, so that half of them are inverted; σ₁ ± σ₂ (σ₀ ± σ₁ in 2D) at least `gap` times the largest singular
    /// value: V has a derivative and is well conditioned.
    template <int D>
    firn::Mat<double, D> deformation(double gap = 0.1) {
        for (;;) {
            const firn::Mat<double, D> F = gaussian<D>();
            const Eigen::Matrix<double, D, 1> s =
                Eigen::JacobiSVD<Eigen::Matrix<double, D, D>>(firn::as_eigen(F)).singularValues();
            const double last = firn::determinant(F) < 0 ? -s[D - 1] : s[D - 1];
            if (s[D - 2] + last > gap * s[0]) return F;
        }
    }
    /// The same with det F > 0.
    template <int D>
    firn::Mat<double, D> upright_deformation(double gap = 0.1) {
        firn::Mat<double, D> F = deformation<D>(gap);
        while (firn::determinant(F) <= 0) F = deformation<D>(gap);
        return F;
    }

private:
    std::mt19937_64 engine_;
};

/// The same matrices in the lanes of a pack and as plain numbers.
template <class T, int D>
struct MatricesInLanes {
    firn::Mat<firn::native_pack<T>, D> F{};
    std::vector<firn::Mat<T, D>> plain{};

    /// Most are near a rotation, some are far from one, and some are 0. `turn` decides which lanes have those.
    MatricesInLanes(Random& random, int turn) {
        for (int lane = 0; lane < firn::scalar_traits<firn::native_pack<T>>::lanes; ++lane) {
            const double spread = (lane + turn) % 5 ? 0.1 : 1.0;
            plain.push_back(firn::cast<T>(random.rotation<D>() + random.gaussian<D>() * spread));
            if ((lane + turn) % 11 == 0) plain.back() = firn::Mat<T, D>::zero();
            for (int i = 0; i < D * D; ++i) F.m[i].set(lane, plain.back().m[i]);
        }
    }
};

}  // namespace test_support
